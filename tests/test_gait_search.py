"""Cycles in the limit of short sample periods, and the search by gradients that closes them."""

import numpy as np
import pytest

pytest.importorskip("cma", reason="pip install 'skate-env[identify]'")

from typer.testing import CliRunner

from skate_env import Simulator, load_scene
from skate_env.gait import SIGMA
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED
from training.gaits.cycle import CLOSED, Cycle
from training.gaits.descent import Search, Stability
from training.gaits.gradients import app
from training.gaits.score import run

SCENE, AHEAD = PAPER_DAMPED, "control.lifting.ahead"


@pytest.fixture(scope="module")
def closed():
    cycle = Cycle(load_scene(SCENE))
    point, linear, size = cycle.close(cycle.found())
    assert size < CLOSED
    return cycle, point, linear


def test_an_orbit_without_a_clock_has_the_multiplier_1_along_itself(closed):
    _, _, linear = closed
    start, end = (linear.basis.T @ each for each in linear.along)
    # A shift along the orbit returns as a shift along the orbit (1e-5 of its size).
    assert np.abs(linear.P @ start - end).max() < 1e-4 * np.abs(start).max()
    # 8e-5: the samples of 10 us.
    assert np.abs(np.linalg.eigvals(linear.P) - 1.0).min() < 5e-4


def test_a_sample_follows_the_event_before_it():
    # After the toe's landing the sample's torques change the sign of a force at once.
    cycle = Cycle(load_scene("paper"))
    _, linear, size = cycle.close(cycle.found())
    assert size < CLOSED
    moduli = np.sort(np.abs(np.linalg.eigvals(linear.P)))
    # 1 + 2e-4, then 0.9596.
    assert moduli[-1] == pytest.approx(1.0, abs=5e-4) and moduli[-2] < 0.97


def test_a_cycle_begins_where_a_reset_goes_on_like_the_motion():
    # A reset in the middle of its state 3 presses and slides where the motion is pulled.
    cycle = Cycle(load_scene("paper_arms"))
    point, linear, size = cycle.close(cycle.found())
    # 1.5e-3; 16 rad/s from the middle.
    assert size < CLOSED
    # 0.3907 s and 0.9353.
    assert point.period == pytest.approx(0.3907, abs=1e-4)
    moduli = np.sort(np.abs(np.linalg.eigvals(linear.P)))
    assert moduli[-1] == pytest.approx(1.0, abs=5e-4)
    assert moduli[-2] == pytest.approx(0.9353, abs=1e-3)


def test_derivatives_by_a_parameter_are_those_of_closed_cycles(closed):
    cycle, point, _ = closed
    step = 5e-3
    ahead = load_scene(SCENE).parameters()[AHEAD][0]
    low, high = (
        Cycle(replace(load_scene(SCENE), {AHEAD: ahead + side})).close(point)[0]
        for side in (-step, step)
    )
    linear = cycle.linearize(point, [AHEAD])
    change = linear.solve(-linear.by_parameters)[:, 0]
    # 2e-4 apart.
    assert change[-1] == pytest.approx((high.period - low.period) / (2.0 * step), rel=0.01)
    along = linear.along[0] / np.linalg.norm(linear.along[0])
    off = (high.x - low.x) / (2.0 * step) - linear.basis @ change[:-1]
    moving = slice(0, 2 * cycle.strobe.n)
    # A cycle has its starts anywhere along it. 3e-4 apart.
    off -= along * (along @ off)
    assert np.abs(off[moving]).max() < 0.01 * np.abs(linear.basis @ change[:-1]).max()


def test_a_start_below_the_ice_is_refused(closed):
    cycle, point, _ = closed
    with pytest.raises(ValueError, match="ends within a step"):
        cycle.close(type(point)(point.x + 0.5, point.leg, point.period))


@pytest.mark.long("a search by gradients")
def test_a_search_improves_the_card_and_keeps_the_contact_states():
    search = Search(load_scene(SCENE), {}, human=True, stability=Stability.none)
    before = search.gait
    box, _ = search.iterate(0.2)
    assert box > 0.0
    # 42.35 to 37.8.
    assert search.score(search.gait) < search.score(before) - 2.0
    assert search.gait.sequence == before.sequence
    # It skates with samples of 1 ms, too.
    found = search.result()
    assert found.parameters()["control.sample_period"][0] == 1e-3
    assert len(run(found, 30, 0.0, 0).orders) == 29


@pytest.mark.long("a search by gradients")
def test_the_multipliers_bound_is_kept():
    search = Search(load_scene(SCENE), {}, human=True, bound=0.93)
    before = search.gait.radius
    search.iterate(0.2)
    # 0.9302 before.
    assert search.gait.radius < max(before, 0.93) + 1e-4


@pytest.mark.long("a search by gradients")
def test_a_gait_that_loses_a_start_is_refused():
    search = Search(load_scene(SCENE), {}, human=True, bound=0.93, starts=5)
    _, reasons = search.iterate(0.2)
    # The first box is too large: 31 steps from the start with the seed 4.
    assert "perturbed with seed" in reasons
    for seed in range(5):
        sim = Simulator(search.result())
        sim.perturb(SIGMA, seed)
        assert record(sim, 100).steps.size == 100


@pytest.mark.long("a search by gradients")
def test_the_command_writes_a_scene_and_says_what_stops_it(tmp_path):
    out = tmp_path / "new" / "found.toml"
    said = CliRunner().invoke(app, ["--scene", SCENE, "--iterations", "1", "--out", str(out)])
    assert said.exit_code == 0, said.output
    assert "score" in said.output and "radius" in said.output
    assert "gradients" in load_scene(out).get("provenance")


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--scene", "nowhere"], "nowhere"),
        (["--scene", "push_only"], "the motion ends"),
        (["--weight", "beauty=1"], "beauty"),
    ],
)
def test_what_cannot_be_searched_is_refused(arguments, message, tmp_path):
    said = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "found.toml")])
    assert said.exit_code == 2 and message in said.output
