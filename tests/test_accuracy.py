"""Properties of all accuracies: energy balance, constraints, events, and the setting itself."""

from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest

from skate_env import Scene, Simulator
from skate_env.scenes import load_scene, replace, scene_names
from skate_env.studies.motions.cases import Case, cases

CASES = cases()
EVENTFUL = [name for name, case in CASES.items() if not case.smooth]


def started(case: Case, accuracy: Any, start: int = 0) -> Simulator:
    sim = Simulator(case.with_accuracy(accuracy))
    sim.reset(*case.start(start))
    return sim


def events(case: Case, accuracy: Any, start: int = 0) -> list[tuple[float, str, int, int, str]]:
    sim = started(case, accuracy, start)
    assert sim.advance(case.duration, case.torque), sim.termination
    return sim.take_events()


def watch(
    sim: Simulator, period: float, until: float, torque: Any = None, steps: int = 10**9
) -> dict[str, float]:
    """Largest kinetic energy, unaccounted energy and constraint violation of the free foot."""
    most = {"kinetic": 0.0, "unaccounted": 0.0, "violation": 0.0}
    made = 0
    while made < steps and sim.time < until - 1e-9:
        goes_on = sim.advance(min(until, sim.time + period), torque)
        made += len(sim.take_steps())
        values = {
            "kinetic": sim.energy(sim.q, sim.v)[0],
            "unaccounted": abs(sim.stats()["energy_residual"]),
            "violation": sim.violation()[0],
        }
        most = {name: max(most[name], value) for name, value in values.items()}
        if not goes_on:
            break
    return most


# --- at reference ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_energy_balance_of_every_motion(name: str) -> None:
    case = CASES[name]
    sim = started(case, "reference")
    most = watch(sim, case.duration / 50, case.duration, case.torque)
    assert sim.time > case.duration - 1e-9, sim.termination
    # Measured at most 1.4e-11, on push_only.
    assert most["unaccounted"] < 1e-9 * most["kinetic"], most


@pytest.mark.long("the energy balance over 100 steps")
@pytest.mark.parametrize("name", scene_names())
def test_a_hundred_steps_keep_energy_and_constraints(name: str) -> None:
    sim = Simulator(replace(load_scene(name), {"accuracy": "reference"}))
    most = watch(sim, 0.01, 200.0, steps=100)
    # Measured at most 1.8e-10 (paper_arms).
    assert most["unaccounted"] < 1e-9 * most["kinetic"], most
    # Measured at most 8.5e-13 m, within the projection's tolerance of 1e-12 at both ends.
    assert most["violation"] < 2e-12, most


@pytest.mark.parametrize("name", EVENTFUL)
def test_event_times_agree_between_methods(name: str) -> None:
    case = CASES[name]
    step = 2e-5 if name == "stiff" else 5e-5
    ours = events(case, "reference")
    other = events(case, {"method": "rk4", "step": step})
    assert [event[1:] for event in ours] == [event[1:] for event in other]
    apart = [abs(a[0] - b[0]) for a, b in zip(ours, other, strict=True)]
    assert max(apart) < 1e-9, dict(zip(ours, apart, strict=True))


@pytest.mark.parametrize("name", EVENTFUL)
def test_no_event_fires_twice(name: str) -> None:
    for start in range(12):
        seen = events(CASES[name], "reference", start)
        for one, two in pairwise(seen):
            assert one[1:] != two[1:] or two[0] - one[0] > 1e-6, (start, one, two)


def test_an_early_force_event_causes_no_impact() -> None:
    # Where a projection at a loose tolerance leaves the free foot's normal force 0.3 N before its
    # change of sign, the foot used to be stopped as if wedged: 55 J, 21 rad/s.
    sim = started(CASES["push_off"], 1e-4)
    assert sim.advance(0.322)
    q, v = sim.q, sim.v
    name = "free foot's normal force changes sign"
    assert sim.guards(sim.time, q, v)[name] > 0.1
    assert sim.reset_map(sim.time, q, v, name)
    assert np.array_equal(sim.v, v)


@pytest.mark.parametrize("name", ["landing", "heel_strike", "push_off", "push_only"])
def test_long_steps_miss_no_event(name: str) -> None:
    # At the loosest tolerance the step size is limited by stability only.
    for start in range(12):
        exact = [event[1:] for event in events(CASES[name], 1e-9, start)]
        assert [event[1:] for event in events(CASES[name], 1e-2, start)] == exact, start


@pytest.mark.parametrize(
    ("accuracy", "depth"),
    [
        (1e-9, 1e-9),
        (1e-6, 1e-6),
        (1e-3, 1e-3),
        ({"method": "rk4", "step": 0.05}, 1e-3),
        ({"method": "rosenbrock", "tolerance": 1e-5}, 1e-5),
    ],
)
def test_an_end_that_dips_into_the_ice_within_a_step_lands(accuracy: Any, depth: float) -> None:
    # In flight the free toe swings down and up again: its lowest point lies in the middle of a step
    # of 20 to 50 ms, and its height is positive at both ends.
    swinging = {
        "start.q": {"z0": 1.0, "q5": 0.6, "q6": -0.4},
        "start.v": {"z0": 1.5, "q5": -6.0},
    }
    scene, until = replace(CASES["flight"].scene, swinging), 0.15
    free = scene.without("impacts")
    lowest = np.inf
    exact = Simulator(replace(free, {"accuracy": 1e-12}))
    for time in np.linspace(0.09, 0.11, 2001):
        assert exact.advance(float(time))
        lowest = min(lowest, exact.gaps().min())
    for under, lands in ((depth, True), (-depth, False)):
        lowered = scene.with_values({"start.q.z0": float(1.0 - lowest - under)})
        sim = Simulator(replace(lowered, {"accuracy": accuracy}))
        sim.advance(until)
        # The toe strikes the ice and leaves it at once: an event without a change of the contact
        # state.
        assert sim.stats()["events"] == lands, sim.stats()


# --- the setting ------------------------------------------------------------------------------


def test_all_forms_of_the_accuracy_setting() -> None:
    paper = load_scene("paper")
    for accuracy in (
        "fast",
        "balanced",
        "reference",
        1e-4,
        {"method": "dop853", "tolerance": 1e-4},
        {"method": "dop853", "step": 1e-3},
        {"method": "dopri5", "tolerance": 1e-4},
        {"method": "dopri5", "step": 1e-3},
        {"method": "rosenbrock", "tolerance": 1e-4},
        {"method": "rosenbrock", "step": 1e-3},
        {"method": "rk4", "step": 1e-3},
        {"method": "moreau", "step": 5e-3},
    ):
        scene = replace(paper, {"accuracy": accuracy})
        assert scene.get("accuracy") == accuracy
        assert Scene.from_toml(scene.to_toml()).to_json() == scene.to_json()
        seen = []
        for keywords in ({"accuracy": accuracy}, {"scene": scene}):
            env = gymnasium.make("IceSkate-v0", **keywords)
            env.reset(seed=0)
            for _ in range(20):
                observation, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
            seen.append(observation)
            env.close()
        assert np.array_equal(*seen), accuracy


@pytest.mark.parametrize(
    ("accuracy", "says"),
    [
        ("nope", "fast, balanced, reference"),
        (1.0, "accuracy = 1: must lie in"),
        ({"method": "rk4"}, "rk4 or moreau with a step"),
        ({"method": "rk4", "tolerance": 1e-3}, "rk4 or moreau with a step"),
        ({"method": "moreau", "step": 1.0}, r"accuracy.step = 1: must lie in \[0.000001, 0.1\] s"),
        ({"method": "euler", "step": 1e-3}, "dopri5 or rosenbrock"),
        ({"method": "rk4", "step": 1e-3, "order": 4}, "rk4 or moreau with a step"),
    ],
)
def test_invalid_accuracies_are_refused(accuracy: Any, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        replace(load_scene("paper"), {"accuracy": accuracy})


def test_statistics_of_a_run() -> None:
    case = CASES["heel_strike"]
    stats = {}
    for accuracy in ("fast", "balanced", "reference", "rosenbrock"):
        way = {"method": accuracy, "tolerance": 1e-4} if accuracy == "rosenbrock" else accuracy
        sim = started(case, way)
        sim.advance(case.duration)
        stats[accuracy] = sim.stats()
    assert (
        stats["fast"]["evaluations"]
        < stats["balanced"]["evaluations"]
        < (stats["reference"]["evaluations"])
    )
    assert stats["balanced"]["error_estimate"] > stats["reference"]["error_estimate"] > 0.0
    assert stats["fast"]["error_estimate"] == 0.0
    for name, seen in stats.items():
        assert seen["steps"] > 0 and seen["events"] >= 1, name
        assert (seen["factorisations"] > 0) == (name == "rosenbrock")
        assert seen["root_iterations"] > 0
    # A step of the linearly implicit method has one factorisation and four stages.
    rosenbrock = stats["rosenbrock"]
    assert rosenbrock["factorisations"] >= rosenbrock["steps"]


# --- fast --------------------------------------------------------------------------------------


def test_paper_makes_its_hundred_steps_fast() -> None:
    def steps(seed: int | None) -> int:
        sim, made = Simulator(replace(load_scene("paper"), {"accuracy": "fast"})), 0
        if seed is not None:
            sim.perturb(0.01, seed)
        # A robot that stands makes no step; 100 steps take 31 s.
        while made < 100 and sim.time < 45.0 and sim.step():
            made += len(sim.take_steps())
        return made

    assert steps(None) == 100
    # Measured 9 of 10, and 55 of 60.
    assert sum(steps(seed) == 100 for seed in range(10)) >= 8


@pytest.mark.parametrize("step", [2e-3, 5e-3, 1e-2])
def test_time_stepping_is_stable_on_stiff_friction_and_lifting(step: float) -> None:
    # A hundred times the joint friction and ten thousand times K_p: explicit steps of a hundredth
    # of this length are unstable.
    paper = load_scene("paper")
    values = {name: value for name, (value, *_) in paper.parameters().items()}
    stiff = {n: 100.0 * x for n, x in values.items() if n.startswith("body") and "damping" in n}
    stiff |= {n: 1e4 * x for n, x in values.items() if "K_p" in n}
    swing = CASES["swing"].scene
    lifting = paper.get("control.lifting")
    standing = Simulator(swing)
    # The target is the head position relative to the ankle.
    _, y, z = standing.head_position - [0.0, standing.link_segments()[1, 0, 1], 0.0]
    lifting |= {"ahead": float(y), "height": float(z)}
    scene = replace(swing, {"control.lifting": lifting})
    scene = replace(scene.with_values(stiff), {"accuracy": {"method": "moreau", "step": step}})
    sim = Simulator(scene)
    assert sim.advance(1.0)
    assert np.abs(sim.v).max() < 50.0
    assert np.abs(sim.q).max() < 10.0


def test_time_stepping_closes_the_energy_balance() -> None:
    # Second order in the step: measured 1.2e-4 and 3.1e-5 of the kinetic energy.
    unaccounted = []
    for step in (5e-3, 2.5e-3):
        sim = started(CASES["flight"], {"method": "moreau", "step": step})
        most = watch(sim, 0.05, CASES["flight"].duration)
        unaccounted.append(most["unaccounted"] / most["kinetic"])
    assert unaccounted[0] < 1e-3
    assert abs(np.log2(unaccounted[0] / unaccounted[1]) - 2.0) < 0.3, unaccounted
