"""Slip and stick: at rest, at the limit, at reversal, and next to nothing."""

import numpy as np

from ..._core import Simulator
from ..accuracy.cases import cases
from .case import EVENTS, Chapter, Lab
from .fixtures import (
    GRAVITY,
    ON_ONE_LEG,
    ROOT,
    STANCE,
    apart,
    expect,
    kinetic,
    outside,
    pushing,
    standing,
    unbooked,
    unbooked_share,
)

CHAPTER = Chapter("slip and stick", [])


@CHAPTER.case(
    setup="A body that its joints hold slides to rest from 1 m/s on mu = 0.2; friction ends with "
    "the motion.",
    naive="Friction of the sign of a velocity that rounding flips: the foot trembles, or creeps "
    "back.",
    law="Coulomb: it stops after v^2 / (2 mu g) = 0.254842 m and stays.",
    criterion="distance from that place after 0.55 s",
    unit="m",
    limit={"balanced": 1e-9, "reference": 1e-11, "rosenbrock": 1e-12, "rk4": 1e-11, "fast": 5e-6},
)
def slide_to_rest(lab: Lab) -> float:
    case = cases()["slide"]
    sim = lab.simulator(case.scene)
    sim.advance(case.duration, case.torque)
    expect(sim.v[0] == 0.0, f"it still moves at {sim.v[0]} m/s")
    return abs(float(sim.q[0]) - 1.0 / (2.0 * 0.2 * GRAVITY))


@CHAPTER.case(
    setup="A robot on one leg, pushed along the ice by swinging torques that stay just inside the "
    "cone for most of 1 s.",
    naive="Regularised friction creeps; a speed threshold lets the foot crawl below it.",
    law="Coulomb: a foot that sticks does not move at all.",
    criterion="way of the supporting foot while it sticks",
    unit="m",
    limit=0.0,
)
def no_creep(lab: Lab) -> float:
    sim, crept = lab.simulator(pushing(standing()), {"start": ON_ONE_LEG}), 0.0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(1, 101):
        place, stuck = sim.q[0], sim.state_name.startswith("stick_flat")
        torque[4] = 6.0 * np.sin(0.7 * part)
        if not sim.advance(0.01 * part, torque):
            break
        events = [what for _, what, *_ in sim.take_events()]
        if stuck and not events and sim.state_name.startswith("stick_flat"):
            crept = max(crept, abs(sim.q[0] - place))
    expect(sim.time > 0.1, f"ended with {sim.termination} at {sim.time} s")
    return float(crept)


@CHAPTER.case(
    setup="A standing foot whose ankle pushes it forward with 1 - 1e-7 and 1 + 1e-7 times what "
    "its cone holds.",
    naive="Static friction that differs from sliding friction by a tolerance: the foot starts "
    "with a jerk, or flickers between sticking and sliding.",
    law="Coulomb: inside the cone it sticks; outside it slides, and its acceleration starts from "
    "zero.",
    criterion="acceleration right outside the cone",
    unit="m/s2",
    limit=1e-4,
    methods=EVENTS,
    excluded="an instant is no step",
)
def at_the_limit(lab: Lab) -> float:
    sim = lab.simulator(pushing(standing()), {"start": ON_ONE_LEG})
    q, v = sim.q, sim.v
    torque = np.zeros(len(q) - ROOT)

    def slides(ankle: float) -> bool:
        sim.reset(q, v)
        torque[0] = ankle
        sim.advance(1e-9, torque)
        return sim.state_name.startswith("slide_flat")

    low, high = 0.0, 20.0
    expect(slides(high) and not slides(low), "the ankle's torque does not decide")
    while high - low > 1e-10 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slides(middle) else (middle, high)
    expect(not slides(low * (1.0 - 1e-7)), "it slides inside the cone")
    expect(slides(high * (1.0 + 1e-7)), "it sticks outside the cone")
    return float(abs(sim.acceleration[0]))


@CHAPTER.case(
    setup="A foot on slippery ice (mu = 0.02) that an ankle swings forward and back ten times a "
    "second.",
    naive="Steps over the reversal: friction goes on pushing the way it did and gives energy.",
    law="First law of thermodynamics, friction booked as a loss.",
    criterion="energy nobody booked over 1 s",
    unit="kinetic energies",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 3e-3, "rk4": 1e-6, "fast": 0.1},
)
def reversal(lab: Lab) -> float:
    sim = lab.simulator(
        pushing(standing()),
        {
            "start": ON_ONE_LEG,
            "ice.friction": {"kind": "coulomb", "mu": 0.02, "capture_speed": 0.0},
        },
    )
    most, worst, turns = kinetic(sim), 0.0, 0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(1, 101):
        torque[0] = 15.0 * np.sin(0.2 * np.pi * part)
        if not sim.advance(0.01 * part, torque):
            break
        most, worst = max(most, kinetic(sim)), max(worst, unbooked(sim))
        turns += sum("stops" in what for _, what, *_ in sim.take_events())
    expect(turns >= 1, f"only {turns} reversals until {sim.time} s ({sim.termination})")
    return worst / most


@CHAPTER.case(
    setup="Feet that start at 5e-324, 1e-310, 2e-308, 1e-200 and 1e-30 m/s, forward and backward.",
    naive="Divides by the speed, or treats any speed but 0 as sliding: NaN, or friction of full "
    "size on a foot at rest.",
    law="Continuity: the motion is that from rest.",
    criterion="distance from the motion that starts at rest after 0.1 s",
    unit="rad, m, /s",
    limit={"balanced": 1e-10, "reference": 1e-12, "rosenbrock": 1e-10, "rk4": 1e-12, "fast": 1e-15},
)
def subnormal_speed(lab: Lab) -> float:
    def moved(speed: float) -> Simulator:
        start = {**ON_ONE_LEG, "v": {"y0": speed}}
        sim = lab.simulator(pushing(standing()), {"start": start})
        sim.advance(0.1)
        return sim

    rest = moved(0.0)
    speeds = (5e-324, 1e-310, 2e-308, 1e-200, 1e-30)
    return max(apart(moved(sign * speed), rest) for speed in speeds for sign in (1.0, -1.0))


@CHAPTER.case(
    setup="`blade` on dry ice whose friction is zero: mu = 0, but every foot has a direction of "
    "sliding.",
    naive="Divides by mu, or takes a foot in a cone without width for one that sticks.",
    law="Newton: nothing changes the momentum along the ice, landings included.",
    criterion="momentum along the ice gained or lost in 0.5 s",
    unit="of it",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-3},
    excluded="the stabilizers of `blade` are too stiff for fixed steps of this length",
)
def no_friction(lab: Lab) -> float:
    ice = {"kind": "coulomb", "mu": 0.0, "capture_speed": 0.0}
    sim = lab.simulator("blade", {"ice.friction": ice, "fall": None})
    before = sim.momentum(sim.q, sim.v)[0]
    sim.advance(0.5)
    expect(sim.termination is None, f"ended with {sim.termination}")
    expect(sim.stats()["events"] >= 2, "nothing lands")
    return abs(float(sim.momentum(sim.q, sim.v)[0] / before - 1.0))


@CHAPTER.case(
    setup="Random torques of 50 N m on both feet on ice of mu = 10, from 40 starts: far beyond "
    "Painleve's limit.",
    naive="Pulls, jams or blows up at the first sliding contact.",
    law="Signorini and Coulomb while it goes on; a named end otherwise.",
    criterion="pull, or friction outside the cone",
    unit="weights",
    limit=1e-11,
    methods=EVENTS,
    excluded="its forces are means over steps in which contact states change",
)
def very_rough_ice(lab: Lab) -> float:
    ice = {"kind": "coulomb", "mu": 10.0, "capture_speed": 0.01}
    worst, rng = 0.0, np.random.default_rng(5)
    for _ in range(40):
        sim = lab.simulator(pushing(standing()), {"start": ON_ONE_LEG, "ice.friction": ice})
        torque = rng.uniform(-50.0, 50.0, len(sim.q) - ROOT)
        torque[6:] *= 0.1
        sim.advance(0.1, torque)
        worst = max(worst, outside(sim) if sim.termination is None else 0.0)
    return worst


@CHAPTER.case(
    setup="A foot that slides to rest at 0.01 m/s, the capture speed, on a free leg that swings.",
    naive="Stops the foot by setting its speed to zero: energy and momentum vanish unbooked.",
    law="First law: the impulse that captures a foot is booked.",
    criterion="energy nobody booked over 0.3 s",
    unit="kinetic energies",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 1e-4},
    excluded="it captures no foot: friction itself brings it to rest",
)
def capture(lab: Lab) -> float:
    start = {"support_leg": "right", "q": STANCE, "v": {"y0": 0.15, "q6": 1.0}}
    sim = lab.simulator(pushing(standing()), {"start": start})
    share = unbooked_share(sim, 0.3)
    expect(sim.energy_balance()["capture"] != 0.0, "no foot was captured")
    return share


@CHAPTER.case(
    setup="30 starts at up to 2 m/s forward or backward on the paper's ice, only pushing, under "
    "random torques that are held.",
    naive="Friction that is evaluated with the old normal force drives the foot.",
    law="Second law: friction never gives energy.",
    criterion="energy that friction gave in any 10 ms",
    unit="J",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-9, "rk4": 1e-6, "fast": 0.05},
)
def friction_only_takes(lab: Lab) -> float:
    worst, rng = 0.0, np.random.default_rng(6)
    for _ in range(30):
        start = {**ON_ONE_LEG, "v": {"y0": rng.uniform(-2.0, 2.0)}}
        sim = lab.simulator(pushing(standing()), {"start": start, "fall": {"head_height": 1.0}})
        torque = rng.uniform(-40.0, 40.0, len(sim.q) - ROOT)
        torque[6:] *= 0.1
        taken, goes_on = 0.0, True
        while goes_on and sim.time < 0.3:
            goes_on = sim.advance(sim.time + 0.01, torque)
            lost = sim.energy_balance()["friction"]
            worst, taken = max(worst, taken - lost), lost
    return worst
