"""Invalid arguments are refused with the argument's name, and nothing changes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import Scene, Simulator, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

N = 19
QUICK = settings(max_examples=150, deadline=None)
HUGE = 10**400
QUIET = [0.0] * N


def skating(accuracy="balanced"):
    """Return a simulator with untaken events and a completed step."""
    sim = Simulator(replace(load_scene("paper_printed"), {"accuracy": accuracy}))
    for _ in range(130):
        sim.step()
    return sim


class Pair:
    """Two simulators with the same history; the first one gets the invalid arguments."""

    def __init__(self):
        self.sim, self.twin = skating(), skating()

    def check(self):
        """Whether both simulators are equal, including untaken events and steps."""
        assert self.sim.snapshot() == self.twin.snapshot()
        assert self.sim.stats() == self.twin.stats()
        events, steps = self.sim.take_events(), self.sim.take_steps()
        assert events == self.twin.take_events() and events
        assert steps == self.twin.take_steps() and steps


@pytest.fixture
def pair():
    made = Pair()
    yield made
    made.check()


# --- vectors ---

# Methods with vector arguments: name and length of the argument.
VECTORS = {
    "reset q": ("q", N, lambda sim, x: sim.reset(q=x)),
    "reset v": ("v", N, lambda sim, x: sim.reset(v=x)),
    "step": ("residual_torque", 16, lambda sim, x: sim.step(x)),
    "advance": ("residual_torque", 16, lambda sim, x: sim.advance(sim.time + 0.01, x)),
    "link_segments": ("q", N, lambda sim, x: sim.link_segments(x)),
    "rhs q": ("q", N, lambda sim, x: sim.rhs(0.0, x, QUIET)),
    "rhs v": ("v", N, lambda sim, x: sim.rhs(0.0, QUIET, x)),
    "guards q": ("q", N, lambda sim, x: sim.guards(0.0, x, QUIET)),
    "guards v": ("v", N, lambda sim, x: sim.guards(0.0, QUIET, x)),
    "sampled q": ("q", N, lambda sim, x: sim.sampled(0.0, x, QUIET)),
    "sampled v": ("v", N, lambda sim, x: sim.sampled(0.0, QUIET, x)),
    "reset_map q": ("q", N, lambda sim, x: sim.reset_map(0.0, x, QUIET)),
    "reset_map v": ("v", N, lambda sim, x: sim.reset_map(0.0, QUIET, x)),
    "mass_matrix": ("q", N, lambda sim, x: sim.mass_matrix(x)),
    "bias_forces q": ("q", N, lambda sim, x: sim.bias_forces(x, QUIET)),
    "bias_forces v": ("v", N, lambda sim, x: sim.bias_forces(QUIET, x)),
    "energy q": ("q", N, lambda sim, x: sim.energy(x, QUIET)),
    "energy v": ("v", N, lambda sim, x: sim.energy(QUIET, x)),
    "momentum q": ("q", N, lambda sim, x: sim.momentum(x, QUIET)),
    "momentum v": ("v", N, lambda sim, x: sim.momentum(QUIET, x)),
}


def with_last(n, x, dtype=float):
    values = np.zeros(n, dtype)
    values[-1] = x
    return values


WRONG_VECTORS = {
    "nan": (ValueError, lambda n: with_last(n, np.nan), ["] = NaN", "[-1e6, 1e6]"]),
    "inf": (ValueError, lambda n: with_last(n, np.inf), ["] = inf", "[-1e6, 1e6]"]),
    "minus inf": (ValueError, lambda n: list(with_last(n, -np.inf)), ["] = -inf", "1e6"]),
    "float32 nan": (ValueError, lambda n: with_last(n, np.nan, np.float32), ["] = NaN"]),
    "1e300": (ValueError, lambda n: with_last(n, 1e300), ["] = 1e300", "[-1e6, 1e6]"]),
    "just too much": (ValueError, lambda n: with_last(n, -1000001), ["] = -1000001", "1e6"]),
    "int64": (ValueError, lambda n: with_last(n, -(2**63), np.int64), ["e18", "1e6"]),
    "long double": (ValueError, lambda n: with_last(n, 1e300, np.longdouble), ["1e300"]),
    "one less": (ValueError, lambda n: np.zeros(n - 1), ["has shape", "must be ({n},)"]),
    "one more": (ValueError, lambda n: np.zeros(n + 1), ["has shape", "must be ({n},)"]),
    "empty": (ValueError, lambda n: [], ["has shape (0,): must be ({n},)"]),
    "column": (ValueError, lambda n: np.zeros((n, 1)), ["has shape ({n}, 1): must be ({n},)"]),
    "row": (ValueError, lambda n: [[0.0] * n], ["has shape (1, {n}): must be ({n},)"]),
    "one number": (ValueError, lambda n: 1.0, ["has shape (): must be ({n},)"]),
    "0-d": (ValueError, lambda n: np.array(1.0), ["has shape (): must be ({n},)"]),
    "ragged": (ValueError, lambda n: [[0.0], [0.0, 1.0]], ["not an array of {n} numbers"]),
    "complex": (TypeError, lambda n: np.zeros(n, complex), ["complex128", "{n} real numbers"]),
    "bool": (TypeError, lambda n: np.zeros(n, bool), ["bool", "{n} real numbers"]),
    "date": (TypeError, lambda n: np.zeros(n, "M8[s]"), ["datetime64", "{n} real numbers"]),
    "objects": (TypeError, lambda n: np.zeros(n, object), ["object", "{n} real numbers"]),
    "fields": (TypeError, lambda n: np.zeros(n, [("a", float)]), ["{n} real numbers"]),
    "words": (TypeError, lambda n: ["1.0"] * n, ["<U3", "{n} real numbers"]),
    "a word": (TypeError, lambda n: "abc", ["<U3", "{n} real numbers"]),
    "bytes": (TypeError, lambda n: bytes(8 * n), ["real numbers"]),
    "dict": (TypeError, lambda n: dict.fromkeys(range(n), 0.0), ["object", "real numbers"]),
    "set": (TypeError, lambda n: set(range(n)), ["object", "real numbers"]),
    "generator": (TypeError, lambda n: (0.0 for _ in range(n)), ["object", "real numbers"]),
    "huge integers": (TypeError, lambda n: [HUGE] * n, ["object", "real numbers"]),
}


@pytest.mark.parametrize("method", VECTORS)
def test_wrong_vectors_are_refused(refused, pair, method):
    name, n, call = VECTORS[method]
    for kind, make, words in WRONG_VECTORS.values():
        said = [word.replace("{n}", str(n)) for word in words]
        refused(kind, lambda make=make: call(pair.sim, make(n)), name, *said)
    needs_one = method.split()[0] not in ("reset", "step", "advance", "link_segments")
    if needs_one:
        refused(TypeError, lambda: call(pair.sim, None), name, f"{n} real numbers")


SAME = {
    "list": list,
    "tuple": tuple,
    "strided": lambda x: np.repeat(x, 2)[::2],
    "backwards": lambda x: x[::-1].copy()[::-1],
    "big-endian": lambda x: x.astype(">f8"),
    "long double": lambda x: x.astype(np.longdouble),
    "not aligned": lambda x: np.frombuffer(b"." + x.tobytes(), np.uint8)[1:].view(float),
    "column of a matrix": lambda x: np.column_stack([x, x])[:, 1],
    "objects with a buffer": lambda x: memoryview(x),
}


@pytest.mark.parametrize("form", SAME)
def test_vectors_of_any_form_mean_the_same(form):
    torque = np.linspace(-20.0, 20.0, 16) / 3.0
    sims = [skating(), skating()]
    sims[0].step(torque)
    sims[1].step(SAME[form](torque))
    assert sims[0].snapshot() == sims[1].snapshot()


# --- numbers ---

TIMES = {
    "advance": ("until", lambda sim, t: sim.advance(t)),
    "rhs": ("t", lambda sim, t: sim.rhs(t, sim.q, sim.v)),
    "guards": ("t", lambda sim, t: sim.guards(t, sim.q, sim.v)),
    "sampled": ("t", lambda sim, t: sim.sampled(t, sim.q, sim.v)),
    "reset_map": ("t", lambda sim, t: sim.reset_map(t, sim.q, sim.v)),
}
WRONG_NUMBERS = {
    "nan": (ValueError, math.nan, ["= NaN: must lie in [", "s"]),
    "inf": (ValueError, math.inf, ["= inf: must lie in ["]),
    "minus inf": (ValueError, -math.inf, ["= -inf: must lie in ["]),
    "1e300": (ValueError, 1e300, ["= 1e300: must lie in ["]),
    "1e7": (ValueError, 1.0e7, ["= 10000000: must lie in ["]),
    "huge": (ValueError, HUGE, ["too large"]),
    "text": (TypeError, "0.1", ["= '0.1': must be a real number, not str"]),
    "none": (TypeError, None, ["= None: must be a real number, not NoneType"]),
    "complex": (TypeError, 1j, ["= 1j: must be a real number, not complex"]),
    "bool": (TypeError, True, ["= True: must be a real number, not bool"]),
    "list": (TypeError, [0.1], ["= [0.1]: must be a real number, not list"]),
    "long list": (TypeError, [0.1] * 1000, ["...: must be a real number, not list"]),
    "vector": (TypeError, np.zeros(3), ["must be a real number, not ndarray"]),
}


@pytest.mark.parametrize("method", TIMES)
def test_wrong_times_are_refused(refused, pair, method):
    name, call = TIMES[method]
    for kind, wrong, words in WRONG_NUMBERS.values():
        refused(kind, lambda wrong=wrong: call(pair.sim, wrong), name, *words)


def test_time_does_not_go_back(refused, pair):
    refused(ValueError, lambda: pair.sim.advance(1.2), "until = 1.2: must lie in [1.3, 10001.3] s")
    refused(ValueError, lambda: pair.sim.advance(-5e-324), "until = -5e-324")


def test_advance_by_nothing_changes_no_motion():
    for accuracy in ("balanced", "fast", "reference"):
        sim = skating(accuracy)
        q, t = sim.q, sim.time
        assert sim.advance(t) and sim.time == t
        np.testing.assert_array_equal(sim.q, q)


# The controller's next sample time as a fraction of 5e-324 s used to overflow, and the search for
# it did not terminate.
@pytest.mark.parametrize("accuracy", ["balanced", "fast", "reference", 1e-13])
@pytest.mark.parametrize("preset", ["paper_printed", BLADE])
@pytest.mark.parametrize("until", [5e-324, 1e-310, 1e-300, 1e-100, 1e-15, 1e-12, 1e-9])
def test_a_tiny_advance_terminates(preset, accuracy, until):
    sim = Simulator(replace(load_scene(preset), {"accuracy": accuracy}))
    assert sim.advance(until) and sim.time == until
    # At `fast` the preset blade falls, for a tiny advance as for a single step.
    assert sim.step() == (sim.time == 0.01) == (sim.termination is None)


def test_advance_by_hours_ends_with_a_name():
    sim = Simulator("push_only")
    assert not sim.advance(1e4)
    assert sim.termination == "fall" and np.isfinite(sim.q).all()


# --- names, tables, bytes ---

NOT_A_STR = {"bytes": b"right", "number": 1, "list": ["right"], "float": math.nan}


def test_wrong_words_are_refused(refused, pair):
    sim, scene = pair.sim, pair.sim.scene
    for word in ("", "Right", "both", "right\0", "r" * 1000):
        choices = 'must be "right" or "left"'
        refused(ValueError, lambda w=word: sim.reset(support_leg=w), "support_leg", choices)
    for word in ("", "nope", "free heel lifts\0", "ä"):
        jump = lambda w=word: sim.reset_map(sim.time, sim.q, sim.v, w)  # noqa: E731
        shown = word.replace("\0", r"\0")
        refused(ValueError, jump, f'guard = "{shown}"', "must be one of", "free heel lifts")
        for change in (scene.without, scene.with_effect):
            refused(ValueError, lambda c=change, w=word: c(w), f'effect "{shown}"', "arms, head_")
    takers = {
        "support_leg": lambda x: sim.reset(support_leg=x),
        "guard": lambda x: sim.reset_map(sim.time, sim.q, sim.v, x),
        "effect": scene.without,
        "effect ": scene.with_effect,
        "text": Scene.from_toml,
        "text ": Scene.from_json,
    }
    for name, call in takers.items():
        for wrong in NOT_A_STR.values():
            kind = type(wrong).__name__
            refused(TypeError, lambda c=call, w=wrong: c(w), name.strip(), f"a str, not {kind}")
        refused(ValueError, lambda c=call: c("\ud800"), name.strip(), "UTF-8")


NUMBERS = {
    "unknown": (ValueError, {"nope": 1.0}, ['"nope"', "no number of that name"]),
    "no name": (ValueError, {"": 1.0}, ['"": this scene has no number']),
    "a table": (ValueError, {"ice": 1.0}, ['"ice"', "no number of that name"]),
    "a word": (ValueError, {"contact.law": 1.0}, ['"contact.law"', "no number"]),
    "a pointer": (ValueError, {"ice/gravity": 1.0}, ['"ice/gravity"', "no number"]),
    "below": (ValueError, {"ice.gravity": -1}, ["ice.gravity = -1", "[0, 100] m/s2"]),
    "above": (ValueError, {"ice.gravity": 1e300}, ["ice.gravity = 1e300", "[0, 100] m/s2"]),
    "nan": (ValueError, {"ice.gravity": math.nan}, ["ice.gravity = NaN", "[0, 100] m/s2"]),
    "inf": (ValueError, {"ice.gravity": -math.inf}, ["ice.gravity = -inf", "[0, 100] m/s2"]),
    "tiny": (ValueError, {"control.action_period": 5e-324}, ["= 5e-324", "[0.0001, 1] s"]),
    "huge": (ValueError, {"ice.gravity": HUGE}, ["ice.gravity: too large"]),
    "number as text": (TypeError, {"ice.gravity": "9"}, ["ice.gravity = '9'", "real number"]),
    "none": (TypeError, {"ice.gravity": None}, ["ice.gravity = None", "real number"]),
    "bool": (TypeError, {"ice.gravity": True}, ["ice.gravity = True", "real number"]),
    "list": (TypeError, {"ice.gravity": [9.0]}, ["ice.gravity = [9.0]", "real number"]),
    "key": (TypeError, {1: 1.0}, ["key of", "= 1: must be a str, not int"]),
    "pairs": (TypeError, [("ice.gravity", 1.0)], ["must be a dict of numbers by name, not list"]),
    "text": (TypeError, "ice.gravity", ["must be a dict of numbers by name, not str"]),
}


@pytest.mark.parametrize("wrong", NUMBERS)
def test_wrong_numbers_by_name_are_refused(refused, pair, wrong):
    kind, values, words = NUMBERS[wrong]
    refused(kind, lambda: pair.sim.reset(params=values), *words)
    refused(kind, lambda: pair.sim.scene.with_values(values), *words)
    if kind is TypeError and not isinstance(values, dict):
        refused(kind, lambda: pair.sim.reset(params=values), "params = ")
        refused(kind, lambda: pair.sim.scene.with_values(values), "values = ")


def test_an_invalid_start_is_refused(refused, pair):
    below = pair.sim.q
    below[1] = -0.1
    refused(ValueError, lambda: pair.sim.reset(q=below), "below the ice", "at least 0")
    above = [0.0, 0.1, *[0.0] * 17]
    refused(ValueError, lambda: pair.sim.reset(q=above), "above the ice")


def test_only_a_scene_makes_a_simulator(refused):
    from skate_env import _core

    for wrong in ("paper_printed", None, 1, {}, Scene):
        kind = type(wrong).__name__
        refused(TypeError, lambda w=wrong: _core.Simulator(w), "scene = ", f"a Scene, not {kind}")


def test_damaged_snapshots_are_refused(refused, pair):
    sim = pair.sim
    whole = sim.snapshot()
    wrong = {
        "empty": b"",
        "beginning": whole[:10],
        "cut": whole[:-1],
        "longer": whole + b"\0",
        "older": b"IceSkate9" + whole[10:],
        "zeros": bytes(len(whole)),
        "another's": Simulator(BLADE).snapshot(),
        "other numbers and effects": Simulator(
            load_scene("paper_printed").with_effect("knee_stop")
        ).snapshot(),
    }
    for data in wrong.values():
        refused(ValueError, lambda d=data: sim.restore(d), "not a snapshot of this scene")
    for data in (None, "text", bytearray(whole), memoryview(whole), list(whole), 1):
        kind = type(data).__name__
        refused(TypeError, lambda d=data: sim.restore(d), "data = ", f"bytes, not {kind}")


def test_every_changed_byte_is_noticed():
    sim = Simulator("paper_printed")
    whole = sim.snapshot()
    for i in range(len(whole)):
        changed = bytearray(whole)
        changed[i] ^= 1 << (i % 8)
        with pytest.raises(ValueError, match="not a snapshot"):
            sim.restore(bytes(changed))
    assert sim.snapshot() == whole


@QUICK
@given(st.data())
def test_bytes_of_any_kind_are_a_snapshot_or_refused(data):
    sim = Simulator("paper_printed")
    whole = sim.snapshot()
    at = data.draw(st.integers(0, len(whole)))
    length = data.draw(st.integers(0, 20))
    changed = whole[:at] + data.draw(st.binary(max_size=40)) + whole[at + length :]
    if changed != whole:
        with pytest.raises(ValueError, match="not a snapshot of this scene"):
            sim.restore(changed)
    assert sim.snapshot() == whole
