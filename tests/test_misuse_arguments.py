"""Arguments of public functions: their ranges, and objects after a refusal."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from skate_env import Mirror, Policy, Simulator, load_scene, policies, to_mjcf
from skate_env.environments import IceSkateEnv, IceSkateVectorEnv
from skate_env.policies import baseline, shipped
from skate_env.render import Renderer
from skate_env.render.side_by_side import SideBySide
from skate_env.replay import film, record
from skate_env.studies import callgrind
from tests.commands import line


@pytest.mark.parametrize("wrong", [0, -1, 1.5, np.nan, True, None])
def test_counts_of_a_recording_and_a_film_are_ints_of_at_least_one(refused, wrong, tmp_path):
    sim = Simulator("paper")
    before, kind = sim.snapshot(), ValueError if wrong in (0, -1) else TypeError
    path = tmp_path / "a.gif"
    refused(kind, lambda: record(sim, wrong), "steps = ")
    refused(kind, lambda: record(sim, 1, every=wrong), "every = ")
    refused(kind, lambda: film.make(path, sim, Renderer(320, 200), wrong, 25.0, 1.0), "steps = ")
    assert sim.snapshot() == before and not path.exists()


def test_a_film_has_a_path_of_either_type(refused, tmp_path):
    size = SimpleNamespace(width=320, height=200)
    film.check(str(tmp_path / "a.gif"), size, 25.0)
    refused(TypeError, lambda: film.check(str(tmp_path / "a.gif"), size, "25"), "fps = ")
    sim = Simulator("paper")
    made = film.make(str(tmp_path / "a.gif"), sim, Renderer(320, 200), 1, 1.0, 1.0)
    assert made.steps >= 1 and (tmp_path / "a.gif").exists()


@pytest.mark.parametrize(
    "wrong", [np.nan, -1.0, 0.0, np.inf, 10**400, "1", True], ids=lambda x: str(x)[:9]
)
def test_the_time_step_of_an_export_has_a_range(refused, wrong):
    kind = TypeError if isinstance(wrong, str | bool) else ValueError
    refused(kind, lambda: to_mjcf("paper", timestep=wrong), "timestep")


def test_mirrored_vectors_have_the_length_of_the_names(refused):
    refused(ValueError, lambda: Mirror([]), "names", "at least one")
    mirror = Mirror(["q1", "q8"])
    for shape in ((3,), (1,), (2, 3), ()):
        refused(ValueError, lambda shape=shape: mirror(np.zeros(shape)), "values have shape")
    for wrong in ([0.0, 0.0], np.zeros(2, int), np.zeros(2, complex)):
        refused(TypeError, lambda wrong=wrong: mirror(wrong), "values", "floating-point")
    assert mirror(np.zeros((0, 2), np.float32)).shape == (0, 2)


@pytest.fixture(scope="module")
def feedback():
    policy = Policy.load(shipped("paper_printed"))
    n, d = len(policy.joint_names), len(policies.inputs(policy.observation_names))
    names = "scene", "action_scale", "observation_names", "joint_names", "about"
    rng = np.random.default_rng(0)
    return policies.OrbitPolicy(
        references=rng.normal(size=(3, d)),
        actions=np.zeros((3, n)),
        gains=rng.normal(size=(3, n, d)),
        roots=rng.normal(size=(3, d, d)),
        limit=1.0,
        **{name: getattr(policy, name) for name in names},
    )


def test_a_feedback_has_actions_for_no_and_for_extreme_observations(feedback):
    size = len(feedback.observation_names)
    assert feedback.predict(np.zeros((0, size)))[0].shape == (0, len(feedback.joint_names))
    rng = np.random.default_rng(1)
    for scale in (1e9, 1e30, 1e308):
        seen = scale * rng.uniform(-1.0, 1.0, (5, size))
        assert np.isfinite(feedback.predict(seen)[0]).all()


@pytest.fixture(params=["network", "feedback"])
def policy(request):
    network = request.param == "network"
    return Policy.load(shipped("paper")) if network else request.getfixturevalue("feedback")


def fields_of(policy):
    return {name: getattr(policy, name) for name in policy.__dataclass_fields__}


def test_the_order_in_memory_does_not_matter(policy):
    """Sums in another order have other bits."""

    def other(given):
        if isinstance(given, tuple | list):
            return type(given)(other(each) for each in given)
        return np.asfortranarray(given) if isinstance(given, np.ndarray) else given

    turned = type(policy)(**{name: other(given) for name, given in fields_of(policy).items()})
    seen = np.random.default_rng(2).normal(0.0, 0.3, (50, len(policy.observation_names)))
    for rows in (seen, other(seen), np.repeat(seen, 2, 1)[:, ::2]):
        np.testing.assert_array_equal(turned.predict(rows)[0], policy.predict(seen)[0])


def test_a_policy_acts_whatever_numpy_makes_of_overflow_and_underflow(policy):
    rng, size = np.random.default_rng(3), len(policy.observation_names)
    for scale in (1e-310, 1e-40, 1.0, 1e40, 1e300):
        seen = scale * rng.uniform(-1.0, 1.0, (5, size))
        wanted = policy.predict(seen)[0]
        with np.errstate(all="raise"):
            again = type(policy)(**fields_of(policy))
            np.testing.assert_array_equal(again.predict(seen)[0], wanted)


def test_a_picture_does_not_depend_on_what_numpy_makes_of_underflow():
    sim, renderer = Simulator("paper"), Renderer(1920, 1080)
    sim.advance(0.3)
    wanted = renderer.draw(sim)
    with np.errstate(all="raise"):
        np.testing.assert_array_equal(Renderer(1920, 1080).draw(sim), wanted)


class Fails:
    """An object whose conversion to an array, to a list or to a number fails."""

    def fail(self, *_, **__):
        raise OSError("disk")

    __array__ = __float__ = __len__ = __iter__ = __getitem__ = fail


def test_parts_of_a_policy_whose_conversion_fails_are_refused(policy):
    arrays = ("layers", "log_std", "mean", "std", "clip", "references", "actions", "gains", "roots")
    fields = fields_of(policy)
    wrong = [{name: Fails()} for name in (*arrays, "limit") if name in fields]
    wrong += [{"layers": [layer]} for layer in (Fails(), (Fails(), Fails()))] * ("layers" in fields)
    for part in wrong:
        with pytest.raises((TypeError, ValueError), match="disk"):
            type(policy)(**fields | part)
    for acting in (policy, baseline.no_residual()):
        with pytest.raises(ValueError, match="observation"):
            acting.predict(Fails())


def test_the_scene_of_a_policy_is_a_scene(refused, feedback):
    wrong = fields_of(feedback) | {"scene": "paper", "joint_names": ["q2"]}
    refused(TypeError, lambda: policies.OrbitPolicy(**wrong), "scene = 'paper'", "Scene")


def test_numbers_beyond_double_precision_are_refused(refused, feedback):
    seen = np.full(len(feedback.observation_names), np.longdouble("1e4000"))
    refused(ValueError, lambda: feedback.predict(seen), "observation[0] = inf")


def test_options_and_snapshots_of_a_wrong_type_are_refused_by_name(refused):
    env = IceSkateVectorEnv(2)
    env.reset(seed=1)
    before = env.snapshot()
    refused(ValueError, lambda: env.reset(options={"elapsed": [[1], [1, 2]]}), "elapsed")
    for wrong in (None, iter(before), "ab", {0: before[0], 1: before[1]}):
        refused(TypeError, lambda wrong=wrong: env.restore(wrong), "snapshots: must be a list")
    assert env.snapshot() == before


@pytest.mark.parametrize("made", [Renderer(320, 200), SideBySide(644, 217, ("a", "b"))])
def test_renderers_have_copies(made):
    """Fonts have none."""
    sims = Simulator("paper") if isinstance(made, Renderer) else [Simulator("paper")] * 2
    for copied in (copy.copy(made), copy.deepcopy(made), pickle.loads(pickle.dumps(made))):
        np.testing.assert_array_equal(copied.draw(sims), made.draw(sims))


def test_pictures_need_a_reset_of_every_environment(refused):
    env = IceSkateVectorEnv(2, render_mode="rgb_array", autoreset_mode="Disabled")
    refused(ResetNeeded, env.render, "reset")
    env.reset(seed=1, options={"reset_mask": np.array([True, False])})
    refused(ResetNeeded, env.render, "reset")
    env.reset(seed=1)
    other = IceSkateVectorEnv(2, render_mode="rgb_array", autoreset_mode="Disabled")
    other.restore(env.snapshot())
    assert len(env.render()) == len(other.render()) == 2


@pytest.mark.parametrize("make", [IceSkateEnv, lambda: IceSkateVectorEnv(2)])
def test_an_environment_keeps_its_episode_where_a_pickle_is_damaged(make):
    env = make()
    env.reset(seed=1)
    state, before = env.__getstate__(), env.snapshot()
    damaged = b"x" if isinstance(before, bytes) else [before[0], b"x"]
    with pytest.raises(ValueError, match="snapshot"):
        env.__setstate__(state | {"_batch": damaged})
    assert env.snapshot() == before


def test_a_command_without_stderr_shows_no_progress(tmp_path):
    command = f"{sys.executable} -m skate_env replay --steps 1 --no-figures --out {tmp_path} 2>&-"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert done.returncode == 0 and "written to" in done.stdout, done.stdout


def test_an_interrupted_count_ends_valgrind(tmp_path, monkeypatch):
    fake = tmp_path / "valgrind"
    fake.write_text(f"#!/bin/sh\necho $$ > {tmp_path}/pid\necho 1\nexec sleep 30\n")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    def stop():
        raise KeyboardInterrupt

    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        callgrind.instructions_per_evaluation([load_scene("paper")], stop)
    assert time.monotonic() - started < 5.0
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_processes_of_a_killed_stress_test_end():
    command = line("stress", "--jobs", 2, "--steps", 100_000_000)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        workers, deadline = [], time.monotonic() + 60.0
        while len(workers) < 2 and time.monotonic() < deadline:
            time.sleep(0.1)
            workers = [pid for pid in children(process.pid) if "spawn_main" in command_of(pid)]
        # The workers register themselves after their imports.
        time.sleep(3.0)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert len(workers) == 2
    deadline = time.monotonic() + 5.0
    while any(command_of(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(command_of(pid) for pid in workers)


def children(pid):
    """Process ids of the children of a process."""
    text = open(f"/proc/{pid}/task/{pid}/children", encoding="ascii").read()
    return [int(child) for child in text.split()]


def command_of(pid):
    """Command of a process; empty after its end."""
    try:
        return open(f"/proc/{pid}/cmdline", encoding="utf-8").read()
    except OSError:
        return ""
