"""Invalid and extreme input: steps, torques, states, scenes and snapshots."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..._core import Scene, Simulator
from ..fixtures import BLADE
from .case import CaseContext, CaseGroup
from .fixtures import ROOT, finite, motion

GROUP = CaseGroup("invalid input", [])

_NOT_FINITE = (float("nan"), float("inf"), float("-inf"))


def _refused(sim: Simulator, call: Callable[..., object], *args: object) -> bool:
    """Whether a call raises ValueError with a message and changes no bit of the simulator."""
    before = sim.snapshot()
    try:
        call(*args)
    except ValueError as error:
        return bool(str(error)) and sim.snapshot() == before
    return False


@GROUP.case(
    setup="NaN, +inf and -inf in every element of torques, coordinates and rates, and as a time.",
    naive="Accepts a NaN in one action; ten steps later every robot of the batch is NaN.",
    law="A value that is not finite is refused with its position, and the state does not change.",
    criterion="calls that were accepted or changed a bit [calls]",
)
def not_a_number(context: CaseContext) -> float:
    sim, wrong = context.simulator("paper_printed"), 0
    sim.advance(0.05)
    q, v, n = sim.q, sim.v, len(sim.q)
    for bad in _NOT_FINITE:
        for i in range(n - ROOT):
            torque = np.zeros(n - ROOT)
            torque[i] = bad
            wrong += not _refused(sim, sim.step, torque)
            wrong += not _refused(sim, sim.advance, 0.1, torque)
        for i in range(n):
            broken = q.copy()
            broken[i] = bad
            wrong += not _refused(sim, sim.reset, broken, v)
            wrong += not _refused(sim, sim.reset, q, broken)
            wrong += not _refused(sim, sim.reset_map, 0.05, broken, v)
            wrong += not _refused(sim, sim.rhs, 0.05, q, broken)
        wrong += not _refused(sim, sim.advance, bad)
        wrong += not _refused(sim, sim.rhs, bad, q, v)
    return float(wrong)


@GROUP.case(
    setup="1e20 to 1e308 and -1e300 as coordinates, rates and torques.",
    naive="Squares overflow: NaN in the first step.",
    law="The value is refused, or the state stays finite, or the motion ends with a named cause.",
    criterion="calls after which a value is not finite [calls]",
)
def huge_numbers(context: CaseContext) -> float:
    sim, wrong = context.simulator(motion("flight")), 0
    n = len(sim.q)
    for huge in (1e300, 1e308, -1e300, 1e100, 1e20):
        for where in ("q", "v", "torque"):
            for i in range(0, n - ROOT, 3):
                sim.reset()
                q, v, torque = sim.q, sim.v, np.zeros(n - ROOT)
                {"q": q, "v": v, "torque": torque}[where][i] = huge
                try:
                    sim.reset(q, v)
                    goes_on = sim.step(torque)
                except ValueError:
                    continue
                wrong += not np.isfinite([*sim.q, *sim.v]).all()
                wrong += not finite(sim) if goes_on else sim.termination is None
    return float(wrong)


@GROUP.case(
    setup="Steps of 0, 5e-324, 1e-300, 1e-15 to 1e-9 s; of -1, NaN and 1e300 s; one of 10 s.",
    naive="Divides by the step, runs backward, or loops because t + h equals t.",
    law="Time advances to the requested value, or the call is refused.",
    criterion="calls for which neither holds [calls]",
)
def odd_steps(context: CaseContext) -> float:
    sim, wrong = context.simulator("paper_printed"), 0
    for short in (0.0, 5e-324, 1e-300, 1e-15, 1e-12, 1e-9):
        for _ in range(50):
            until = sim.time + short
            wrong += not sim.advance(until) or sim.time != until
    for odd in (-1.0, *_NOT_FINITE, 1e300):
        wrong += not _refused(sim, sim.advance, sim.time + odd)
    wrong += not sim.advance(sim.time + 10.0)
    return float(wrong)


@GROUP.case(
    setup="5,000 calls of 1 us, each with a different torque.",
    naive="Counts calls as a failure to progress and stops, or accumulates errors of 1e-16.",
    law="Short calls are valid: the motion is that of torques held for 1 us each.",
    criterion="calls after which the simulation had ended [calls]",
)
def tiny_calls(context: CaseContext) -> float:
    sim, wrong = context.simulator("paper_printed"), 0
    rng = np.random.default_rng(9)
    for part in range(1, 5001):
        wrong += not sim.advance(1e-6 * part, rng.uniform(-1.0, 1.0, len(sim.q) - ROOT))
    return float(wrong)


@GROUP.case(
    setup="Each number of `blade` alone: NaN, infinite, 1e300, below and above its range.",
    naive="Accepts a mass of 0 and divides by it later.",
    law="A scene is refused with the name of the number, its value and its range.",
    criterion="scenes that were accepted, or refused without the name [scenes]",
)
def impossible_scenes(context: CaseContext) -> float:
    scene, wrong = context.scene(BLADE), 0
    for name, (_, low, high, _) in scene.parameters().items():
        far = 1.0 + abs(high - low)
        for bad in (*_NOT_FINITE, 1e300, low - far, high + far):
            try:
                scene.with_values({name: bad})
                wrong += 1
            except ValueError as error:
                wrong += name not in str(error)
    return float(wrong)


@GROUP.case(
    setup="A snapshot truncated to 200 lengths, and with 2,000 single bits flipped.",
    naive="Restores a state that never existed and continues from it.",
    law="Damage is detected, and the simulator does not change.",
    criterion="damaged snapshots that were accepted, or changed a bit [snapshots]",
)
def damaged_snapshots(context: CaseContext) -> float:
    sim, wrong = context.simulator("paper_printed"), 0
    sim.advance(0.2)
    whole, rng = sim.snapshot(), np.random.default_rng(10)
    sim.advance(0.25)
    damaged = [whole[:cut] for cut in rng.integers(0, len(whole), 200)]
    for place in rng.integers(0, 8 * len(whole), 2000):
        turned = bytearray(whole)
        turned[place // 8] ^= 1 << (place % 8)
        damaged.append(bytes(turned))
    for data in damaged:
        wrong += not _refused(sim, sim.restore, data)
    return float(wrong)


@GROUP.case(
    setup="Starts 1e-4 m and more below the ice, in the air, on rotated feet; within 1e-6 m of it.",
    naive="Corrects the start silently, or starts with a penetrating foot that is thrown out.",
    law="A start that violates a constraint is refused by name. Rounding errors are accepted.",
    criterion="starts with a wrong result [starts]",
)
def inconsistent_starts(context: CaseContext) -> float:
    base = Scene.from_toml('name = "standing"')
    pushes = base.with_effect("push_only")
    lifted = {"q5": 0.3, "q6": -0.6, "q7": 0.3}
    fine: list[tuple[Scene, dict[str, Any]]] = [
        (base, {"q": {}, "v": {}}),
        (pushes, {"q": lifted | {"z0": 5e-7}, "v": {}}),
        (pushes, {"q": lifted | {"z0": -5e-7}, "v": {}}),
    ]
    broken: list[tuple[Scene, dict[str, Any], str]] = [
        (base, {"q": lifted | {"z0": 0.1}, "v": {}}, "above the ice"),
        (base, {"q": lifted | {"z0": -1e-4}, "v": {}}, "below the ice"),
        (pushes, {"q": lifted | {"z0": -0.1}, "v": {}}, "below the ice"),
        (base.without("foot_rotation"), {"q": lifted | {"q1": 0.1}, "v": {}}, "q1"),
        (pushes, {"q": {"q7": -0.3}, "v": {}}, "below the ice"),
    ]
    wrong = 0
    for scene, start in fine:
        sim = context.simulator(scene, {"start": {"support_leg": "right", **start}})
        wrong += sim.termination is not None
    for scene, start, says in broken:
        try:
            context.simulator(scene, {"start": {"support_leg": "right", **start}})
            wrong += 1
        except ValueError as error:
            wrong += says not in str(error)
    return float(wrong)
