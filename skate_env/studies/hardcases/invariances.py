"""Invariances: mirrored, resumed, in threads, interleaved, after a reset, after a leg swap."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..._core import Simulator
from ..fixtures import PAPER_DAMPED
from .case import CaseContext, CaseGroup
from .fixtures import ROOT, energy, expect

GROUP = CaseGroup("invariances", [])


def _with_random_torques(sim: Simulator, seed: int, steps: int = 60) -> bytes:
    """Step under random torques and return the snapshot at the end."""
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        if not sim.step(20.0 * rng.uniform(-1.0, 1.0, len(sim.q) - ROOT)):
            break
    return sim.snapshot()


@GROUP.case(
    setup="`push_only`, saved and restored at all events, just before them, at 60 other times.",
    naive="Does not save the step size, a clock or a guard value: the motions differ.",
    law="A snapshot is complete: the restored simulation continues bit for bit.",
    criterion="bytes that differ at the end [bytes]",
)
def resumed(context: CaseContext) -> float:
    whole = context.simulator("push_only")
    events = context.simulator("push_only")
    events.advance(0.6)
    times = [t for t, *_ in events.take_events()]
    rng = np.random.default_rng(11)
    moments = [*times, *(np.nextafter(times, 0.0)), *rng.uniform(0.0, 0.6, 60)]
    parts = context.simulator("push_only")
    for moment in sorted(float(t) for t in moments if t < 0.6):
        whole.advance(max(moment, whole.time))
        parts.advance(max(moment, parts.time))
        other = Simulator(parts.scene)
        other.restore(parts.snapshot())
        parts = other
    for sim in (whole, parts):
        sim.advance(0.6)
    return float(_differ(whole.snapshot(), parts.snapshot()))


@GROUP.case(
    setup="Eight robots under different torques, one after the other, and in four threads.",
    naive="Shares a workspace: robots occasionally overwrite each other's values.",
    law="The motion of a robot depends on its own calls only.",
    criterion="bytes that differ at the end [bytes]",
)
def in_threads(context: CaseContext) -> float:
    alone = [_with_random_torques(context.simulator("push_only"), seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        together = list(
            pool.map(
                lambda seed: _with_random_torques(context.simulator("push_only"), seed), range(8)
            )
        )
    return float(sum(_differ(*pair) for pair in zip(alone, together, strict=True)))


@GROUP.case(
    setup="Eight robots, one after the other, and interleaved by one action each.",
    naive="Reuses cached values of another robot.",
    law="The motion of a robot depends on its own calls only.",
    criterion="bytes that differ at the end [bytes]",
)
def in_turn(context: CaseContext) -> float:
    alone = [_with_random_torques(context.simulator("push_only"), seed) for seed in range(8)]
    sims = [context.simulator("push_only") for _ in range(8)]
    rngs = [np.random.default_rng(seed) for seed in range(8)]
    for _ in range(60):
        for sim, rng in zip(sims, rngs, strict=True):
            if sim.termination is None:
                sim.step(20.0 * rng.uniform(-1.0, 1.0, len(sim.q) - ROOT))
    return float(sum(_differ(one, sim.snapshot()) for one, sim in zip(alone, sims, strict=True)))


@GROUP.case(
    setup="A new simulator, and one that has run, perhaps fallen, refused a call and is reset.",
    naive="The step size, a clock or an event survives the reset.",
    law="A reset clears the whole state.",
    criterion="bytes that differ after 0.3 s [bytes]",
)
def reset_forgets(context: CaseContext) -> float:
    used, new = context.simulator("push_only"), context.simulator("push_only")
    _with_random_torques(used, 12, 400)
    try:
        used.reset(np.full(len(used.q), np.nan))
    except ValueError:
        used.reset()
    for sim in (used, new):
        sim.advance(0.3)
    return float(_differ(used.snapshot(), new.snapshot()))


@GROUP.case(
    setup="`paper_printed` with arm swing, yaw, roll, one arm forward; and its mirror image.",
    naive="A sign is right for one leg only.",
    law="Mirror symmetry: yaw and roll change sign, the arms exchange, everything else is equal.",
    criterion="distance of one motion from the mirror image of the other after 1.2 s [rad, m, /s]",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-8, "rk4": 1e-9, "fast": 1e-9},
)
def mirrored(context: CaseContext) -> float:
    swinging = {"control.arm_swing": {"amplitude": 30.0}}
    right, left = (context.simulator("paper_printed", swinging) for _ in range(2))
    index = {name: i for i, name in enumerate(right.coordinate_names)}
    sign, partner = np.ones(len(index)), np.arange(len(index))
    for body in right.bodies():
        if body["axis"] != "x":
            sign[index[body["joint"]]] = -1.0
    for one, other in (("q11", "q14"), ("q12", "q15"), ("q13", "q16")):
        partner[[index[one], index[other]]] = index[other], index[one]
    q, v = right.q, right.v
    q[index["q8"]], v[index["q10"]], q[index["q11"]] = 0.05, 0.2, q[index["q11"]] + 0.1
    right.reset(q, v, "right")
    left.reset(sign * q[partner], sign * v[partner], "left")
    for sim in (right, left):
        sim.advance(1.2)
    expect(right.state_name == left.state_name, f"{right.state_name} and {left.state_name}")
    apart_q, apart_v = left.q - sign * right.q[partner], left.v - sign * right.v[partner]
    return float(max(abs(apart_q).max(), abs(apart_v).max()))


@GROUP.case(
    setup="The leg swap in 20 postures of push-off (states 13 to 16).",
    naive="Transforms angles with a wrong sign or frame: the momentum jumps.",
    law="Only coordinates change: energy and momentum are constant.",
    criterion="relative change of energy and momentum",
    limit=1e-11,
    excluded="its free foot meets its constraints to the order of a step",
)
def swap_of_the_legs(context: CaseContext) -> float:
    sim, worst, swaps = context.simulator(PAPER_DAMPED), 0.0, 0
    period = 1e-3
    while swaps < 20 and sim.time < 60.0:
        leg = sim.support_leg
        if not sim.advance(sim.time + period):
            break
        if "toe" in sim.state_name.split("/")[0] and sim.state_name.endswith("flat"):
            before = np.array([energy(sim), *sim.momentum(sim.q, sim.v)])
            saved = sim.snapshot()
            losses = sim.energy_balance()["impacts"] + sim.energy_balance()["capture"]
            sim.reset_map(sim.time, sim.q, sim.v, "supporting toe lifts")
            taken = sim.energy_balance()["impacts"] + sim.energy_balance()["capture"] - losses
            if sim.support_leg != leg and taken == 0.0:
                after = np.array([energy(sim), *sim.momentum(sim.q, sim.v)])
                worst = max(worst, float((abs(after - before) / abs(before).max()).max()))
                swaps += 1
            sim.restore(saved)
    expect(swaps >= 20, f"only {swaps} swaps")
    return worst


def _differ(one: bytes, other: bytes) -> int:
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))
