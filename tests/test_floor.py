"""Forward dynamics generated as straight-line C, an oracle of its own, against the engine's.

Residuals are relative to the largest acceleration in that state.
"""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from skate_env import Simulator, load_scene
from skate_env.bench import floor

Array = NDArray[np.float64]

STATES = 200


@pytest.fixture(autouse=True)
def installed() -> None:
    pytest.importorskip("casadi")
    if lack := floor.missing():
        pytest.skip(lack)


def worst(
    line: floor.StraightLine,
    sim: Simulator,
    draw: Callable[[np.random.Generator, Array, Array], None],
    number: int,
) -> float:
    """Largest residual in random states that `draw` puts into the contact state `number`."""
    rng = np.random.default_rng(7)
    found = []
    while len(found) < STATES:
        q = rng.uniform(-1.5, 1.5, line.n)
        v = rng.uniform(-10.0, 10.0, line.n)
        draw(rng, q, v)
        try:
            sim.reset(q=q, v=v)
        except ValueError:
            # A foot would be below the ice.
            continue
        assert sim.state_number == number
        along, normal = np.abs(sim.contact_forces[0, :2])
        if along < 1e-6 * normal:
            # The ice of two-way contact pulls, and friction does not act.
            continue
        ours = sim.acceleration
        assert not sim.torque[:2].any()
        error = np.abs(line.accelerations(q, v, sim.torque) - ours).max()
        found.append(float(error / np.abs(ours).max()))
    return max(found)


def test_flight() -> None:
    scene = load_scene("unilateral")

    def draw(rng: np.random.Generator, q: Array, v: Array) -> None:
        # Where the toe is lower than the heel it is the pivot.
        q[1], q[2] = 3.0, rng.uniform(-1.5, 0.0)

    line = floor.StraightLine(scene)
    assert worst(line, Simulator(scene), draw, number=0) < 1e-9  # 1.6e-13


def test_sliding_on_the_toe() -> None:
    scene = load_scene("paper")

    def draw(rng: np.random.Generator, q: Array, v: Array) -> None:
        q[1:3], v[:2] = [0.0, rng.uniform(-1.0, -0.01)], [rng.uniform(0.1, 10.0), 0.0]

    line = floor.StraightLine(scene, contact="sliding")
    assert worst(line, Simulator(scene), draw, number=4) < 1e-9  # 7.9e-14


def test_flops() -> None:
    # The supporting leg's foot and six joints, the trunk's three, seven of arms and head.
    flops = floor.StraightLine().flops
    assert flops.sines == flops.cosines == 17
    assert flops.square_roots == 0
    assert flops.total < 2100  # 2,059


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert floor.measure() is None
    with pytest.raises(RuntimeError, match="no-such-compiler"):
        floor.StraightLine()


def test_bad_input_is_refused(refused: Callable[..., None]) -> None:
    ice = load_scene("paper").without("slipping")
    refused(ValueError, lambda: floor.StraightLine(ice, contact="sliding"), "paper", "sticking")
    refused(RuntimeError, lambda: floor.StraightLine(flags=["--no-such-flag"]), "--no-such-flag")
    line = floor.StraightLine()
    zero = np.zeros(line.n)
    refused(ValueError, lambda: line.accelerations(zero, zero[1:], zero), "v", "(18,)", "(19,)")
    refused(ValueError, lambda: floor.measure(rounds=0), "rounds", "0", "at least 1")
