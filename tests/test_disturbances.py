"""Disturbances of robust policies: random kicks, and starts with a rotated, tilted trunk."""

import copy
import pickle

import numpy as np
import pytest
from scipy import stats

from skate_env import IceSkateEnv, IceSkateVectorEnv, Simulator, load_scene
from skate_env.scenes import Mirror, replace
from skate_env.studies.fixtures import PAPER_DAMPED

ACCURACIES = ["fast", "balanced"]
SIZE = 0.2
TRUNK = ["q8", "q10"]
# Knees bent, the free foot 7 cm above the ice: the first draw is valid for any noise.
LIFTED = {"start": {"q": {"q2": 0.1, "q3": -0.2, "q5": 0.5, "q6": -0.9, "q7": 0.4}}}


def sticking():
    """Ice on which no foot can slide."""
    return load_scene("paper_printed").without("slipping")


def kicked(env, actions):
    """Play an episode and return the times of its kicks [s], taken from the energy balance."""
    times, booked = [], 0.0
    for action in actions:
        begun = env.simulator.time
        over = env.step(action)[2]
        now = env.simulator.energy_balance()["kicks"]
        if now != booked:
            times.append(round(begun / env.action_period) * env.action_period)
        if over:
            break
        booked = now
    return times


# --- kicks ---------------------------------------------------------------------------------------


def test_kicks_of_an_episode_depend_on_its_seed_alone():
    scene = replace(load_scene(PAPER_DAMPED), {"accuracy": "fast", "fall": None})
    # Few of these robots make steps.
    env = IceSkateEnv(
        scene, kick=0.05, action_period=0.05, action_scale=100.0, reward={"longest_step": 1e3}
    )
    rng = np.random.default_rng(0)
    still, restless = np.zeros((600, 10)), rng.uniform(-0.2, 0.2, (600, 10))
    seen = []
    for seed in range(4):
        each = []
        for actions in (still, restless):
            env.reset(seed=seed)
            each.append(kicked(env, actions))
        shorter = min(len(times) for times in each)
        assert each[0][:shorter] == each[1][:shorter] and shorter > 1
        for times in each:
            waits = np.diff([0.0, *times])
            assert waits.min() > 2.0 - 1e-9 and waits.max() < 6.0 + 1e-9
        seen.append(each[0])
    assert len({tuple(times) for times in seen}) == 4
    # The kicks and start of the next episode do not depend on the length of this one.
    begun = []
    for length in (3, 300):
        env.reset(seed=0)
        kicked(env, still[:length])
        observation, _ = env.reset()
        begun.append((observation.tolist(), kicked(env, still)))
    assert begun[0] == begun[1] and begun[0][1] != seen[0]


@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_an_environment_kicks_as_the_simulator_does(accuracy):
    env = IceSkateEnv("paper_printed", accuracy=accuracy, kick=SIZE)
    signs = set()
    for seed in range(4):
        env.reset(seed=seed)
        hand = env.simulator
        for _ in range(700):
            before = env.simulator.energy_balance()["kicks"]
            over = env.step(np.zeros(10))[2]
            if over:
                break
            if env.simulator.energy_balance()["kicks"] != before:
                momentum = [hand.momentum(hand.q, hand.v)[0]]
                tries = {sign: copy.copy(hand) for sign in (1.0, -1.0)}
                for sign, twin in tries.items():
                    assert twin.kick(sign * SIZE)
                    momentum.append(twin.momentum(twin.q, twin.v)[0])
                    twin.step()
                mass = sum(body["mass"] for body in hand.bodies())
                # Measured at most 2e-14.
                assert np.diff(momentum) == pytest.approx(np.array([1, -2]) * mass * SIZE, 1e-12)
                wanted = env.simulator.snapshot()
                sign = next(sign for sign in tries if tries[sign].snapshot() == wanted)
                signs.add(sign)
                hand = tries[sign]
            else:
                hand.step()
                assert hand.snapshot() == env.simulator.snapshot()
    assert signs == {1.0, -1.0}


@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_a_mirrored_robot_takes_the_same_kicks(accuracy):
    keywords = {"accuracy": accuracy, "kick": SIZE, "trunk_noise": 0.05, "action_period": 0.02}
    envs = [IceSkateEnv("paper_printed", **keywords) for _ in range(2)]
    for seed in range(3):
        envs[0].reset(seed=seed)
        mirror = Mirror(envs[0].simulator.coordinate_names)
        sim = envs[0].simulator
        left = {"q": mirror(sim.q), "v": mirror(sim.v), "support_leg": "left"}
        right = {"q": sim.q, "v": sim.v, "support_leg": "right"}
        for env, state in zip(envs, (right, left), strict=True):
            env.reset(seed=seed, options={"state": state})
        for _ in range(400):
            ends = [env.step(np.zeros(10))[2] for env in envs]
            sims = [env.simulator for env in envs]
            np.testing.assert_array_equal(mirror(sims[0].q), sims[1].q)
            np.testing.assert_array_equal(mirror(sims[0].v), sims[1].v)
            assert ends[0] == ends[1]
            if ends[0]:
                break
        assert sims[0].energy_balance()["kicks"] != 0.0


def test_invalid_kicks_are_refused(refused):
    sim = Simulator(load_scene("paper_printed"))
    sim.step()
    before = sim.snapshot()
    for wrong in (10.5, -11, np.nan, np.inf):
        refused(ValueError, lambda x=wrong: sim.kick(x), "speed", "must lie in [-10, 10] m/s")
    for wrong in (None, "1", True, 1j, [1.0]):
        refused(TypeError, lambda x=wrong: sim.kick(x), "speed", "must be a real number")
    assert sim.snapshot() == before
    stuck = Simulator(sticking())
    refused(ValueError, lambda: stuck.kick(-0.5), "speed = -0.5", "must be 0 on sticking ice")
    assert stuck.kick(0.0)


# --- trunk noise ---------------------------------------------------------------------------------


def starts(n, scene="paper_printed", **keywords):
    """Return simulators at the starts of n seeds."""
    env = IceSkateEnv(scene, **keywords)
    for seed in range(n):
        env.reset(seed=seed)
        yield env.simulator


def test_trunk_noise_has_the_size_asked_for_and_moves_the_trunk_alone():
    sigma, own = 0.03, Simulator(load_scene("paper_printed"))
    where = [own.coordinate_names.index(name) for name in TRUNK]
    noise = []
    for sim in starts(300, trunk_noise=sigma):
        moved = np.array([sim.q - own.q, sim.v - own.v])
        noise.append(moved[:, where].ravel() / sigma)
        assert not np.delete(moved, where, axis=1).any()
    noise = np.array(noise)
    assert stats.kstest(noise.ravel(), "norm").pvalue > 0.01
    # Independent of each other: 0.2 exceeds three standard deviations.
    assert np.abs(np.corrcoef(noise.T) - np.eye(4)).max() < 0.2


def test_trunk_noise_changes_nothing_else_of_a_disturbed_start():
    scene = replace(load_scene("paper_printed"), LIFTED)
    where = [Simulator(scene).coordinate_names.index(name) for name in TRUNK]
    pairs = zip(
        starts(20, scene, perturb=0.02),
        starts(20, scene, perturb=0.02, trunk_noise=0.1),
        strict=True,
    )
    for without, noisy in pairs:
        for of in ("q", "v"):
            left, right = getattr(without, of), getattr(noisy, of)
            assert (left != right).nonzero()[0].tolist() == where


def test_noise_of_a_trunk_that_is_partly_locked(refused, paper):
    for locked in TRUNK:
        scene = paper(locked=[locked])
        sim, noisy = Simulator(scene), next(starts(1, scene, trunk_noise=0.1))
        (moved,) = (sim.q != noisy.q).nonzero()
        assert {sim.coordinate_names[i] for i in moved} == set(TRUNK) - {locked}
    rigid = paper(locked=TRUNK)
    for kind in (IceSkateEnv, lambda scene, **given: IceSkateVectorEnv(2, scene, **given)):
        kind(rigid, trunk_noise=0.0)
        refused(
            ValueError,
            lambda make=kind: make(rigid, trunk_noise=0.1),
            "trunk_noise = 0.1: must be 0",
            "q8 and q10",
        )


def test_a_given_state_has_no_trunk_noise():
    env = IceSkateEnv("paper_printed", trunk_noise=0.1)
    sim = Simulator(load_scene("paper_printed"))
    where = [sim.coordinate_names.index(name) for name in TRUNK]
    for options in ({"state": {"q": sim.q}}, {"state": {"q": sim.q}, "perturb": 0.01}):
        env.reset(seed=0, options=options)
        np.testing.assert_array_equal(env.simulator.q[where], sim.q[where])
    env.reset(seed=0, options={"phase": 0.5, "perturb": 0.0})
    assert (env.simulator.q[where] != sim.q[where]).all()


# --- both ----------------------------------------------------------------------------------------

BOTH = {"perturb": 0.01, "trunk_noise": 0.05, "kick": SIZE, "action_period": 0.02}


@pytest.mark.parametrize(
    ("name", "accuracy"),
    [("paper_printed", "balanced"), ("paper_printed", "fast"), ("push_only", "fast")],
)
def test_a_batch_is_disturbed_as_its_environments_are(name, accuracy):
    n, limit, steps = 5, 200, 410
    keywords = BOTH | {"accuracy": accuracy}
    actions = np.random.default_rng(2).uniform(-0.01, 0.01, (steps, n, 10)).astype(np.float32)
    wanted, kicks = [], 0
    for i in range(n):
        env, made = IceSkateEnv(name, **keywords), 0
        seen = [env.reset(seed=3 + i)[0]]
        for action in actions[:, i]:
            observation, _, over, *_ = env.step(action)
            made += 1
            if over or made == limit:
                kicks += env.simulator.energy_balance()["kicks"] != 0.0
                observation, made = env.reset()[0], 0
            seen.append(observation)
        wanted.append((seen, env.simulator.snapshot()))
    # Robots of `push_only` mostly fall earlier and are reset more often.
    assert kicks > 2 or name == "push_only"
    for threads in (1, 2):
        envs = IceSkateVectorEnv(
            n,
            name,
            autoreset_mode="SameStep",
            num_threads=threads,
            max_episode_steps=limit,
            **keywords,
        )
        seen = [envs.reset(seed=3)[0], *(envs.step(action)[0] for action in actions)]
        for i in range(n):
            np.testing.assert_array_equal([each[i] for each in seen], wanted[i][0])
            assert envs.simulator(i).snapshot() == wanted[i][1]


@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_a_snapshot_between_kicks_continues_bit_for_bit(accuracy):
    def make():
        return IceSkateEnv("paper_printed", accuracy=accuracy, **BOTH)

    env, rng = make(), np.random.default_rng(4)
    env.reset(seed=1)
    twins, kicks = [], 0
    for i in range(500):
        booked = env.simulator.energy_balance()["kicks"]
        if i % 60 == 30:
            twins += [make(), pickle.loads(pickle.dumps(env))]
            twins[-2].restore(env.snapshot())
        action = rng.uniform(-0.02, 0.02, 10).astype(np.float32)
        over = env.step(action)[2]
        kicks += env.simulator.energy_balance()["kicks"] != booked
        ends = over or i == 250
        if ends:
            env.reset()
        for twin in twins:
            assert twin.step(action)[2] == over
            if ends:
                twin.reset()
            assert twin.snapshot() == env.snapshot()
    assert kicks > 1


def test_without_disturbances_nothing_is_random():
    env = IceSkateEnv("paper_printed")
    env.reset(seed=0)
    for _ in range(700):
        if env.step(np.zeros(10))[2]:
            break
    assert env.simulator.energy_balance()["kicks"] == 0.0
    assert env.scene.get("energy_balance")
    plain, disturbed = (
        IceSkateEnv("paper_printed", perturb=0.01, **k) for k in ({}, {"kick": SIZE})
    )
    np.testing.assert_array_equal(plain.reset(seed=5)[0], disturbed.reset(seed=5)[0])


@pytest.mark.parametrize("many", [False, True])
def test_kicks_on_sticking_ice_are_refused(refused, many):
    def make(kick):
        scene = sticking()
        return IceSkateVectorEnv(2, scene, kick=kick) if many else IceSkateEnv(scene, kick=kick)

    make(0.0)
    refused(ValueError, lambda: make(0.5), "kick = 0.5: must be 0 on sticking ice")
