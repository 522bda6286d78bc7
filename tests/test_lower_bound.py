"""Forward dynamics generated as straight-line C, compared with the engine's.

Residuals are relative to the largest acceleration in that state.
"""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from skate_env import Simulator, _core, load_scene
from skate_env.scenes import replace
from tests.bench import lower_bound

Array = NDArray[np.float64]

STATES = 200


@pytest.fixture(autouse=True)
def installed() -> None:
    pytest.importorskip("casadi")
    if lack := lower_bound.missing():
        pytest.skip(lack)


def worst(
    compiled: lower_bound.Compiled,
    sim: _core.Simulator,
    draw: Callable[[np.random.Generator, Array, Array], None],
    number: int,
) -> float:
    """Largest residual over random states with the contact state `number`, drawn by `draw`."""
    n, lanes = compiled.shape
    rng = np.random.default_rng(7)
    found: list[tuple[Array, Array, Array, Array]] = []
    while len(found) < STATES:
        q, v = rng.uniform(-1.5, 1.5, n), rng.uniform(-10.0, 10.0, n)
        draw(rng, q, v)
        try:
            sim.reset(q=q, v=v)
        except ValueError:
            # A foot would be below the ice.
            continue
        assert sim.state_number == number
        along, normal = np.abs(sim.contact_forces[0, :2])
        if along < 1e-6 * normal:
            # In two-way contact the ice can pull; friction is absent.
            continue
        assert not sim.torque[:2].any()
        found.append((q, v, sim.torque, sim.acceleration))
    q, v, tau, ours = (np.array(each) for each in zip(*found, strict=True))
    theirs = np.empty((STATES, n))
    for i in range(0, STATES, lanes):
        part = slice(i, i + lanes)
        theirs[part] = compiled.accelerations(q[part].T, v[part].T, tau[part].T).T
    return float((np.abs(theirs - ours).max(1) / np.abs(ours).max(1)).max())


def in_flight(rng: np.random.Generator, q: Array, v: Array) -> None:
    # If the toe is lower than the heel, it is the pivot.
    q[1], q[2] = 3.0, rng.uniform(-1.5, 0.0)


@pytest.mark.parametrize("lanes", [1, 8])
def test_flight(lanes: int) -> None:
    scene = load_scene("push_only")
    compiled = lower_bound.Compiled(scene, lanes=lanes)
    assert worst(compiled, Simulator(scene), in_flight, number=0) < 1e-9  # 1.7e-13


@pytest.mark.parametrize(
    "locked", [["q8"], ["q8", "q9", "q10"], ["q9", "q11", "q12", "q16"]], ids=" ".join
)
def test_other_trees(locked: list[str]) -> None:
    start = load_scene("push_only").get("start")
    for part in ("q", "v"):
        start[part] = {name: x for name, x in start[part].items() if name not in locked}
    start["support_leg"] = "left"
    scene = replace(load_scene("push_only"), {"locked": locked, "start": start})
    compiled = lower_bound.Compiled(scene)
    assert worst(compiled, Simulator(scene), in_flight, number=0) < 1e-9  # 2.4e-13


def test_sliding_on_the_toe() -> None:
    scene = load_scene("paper")

    def draw(rng: np.random.Generator, q: Array, v: Array) -> None:
        q[1:3], v[:2] = [0.0, rng.uniform(-1.0, -0.01)], [rng.uniform(0.1, 10.0), 0.0]

    compiled = lower_bound.Compiled(scene, contact="sliding")
    assert worst(compiled, Simulator(scene), draw, number=4) < 1e-9  # 7.9e-14


def test_flops() -> None:
    # The supporting foot with six leg joints, three of the trunk, seven of arms and head.
    flops = lower_bound.Compiled().flops
    assert flops.sines == flops.cosines == 17
    assert flops.square_roots == 0
    assert flops.total < 2100  # 2,059


def test_missing_tools_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(RuntimeError, match="no-such-compiler"):
        lower_bound.Compiled()


def test_bad_input_is_refused(refused: Callable[..., None]) -> None:
    ice = load_scene("paper").without("slipping")
    refused(ValueError, lambda: lower_bound.Compiled(ice, contact="sliding"), "paper", "sticking")
    refused(RuntimeError, lambda: lower_bound.Compiled(flags=["--no-such-flag"]), "--no-such-flag")
    refused(ValueError, lambda: lower_bound.Compiled(lanes=3), "lanes", "3", "power of 2")
    compiled = lower_bound.Compiled()
    zero = np.zeros(compiled.shape)
    refused(ValueError, lambda: compiled.accelerations(zero, zero[1:], zero), "v", "(18, 1)")
