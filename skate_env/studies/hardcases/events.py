"""Landings and other events: grazing, at once, without end, within a step, at its edges."""

from typing import Any

import numpy as np

from ..._core import Simulator
from .case import EVENTS, Chapter, Lab
from .fixtures import (
    STANCE,
    apart,
    depth,
    expect,
    kinetic,
    motion,
    pushing,
    standing,
    ticks,
    unbooked,
)

CHAPTER = Chapter("landings and other events", [])


def _dropped(height: float, angle: float = 0.0, speed: float = -0.3) -> dict[str, Any]:
    """Hold a foot above the ice, turned by an angle [rad], on its way down [m/s]."""
    q = {"q2": 0.1, "q3": -0.2, "q4": 0.15, "q5": 0.5, "q6": -0.9, "q7": 0.4}
    start = {"q": q | {"z0": height, "q1": angle}, "v": {"z0": speed}, "support_leg": "right"}
    return {"start": start}


@CHAPTER.case(
    setup="In flight the toe swings down and up again; its lowest point, in the middle of a step, "
    "is as far below the ice as the tolerance, or as far above.",
    naive="Compares heights at the ends of its steps, both above the ice, and sees nothing.",
    law="Signorini: an end that comes to the ice lands; one that does not does not.",
    criterion="starts with a wrong answer",
    unit="starts",
    limit=0.0,
    methods=EVENTS,
    excluded="it looks at the ends of its steps only",
)
def grazing(lab: Lab) -> float:
    swinging = {
        "start.q": {"z0": 1.0, "q5": 0.6, "q6": -0.4},
        "start.v": {"z0": 1.5, "q5": -6.0},
    }
    scene = lab.scene(motion("flight"), swinging)
    # Where the lowest point is, by parabolas through heights of a motion without contact.
    free = Simulator(lab.scene(scene.without("impacts")))
    heights, times = [], np.linspace(0.09, 0.11, 201)
    for time in times:
        free.advance(float(time))
        heights.append(float(free.gaps().min()))
    low = int(np.argmin(heights))
    fit = np.polyfit(times[low - 2 : low + 3] - times[low], heights[low - 2 : low + 3], 2)
    lowest = float(fit[2] - fit[1] ** 2 / (4.0 * fit[0]))
    near = {"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-5, "rk4": 1e-6}[lab.method]
    wrong = 0
    for under, lands in ((near, True), (-near, False)):
        sim = lab.watch(Simulator(scene.with_values({"start.q.z0": 1.0 - lowest - under})))
        sim.advance(0.15)
        wrong += (sim.stats()["events"] > 0) != lands
    return float(wrong)


@CHAPTER.case(
    setup="A foot lands flat at 0.3 m/s, level or turned by 1e-12 and 1e-10 rad either way: heel "
    "and toe come down at once, or 1e-12 s apart.",
    naive="Passes the ends one by one, in the order of rounding: each kicks the other up.",
    law="Continuity: a turn too small to be seen changes nothing.",
    criterion="distance from the level landing 10 ms later",
    unit="rad, m, /s",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-9, "rk4": 1e-9, "fast": 1e-8},
)
def heel_and_toe_at_once(lab: Lab) -> float:
    def landed(angle: float) -> Simulator:
        start = _dropped(1e-3, angle)
        # With its toe up a foot is given by its heel, which is 0.28 m behind the toe.
        start["start"]["q"]["y0"] = -0.28 if angle > 0.0 else 0.0
        sim = lab.simulator(motion("landing"), start)
        sim.advance(0.013)
        return sim

    level = landed(0.0)
    expect(level.stats()["events"] > 0, "nothing lands")
    return max(apart(landed(angle), level) for angle in (-1e-10, -1e-12, 1e-12, 1e-10))


@CHAPTER.case(
    setup="A foot lands on its edge, turned by 1e-2 to 1e-6 rad, and rattles: heel, toe, heel, "
    "ever faster.",
    naive="Locates every landing of a series that has no end in finite time (Zeno).",
    law="A landing slower than 1 mm/s brings all closed ends to rest.",
    criterion="most events until both ends rest, or 50 ms are over",
    unit="events",
    limit=12.0,
)
def rattling_sole(lab: Lab) -> float:
    most = 0.0
    for angle in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, -1e-3, -1e-5):
        sim = lab.simulator(motion("landing"), _dropped(1e-3, angle, -0.1))
        sim.advance(0.05)
        expect(sim.termination is None, f"ended with {sim.termination}")
        most = max(most, sim.stats()["events"])
    return most


@CHAPTER.case(
    setup="A foot whose heel touches the ice at t = 0 and runs into it at 0.5 m/s.",
    naive="Looks for a sign change, finds none, and lets the foot sink.",
    law="Signorini: what touches and runs into the ice is struck at once, and loses energy.",
    criterion="depth of the lowest end in the first 10 ms",
    unit="m",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 2e-3},
)
def event_at_the_start(lab: Lab) -> float:
    start = _dropped(0.0, 0.1, -0.5)
    sim, before = lab.simulator(motion("landing"), start), Simulator(motion("flight"))
    names = before.coordinate_names
    q, v = np.zeros(len(names)), np.zeros(len(names))
    for name, value in start["start"]["q"].items():
        q[names.index(name)] = value
    v[names.index("z0")] = -0.5
    expect(kinetic(sim) < before.energy(q, v)[0], "the blow took no energy")
    expect(unbooked(sim) < 1e-9, f"{unbooked(sim):.2g} J vanished in the blow")
    worst = depth(sim)
    for _ in ticks(sim, 0.01, 1e-3):
        worst = max(worst, depth(sim))
    return worst


@CHAPTER.case(
    setup="A landing whose heel and toe are 1e-6, 1e-8 and 1e-10 s apart: much closer than any "
    "step.",
    naive="The first event's step ends behind the second, which starts below the ice and is lost.",
    law="Signorini at every instant.",
    criterion="depth of the lowest end",
    unit="m",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 2e-3},
)
def closer_than_a_step(lab: Lab) -> float:
    worst = 0.0
    for apart_by in (1e-6, 1e-8, 1e-10):
        # The sole is 0.28 m long, and comes down at 0.3 m/s.
        sim = lab.simulator(motion("landing"), _dropped(1e-3, 0.3 * apart_by / 0.28))
        for _ in ticks(sim, 0.02, 1e-3):
            worst = max(worst, depth(sim))
        expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="The paper's heel strike, once in one call, and once with calls that end at the event's "
    "time, one rounding before it and one after.",
    naive="An event at the end of a call is found twice, or never.",
    law="The motion does not depend on when somebody looks.",
    criterion="distance between both motions 50 ms later",
    unit="rad, m, /s",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 1e-6},
    excluded="its steps are shortened so that a call ends on time",
)
def event_at_the_end_of_a_call(lab: Lab) -> float:
    whole = lab.simulator("paper")
    whole.advance(0.25)
    events = whole.take_events()
    time = next(t for t, what, *_ in events if what == "free heel lands")
    whole = lab.simulator("paper")
    whole.advance(time + 0.05)
    worst = 0.0
    for end in (np.nextafter(time, 0.0), time, np.nextafter(time, 1.0)):
        sim = lab.simulator("paper")
        for until in (end, np.nextafter(end, 1.0), time + 0.05):
            sim.advance(float(until))
        landed = [what for _, what, *_ in sim.take_events()].count("free heel lands")
        expect(landed == 1, f"it lands {landed} times")
        worst = max(worst, apart(sim, whole))
    return worst


@CHAPTER.case(
    setup="The first 0.3 s of `unilateral` in one call, and in 1,000 parts of random lengths from "
    "1e-12 to 1e-2 s.",
    naive="Every call restarts the step size, shifts a tick of the controller or loses an event.",
    law="The motion does not depend on when somebody looks.",
    criterion="contact states in one sequence and not in the other",
    unit="states",
    limit=0.0,
    methods=EVENTS,
    excluded="its steps are shortened so that a call ends on time",
)
def in_a_thousand_parts(lab: Lab) -> float:
    whole, parts = lab.simulator("unilateral"), lab.simulator("unilateral")
    whole.advance(0.3)
    rng = np.random.default_rng(7)
    lengths = 10.0 ** rng.uniform(-12.0, -2.0, 1000)
    for until in np.cumsum(0.3 * lengths / lengths.sum()):
        parts.advance(float(min(until, 0.3)))
    parts.advance(0.3)
    seen = [[event[1:] for event in sim.take_events()] for sim in (whole, parts)]
    same = sum(one == other for one, other in zip(*seen, strict=False))
    return float(max(map(len, seen)) - same)


@CHAPTER.case(
    setup="A head that falls through its limit at 3 m/s, in the middle of a step.",
    naive="Notices at the end of the step or of the action: the head is centimetres too low.",
    law="A fall is an event like others: it ends on the limit.",
    criterion="distance of the head from its limit at the end",
    unit="m",
    limit={"balanced": 1e-11, "reference": 1e-11, "rosenbrock": 1e-7, "rk4": 1e-11, "fast": 0.02},
)
def fall_on_the_limit(lab: Lab) -> float:
    start = {"support_leg": "right", "q": STANCE | {"q9": 0.3}, "v": {"q2": -2.0}}
    sim = lab.simulator(pushing(standing()), {"start": start, "fall": {"head_height": 1.2}})
    sim.advance(3.0)
    expect(sim.termination == "fall", f"ended with {sim.termination}")
    return abs(float(sim.head_position[2]) - 1.2)


@CHAPTER.case(
    setup="A robot that jumps: 400 N m at both knees take the normal force of both feet to zero.",
    naive="Keeps a foot with a small pull, or ends because Table 2 has no state without a foot.",
    law="Newton: in flight only gravity moves the centre of mass; friction and ice give nothing.",
    criterion="momentum along the ice gained in 50 ms of flight",
    unit="kg m/s",
    limit={"balanced": 1e-4, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 5e-4, "fast": 1.0},
)
def lift_off(lab: Lab) -> float:
    q = {"q2": -0.5, "q3": 1.0, "q4": -0.5, "q5": 0.5, "q6": -1.0, "q7": 0.5}
    sim = lab.simulator(pushing(standing()), {"start": {"support_leg": "right", "q": q, "v": {}}})
    torque = np.zeros(len(sim.q) - 3)
    torque[1], torque[4] = -400.0, 400.0
    while sim.state_number != 0:
        expect(sim.advance(sim.time + 1e-3, torque) and sim.time < 0.5, "it does not leave the ice")
    before = sim.momentum(sim.q, sim.v)[0]
    sim.advance(sim.time + 0.05, 0.0 * torque)
    expect(sim.state_number == 0, "it landed too soon")
    return abs(float(sim.momentum(sim.q, sim.v)[0] - before))


@CHAPTER.case(
    setup="The centre of pressure wanders to the toe and to the heel while an ankle turns slowly: "
    "the sole tips about its edge and comes back.",
    naive="A load at the far end that goes through zero: pulls, or tips half a step late.",
    law="Signorini at both ends: the centre of pressure stays on the sole.",
    criterion="pull at an end of a sole",
    unit="weights",
    limit={"balanced": 1e-11, "reference": 1e-11, "rosenbrock": 1e-11, "rk4": 1e-11, "fast": 1e-3},
)
def edge_of_the_sole(lab: Lab) -> float:
    start = {"support_leg": "right", "q": STANCE, "v": {}}
    ice = {"kind": "coulomb", "mu": 5.0, "capture_speed": 0.01}
    sim, worst, tips = (
        lab.simulator(pushing(standing()), {"start": start, "ice.friction": ice}),
        0.0,
        0,
    )
    torque = np.zeros(len(sim.q) - 3)
    for part in range(1, 401):
        torque[0] = 100.0 * np.sin(np.pi * part / 50.0)
        if not sim.advance(1e-3 * part, torque):
            break
        tips += sum("lifts" in what for _, what, *_ in sim.take_events())
        worst = max(worst, -float(sim.contact_forces[:, 2:].min()))
    expect(tips >= 2, f"it tips {tips} times until {sim.time} s")
    return worst / 627.0


@CHAPTER.case(
    setup="The gait of `paper` from a disturbed start: once a step a free heel that slides on ice "
    "that pulls lets go.",
    naive="Asks the sign of a force that is zero but for rounding whether friction drags the heel "
    "down, and stops it at a blow: one time in twenty, with up to 100 J.",
    law="What nothing presses is not struck.",
    criterion="energy that blows take while a heel lifts and nothing lands or stops",
    unit="J",
    limit=0.0,
)
def letting_go(lab: Lab) -> float:
    sim = lab.simulator("paper")
    sim.perturb(0.1, 45)
    lost, lifts = 0.0, 0
    while sim.time < 20.0:
        before = sim.energy_balance()["impacts"]
        expect(sim.step(), f"{sim.termination} at {sim.time} s")
        happened = {what for _, what, *_ in sim.take_events()}
        if {"free heel lifts"} <= happened <= {"free heel lifts", "supporting foot slips forward"}:
            lost = max(lost, sim.energy_balance()["impacts"] - before)
            lifts += 1
    expect(lifts >= 3, f"only {lifts} lifts")
    return lost
