"""Calls of every public callable of the package with values that break careless code.

The callables are found by introspection. A call may raise what is documented; then the object must
be unchanged. No call takes more than 2 s after a signal, and all of them take less than 256 MB.

    python tests/misuse_harness.py --calls 100000 --seed 1
"""

import argparse
import collections
import inspect
import os
import resource
import signal
import sys
import tempfile
import time
from pathlib import Path

import gymnasium
import numpy as np

import skate_env
from skate_env import gradients, policies, render
from skate_env.environments.config import DEFAULTS
from skate_env.policies import Policy, baseline, shipped
from skate_env.replay import film, recorder
from skate_env.scenes import loading as scenes
from skate_env.studies.fixtures import PAPER_DAMPED

MOST_SECONDS, MOST_BYTES = 2.0, 256 * 2**20
# Long calls get a signal after this time [s].
PATIENCE = 1.0
ALLOWED = (ValueError, TypeError, OSError, gymnasium.error.Error)
# Called with another object than one of the package, these fail by its missing attributes.
OBJECTS = ("record", "make", "make_comparison", "check", "residual", "draw")
# Modules whose public functions and classes are called, besides `skate_env.__all__`.
MODULES = (baseline, recorder, scenes, render, film, gradients, policies)
# What a signal interrupts between two time steps or actions.
MOVING = (
    *("Simulator.advance", "Simulator.step", "IceSkateEnv.step"),
    *("IceSkateVectorEnv.advance", "IceSkateVectorEnv.step"),
    *("OfSimulator.record", "OfSimulator.rollout"),
)
# Not calls: they return what is set, or they are generic methods of a base class. `inputs` is for
# names that are checked already.
SKIPPED = {"close", "get_wrapper_attr", "has_wrapper_attr", "set_wrapper_attr", "close_extras"}
SKIPPED |= {"inputs"}


class Hostile(Exception):
    """Raised by hostile objects; a call may pass it on."""


class Stop(Exception):
    """Raised by the signal's handler."""


def _raise(*_, **__):
    raise Hostile


def _breaks(*_, **__):
    raise ArithmeticError("of the array")


def hostile(**methods):
    return type("HostileObject", (), methods)()


def values(rng):
    """Return one nasty value."""
    n = int(rng.integers(0, 40))
    nested = []
    for _ in range(3000):
        nested = [nested]
    choices = [
        lambda: None,
        lambda: bool(n % 2),
        lambda: n,
        lambda: -n,
        lambda: int(rng.choice([2**31, 2**32, 2**53, 2**62])) * int(rng.choice([-1, 1])),
        lambda: 2**63 + n,
        lambda: 2**64 + n,
        lambda: 10**30,
        lambda: -(10**5000),
        lambda: float(rng.choice([np.nan, np.inf, -np.inf, -0.0, 1e-310, 1e300, -1e300])),
        lambda: float(rng.normal()),
        lambda: 1j,
        lambda: np.float32(np.nan),
        lambda: np.uint64(2**64 - 1),
        lambda: np.int8(-1),
        lambda: np.array(n),
        lambda: np.array([], dtype=object),
        lambda: np.full(19, np.nan),
        lambda: rng.normal(size=n),
        lambda: rng.normal(size=16).astype(np.float32),
        lambda: rng.normal(0.0, 1e-2, size=19),
        lambda: np.zeros((2, 16)),
        lambda: np.zeros((2, 16), "M8[s]"),
        lambda: np.broadcast_to(0.0, (10**7,)),
        lambda: np.zeros(19)[::-1],
        lambda: np.zeros(19, ">f8"),
        lambda: np.zeros(3, [("a", "f8")]),
        lambda: "",
        lambda: str(
            rng.choice(["paper_printed", "right", "fast", "fall", "rhs", "step", "\0", "\ud800"])
        ),
        lambda: "x" * 10_000,
        lambda: "[" * 10_000,
        lambda: bytes(n),
        lambda: bytearray(8 * n),
        lambda: memoryview(bytes(n)),
        lambda: nested,
        lambda: [0.0] * n,
        lambda: [[0.0], [0.0, 1.0]],
        lambda: (None, nested),
        lambda: {},
        lambda: {"phase": rng.choice([0.5, -1.0, np.nan, 1e9, 3.0])},
        lambda: {"state": {"q": np.full(19, 1e300)}, "params": {"ice.gravity": -1.0}},
        lambda: {"params": {n: n}, "elapsed": [2**64 - 1] * 2},
        lambda: {None: None},
        lambda: {"ice.friction.mu_forward": nested},
        lambda: {1, 2},
        lambda: range(10**4),
        lambda: iter([]),
        lambda: Path("\0"),
        lambda: Path("/no/such/folder/file.npz"),
        lambda: Path("/dev/zero"),
        lambda: Path("x" * 10_000),
        lambda: object,
        lambda: object(),
        lambda: lambda *_: None,
        lambda: hostile(__index__=_raise),
        lambda: hostile(__index__=lambda self: 10**30),
        lambda: hostile(__index__=lambda self: "1"),
        lambda: hostile(__float__=_raise, __repr__=_raise),
        lambda: hostile(__float__=lambda self: np.nan),
        lambda: hostile(__array__=_raise),
        lambda: hostile(__array__=_breaks),
        lambda: hostile(__array__=lambda self, *a, **k: np.full(19, np.inf)),
        lambda: hostile(__len__=lambda self: 2**62, __getitem__=lambda self, i: 0.0),
        lambda: hostile(__len__=lambda self: -1, __getitem__=_raise),
        lambda: hostile(__fspath__=_raise),
        lambda: hostile(__fspath__=lambda self: 3),
        lambda: hostile(__eq__=_raise, __hash__=lambda self: 1),
        lambda: hostile(__str__=_raise, __repr__=lambda self: "r" * 10**6),
        lambda: hostile(keys=_raise, __getitem__=_raise),
        lambda: skate_env.load_scene("paper_printed"),
        lambda: skate_env.Simulator(skate_env.load_scene("paper_printed")),
    ]
    return choices[rng.integers(len(choices))]()


class OfSimulator:
    """Functions that move a simulator."""

    def __init__(self, scene):
        self.sim = skate_env.Simulator(scene)

    def rollout(self, torques, start=None):
        gradients.rollout(self.sim, torques, start)

    def record(self, steps, every=1):
        recorder.record(self.sim, steps, every)


def orbit(policy):
    """Return a feedback with the names of a policy."""
    n, d = len(policy.joint_names), len(policies.inputs(policy.observation_names))
    names = "scene", "action_scale", "observation_names", "joint_names", "about"
    return policies.OrbitPolicy(
        references=np.zeros((3, d)),
        actions=np.zeros((3, n)),
        gains=np.ones((3, n, d)),
        roots=np.ones((3, d, d)),
        limit=1.0,
        **{name: getattr(policy, name) for name in names},
    )


def subjects():
    """Return makers of objects with methods, by name, and how to compare their states."""
    scene = skate_env.load_scene("paper_printed")

    def env():
        made = skate_env.IceSkateEnv()
        made.reset(seed=1)
        return made

    def vector():
        made = skate_env.IceSkateVectorEnv(2)
        made.reset(seed=1)
        return made

    observed = np.zeros(len(env().observation_names), np.float32)
    policy = Policy.load(shipped("paper_printed"))
    run = recorder.record(skate_env.Simulator(scene), 1)
    feedback = orbit(policy)
    damped = skate_env.load_scene(PAPER_DAMPED)
    derived = gradients.rollout(skate_env.Simulator(damped), np.zeros((2, 16)))
    return {
        "Simulator": (lambda: skate_env.Simulator(scene), lambda sim: sim.snapshot()),
        "Scene": (lambda: scene, lambda scene: scene.to_json()),
        "IceSkateEnv": (env, lambda env: (env.snapshot(), str(env.np_random.bit_generator.state))),
        "IceSkateVectorEnv": (
            vector,
            lambda env: (env.snapshot(), str(env.np_random.bit_generator.state)),
        ),
        "OfSimulator": (lambda: OfSimulator(damped), lambda of: of.sim.snapshot()),
        "Rollout": (lambda: derived, lambda derived: derived.A.tobytes()),
        "OrbitPolicy": (lambda: feedback, lambda policy: policy.predict(observed)[0].tobytes()),
        "Policy": (lambda: policy, lambda policy: policy.predict(observed)[0].tobytes()),
        "Recording": (lambda: run, lambda run: run.q.tobytes()),
        "Mirror": (lambda: skate_env.Mirror(policy.joint_names), lambda mirror: None),
        "Renderer": (lambda: render.Renderer(320, 200), lambda renderer: None),
    }


def is_public(name, member):
    named = not name.startswith("_") or name == "__call__"
    return named and callable(member) and name not in SKIPPED


def targets():
    """Return (name, subject or None, function) of all public callables."""
    found = []
    for name in skate_env.__all__:
        member = getattr(skate_env, name)
        if is_public(name, member):
            found.append((name, None, member))
    for module in MODULES:
        for name, member in vars(module).items():
            own = getattr(member, "__module__", "").startswith(module.__name__)
            if own and is_public(name, member) and not isinstance(member, type(Path)):
                found.append((f"{module.__name__}.{name}", None, member))
    for name, (make, _) in subjects().items():
        kind = type(make())
        for method in dir(kind):
            if is_public(method, getattr(kind, method)):
                found.append((f"{name}.{method}", name, method))
    return found


def arguments(function, rng):
    """Draw arguments: as many as the signature has, now and then one more or fewer."""
    try:
        parameters = [
            each
            for each in inspect.signature(function).parameters.values()
            if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)
        ]
    except (TypeError, ValueError):
        return [values(rng) for _ in range(rng.integers(0, 4))], {}
    positional = [each for each in parameters if each.kind != each.KEYWORD_ONLY]
    needed = sum(each.default is each.empty for each in positional)
    count = int(rng.integers(needed, len(positional) + 1))
    if rng.random() < 0.05:
        count = max(count + int(rng.choice([-1, 1])), 0)
    keywords = [each.name for each in parameters if each.kind == each.KEYWORD_ONLY]
    # The table of keywords of the environments.
    keywords += DEFAULTS if "keywords" in inspect.signature(function).parameters else ()
    chosen = [name for name in keywords if rng.random() < 0.4]
    return [values(rng) for _ in range(count)], {name: values(rng) for name in chosen}


def call(function, given, keywords):
    """Call with a signal after `PATIENCE`; return the time after it and what was raised."""
    started = time.monotonic()
    try:
        raised = attempt(function, given, keywords)
    # The signal has arrived at the very end.
    except Stop as stop:
        raised = stop
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    return time.monotonic() - started - PATIENCE, raised


def attempt(function, given, keywords):
    """Call with the timer set; return what was raised."""
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)
    try:
        result = function(*given, **keywords)
        if inspect.isgenerator(result):
            result.close()
    # Whatever is raised is checked by the caller, panics of the engine included.
    except BaseException as error:
        return error
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return None


def run(calls, seed):
    """Make random calls; return counts of outcomes and a list of failures."""
    rng = np.random.default_rng(seed)
    before = signal.signal(signal.SIGALRM, _stop)
    found, makers = targets(), subjects()
    counts, failures = collections.Counter(), []
    kept = {name: make() for name, (make, _) in makers.items()}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(calls):
        name, subject, member = found[rng.integers(len(found))]
        if subject is None:
            function, state = member, None
        else:
            function, state = getattr(kept[subject], member), makers[subject][1](kept[subject])
        given, keywords = arguments(function, rng)
        late, raised = call(function, given, keywords)
        counts[type(raised).__name__ if raised else "returned"] += 1
        said = f"{number}: {name}({[_kind(x) for x in given]}, {list(keywords)}): {raised!r:.300}"
        if late > MOST_SECONDS:
            failures.append(f"{said}: {late:.1f} s after the signal")
        missing = isinstance(raised, AttributeError) and name.rpartition(".")[2] in OBJECTS
        expected = raised is None or missing or isinstance(raised, (*ALLOWED, Hostile, Stop))
        if not expected:
            failures.append(said)
        interrupted = isinstance(raised, Stop) and name in MOVING
        if subject is not None and raised is not None and not interrupted:
            if makers[subject][1](kept[subject]) != state:
                failures.append(f"{said}: the state has changed")
        if subject is not None and (raised is None or interrupted):
            kept[subject] = makers[subject][0]()
        now = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if 1024 * (now - peak) > MOST_BYTES:
            failures.append(f"{said}: {(now - peak) // 1024} MiB")
        peak = max(now, peak)
    signal.signal(signal.SIGALRM, before)
    return counts, failures


def _stop(*_):
    raise Stop


def _kind(x):
    try:
        return f"{type(x).__name__} {x!r}"[:60]
    except Exception:
        return type(x).__name__


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        counts, failures = run(given.calls, given.seed)
    print(len(targets()), "callables;", dict(counts))
    print("\n".join(failures))
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
