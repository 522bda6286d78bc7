"""A restored snapshot continues like the original, bit for bit."""

import copy
import pickle
import struct

import gymnasium
import numpy as np
import pytest

import skate_env
from skate_env import Simulator, load_scene
from skate_env.environments import IceSkateEnv
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

PRESETS = [*skate_env.scene_names(), BLADE]


def twins_of(sim):
    """Copy a simulator by every way of saving and restoring."""
    restored = Simulator(sim.scene)
    restored.restore(sim.snapshot())
    return {
        "snapshot": restored,
        "pickle": pickle.loads(pickle.dumps(sim)),
        "copy": copy.copy(sim),
        "deepcopy": copy.deepcopy(sim),
    }


@pytest.mark.parametrize("accuracy", ["balanced", "fast"])
@pytest.mark.parametrize("name", PRESETS)
def test_simulators_continue_around_every_event(name, accuracy):
    scene = replace(load_scene(name), {"accuracy": accuracy})
    scout = Simulator(scene)
    while scout.time < 1.5 and scout.step():
        pass
    # Right before, at and right after the first events, and a little later. The gait's events form
    # groups, so some of these times are between two of them.
    times = sorted(
        t + offset
        for t in {event[0] for event in scout.take_events()[:25]}
        for offset in (-1e-7, -1e-12, 0.0, 1e-12, 1e-7)
        if t + offset > 0.0
    )
    rng = np.random.default_rng(0)
    sim = Simulator(scene)
    checked = 0
    for i, t in enumerate(times):
        if t < sim.time or not sim.advance(t):
            continue
        if i % 3 != 0:
            continue
        twins = twins_of(sim)
        straight = copy.copy(sim)
        residuals = rng.normal(0.0, 5.0, (5, 16))
        for residual in residuals:
            straight.step(residual)
        for way, twin in twins.items():
            for residual in residuals:
                twin.step(residual)
            assert twin.snapshot() == straight.snapshot(), (way, t)
        checked += 1
    assert checked >= (15 if accuracy == "balanced" and name != BLADE else 1), checked


@pytest.mark.parametrize("keywords", [{}, {"torque_limit": 60.0, "accuracy": "fast"}])
@pytest.mark.parametrize("name", PRESETS)
def test_environments_continue_at_random_moments(name, keywords):
    env = IceSkateEnv(name, perturb=0.01, **keywords)
    rng = np.random.default_rng(1)
    env.reset(seed=2)
    saves = set(rng.integers(0, 200, 12).tolist())
    pending = []
    for i in range(240):
        if i in saves:
            other = IceSkateEnv(name, perturb=0.01, **keywords)
            other.restore(env.snapshot())
            pending += [other, pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
        action = rng.uniform(-0.1, 0.1, 10).astype(np.float32)
        wanted = env.step(action)
        for twin in pending:
            seen = twin.step(action)
            np.testing.assert_array_equal(seen[0], wanted[0])
            assert seen[1:] == wanted[1:]
        if wanted[2]:
            # The random numbers of the next start are included.
            begun, _ = env.reset()
            for twin in pending:
                np.testing.assert_array_equal(twin.reset()[0], begun)
    assert len(pending) > 20


def test_an_episode_can_be_repeated_from_a_snapshot():
    env = IceSkateEnv("paper")
    env.reset(seed=0)
    for _ in range(30):
        env.step(np.zeros(10))
    saved = env.snapshot()
    tries = []
    for size in (0.0, 0.5, 0.0):
        env.restore(saved)
        tries.append([env.step(np.full(10, size)) for _ in range(20)])
    for first, other in zip(tries[0], tries[2], strict=True):
        np.testing.assert_array_equal(first[0], other[0])
        assert first[1:] == other[1:]
    assert not np.array_equal(tries[0][-1][0], tries[1][-1][0])


def test_wrapped_environments_pickle_with_their_time_limit():
    env = gymnasium.make("IceSkate-v0", max_episode_steps=10, perturb=0.01)
    env.reset(seed=0)
    for _ in range(6):
        env.step(np.zeros(10, np.float32))
    twin = pickle.loads(pickle.dumps(env))
    for i in range(4):
        mine, its = (each.step(np.zeros(10, np.float32)) for each in (env, twin))
        np.testing.assert_array_equal(mine[0], its[0])
        assert mine[1:] == its[1:] and mine[3] is (i == 3)


def test_an_environment_without_reset_stays_without_reset(refused):
    env = IceSkateEnv("paper")
    twin = pickle.loads(pickle.dumps(env))
    for each in (env, twin):
        refused(
            gymnasium.error.ResetNeeded, lambda e=each: e.step(np.zeros(10)), "has not been reset"
        )


def test_a_snapshot_holds_the_numbers_of_its_episode():
    scene = replace(load_scene("paper"), {"randomise": {"body.head.mass": [3.0, 6.0]}})
    env, other = IceSkateEnv(scene), IceSkateEnv(scene)
    env.reset(seed=0)
    other.reset(seed=1)
    assert env.simulator.scene != other.simulator.scene
    other.restore(env.snapshot())
    assert env.simulator.scene == other.simulator.scene


def test_scenes_pickle_and_compare_by_their_fields():
    scene = load_scene("paper")
    twin = pickle.loads(pickle.dumps(scene))
    assert twin == scene and hash(twin) == hash(scene) and copy.deepcopy(scene) == scene
    assert scene != load_scene(BLADE) and scene != "paper"
    assert scene != replace(scene, {"ice.gravity": 9.8100001})


@pytest.mark.parametrize("wrong", [b"", b"IceSkate", b"x" * 500])
def test_an_invalid_snapshot_changes_nothing(refused, wrong):
    env = IceSkateEnv("paper")
    env.reset(seed=0)
    env.step(np.zeros(10))
    before = env.snapshot()
    refused(ValueError, lambda: env.restore(wrong), "not a snapshot of this environment")
    refused(TypeError, lambda: env.restore("text"), "data", "must be bytes")
    assert env.snapshot() == before


@pytest.mark.parametrize("seed", range(3))
def test_every_damaged_byte_is_noticed(seed):
    env = IceSkateEnv("paper")
    env.reset(seed=0)
    saved = env.snapshot()
    rng = np.random.default_rng(seed)
    for _ in range(300):
        damaged = bytearray(saved)
        damaged[rng.integers(len(damaged))] ^= int(rng.integers(1, 256))
        with pytest.raises(ValueError, match="not a snapshot"):
            env.restore(bytes(damaged))
    assert env.snapshot() == saved


def resealed(data):
    """Compute the checksum of a snapshot again, as anybody can."""
    body, mask = data[:-8], (1 << 64) - 1
    s = 0xCBF29CE484222325 ^ len(body)
    for i in range(0, len(body) // 8 * 8 + 8, 8):
        s ^= int.from_bytes(body[i : i + 8].ljust(8, b"\0"), "little")
        s = (s * 0x9E3779B97F4A7C15) & mask
        s = ((s << 32) | (s >> 32)) & mask
    return body + s.to_bytes(8, "little")


def forged(data, number):
    """Snapshots with a number in place of any eight bytes."""
    for offset in range(16, len(data) - 16):
        yield resealed(data[:offset] + struct.pack("<d", number) + data[offset + 8 :])


@pytest.mark.parametrize("number", [np.nan, -np.inf, 1e308, -1e308])
def test_forged_simulators_are_refused_or_finite(number):
    sim = Simulator("paper")
    sim.advance(0.53)
    for data in forged(sim.snapshot(), number):
        try:
            sim.restore(data)
        except ValueError:
            continue
        sim.step()
        shown = (sim.q, sim.v, sim.contact_forces, sim.acceleration, sim.torque)
        assert all(np.isfinite(values).all() for values in shown)
        assert np.isfinite([*sim.totals().values(), *sim.stats().values()]).all()


@pytest.mark.parametrize("number", [np.nan, -np.inf, 1e308, -1e308])
def test_forged_environments_are_refused_or_finite(number):
    env, zero = IceSkateEnv(kick=0.3), np.zeros(10, np.float32)
    env.reset(seed=0)
    for _ in range(53):
        env.step(zero)
    for data in forged(env.snapshot(), number):
        try:
            env.restore(data)
        except ValueError:
            continue
        try:
            observation, reward, *_, info = env.step(zero)
        except gymnasium.error.ResetNeeded:
            continue
        numbers = [x for x in info.values() if isinstance(x, float)]
        assert np.isfinite(observation).all() and np.isfinite([reward, *numbers]).all()
