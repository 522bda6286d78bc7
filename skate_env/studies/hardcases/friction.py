"""Sliding and sticking: at rest, at the friction limit, at reversals, at tiny speeds."""

import numpy as np

from ..._core import Simulator
from ..fixtures import BLADE
from ..motions.cases import cases
from .case import CaseContext, CaseGroup
from .fixtures import (
    GRAVITY,
    ON_ONE_LEG,
    ROOT,
    STANCE,
    coulomb,
    energy_residual,
    expect,
    force_violation,
    kinetic,
    push_only,
    relative_residual,
    standing,
    state_distance,
)

GROUP = CaseGroup("sliding and sticking", [])


@GROUP.case(
    setup="A body with fixed joints slides to rest from 1 m/s with mu = 0.2.",
    naive="Friction takes the sign of rounding errors: the foot oscillates or moves backward.",
    law="Coulomb: it stops after v^2 / (2 mu g) = 0.254842 m and stays at rest.",
    criterion="distance from that position after 0.55 s [m]",
    limit={"balanced": 1e-9, "reference": 1e-11, "rosenbrock": 1e-12, "rk4": 1e-11, "fast": 5e-6},
)
def slide_to_rest(context: CaseContext) -> float:
    case = cases()["slide"]
    sim = context.simulator(case.scene)
    sim.advance(case.duration, case.torque)
    expect(sim.v[0] == 0.0, f"it still moves at {sim.v[0]} m/s")
    return abs(float(sim.q[0]) - 1.0 / (2.0 * 0.2 * GRAVITY))


@GROUP.case(
    setup="A robot on one leg; torques keep its force just inside the cone for most of 1 s.",
    naive="Regularised friction creeps; with a speed threshold the foot moves below the threshold.",
    law="Coulomb: a sticking foot does not move.",
    criterion="displacement of the supporting foot while it sticks [m]",
)
def no_creep(context: CaseContext) -> float:
    sim, displacement = context.simulator(push_only(standing()), {"start": ON_ONE_LEG}), 0.0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(1, 101):
        before, stuck = sim.q[0], sim.state_name.startswith("stick_flat")
        torque[4] = 6.0 * np.sin(0.7 * part)
        if not sim.advance(0.01 * part, torque):
            break
        events = [what for _, what, *_ in sim.take_events()]
        if stuck and not events and sim.state_name.startswith("stick_flat"):
            displacement = max(displacement, abs(sim.q[0] - before))
    expect(sim.time > 0.1, f"ended with {sim.termination} at {sim.time} s")
    return float(displacement)


@GROUP.case(
    setup="A standing foot, its ankle torque at 1 - 1e-7 and 1 + 1e-7 of the friction limit.",
    naive="Static and sliding friction differ by a tolerance: it jumps, or sticks and slides.",
    law="Coulomb: inside the cone the foot sticks; outside, acceleration grows from zero.",
    criterion="acceleration just outside the cone [m/s2]",
    limit=1e-4,
    excluded="the case needs forces at an instant, not means over a step",
)
def at_the_limit(context: CaseContext) -> float:
    sim = context.simulator(push_only(standing()), {"start": ON_ONE_LEG})
    q, v = sim.q, sim.v
    torque = np.zeros(len(q) - ROOT)

    def slides(ankle: float) -> bool:
        sim.reset(q, v)
        torque[0] = ankle
        sim.advance(1e-9, torque)
        return sim.state_name.startswith("slide_flat")

    low, high = 0.0, 20.0
    expect(slides(high) and not slides(low), "the torque does not separate both")
    while high - low > 1e-10 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slides(middle) else (middle, high)
    expect(not slides(low * (1.0 - 1e-7)), "it slides inside the cone")
    expect(slides(high * (1.0 + 1e-7)), "it sticks outside the cone")
    return float(abs(sim.acceleration[0]))


@GROUP.case(
    setup="A foot on slippery ice (mu = 0.02) that the ankle moves to and fro at 10 Hz.",
    naive="Steps over the reversal: friction keeps its old direction and adds energy.",
    law="Conservation of energy, with friction as a loss.",
    criterion="unaccounted energy in 1 s, divided by the kinetic energy",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 3e-3, "rk4": 1e-6, "fast": 0.1},
)
def reversal(context: CaseContext) -> float:
    changes = {"start": ON_ONE_LEG, "ice.friction": coulomb(0.02, 0.0)}
    sim = context.simulator(push_only(standing()), changes)
    most, worst, turns = kinetic(sim), 0.0, 0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(1, 101):
        torque[0] = 15.0 * np.sin(0.2 * np.pi * part)
        if not sim.advance(0.01 * part, torque):
            break
        most, worst = max(most, kinetic(sim)), max(worst, energy_residual(sim))
        turns += sum("stops" in what for _, what, *_ in sim.take_events())
    expect(turns >= 1, f"only {turns} reversals until {sim.time} s ({sim.termination})")
    return worst / most


@GROUP.case(
    setup="Feet that start at 5e-324, 1e-310, 2e-308, 1e-200 and 1e-30 m/s, forward and backward.",
    naive="Divides by the speed, or takes any speed as sliding: NaN, or friction at rest.",
    law="Continuity: the motion equals that from rest.",
    criterion="distance from the motion that starts at rest, after 0.1 s [rad, m, /s]",
    limit={"balanced": 1e-10, "reference": 1e-12, "rosenbrock": 1e-10, "rk4": 1e-12, "fast": 1e-15},
)
def subnormal_speed(context: CaseContext) -> float:
    def moved(speed: float) -> Simulator:
        start = {**ON_ONE_LEG, "v": {"y0": speed}}
        sim = context.simulator(push_only(standing()), {"start": start})
        sim.advance(0.1)
        return sim

    rest = moved(0.0)
    speeds = (5e-324, 1e-310, 2e-308, 1e-200, 1e-30)
    return max(
        state_distance(moved(sign * speed), rest) for speed in speeds for sign in (1.0, -1.0)
    )


@GROUP.case(
    setup="Scene `blade` with Coulomb friction of mu = 0; feet still have sliding directions.",
    naive="Divides by mu, or lets a foot stick because the cone has no width.",
    law="Newton: the horizontal momentum is constant, landings included.",
    criterion="relative change of the horizontal momentum in 0.5 s",
    limit={"balanced": 5e-3, "reference": 1e-9, "rosenbrock": 1e-3},
    excluded="the stabilizers of `blade` are too stiff for fixed steps of this length",
)
def no_friction(context: CaseContext) -> float:
    ice = coulomb(0.0, 0.0)
    sim = context.simulator(BLADE, {"ice.friction": ice, "fall": None})
    before = sim.momentum(sim.q, sim.v)[0]
    sim.advance(0.5)
    expect(sim.termination is None, f"ended with {sim.termination}")
    expect(sim.stats()["events"] >= 2, "nothing lands")
    return abs(float(sim.momentum(sim.q, sim.v)[0] / before - 1.0))


@GROUP.case(
    setup="Random torques up to 50 N m on ice with mu = 10, 40 starts: beyond Painleve's limit.",
    naive="Pulls, jams or diverges at the first sliding contact.",
    law="Signorini and Coulomb hold until the end of the motion, which has a named cause.",
    criterion="pulling force, or friction outside the cone [body weights]",
    limit=1e-11,
    excluded="its forces are means over steps, in which contact states change",
)
def very_rough_ice(context: CaseContext) -> float:
    ice = coulomb(10.0)
    worst, rng = 0.0, np.random.default_rng(5)
    for _ in range(40):
        sim = context.simulator(push_only(standing()), {"start": ON_ONE_LEG, "ice.friction": ice})
        torque = rng.uniform(-50.0, 50.0, len(sim.q) - ROOT)
        torque[6:] *= 0.1
        sim.advance(0.1, torque)
        worst = max(worst, force_violation(sim) if sim.termination is None else 0.0)
    return worst


@GROUP.case(
    setup="A foot slides to rest below the capture speed of 0.01 m/s while the free leg swings.",
    naive="Sets the foot's velocity to zero without an impulse: energy and momentum disappear.",
    law="Conservation of energy: the work of the impulse that stops the foot is accounted for.",
    criterion="unaccounted energy in 0.3 s, divided by the kinetic energy",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 1e-4},
    excluded="it has no capture: friction impulses bring the foot to rest",
)
def capture(context: CaseContext) -> float:
    start = {"support_leg": "right", "q": STANCE, "v": {"y0": 0.15, "q6": 1.0}}
    # Only the paper's two-way contact captures: see `capture_speed`.
    sim = context.simulator(standing(), {"start": start})
    share = relative_residual(sim, 0.3)
    expect(sim.energy_balance()["capture"] != 0.0, "no foot was captured")
    return share


@GROUP.case(
    setup="30 starts at up to 2 m/s either way, push-only contact, constant random torques.",
    naive="Evaluates friction with an old normal force, which drives the foot.",
    law="Second law: friction never adds energy.",
    criterion="energy added by friction in any 10 ms [J]",
    limit={"balanced": 1e-9, "reference": 1e-9, "rosenbrock": 1e-9, "rk4": 1e-6, "fast": 1e-4},
)
def friction_only_takes(context: CaseContext) -> float:
    worst, rng = 0.0, np.random.default_rng(6)
    for _ in range(30):
        start = {**ON_ONE_LEG, "v": {"y0": rng.uniform(-2.0, 2.0)}}
        sim = context.simulator(
            push_only(standing()), {"start": start, "fall": {"head_height": 1.0}}
        )
        torque = rng.uniform(-40.0, 40.0, len(sim.q) - ROOT)
        torque[6:] *= 0.1
        taken, goes_on = 0.0, True
        while goes_on and sim.time < 0.3:
            goes_on = sim.advance(sim.time + 0.01, torque)
            lost = sim.energy_balance()["friction"]
            worst, taken = max(worst, taken - lost), lost
    return worst
