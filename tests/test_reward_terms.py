"""The terms of the reward, and what an environment counts: slide, steps, flight, double support."""

from functools import partial

import numpy as np
import pytest

import skate_env
from skate_env._core import REWARD_WEIGHTS
from skate_env.environments import PAPER_ACTIONS, IceSkateEnv
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED

PRESETS = skate_env.scene_names()
ZERO = np.zeros(16, np.float32)
# All joints act, with the torques that the paper prints, and nothing is mirrored.
whole = partial(IceSkateEnv, **PAPER_ACTIONS)
SCALE = PAPER_ACTIONS["action_scale"]
HEAD = {name: default for name, _, default in REWARD_WEIGHTS}["head"]


def play(env, actions):
    """Observations, rewards and infos of an episode, up to its end."""
    env.reset(seed=0)
    seen = []
    for action in actions:
        observation, reward, terminated, _, info = env.step(action)
        seen.append((observation, reward, info))
        if terminated:
            break
    return zip(*seen, strict=True)


# --- rewards -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PRESETS)
def test_slide_sums_to_the_replay_s_and_terms_to_the_reward(name):
    env = whole(name)
    _, rewards, infos = play(env, [ZERO] * 500)
    for reward, info in zip(rewards, infos, strict=True):
        assert reward == sum(value for key, value in info.items() if key.startswith("reward_"))
    replay = record(skate_env.Simulator(name), steps=int(infos[-1]["steps"]) + 2)
    at = int(np.flatnonzero(replay.t == infos[-1]["time"])[0])
    assert at > 30
    # The slide of the replay's gait steps until then, plus the present gait step.
    sim = skate_env.Simulator(name)
    for _ in range(len(infos)):
        sim.step()
    made = sim.take_steps()
    assert infos[-1]["loaded_slide"] == sim.totals()["loaded_slide"]
    np.testing.assert_array_equal(
        [step["loaded_slide"] for step in made], replay.steps["loaded_slide"][: len(made)]
    )
    assert sum(step["loaded_slide"] for step in made) <= sim.totals()["loaded_slide"] + 1e-12


@pytest.mark.parametrize("name", ["paper", "push_only"])
def test_weights_scale_their_terms(name):
    names = [each for each, *_ in REWARD_WEIGHTS[:-5]]
    factors = dict(zip(names, (-3.0, 0.5, 0.0, 2.0, 4.0, 7.0, 5.0, 1.5), strict=True))
    usual = {each: default for each, _, default in REWARD_WEIGHTS} | {"speed": 5.0}
    usual["high_speed"] = 1.5
    weights = {each: factor * usual[each] for each, factor in factors.items()}
    actions = np.full((600, 10), 0.1, np.float32)
    one, two = (IceSkateEnv(name, reward=usual | given) for given in ({}, weights))
    paid = set()
    for (*_, a), (*_, b) in zip(
        zip(*play(one, actions), strict=True), zip(*play(two, actions), strict=True), strict=True
    ):
        for each, factor in factors.items():
            key = f"reward_{each}"
            assert b[key] == pytest.approx(factor * a[key], rel=1e-15)
            paid |= {each} if a[key] else set()
    # No flight and no fall of `paper` here, no two long steps of `push_only`.
    assert paid >= set(names) - {"paper": {"flight", "fall", "step"}, "push_only": {"step"}}[name]


def sliding_point(sim):
    """Position of the supporting foot's end on the ice [m]; y0 is that of the toe."""
    length = sum(sim.scene.get(f"body.foot.{end}") for end in ("toe", "heel"))
    on_heel = sim.state_name.startswith(("slide_roll_heel", "stick_roll_heel"))
    return sim.q[0] - on_heel * length * np.cos(sim.q[2])


def test_slide_pays_only_on_a_loaded_foot_that_slips():
    # Random torques with push-only contact: feet fly, stick, and carry small loads.
    scene = replace(skate_env.load_scene("push_only"), {"control.action_period": 1e-3})
    env = whole(scene, perturb=0.02)
    env.action_space.seed(0)
    weight = 64.2 * 9.81
    paid = {"air": 0, "light": 0, "stuck": 0, "slides": 0}
    for episode in range(6):
        env.reset(seed=episode)
        for _ in range(600):
            # New torques change the forces; with constant torques they hardly change within 1 ms.
            action = env.action_space.sample()
            if env.step(action)[2]:
                break
            before = env.simulator
            *_, terminated, _, info = env.step(action)
            if terminated:
                break
            after = env.simulator
            if len(after.take_events()) > len(before.take_events()):
                continue  # More than one contact state within the action.
            loads = [sim.contact_forces[0, 1] / weight for sim in (before, after)]
            slides = after.state_number > 0 and (after.state_number - 1) % 4 >= 2
            if after.state_number == 0:
                kind = "air"
            elif not slides:
                kind = "stuck"
            elif max(loads) < 0.09:
                kind = "light"
            elif min(loads) > 0.11:
                kind = "slides"
            else:
                continue
            slide = info["loaded_slide"] - before.totals()["loaded_slide"]
            if kind == "slides":
                slid = sliding_point(after) - sliding_point(before)
                assert slide == pytest.approx(slid, abs=1e-12)
            else:
                assert slide == info["reward_slide"] == 0.0, kind
            paid[kind] += 1
    assert min(paid.values()) > 0, paid


def test_head_pays_for_its_height_and_effort_costs():
    scene = skate_env.load_scene("paper")
    env = whole(scene)
    _, _, infos = play(env, np.ones((5, 16), np.float32))
    standing = 1.70
    sim = skate_env.Simulator(scene)
    for info in infos:
        assert info["reward_effort"] == pytest.approx(-0.1 * sim.action_period, rel=1e-12)
        sim.step(list(SCALE.values()))
        # The scene's robot counts as fallen at 1 m.
        posture = (sim.head_position[2] - 1.0) / (standing - 1.0)
        wanted = HEAD * sim.action_period * np.clip(posture, 0.0, 1.0)
        assert info["reward_head"] == pytest.approx(wanted, abs=1e-15)


def test_without_fall_detection_a_head_pays_down_to_the_ice():
    env = whole(replace(skate_env.load_scene("paper"), {"fall": None}))
    _, _, infos = play(env, [ZERO] * 5)
    sim = skate_env.Simulator(env.scene)
    for info in infos:
        sim.step()
        wanted = HEAD * sim.action_period * min(sim.head_position[2] / 1.70, 1.0)
        assert info["reward_head"] == pytest.approx(wanted, abs=1e-15)


# --- steps, flight, double support ---------------------------------------------------------------


@pytest.mark.parametrize("name", ["paper", PAPER_DAMPED, "paper_arms", BLADE])
def test_steps_of_a_steady_gait_are_the_replay_s(name):
    env = whole(name)
    _, _, infos = play(env, [ZERO] * 1000)
    sim = skate_env.Simulator(name)
    for _ in range(1000):
        sim.step()
    made = len(sim.take_steps())
    # The load may be transferred a little after the leg swap.
    assert made > 8 and infos[-1]["steps"] in (made, made - 1)


def test_chattering_feet_make_no_steps():
    # Leg swaps within less than 0.15 s, and those without load, do not count.
    env = whole("push_only")
    _, _, infos = play(env, [ZERO] * 1000)
    sim = env.simulator
    legs = [leg for *_, leg in sim.take_events()]
    swaps = sum(a != b for a, b in zip(["right", *legs], legs, strict=False))
    steps = infos[-1]["steps"]
    assert 0 < steps < swaps
    times = [info["time"] for info in infos]
    counted = [
        t for t, d in zip(times, np.diff([0, *(i["steps"] for i in infos)]), strict=True) if d
    ]
    assert np.diff(counted).min() > 0.15 - 0.01 - 1e-9


def test_flight_and_double_support_are_the_time_between_events():
    env = whole("push_only")
    _, _, infos = play(env, [ZERO] * 300)
    sim = env.simulator
    events = sim.take_events()
    begins = [0.0, *(event[0] for event in events)]
    states = [3, *(event[3] for event in events)]
    spans = np.diff([*begins, sim.time])
    flight = sum(span for span, state in zip(spans, states, strict=True) if state == 0)
    double = sum(span for span, state in zip(spans, states, strict=True) if state > 4)
    assert flight > 0.05 and double > 0.005
    # Measured: 1e-15 s.
    assert infos[-1]["flight_time"] == pytest.approx(flight, abs=1e-12)
    assert infos[-1]["double_support_time"] == pytest.approx(double, abs=1e-12)


def test_the_hips_are_where_the_waist_is():
    env = whole("push_only")
    env.reset(seed=0)
    for _ in range(100):
        *_, info = env.step(ZERO)
        # The waist is the bar between the hips: the two ends of link 4.
        ends = env.simulator.link_segments()[3, :, 1]
        assert info["y_position"] == pytest.approx(ends, abs=1e-12)  # 2e-16
