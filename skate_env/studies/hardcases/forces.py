"""Contact forces that do not exist, are not unique, or are not determined by the equations."""

from collections.abc import Callable, Iterator

import numpy as np

from ..._core import Simulator
from .case import Array, CaseContext, CaseGroup, Unexpected
from .fixtures import (
    ROOT,
    STANCE,
    coulomb,
    energy_residual,
    expect,
    force_violation,
    kinetic,
    largest,
    push_only,
    sampled,
    standing,
    weight,
)

GROUP = CaseGroup("contact forces that do not exist or are not unique", [])

MU_BACKWARD = 0.9
_DRAWS = 20_000
# Index of the link in Table 1.
_FREE_FOOT = 6


def _on_the_heel(
    sim: Simulator,
    draws: tuple[int, int],
    wanted: Callable[[float, float, float], bool],
    rates: float = 0.0,
) -> Iterator[tuple[Array, Array]]:
    """Reset to random postures on a heel that slides backward at 1 m/s; yield their q and v.

    `draws` holds the seed and the number of postures, `rates` the standard deviation of the leg
    rates [rad/s]. `wanted(gain, free, start)` selects postures: the heel's normal acceleration is
    gain N + start with friction and free N + start without. A negative gain is Painleve's paradox.
    """
    seed, left = draws
    rng = np.random.default_rng(seed)
    n = len(sim.q)
    sole = np.ptp(sim.link_segments(np.zeros(n))[0, :, 1])
    for _ in range(_DRAWS):
        q, v, heel = np.zeros(n), np.zeros(n), np.eye(2, n)
        q[2] = rng.uniform(0.01, 0.3)
        q[1] = sole * np.sin(q[2])
        heel[:, 2] = q[1], -sole * np.cos(q[2])
        q[ROOT : ROOT + 6] = 0.4 * rng.standard_normal(6)
        v[0] = -1.0
        v[ROOT : ROOT + 6] = rates * rng.standard_normal(6)
        try:
            sim.reset(q, v)
        except ValueError:
            continue  # The other foot would be below the ice.
        # The Jacobian of the heel turns forces there into motions of the heel.
        inverse = heel @ np.linalg.inv(sim.mass_matrix(q))
        along, free = inverse @ heel[1]
        gain = free + MU_BACKWARD * along
        start = -(inverse @ sim.bias_forces(q, v))[1]
        if not wanted(gain, free, start):
            continue
        yield q, v
        left -= 1
        if left == 0:
            return
    raise Unexpected("too few postures of the wanted kind")


@GROUP.case(
    setup="A heel slides at 1 m/s (mu = 0.9) in 10 postures without a consistent sliding force.",
    naive="Solves for the force anyway: it pulls, the heel penetrates the ice, or NaN results.",
    law="Tangential impact (Genot and Brogliato 1999); Signorini and Coulomb afterwards.",
    criterion="pulling force, or friction outside the cone, in the next 20 ms [body weights]",
    limit=1e-12,
)
def painleve_heel(context: CaseContext) -> float:
    sim, worst = context.simulator(push_only(standing())), 0.0
    for q, v in _on_the_heel(sim, (1, 10), lambda gain, _, start: max(gain, start) <= 0.0):
        before = sim.energy(q, v)[0]
        expect(abs(sim.v[0] + sim.q[1] * sim.v[2]) < 1e-12, "the heel was not stopped")
        expect(kinetic(sim) <= before, "the impact added energy")
        worst = max(worst, force_violation(sim), largest(sim, 0.02, force_violation))
        expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="The same heel in 20 postures in which lift-off and sliding with a large force are both "
    "consistent. Each runs twice, and once with right and left exchanged.",
    naive="Takes the solution that its solver finds first, which depends on the order of the rows.",
    law="Of several consistent contact states, the one nearest to the present state is taken.",
    criterion="starts whose repetition or mirror image moves differently [starts]",
)
def painleve_two_answers(context: CaseContext) -> float:
    sim, differ = context.simulator(push_only(standing())), 0
    for q, v in _on_the_heel(sim, (2, 20), lambda gain, _, start: gain <= 0.0 <= start, 3.0):
        ends = []
        for leg in ("right", "right", "left"):
            sim.reset(q, v, leg)
            sim.advance(0.01)
            ends.append((sim.state_name, sim.q[1], sim.q[2], sim.v[0]))
        differ += len(set(ends)) > 1
    return float(differ)


@GROUP.case(
    setup="10 postures close to the paradox: friction multiplies a load on the heel by 20 or more.",
    naive="Integrates a force that grows until the step size underflows or energy appears.",
    law="Energy changes by the work of torques, damping, friction and impacts.",
    criterion="unaccounted energy in 20 ms, divided by the kinetic energy",
    limit={"balanced": 2e-2, "reference": 1e-8, "rosenbrock": 1e-3},
    excluded="steps of fixed length do not resolve the approach to an unbounded force",
)
def painleve_near(context: CaseContext) -> float:
    sim, worst = context.simulator(push_only(standing())), 0.0
    for q, v in _on_the_heel(
        sim, (3, 10), lambda gain, free, start: start <= 0.0 <= 20.0 * gain <= free
    ):
        whole = sim.energy(q, v)[0]
        for _ in sampled(sim, 0.02):
            worst = max(worst, energy_residual(sim) / whole)
        expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="A sliding foot (mu = 0.01) is pressed on with over 100 body weights, no paradox.",
    naive="Takes the large force for a jammed foot and stops the foot at once.",
    law="Coulomb: a sliding foot decelerates by mu N / m.",
    criterion="speed lost in 10 us [m/s]",
    limit=0.15,
)
def pressed_foot(context: CaseContext) -> float:
    changes = {
        "start": {"support_leg": "right", "q": STANCE, "v": {"y0": 1.0}},
        "ice.friction": coulomb(0.01),
        "control.lifting": {"K_p": [0.0, 0.0, 1e6], "ahead": 0.0, "height": 2.0},
    }
    sim = context.simulator(push_only(standing()), changes)
    expect(sim.contact_forces[0, 1] > 100.0 * weight(sim), "the normal force is too small")
    sim.advance(1e-5)
    return float(1.0 - sim.v[0])


@GROUP.case(
    setup="100 postures on feet that slide apart at 1 m/s with mu = 5: each one loads the other.",
    naive="Iterates without end, or returns the last iterate as a solution.",
    law="Without a consistent contact state the simulation ends with `jam`; where friction makes a "
    "heel bounce without end, it ends with `step_limit`. Until then Signorini and Coulomb hold.",
    criterion="pulling force, or friction outside the cone, before the end [body weights]",
    limit=1e-11,
    excluded="its forces are means over steps, in which contact states change",
)
def feet_that_block(context: CaseContext) -> float:
    ice = {"ice.friction": coulomb(5.0)}
    sim, worst = context.simulator(push_only(standing()), ice), 0.0
    rng = np.random.default_rng(4)
    for _ in range(100):
        q, v = _double_stance(sim, rng)
        try:
            sim.reset(q, v)
        except ValueError as refused:
            expect("no motion is possible from this start: jam" in str(refused), str(refused))
            continue
        worst = max(worst, force_violation(sim), largest(sim, 0.03, force_violation))
        ends = (None, "fall", "jam", "step_limit")
        expect(sim.termination in ends, f"ended with {sim.termination}")
    return worst


def _double_stance(sim: Simulator, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw a posture with both soles flat on the ice, and rates that make them slide."""
    q = np.zeros(len(sim.q))
    lower, upper = 0.4, 0.38
    reach = 2.0
    while reach > upper:
        # Angles of shank, thigh, hip, shank to the vertical; the last thigh closes the chain.
        shank, thigh, waist, other = rng.uniform(-0.6, 0.6, 4)
        reach = lower * (np.cos(shank) - np.cos(other)) + upper * np.cos(thigh)
    last = rng.choice([-1.0, 1.0]) * np.arccos(reach / upper)
    q[ROOT : ROOT + 6] = np.diff([0.0, shank, thigh, waist, last, other, 0.0])
    v = np.zeros_like(q)
    v[0] = rng.choice([-1.0, 1.0])
    v[ROOT : ROOT + 6] = 2.0 * rng.standard_normal(6)
    return q, v


@GROUP.case(
    setup="Standing on both straight legs: six unknown forces, five independent equations.",
    naive="Divides by a pivot at rounding level, 1e-17: arbitrary forces, or a failed solve.",
    law="Statics: the forces carry the weight, with the least norm (Rockafellar 1976).",
    criterion="deviation of the sum of both normal forces from the weight [body weights]",
    limit=1e-13,
)
def straight_legs(context: CaseContext) -> float:
    sim = context.simulator(standing())
    normal = float(sim.contact_forces[:, 1].sum())
    sim.advance(0.05)
    expect(sim.termination is None, f"ended with {sim.termination}")
    expect(abs(sim.contact_forces).max() < 2.0 * weight(sim), "forces grow")
    return abs(normal / weight(sim) - 1.0)


@GROUP.case(
    setup="Standing on both feet with knees bent by 1e-2 down to 1e-12 rad. The condition number "
    "of the contact equations grows with the inverse square of that angle.",
    naive="Loses all digits of the forces between the legs: feet slip or separate.",
    law="Linear response: joint speeds after 0.1 s are proportional to the knee angle.",
    criterion="deviation of the largest joint speed after 0.1 s from that proportion [rad/s]",
    limit={"balanced": 1e-4, "reference": 1e-5, "rosenbrock": 1e-4, "rk4": 1e-5, "fast": 1e-5},
)
def nearly_straight(context: CaseContext) -> float:
    speeds, bends = [], 10.0 ** np.arange(-12.0, -1.0)
    for bend in bends:
        half, names = 0.5 * bend, ("q2", "q3", "q4", "q5", "q6", "q7")
        posture = dict(zip(names, (-half, bend, -half, half, -bend, half), strict=True))
        sim = context.simulator(standing(), {"start.q": posture})
        sim.advance(0.1)
        expect(sim.termination is None, f"knees of {bend:g} rad: {sim.termination}")
        expect(sim.violation()[0] < 1e-11, f"knees of {bend:g} rad: a foot moved")
        expect(sim.state_name == "stick_flat/stick_flat", f"knees of {bend:g} rad: a foot slides")
        speeds.append(abs(sim.v).max())
    return float(abs(speeds - speeds[-1] * bends / bends[-1]).max())


@GROUP.case(
    setup="Torques of up to 30 N m bend and straighten both legs while both feet stand flat.",
    naive="Applies six constraint forces where five are independent, and lets the feet drift.",
    law="Constraints of position and velocity hold through the change of rank.",
    criterion="violation of the free foot's constraints [m]",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 1e-9},
)
def through_straight(context: CaseContext) -> float:
    sim, worst = context.simulator(standing()), 0.0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(20):
        swing = 30.0 * np.sin(0.9 * part)
        torque[:6] = swing * np.array([-0.5, 1.0, -0.5, 0.5, -1.0, 0.5])
        if not sim.advance(0.01 * (part + 1), torque):
            break
        worst = max(worst, sim.violation()[0])
    expect(sim.termination in (None, "fall", "singular"), f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="25 postures in two-way contact: friction (mu = 0.9) drags a sliding heel down.",
    naive="The heel lands, is pulled, lifts off, and lands again from 1e-11 m, thousands of times.",
    law="No force is consistent, and the heel would fall back: a tangential impact stops it.",
    criterion="largest number of events in 0.15 s [events]",
    limit=60.0,
    excluded="it does not locate events inside a step",
)
def dragged_heel(context: CaseContext) -> float:
    sim, most, found = context.simulator(standing()), 0.0, 0
    n, rng = len(sim.q), np.random.default_rng(5)
    for _ in range(_DRAWS):
        q, v = np.zeros(n), np.zeros(n)
        q[ROOT : ROOT + 6] = 0.4 * rng.standard_normal(6)
        q[ROOT + 5] += rng.uniform(0.05, 0.5) - q[2 : ROOT + 6].sum()
        v[ROOT : ROOT + 6] = rng.standard_normal(6)
        try:
            sim.reset(q, v)
        except ValueError:
            continue  # A foot would be below the ice.
        if sim.gaps()[1, 0] > 0.05 or sim.state_name != "stick_flat/air":
            continue
        jacobian = _heel_jacobian(sim, q)
        gives = jacobian @ np.linalg.solve(sim.mass_matrix(q)[ROOT:, ROOT:], jacobian.T)
        along, up = jacobian @ v[ROOT:]
        if along > -0.2 or up > 0.0 or gives[1, 1] + MU_BACKWARD * gives[0, 1] > 0.0:
            continue
        sim.advance(0.15)
        ends = (None, "fall", "step_limit", "wedged")
        expect(sim.termination in ends, f"ended with {sim.termination}")
        most = max(most, sim.stats()["events"])
        found += 1
        if found == 25:
            return most
    raise Unexpected("too few postures of the wanted kind")


def _heel_jacobian(sim: Simulator, q: Array) -> Array:
    """Jacobian of the free heel's y and z for the joints, (2, n - 3), by finite differences."""
    step = 1e-6
    columns = []
    for joint in range(ROOT, len(q)):
        moved = np.zeros_like(q)
        moved[joint] = step
        ends = [sim.link_segments(q + sign * moved)[_FREE_FOOT, 0, 1:] for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.stack(columns, axis=1)
