"""The terms of the reward, the end without steps, and what an environment counts."""

import copy
import pickle
from functools import partial

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import skate_env
from skate_env._core import REWARD_WEIGHTS
from skate_env.environments import PAPER_ACTIONS, IceSkateEnv, IceSkateVectorEnv
from skate_env.policies import baseline
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED

PRESETS = skate_env.scene_names()
ZERO = np.zeros(16, np.float32)
# All joints act, with the torques that the paper prints, and nothing is mirrored.
whole = partial(IceSkateEnv, **PAPER_ACTIONS)
SCALE = PAPER_ACTIONS["action_scale"]
WEIGHTS = {name: default for name, _, default in REWARD_WEIGHTS}
TERMS = ["slide", "head", "flight", "speed", "fall"]
LIMITS = ["high_speed", "longest_step"]
# Episodes of any length without steps.
ENDLESS = {"longest_step": 1e3}


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
        assert reward == sum(info[f"reward_{term}"] for term in TERMS)
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
    assert [each for each, *_ in REWARD_WEIGHTS] == TERMS + LIMITS
    factors = dict(zip(TERMS, (-3.0, 0.5, 0.0, 2.0, 1.5), strict=True))
    usual = WEIGHTS | {"high_speed": 1.5}
    weights = {each: factor * usual[each] for each, factor in factors.items()}
    actions = np.full((600, 10), 0.02, np.float32)
    one, two = (
        IceSkateEnv(name, action_scale=100.0, reward=usual | given) for given in ({}, weights)
    )
    paid = set()
    for (*_, a), (*_, b) in zip(
        zip(*play(one, actions), strict=True), zip(*play(two, actions), strict=True), strict=True
    ):
        for each, factor in factors.items():
            key = f"reward_{each}"
            assert b[key] == pytest.approx(factor * a[key], rel=1e-15)
            paid |= {each} if a[key] else set()
    # No flight and no fall of `paper` here.
    assert paid >= set(TERMS) - {"paper": {"flight", "fall"}, "push_only": set()}[name]


def sliding_point(sim):
    """Position of the supporting foot's end on the ice [m]; y0 is that of the toe."""
    length = sum(sim.scene.get(f"body.foot.{end}") for end in ("toe", "heel"))
    on_heel = sim.state_name.startswith(("slide_roll_heel", "stick_roll_heel"))
    return sim.q[0] - on_heel * length * np.cos(sim.q[2])


def test_slide_counts_only_on_a_loaded_foot_that_slips():
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
                assert slide == 0.0, kind
            paid[kind] += 1
    assert min(paid.values()) > 0, paid


def test_head_pays_for_its_height():
    scene = skate_env.load_scene("paper")
    env = whole(scene)
    _, _, infos = play(env, np.ones((5, 16), np.float32))
    standing = 1.70
    sim = skate_env.Simulator(scene)
    for info in infos:
        sim.step(list(SCALE.values()))
        # The scene's robot counts as fallen at 1 m.
        posture = (sim.head_position[2] - 1.0) / (standing - 1.0)
        wanted = WEIGHTS["head"] * sim.action_period * np.clip(posture, 0.0, 1.0)
        assert info["reward_head"] == pytest.approx(wanted, abs=1e-15)


def test_without_fall_detection_a_head_pays_down_to_the_ice():
    env = whole(replace(skate_env.load_scene("paper"), {"fall": None}))
    _, _, infos = play(env, [ZERO] * 5)
    sim = skate_env.Simulator(env.scene)
    for info in infos:
        sim.step()
        wanted = WEIGHTS["head"] * sim.action_period * min(sim.head_position[2] / 1.70, 1.0)
        assert info["reward_head"] == pytest.approx(wanted, abs=1e-15)


@pytest.mark.parametrize("name", ["paper_printed", "push_only"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slide_flight_and_speed_are_those_of_the_action(name, sign):
    """From the totals and the hips before and after it, forward and backward.

    Slide is that of the gait step that the action completes.
    """
    weights = {"slide": 3.0, "flight": 5.0, "speed": 2.0, "high_speed": 0.8} | ENDLESS
    env = whole(name, reward=weights)
    velocity = skate_env.Simulator(name).v
    velocity[0] *= sign
    _, before = env.reset(seed=0, options={"state": {"v": velocity}})
    rng, sides, flown, most = np.random.default_rng(0), set(), 0.0, 0.0
    began = before
    for _ in range(300):
        *_, terminated, _, info = env.step(rng.uniform(-0.1, 0.1, 16))
        if terminated:
            break
        changed = {key: info[key] - before[key] for key in ("time", "flight_time", "y_position")}
        way = changed["y_position"]
        if info["steps"] > before["steps"]:
            slid, moved = (info[key] - began[key] for key in ("loaded_slide", "y_position"))
            assert info["reward_slide"] == 3.0 * min(slid, moved)
            began = info
        else:
            assert info["reward_slide"] == 0.0
        beyond = max(0.0, abs(way) - weights["high_speed"] * changed["time"])
        assert info["reward_flight"] == -5.0 * changed["flight_time"]
        assert info["reward_speed"] == -2.0 * beyond
        flown += changed["flight_time"]
        sides |= {np.sign(way)} if beyond else set()
        most = max(most, beyond)
        before = info
    assert sign in sides and most > 0.001
    # Backward the robot makes no step.
    assert info["steps"] > 0 or sign < 0.0
    assert (flown > 0.01) is (name == "push_only")


def test_a_fall_is_paid_once_and_by_its_weight_alone():
    """The state at the end of a fall may have any speed; the term `speed` does not count there."""
    scene = skate_env.load_scene("push_only")
    env = whole(scene, reward={"fall": 7.0, "high_speed": 0.0})
    env.action_space.seed(0)
    _, _, infos = play(env, [env.action_space.sample() for _ in range(500)])
    assert infos[-1]["termination"] == "fall"
    assert [info["reward_fall"] for info in infos] == [0.0] * (len(infos) - 1) + [-7.0]
    assert infos[-1]["reward_speed"] == 0.0 and infos[-2]["reward_speed"] < 0.0


# --- the end without steps -----------------------------------------------------------------------


def standing():
    """Scene of a robot that glides and stands, and makes no step."""
    return baseline.lifting_only("paper_printed").scene


def until_its_end(env, action, steps=600):
    """Return the infos of an episode, and the reward of its last action."""
    infos, reward = [env.reset(seed=0)[1]], 0.0
    for _ in range(steps):
        _, reward, terminated, _, info = env.step(action)
        infos.append(info)
        assert terminated is (info["termination"] is not None)
        if terminated:
            break
    return infos, reward


@pytest.mark.parametrize("longest", [0.3, 1.005, 2.0])
@pytest.mark.parametrize("period", [0.01, 0.05])
def test_a_robot_that_makes_no_step_is_terminated_after_the_longest_step(longest, period):
    env = whole(standing(), action_period=period, reward={"longest_step": longest, "fall": 4.0})
    infos, reward = until_its_end(env, ZERO)
    last = infos[-1]
    assert last["termination"] == env.simulator.termination == "no_step" and last["steps"] == 0
    # At the end of the first action after it.
    assert longest < last["time"] <= longest + period * (1.0 + 1e-12)
    assert last["reward_fall"] == -4.0
    assert reward == sum(last[f"reward_{term}"] for term in TERMS) < -3.0
    assert all(info["reward_fall"] == 0.0 for info in infos[:-1])
    # The robot stands.
    assert env.simulator.head_position[2] > 1.5
    with pytest.raises(ResetNeeded):
        env.step(ZERO)
    assert env.reset(seed=0)[1]["termination"] is None


def test_the_default_longest_step_ends_an_episode():
    infos, _ = until_its_end(IceSkateEnv(standing()), ZERO[:10])
    assert infos[-1]["termination"] == "no_step"
    assert infos[-1]["time"] == pytest.approx(WEIGHTS["longest_step"] + 0.01, abs=1e-9)


def test_a_robot_that_may_stand_goes_on():
    infos, _ = until_its_end(whole(standing(), reward=ENDLESS), ZERO)
    assert infos[-1]["termination"] is None and infos[-1]["time"] == pytest.approx(6.0)
    assert infos[-1]["steps"] == 0


def test_a_simulator_has_no_longest_step():
    sim = skate_env.Simulator(standing())
    assert all(sim.step() for _ in range(600)) and sim.termination is None


def test_the_time_counts_from_the_last_step():
    """A gait of 1.1 s for each step; from 1 s on random actions disturb and then stop it."""
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, (500, 10))
    actions = np.concatenate([np.zeros((100, 10)), noise])

    def played(longest):
        weights = {"longest_step": longest}
        env = IceSkateEnv("paper_printed", action_scale=100.0, reward=weights)
        return list(play(env, actions))[2]

    free = played(1e3)
    made = np.flatnonzero(np.diff([0, *(info["steps"] for info in free)]))
    # Ends of the actions within which the steps have been made; the last one after 4.03 s.
    ends = [0.0, *(free[k]["time"] for k in made)]
    assert len(ends) > 4 and free[-1]["time"] > ends[-1] + 1.5
    counted = []
    for longest in (0.7, 1.15, 1.5):
        infos = played(longest)
        last = infos[-1]
        assert last["termination"] == "no_step"
        # The limit changes nothing before the end.
        assert list(infos[:-1]) == list(free[: len(infos) - 1])
        since = last["time"] - ends[last["steps"]]
        assert longest - 0.01 < since < longest + 0.01 + 1e-9
        assert np.diff(ends[: last["steps"] + 1]).max(initial=0.0) < longest + 0.01
        counted.append(last["steps"])
    assert counted[0] == 0 and counted[2] > counted[1] > 1


@pytest.mark.parametrize("name", ["paper_printed", "push_only"])
def test_what_follows_a_snapshot_ends_as_the_whole_does(name):
    """The time since the last step is a part of snapshots, copies and pickles."""
    env, other = (IceSkateEnv(name, reward={"longest_step": 0.4}) for _ in range(2))
    infos, reward = until_its_end(env, ZERO[:10])
    assert infos[-1]["termination"] == "no_step"
    for at in (0, 1, len(infos) // 2, len(infos) - 2):
        env.reset(seed=0)
        for _ in range(at):
            env.step(ZERO[:10])
        other.restore(env.snapshot())
        for twin in (other, copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
            for wanted in infos[at + 1 :]:
                _, paid, terminated, _, info = twin.step(ZERO[:10])
                assert info == wanted
            assert terminated and paid == reward
    # The end is a part of them too.
    other.restore(twin.snapshot())
    assert other.simulator.termination == "no_step"
    with pytest.raises(ResetNeeded):
        other.step(ZERO[:10])


def test_a_new_episode_has_the_whole_time():
    """After a part of an episode, after its end, and where it begins within a gait step."""
    env = whole("paper_printed", reward={"longest_step": 0.5})
    for phase, actions in ((0.0, 20), (0.0, 100), (0.0, 100), (1.5, 100)):
        begun = env.reset(seed=0, options={"phase": phase})[1]["time"]
        for _ in range(actions):
            *_, terminated, _, info = env.step(ZERO)
            if terminated:
                break
        if actions == 100:
            assert info["termination"] == "no_step" and info["steps"] == 0
            # Measured: 0.51 s.
            assert 0.5 < info["time"] - begun < 0.51 + 1e-9
    # The last episode has begun 1.64 s after the scene's start.
    assert begun > 0.5


def test_single_and_vector_end_alike_without_steps():
    """With every reset mode; a step that resets starts the whole time anew."""
    keywords = {"reward": {"longest_step": 0.4}, "perturb": 0.02, "action_scale": 100.0}
    actions = np.random.default_rng(0).uniform(-0.2, 0.2, (150, 3, 10)).astype(np.float32)
    singles = [IceSkateEnv("paper_printed", **keywords) for _ in range(3)]
    many = IceSkateVectorEnv(3, "paper_printed", autoreset_mode="SameStep", **keywords)
    many.reset(seed=4)
    for i, env in enumerate(singles):
        env.reset(seed=4 + i)
    ended = 0
    for action in actions:
        _, rewards, over, _, infos = many.step(action)
        for i, env in enumerate(singles):
            _, reward, terminated, _, info = env.step(action[i])
            assert (rewards[i], over[i]) == (reward, terminated)
            if terminated:
                assert infos["final_info"]["termination"][i] == info["termination"] == "no_step"
                assert infos["final_info"]["time"][i] == info["time"]
                ended += 1
                env.reset()
    assert ended > 6


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
