"""Starts of episodes: states, parameters, phases, disturbances, random numbers."""

import numpy as np
import pytest
from scipy import stats

from skate_env import Simulator, load_scene
from skate_env.environments import IceSkateEnv
from skate_env.replay.recorder import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED

ZERO = np.zeros(10, np.float32)
RANGES = {
    "ice.friction.mu_forward": [0.1, 0.3],
    "body.head.mass": [4.0, 5.0],
    "body.upper_leg.length": [0.36, 0.40],
    "control.lifting.K_p.2": [55000.0, 58000.0],
}
# A free foot rotated so far that no small noise lifts its heel out of the ice.
DEEP = {"q": np.array([0.0] * 8 + [1.5] + [0.0] * 10)}


def numbers(env, names=RANGES):
    known = env.simulator.scene.parameters()
    return [known[name][0] for name in names]


# --- options -------------------------------------------------------------------------------------


def test_an_episode_starts_at_the_given_state():
    sim = Simulator("paper")
    for _ in range(40):
        sim.step()
    env = IceSkateEnv("paper", perturb=0.1)
    state = {"q": sim.q, "v": sim.v, "support_leg": sim.support_leg}
    env.reset(seed=0, options={"state": state})
    # A given state is not disturbed by the keyword.
    np.testing.assert_array_equal(env.simulator.q, sim.q)
    np.testing.assert_array_equal(env.simulator.v, sim.v)
    env.reset(options={"state": {"support_leg": "left"}})
    assert env.simulator.support_leg == "left"
    np.testing.assert_array_equal(env.simulator.q, Simulator("paper").q)
    env.reset(options={"state": state, "perturb": 0.01})
    assert 1e-4 < np.abs(env.simulator.v - sim.v).max() < 0.1


def test_what_a_given_state_leaves_out_is_not_the_last_episode_s():
    env = IceSkateEnv("paper")
    env.reset(seed=0, options={"params": {"start.v.y0": 2.0}})
    env.reset(options={"state": {"support_leg": "left"}})
    np.testing.assert_array_equal(env.simulator.v, Simulator("paper").v)
    # The option applies to this episode only.
    given = {"state": {"support_leg": "left"}, "params": {"start.v.y0": 3.0}}
    env.reset(options=given)
    assert env.simulator.v[0] == 3.0 and env.simulator.support_leg == "left"


def test_parameters_of_one_episode():
    env = IceSkateEnv("paper")
    env.reset(options={"params": {"ice.friction.mu_forward": 0.3}})
    wanted = Simulator(replace(load_scene("paper"), {"ice.friction.mu_forward": 0.3}))
    for _ in range(30):
        env.step(ZERO)
        wanted.step()
    np.testing.assert_array_equal(env.simulator.q, wanted.q)
    env.reset()
    assert env.simulator.scene == load_scene("paper")


@pytest.mark.parametrize("name", ["paper", BLADE])
@pytest.mark.parametrize("phase", [0.25, 1.0, 2.6])
def test_a_phase_agrees_with_the_replay(name, phase):
    env = IceSkateEnv(name)
    observation, info = env.reset(options={"phase": phase})
    replay, ends = Simulator(name), [0.0]
    while len(ends) < 4:
        replay.step()
        ends += [step["time"] for step in replay.take_steps()]
    wanted = Simulator(name)
    while wanted.time < info["time"] - 1e-9:
        wanted.step()
    np.testing.assert_array_equal(env.simulator.q, wanted.q)
    np.testing.assert_array_equal(env.simulator.v, wanted.v)
    walk = IceSkateEnv(name)
    seen, now = walk.reset()
    while now["time"] < info["time"] - 1e-9:
        seen, *_, now = walk.step(ZERO)
    np.testing.assert_array_equal(observation, seen)
    # Rounded to the nearest action.
    at = np.interp(phase, range(4), ends)
    assert info["time"] == pytest.approx(at, abs=0.5 * wanted.action_period + 1e-9)
    # Slide, steps and times count from this start.
    assert env.simulator.totals() == dict.fromkeys(env.simulator.totals(), 0.0)
    before = wanted.totals()["loaded_slide"]
    *_, info = env.step(ZERO)
    wanted.step()
    slid = wanted.totals()["loaded_slide"] - before
    assert info["loaded_slide"] == pytest.approx(slid, abs=1e-14)


@pytest.mark.parametrize(
    ("options", "kind", "words"),
    [
        ({"nope": 1}, ValueError, ["unknown option 'nope'", "state, params, phase, perturb"]),
        ({"state": [0.0]}, TypeError, ["state = [0.0]", "q, v, support_leg"]),
        ({"state": {"qpos": 0}}, ValueError, ["unknown part of state 'qpos'"]),
        ({"state": {"q": np.full(19, np.nan)}}, ValueError, ["q[0] = NaN"]),
        ({"state": {"support_leg": "both"}}, ValueError, ['"both"', '"right" or "left"']),
        ({"state": {"q": -np.ones(19)}}, ValueError, ["below the ice"]),
        ({"params": {"nope": 1.0}}, ValueError, ["nope", "no number of that name"]),
        ({"params": {"ice.gravity": 1e3}}, ValueError, ["ice.gravity = 1000", "[0, 100] m/s2"]),
        ({"params": [1.0]}, TypeError, ["params", "a dict of numbers by name"]),
        ({"params": {"ice.gravity": "9.81"}}, TypeError, ["ice.gravity", "a real number"]),
        ({"phase": -0.1}, ValueError, ["phase = -0.1", "[0, 1000] steps"]),
        ({"phase": np.nan}, ValueError, ["phase = NaN"]),
        ({"phase": "half"}, TypeError, ["phase = 'half'", "real number"]),
        ({"perturb": -1}, ValueError, ["perturb = -1", "[0, 10]"]),
        ({"perturb": 1e-3, "state": DEEP}, ValueError, ["100 draws gave no valid start"]),
    ],
)
def test_a_refused_option_changes_nothing(refused, options, kind, words):
    env = IceSkateEnv("paper_printed")
    env.reset(seed=0)
    env.step(ZERO)
    before = env.snapshot()
    refused(kind, lambda: env.reset(options=options), *words)
    assert env.snapshot() == before
    # Also for a refusal together with a seed.
    refused(kind, lambda: env.reset(seed=9, options=options), *words)
    assert env.snapshot() == before


def test_a_phase_that_the_baseline_does_not_reach_is_refused(refused):
    env = IceSkateEnv("push_only")
    refused(ValueError, lambda: env.reset(options={"phase": 60.0}), "phase = 60", "fall")


# --- random numbers ------------------------------------------------------------------------------


def test_drawn_numbers_lie_evenly_in_their_ranges():
    env = IceSkateEnv(replace(load_scene("paper"), {"randomise": RANGES}))
    env.reset(seed=0)
    drawn = []
    for _ in range(400):
        env.reset()
        drawn.append(numbers(env))
    for name, column in zip(RANGES, np.transpose(drawn), strict=True):
        low, high = RANGES[name]
        assert low <= column.min() and column.max() <= high
        # Draws with legs too long for the start are rejected together with the other parameters, so
        # only parameters without influence on the rejection are uniform.
        if name != "body.upper_leg.length":
            test = stats.kstest(column, "uniform", (low, high - low))
            assert test.pvalue > 1e-3, (name, test)
    # And independent of each other: 5 standard errors.
    correlation = np.corrcoef(np.transpose(drawn)) - np.eye(4)
    assert np.abs(correlation).max() < 5 / np.sqrt(400)


def test_drawn_numbers_hold_for_an_episode_and_depend_on_the_seed_alone():
    scene = replace(load_scene("paper"), {"randomise": RANGES})
    env, other = IceSkateEnv(scene), IceSkateEnv(scene)
    env.reset(seed=4)
    begun = numbers(env)
    for _ in range(20):
        env.step(ZERO)
    assert numbers(env) == begun
    other.reset(seed=4)
    assert numbers(other) == begun
    env.reset()
    other.reset()
    assert numbers(env) == numbers(other) != begun


def test_given_parameters_override_drawn_ones():
    env = IceSkateEnv(replace(load_scene("paper"), {"randomise": RANGES}))
    given = {"body.head.mass": 6.0, "ice.gravity": 9.0}
    env.reset(seed=4, options={"params": given})
    known = env.simulator.scene.parameters()
    assert {name: known[name][0] for name in given} == given
    env.reset(seed=4)
    drawn = numbers(env)
    assert drawn[1] != 6.0 and numbers(env, ["ice.gravity"]) == [9.81]


def test_a_simulator_has_the_scene_s_own_numbers():
    scene = replace(load_scene("paper"), {"randomise": RANGES})
    sim, plain = Simulator(scene), Simulator("paper")
    for _ in range(50):
        sim.step()
        plain.step()
    np.testing.assert_array_equal(sim.q, plain.q)


def test_ranges_survive_files_and_pickles():
    scene = replace(load_scene("paper"), {"randomise": RANGES})
    text = scene.to_toml()
    assert '"ice.friction.mu_forward" = [' in text
    assert type(scene).from_toml(text) == scene
    assert scene.get("randomise") == RANGES


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({"ice.mu": [0.1, 0.2]}, ["ice.mu", "number of this scene's body, ice"]),
        ({"ice.gravity": [9.0, 200.0]}, ["ice.gravity", "200", "[0, 100] m/s2"]),
        ({"ice.gravity": [10.0, 9.0]}, ["ice.gravity", "[10, 9]", "[lowest, highest]"]),
        ({"ice.gravity": [9.0]}, ["randomise"]),
        ({"ice.gravity": 9.0}, ["randomise"]),
        ({"control.action_period": [0.01, 0.02]}, ["control.action_period", "periods"]),
        ({"accuracy": [1e-6, 1e-5]}, ["accuracy", "must be a number of this scene's"]),
        ({"start.v.y0": [1.0, 2.0]}, ["start.v.y0"]),
        # Each is within its range, but the scene is not valid with the other parameters.
        ({"contact.edge_damping": [0.0, 1.0]}, ["contact.edge_damping"]),
    ],
)
def test_invalid_ranges_are_refused(refused, ranges, words):
    push_only = load_scene("push_only")
    refused(ValueError, lambda: replace(push_only, {"randomise": ranges}), *words)


def test_perturbed_starts_differ_and_repeat_with_the_seed():
    env = IceSkateEnv("paper", perturb=0.01)
    sequence = []
    for _ in range(2):
        starts = [env.reset(seed=3)[0], *(env.reset()[0] for _ in range(4))]
        assert len(np.unique(starts, axis=0)) == 5
        sequence.append(starts)
    np.testing.assert_array_equal(*sequence)
    # Equal to a simulator's draw with the same seed.
    sim = Simulator("paper")
    sim.perturb(0.01, 3)
    env.reset(seed=3)
    np.testing.assert_array_equal(env.simulator.q, sim.q)


# --- states of motions ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["paper", "paper_printed", "push_only", PAPER_DAMPED, BLADE])
@pytest.mark.parametrize("accuracy", ["balanced", "fast"])
def test_the_samples_of_a_recording_are_starts(name, accuracy):
    """Of a simulator and of an environment, unless the torques of the new controller swap the legs.

    Without an event, bit for bit.
    """
    scene = replace(load_scene(name), {"accuracy": accuracy})
    recording = record(Simulator(scene), steps=2)
    sim, env, found = Simulator(scene), IceSkateEnv(scene), set()
    for k in range(0, len(recording.t), 3):
        q, v = recording.q[k], recording.v[k]
        leg = "right" if recording.right_support[k] else "left"
        sim.reset(q, v, leg)
        env.reset(options={"state": {"q": q, "v": v, "support_leg": leg}})
        np.testing.assert_array_equal(env.simulator.q, sim.q)
        np.testing.assert_array_equal(env.simulator.v, sim.v)
        if sim.support_leg != leg:
            continue
        # Time steps leave closed ends up to 1e-9 m from the ice.
        apart = 1e-8 if accuracy == "fast" else 1e-13
        np.testing.assert_allclose(sim.q, q, rtol=0.0, atol=apart)
        if sim.state_number == recording.state_number[k]:
            np.testing.assert_array_equal(sim.q, q)
            np.testing.assert_array_equal(sim.v, v)
            found.add(sim.state_number)
        single = [x.astype(np.float32) for x in (q, v)]
        sim.reset(*single, leg)
        if sim.support_leg == leg:
            assert np.abs(sim.q - single[0]).max() < 1e-5
    assert len(found) >= 2
