"""Landings and other events: grazing, simultaneous, accumulating, inside and at ends of steps."""

from typing import Any

import numpy as np

from ..._core import Scene, Simulator
from ...scenes import replace
from .case import CaseContext, CaseGroup
from .fixtures import (
    STANCE,
    coulomb,
    depth,
    energy_residual,
    expect,
    kinetic,
    motion,
    push_only,
    sampled,
    standing,
    state_distance,
)

GROUP = CaseGroup("landings and other events", [])


def above_ice(height: float, angle: float = 0.0, speed: float = -0.3) -> dict[str, Any]:
    """Start with a foot above the ice: height of the lower end [m], angle [rad], speed [m/s]."""
    toe = height + max(0.0, 0.28 * float(np.sin(angle)))
    q = {"q2": 0.1, "q3": -0.2, "q4": 0.15, "q5": 0.5, "q6": -0.9, "q7": 0.4}
    start = {"q": q | {"z0": toe, "q1": angle}, "v": {"z0": speed}, "support_leg": "right"}
    return {"start": start}


def swinging_toe(context: CaseContext) -> Scene:
    """Scene of a flight from z0 = 1 m, in which the toe swings down and up again at 0.1 s."""
    swinging = {"start.q": {"z0": 1.0, "q5": 0.6, "q6": -0.4}, "start.v": {"z0": 1.5, "q5": -6.0}}
    return context.scene(motion("flight"), swinging)


def lowest_toe(context: CaseContext, scene: Scene) -> float:
    """Lowest point of that toe [m], by a parabola through heights of the motion without contact."""
    free = Simulator(context.scene(scene.without("impacts")))
    heights, times = [], np.linspace(0.09, 0.11, 201)
    for time in times:
        free.advance(float(time))
        heights.append(float(free.gaps().min()))
    low = int(np.argmin(heights))
    fit = np.polyfit(times[low - 2 : low + 3] - times[low], heights[low - 2 : low + 3], 2)
    return float(fit[2] - fit[1] ** 2 / (4.0 * fit[0]))


@GROUP.case(
    setup="In flight the toe swings down and up again. Its lowest point, reached inside a step, is "
    "below the ice by the tolerance, or above it by the same amount.",
    naive="Compares heights only at the ends of steps, both above the ice, and misses the contact.",
    law="Signorini: a sole end that reaches the ice lands, and no other one.",
    criterion="starts with a wrong result [starts]",
    excluded="it checks contacts only at the ends of its steps",
)
def grazing(context: CaseContext) -> float:
    scene = swinging_toe(context)
    lowest = lowest_toe(context, scene)
    near = {"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-5, "rk4": 1e-6}[context.method]
    wrong = 0
    for under, lands in ((near, True), (-near, False)):
        sim = context.watch(Simulator(scene.with_values({"start.q.z0": 1.0 - lowest - under})))
        sim.advance(0.15)
        wrong += (sim.stats()["events"] > 0) != lands
    return float(wrong)


@GROUP.case(
    setup="A foot lands at 0.3 m/s, level or rotated by 1e-12 or 1e-10 rad: ends 1e-12 s apart.",
    naive="Handles the ends in an order set by rounding errors: each impact lifts the other end.",
    law="Continuity: a rotation at rounding level does not change the motion.",
    criterion="distance from the level landing 10 ms later [rad, m, /s]",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-9, "rk4": 1e-9, "fast": 1e-8},
)
def heel_and_toe_at_once(context: CaseContext) -> float:
    def landed(angle: float) -> Simulator:
        sim = context.simulator(motion("landing"), above_ice(1e-3, angle))
        sim.advance(0.013)
        return sim

    level = landed(0.0)
    expect(level.stats()["events"] > 0, "nothing lands")
    return max(state_distance(landed(angle), level) for angle in (-1e-10, -1e-12, 1e-12, 1e-10))


def feet_apart(scene: Scene, angles: tuple[float, float] = (0.0, 0.0)) -> dict[str, float]:
    """Joint angles [rad] of bent legs, one foot in front; the lowest ends of both at one height.

    ``angles`` are those of the supporting and of the free sole to the ice [rad].
    """

    def legs(hip: float) -> dict[str, float]:
        bent = {"q1": angles[0], "q2": 0.2, "q3": -0.5, "q4": 0.15, "q5": hip, "q6": -0.4}
        return bent | {"q7": angles[1] - sum(bent.values())}

    def step(hip: float) -> float:
        # In flight, so that contact moves nothing.
        gaps = Simulator(replace(scene, {"start.q": legs(hip) | {"z0": 1.0}})).gaps()
        return float(gaps[1].min() - gaps[0].min())

    # The secant method ends where the height no longer changes.
    before, hip, height = 0.1, 0.3, step(0.1)
    while (new := step(hip)) not in (0.0, height):
        before, hip, height = hip, hip - new * (hip - before) / (new - height), new
    return legs(hip)


@GROUP.case(
    setup="Both feet land within 20 us of the end of a 5 ms step; one is rotated by 1e-12 rad.",
    naive="Locates the landing to 10 um; rounding errors decide which foot lands first.",
    law="Continuity: a rotation at rounding level does not change the motion.",
    criterion="distance from the level landing 10 ms later [rad, m, /s]",
    limit=1e-8,
)
def both_feet_at_once(context: CaseContext) -> float:
    scene = push_only(standing())
    legs = feet_apart(scene)

    def landed(height: float, angle: float) -> Simulator:
        q = legs | {"q7": legs["q7"] + angle, "z0": height}
        start = {"q": q, "v": {"z0": -0.3, "y0": 0.5}, "support_leg": "right"}
        sim = context.simulator(scene, {"start": start})
        sim.advance(0.015)
        return sim

    fall, worst = 0.3 * 0.005 + 0.5 * 9.81 * 0.005**2, 0.0
    for off in (-5e-6, 0.0, 2e-6, 5e-6):
        level, *rotated = (landed(fall + off, angle) for angle in (0.0, -1e-12, 1e-12))
        expect(level.stats()["events"] > 0, "nothing lands")
        worst = max(worst, *(state_distance(other, level) for other in rotated))
    return worst


@GROUP.case(
    setup="Both feet land at one instant, level or inclined; the right or the left one supports.",
    naive="Resolves the impacts in the order of supporting and free foot.",
    law="Objectivity: the roles of the feet before the landing do not change the motion.",
    criterion="distance of the legs between both descriptions 20 ms later [rad, rad/s]",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-3, "rk4": 1e-5, "fast": 1e-2},
)
def landing_named_from_the_other_foot(context: CaseContext) -> float:
    scene, worst = push_only(standing()), 0.0
    joints = ["q2", "q3", "q4", "q5", "q6", "q7"]
    for angles in ((0.0, 0.0), (0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (0.15, 0.05), (-0.05, -0.15)):
        right = feet_apart(scene, angles)
        left = {"q1": angles[1]}
        left |= {joint: -right[other] for joint, other in zip(joints, joints[::-1], strict=True)}
        legs = []
        for leg, q in (("right", right), ("left", left)):
            start = {"q": q | {"z0": 1.0}, "v": {"z0": -0.3, "y0": 0.5}, "support_leg": leg}
            lowest = context.simulator(scene, {"start": start}).gaps().min()
            start["q"] = q | {"z0": float(1.0 - lowest + 1e-3)}
            sim = context.simulator(scene, {"start": start})
            sim.advance(0.02)
            expect(sim.stats()["events"] > 0, "nothing lands")
            at = [sim.coordinate_names.index(joint) for joint in joints]
            if sim.support_leg == "right":
                legs.append(np.concatenate([sim.q[at], sim.v[at]]))
            else:
                legs.append(-np.concatenate([sim.q[at[::-1]], sim.v[at[::-1]]]))
        worst = max(worst, float(np.abs(legs[0] - legs[1]).max()))
    return worst


@GROUP.case(
    setup="A foot lands rotated by 1e-2 to 1e-6 rad and rattles: heel and toe land in turn.",
    naive="Locates every landing of a series that is infinite within a finite time (Zeno).",
    law="A landing slower than 1 mm/s brings all closed sole ends to rest.",
    criterion="largest number of events until both ends rest, or in 50 ms [events]",
    limit=12.0,
)
def rattling_sole(context: CaseContext) -> float:
    most = 0.0
    for angle in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, -1e-3, -1e-5):
        sim = context.simulator(motion("landing"), above_ice(1e-3, angle, -0.1))
        sim.advance(0.05)
        expect(sim.termination is None, f"ended with {sim.termination}")
        most = max(most, sim.stats()["events"])
    return most


@GROUP.case(
    setup="A foot whose heel touches the ice at t = 0 and moves into it at 0.5 m/s.",
    naive="Searches for a sign change of the gap, finds none, and lets the foot penetrate.",
    law="Signorini: a closed contact that approaches has an impact at once, which takes energy.",
    criterion="depth of the lowest sole end in the first 10 ms [m]",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 2e-3},
)
def event_at_the_start(context: CaseContext) -> float:
    start = above_ice(0.0, 0.1, -0.5)
    sim, before = context.simulator(motion("landing"), start), Simulator(motion("flight"))
    names = before.coordinate_names
    q, v = np.zeros(len(names)), np.zeros(len(names))
    for name, value in start["start"]["q"].items():
        q[names.index(name)] = value
    v[names.index("z0")] = -0.5
    expect(kinetic(sim) < before.energy(q, v)[0], "the impact took no energy")
    expect(energy_residual(sim) < 1e-9, "energy is unaccounted for in the impact")
    worst = depth(sim)
    for _ in sampled(sim, 0.01, 1e-3):
        worst = max(worst, depth(sim))
    return worst


@GROUP.case(
    setup="A landing whose heel and toe are 1e-6, 1e-8 and 1e-10 s apart: much closer than a step.",
    naive="The step after the first landing starts below the ice and misses the second.",
    law="Signorini at every instant.",
    criterion="depth of the lowest sole end [m]",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 2e-3},
)
def closer_than_a_step(context: CaseContext) -> float:
    worst = 0.0
    for apart_by in (1e-6, 1e-8, 1e-10):
        # The sole is 0.28 m long and lands at 0.3 m/s.
        sim = context.simulator(motion("landing"), above_ice(1e-3, 0.3 * apart_by / 0.28))
        for _ in sampled(sim, 0.02, 1e-3):
            worst = max(worst, depth(sim))
        expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="The heel strike of paper_printed's gait in one call, and in calls that end at the "
    "time of the event or at the floating-point number before or after it.",
    naive="Finds an event at the end of a call twice, or not at all.",
    law="The motion does not depend on when a call ends.",
    criterion="distance between both motions 50 ms later [rad, m, /s]",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 1e-6},
    excluded="its last step is shortened to the end of the call",
)
def event_at_the_end_of_a_call(context: CaseContext) -> float:
    whole = context.simulator("paper_printed")
    whole.advance(0.25)
    events = whole.take_events()
    time = next(t for t, what, *_ in events if what == "free heel lands")
    whole = context.simulator("paper_printed")
    whole.advance(time + 0.05)
    worst = 0.0
    for end in (np.nextafter(time, 0.0), time, np.nextafter(time, 1.0)):
        sim = context.simulator("paper_printed")
        for until in (end, np.nextafter(end, 1.0), time + 0.05):
            sim.advance(float(until))
        landed = [what for _, what, *_ in sim.take_events()].count("free heel lands")
        expect(landed == 1, f"it lands {landed} times")
        worst = max(worst, state_distance(sim, whole))
    return worst


@GROUP.case(
    setup="The first 0.3 s of `push_only` in one call, and in 1,000 of 1e-12 to 1e-2 s.",
    naive="Every call resets the step size, shifts a controller sample or loses an event.",
    law="The motion does not depend on when a call ends.",
    criterion="events by which both sequences differ [events]",
    excluded="its last step is shortened to the end of the call",
)
def in_a_thousand_parts(context: CaseContext) -> float:
    whole, parts = context.simulator("push_only"), context.simulator("push_only")
    whole.advance(0.3)
    rng = np.random.default_rng(7)
    lengths = 10.0 ** rng.uniform(-12.0, -2.0, 1000)
    for until in np.cumsum(0.3 * lengths / lengths.sum()):
        parts.advance(float(min(until, 0.3)))
    parts.advance(0.3)
    seen = [[event[1:] for event in sim.take_events()] for sim in (whole, parts)]
    same = sum(one == other for one, other in zip(*seen, strict=False))
    return float(max(map(len, seen)) - same)


@GROUP.case(
    setup="The head falls through its limit at 3 m/s, inside a step.",
    naive="Detects the fall at the end of the step, when the head is centimetres too low.",
    law="A fall is located like every event: the motion ends at the limit.",
    criterion="distance of the head from its limit at the end [m]",
    limit={"balanced": 1e-11, "reference": 1e-11, "rosenbrock": 1e-7, "rk4": 1e-11, "fast": 0.02},
)
def fall_on_the_limit(context: CaseContext) -> float:
    start = {"support_leg": "right", "q": STANCE | {"q9": 0.3}, "v": {"q2": -2.0}}
    sim = context.simulator(push_only(standing()), {"start": start, "fall": {"head_height": 1.2}})
    sim.advance(3.0)
    expect(sim.termination == "fall", f"ended with {sim.termination}")
    return abs(float(sim.head_position[2]) - 1.2)


@GROUP.case(
    setup="A jump: torques of 400 N m at both knees bring the normal forces of both feet to zero.",
    naive="Keeps a foot on the ice with a pulling force, or has no state without contact.",
    law="Newton: in flight only gravity acts, so the horizontal momentum is constant.",
    criterion="change of the horizontal momentum in 50 ms of flight [kg m/s]",
    limit={"balanced": 1e-4, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 5e-4, "fast": 1.0},
)
def lift_off(context: CaseContext) -> float:
    q = {"q2": -0.5, "q3": 1.0, "q4": -0.5, "q5": 0.5, "q6": -1.0, "q7": 0.5}
    sim = context.simulator(
        push_only(standing()), {"start": {"support_leg": "right", "q": q, "v": {}}}
    )
    torque = np.zeros(len(sim.q) - 3)
    torque[1], torque[4] = -400.0, 400.0
    while sim.state_number != 0:
        expect(sim.advance(sim.time + 1e-3, torque) and sim.time < 0.5, "it does not leave the ice")
    before = sim.momentum(sim.q, sim.v)[0]
    sim.advance(sim.time + 0.05, 0.0 * torque)
    expect(sim.state_number == 0, "it landed too soon")
    return abs(float(sim.momentum(sim.q, sim.v)[0] - before))


@GROUP.case(
    setup="A slow ankle torque moves the centre of pressure to toe and heel: the foot tips.",
    naive="Lets the unloaded end pull, or the foot tips half a step late.",
    law="Signorini at both ends: the centre of pressure stays on the sole.",
    criterion="pulling force at a sole end [body weights]",
    limit={"balanced": 1e-11, "reference": 1e-11, "rosenbrock": 1e-11, "rk4": 1e-11, "fast": 1e-3},
)
def edge_of_the_sole(context: CaseContext) -> float:
    start = {"support_leg": "right", "q": STANCE, "v": {}}
    ice = coulomb(5.0)
    sim = context.simulator(push_only(standing()), {"start": start, "ice.friction": ice})
    worst, tips = 0.0, 0
    torque = np.zeros(len(sim.q) - 3)
    for part in range(1, 401):
        torque[0] = 100.0 * np.sin(np.pi * part / 50.0)
        if not sim.advance(1e-3 * part, torque):
            break
        tips += sum("lifts" in what for _, what, *_ in sim.take_events())
        worst = max(worst, -float(sim.contact_forces[:, 2:].min()))
    expect(tips >= 2, f"it tips {tips} times until {sim.time} s")
    return worst / 627.0


@GROUP.case(
    setup="`paper_printed` from a perturbed start: in each gait step a sliding heel lifts off.",
    naive="Uses the sign of a force that is zero up to rounding to decide whether friction drags "
    "the heel down. In one of twenty cases it stops the heel with an impact of up to 100 J.",
    law="A contact without a force has no impact.",
    criterion="energy lost in impacts while a heel lifts off and no contact closes or sticks [J]",
)
def letting_go(context: CaseContext) -> float:
    sim = context.simulator("paper_printed")
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
