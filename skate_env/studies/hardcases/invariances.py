"""The same motion by other ways: mirrored, resumed, copied, in threads, with other names."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..._core import Simulator
from .case import EVENTS, Chapter, Lab
from .fixtures import ROOT, energy, expect

CHAPTER = Chapter("the same motion by other ways", [])


def _pushed(sim: Simulator, seed: int, steps: int = 60) -> bytes:
    """Step under random torques; returns the snapshot at the end."""
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        if not sim.step(20.0 * rng.uniform(-1.0, 1.0, len(sim.q) - ROOT)):
            break
    return sim.snapshot()


@CHAPTER.case(
    setup="`unilateral` under random torques, saved and restored into another simulator at 60 "
    "moments, some right before and after events.",
    naive="Forgets the step size, a clock, a guard's value: the motion differs from the third "
    "digit on.",
    law="A snapshot holds everything: restored and continued is not stopped, bit for bit.",
    criterion="bytes that differ in the end",
    unit="bytes",
    limit=0.0,
)
def resumed(lab: Lab) -> float:
    whole = lab.simulator("unilateral")
    events = lab.simulator("unilateral")
    events.advance(0.6)
    times = [t for t, *_ in events.take_events()]
    rng = np.random.default_rng(11)
    moments = [*times, *(np.nextafter(times, 0.0)), *rng.uniform(0.0, 0.6, 60)]
    parts = lab.simulator("unilateral")
    for moment in sorted(float(t) for t in moments if t < 0.6):
        whole.advance(max(moment, whole.time))
        parts.advance(max(moment, parts.time))
        other = Simulator(parts.scene)
        other.restore(parts.snapshot())
        parts = other
    for sim in (whole, parts):
        sim.advance(0.6)
    return float(_differ(whole.snapshot(), parts.snapshot()))


@CHAPTER.case(
    setup="Eight robots under different torques, one after the other, and in four threads at once.",
    naive="Shares a workspace: the robots exchange a number now and then.",
    law="A robot's motion depends on nothing but its own calls.",
    criterion="bytes that differ in the end",
    unit="bytes",
    limit=0.0,
)
def in_threads(lab: Lab) -> float:
    alone = [_pushed(lab.simulator("unilateral"), seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda seed: _pushed(lab.simulator("unilateral"), seed), range(8)))
    return float(sum(_differ(*pair) for pair in zip(alone, together, strict=True)))


@CHAPTER.case(
    setup="Eight robots stepped in turn, a step each, instead of one after the other.",
    naive="A cache of the last robot serves the next one.",
    law="A robot's motion depends on nothing but its own calls.",
    criterion="bytes that differ in the end",
    unit="bytes",
    limit=0.0,
)
def in_turn(lab: Lab) -> float:
    alone = [_pushed(lab.simulator("unilateral"), seed) for seed in range(8)]
    sims = [lab.simulator("unilateral") for _ in range(8)]
    rngs = [np.random.default_rng(seed) for seed in range(8)]
    for _ in range(60):
        for sim, rng in zip(sims, rngs, strict=True):
            if sim.termination is None:
                sim.step(20.0 * rng.uniform(-1.0, 1.0, len(sim.q) - ROOT))
    return float(sum(_differ(one, sim.snapshot()) for one, sim in zip(alone, sims, strict=True)))


@CHAPTER.case(
    setup="A simulator that has run, fallen and been refused things, reset; and a new one.",
    naive="A step size, a clock or a lost event survives the reset.",
    law="A reset forgets everything.",
    criterion="bytes that differ after 0.3 s",
    unit="bytes",
    limit=0.0,
)
def reset_forgets(lab: Lab) -> float:
    used, new = lab.simulator("unilateral"), lab.simulator("unilateral")
    _pushed(used, 12, 400)
    try:
        used.reset(np.full(len(used.q), np.nan))
    except ValueError:
        used.reset()
    for sim in (used, new):
        sim.advance(0.3)
    return float(_differ(used.snapshot(), new.snapshot()))


@CHAPTER.case(
    setup="`paper` with tau8, turned and rolling, one arm ahead, on the right leg; and the "
    "mirrored robot on the left.",
    naive="A sign that is right for one leg.",
    law="Mirror symmetry: yaw and roll change sign, the arms change places, nothing else.",
    criterion="distance of one motion from the other's mirror image after 1.2 s",
    unit="rad, m, /s",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-8, "rk4": 1e-9, "fast": 1e-9},
)
def mirrored(lab: Lab) -> float:
    swinging = {"control.arm_swing": {"amplitude": 30.0}}
    right, left = lab.simulator("paper", swinging), lab.simulator("paper", swinging)
    index = {name: i for i, name in enumerate(right.coordinate_names)}
    sign, place = np.ones(len(index)), np.arange(len(index))
    for body in right.bodies():
        if body["axis"] != "x":
            sign[index[body["joint"]]] = -1.0
    for one, other in (("q11", "q14"), ("q12", "q15"), ("q13", "q16")):
        place[[index[one], index[other]]] = index[other], index[one]
    q, v = right.q, right.v
    q[index["q8"]], v[index["q10"]], q[index["q11"]] = 0.05, 0.2, q[index["q11"]] + 0.1
    right.reset(q, v, "right")
    left.reset(sign * q[place], sign * v[place], "left")
    for sim in (right, left):
        sim.advance(1.2)
    expect(right.state_name == left.state_name, f"{right.state_name} and {left.state_name}")
    apart_q, apart_v = left.q - sign * right.q[place], left.v - sign * right.v[place]
    return float(max(abs(apart_q).max(), abs(apart_v).max()))


@CHAPTER.case(
    setup="The swap of the legs at 20 postures of push-off (states 13 to 16): the free foot "
    "becomes the supporting one.",
    naive="Copies angles from leg to leg with a wrong sign or frame: a jump of momentum.",
    law="Only names change: energy and momenta stay.",
    criterion="change of energy and momenta",
    unit="of their size",
    limit=1e-11,
    methods=EVENTS,
    excluded="its free foot meets its constraints to the order of a step, and what is left is "
    "projected",
)
def swap_of_the_legs(lab: Lab) -> float:
    sim, worst, swaps = lab.simulator("paper_damped"), 0.0, 0
    period = 1e-3
    while swaps < 20 and sim.time < 60.0:
        leg = sim.support_leg
        if not sim.advance(sim.time + period):
            break
        if "toe" in sim.state_name.split("/")[0] and sim.state_name.endswith("flat"):
            before = np.array([energy(sim), *sim.momentum(sim.q, sim.v)])
            saved = sim.snapshot()
            slack = sim.energy_balance()["impacts"] + sim.energy_balance()["capture"]
            sim.reset_map(sim.time, sim.q, sim.v, "supporting toe lifts")
            taken = sim.energy_balance()["impacts"] + sim.energy_balance()["capture"] - slack
            if sim.support_leg != leg and taken == 0.0:
                after = np.array([energy(sim), *sim.momentum(sim.q, sim.v)])
                worst = max(worst, float((abs(after - before) / abs(before).max()).max()))
                swaps += 1
            sim.restore(saved)
    expect(swaps >= 20, f"only {swaps} swaps")
    return worst


def _differ(one: bytes, other: bytes) -> int:
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))
