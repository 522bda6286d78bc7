"""Contact forces that do not exist, that are not unique, or that nothing determines."""

from collections.abc import Callable, Iterator

import numpy as np

from ..._core import Simulator
from .case import EVENTS, Array, Chapter, Lab, Unexpected
from .fixtures import (
    ROOT,
    STANCE,
    expect,
    kinetic,
    outside,
    pushing,
    standing,
    ticks,
    unbooked,
    weight,
    worst_of,
)

CHAPTER = Chapter("forces that do not exist or are not unique", [])

MU_BACKWARD = 0.9
_DRAWS = 20_000
# Of the links of Table 1.
_FREE_FOOT = 6


def _on_the_heel(
    sim: Simulator,
    draws: tuple[int, int],
    wanted: Callable[[float, float, float], bool],
    rates: float = 0.0,
) -> Iterator[tuple[Array, Array]]:
    """Reset to postures on the heel that slide backward at 1 m/s, legs at random rates [rad/s].

    `draws` are seed and number. Yields q and v where `wanted` says so of (gain, free, start): the
    heel's normal acceleration is gain N + start if friction goes with N, Painleve's paradox where
    the gain is negative, and free N + start without friction.
    """
    seed, left = draws
    rng = np.random.default_rng(seed)
    n = len(sim.q)
    for _ in range(_DRAWS):
        q, v = np.zeros(n), np.zeros(n)
        q[2] = rng.uniform(0.01, 0.3)
        q[ROOT : ROOT + 6] = 0.4 * rng.standard_normal(6)
        v[0] = -1.0
        v[ROOT : ROOT + 6] = rates * rng.standard_normal(6)
        try:
            sim.reset(q, v)
        except ValueError:
            continue  # The other foot would be below the ice.
        # M is that of the frame in which the simulator now stands, on the heel.
        inverse = np.linalg.inv(sim.mass_matrix(q))
        gain = inverse[1, 1] + MU_BACKWARD * inverse[1, 0]
        start = -(inverse @ sim.bias_forces(q, v))[1]
        if not wanted(gain, inverse[1, 1], start):
            continue
        yield q, v
        left -= 1
        if left == 0:
            return
    raise Unexpected("too few postures of the wanted kind")


@CHAPTER.case(
    setup="The heel slides backward at 1 m/s (mu = 0.9) in 10 postures where every sliding force "
    "pulls it into the ice: Painleve's paradox.",
    naive="Solves for the force all the same: a normal force that pulls, a heel in the ice, or "
    "NaN.",
    law="Tangential impact, as in the limit of a stiff contact (Genot and Brogliato 1999); "
    "Signorini and Coulomb afterwards.",
    criterion="pull, or friction outside the cone, in the 20 ms afterwards",
    unit="weights",
    limit=1e-12,
)
def painleve_heel(lab: Lab) -> float:
    sim, worst = lab.simulator(pushing(standing())), 0.0
    for q, v in _on_the_heel(sim, (1, 10), lambda gain, _, start: max(gain, start) <= 0.0):
        before = sim.energy(q, v)[0]
        expect(sim.v[0] == 0.0, "the heel was not caught")
        expect(kinetic(sim) <= before, "the catch gave energy")
        worst = max(worst, outside(sim), worst_of(sim, 0.02, outside))
        expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="The same heel in 20 postures where both lift-off and sliding under a huge force are "
    "consistent; each runs twice, and once with right and left exchanged.",
    naive="Takes whichever its solver happens to find: an answer that changes with the order of "
    "rows.",
    law="Of several consistent contact states the one nearest to the present state is taken.",
    criterion="starts of which a repetition or the mirrored start goes another way",
    unit="starts",
    limit=0.0,
)
def painleve_two_answers(lab: Lab) -> float:
    sim, differ = lab.simulator(pushing(standing())), 0
    for q, v in _on_the_heel(sim, (2, 20), lambda gain, _, start: gain <= 0.0 <= start, 3.0):
        ends = []
        for leg in ("right", "right", "left"):
            sim.reset(q, v, leg)
            sim.advance(0.01)
            ends.append((sim.state_name, sim.q[1], sim.q[2], sim.v[0]))
        differ += len(set(ends)) > 1
    return float(differ)


@CHAPTER.case(
    setup="The heel slides backward in 10 postures close to the paradox: friction multiplies a "
    "push on the heel by 20 or more.",
    naive="Integrates a force that grows without bound until its step underflows or energy "
    "appears.",
    law="First law of thermodynamics: what torques, damping, friction and impacts take is what is "
    "gone.",
    criterion="energy nobody booked over 20 ms",
    unit="kinetic energies",
    limit={"balanced": 1e-4, "reference": 1e-8, "rosenbrock": 1e-3},
    excluded="steps of fixed length do not resolve the approach to an unbounded force",
)
def painleve_near(lab: Lab) -> float:
    sim, worst = lab.simulator(pushing(standing())), 0.0
    for q, v in _on_the_heel(
        sim, (3, 10), lambda gain, free, start: start <= 0.0 <= 20.0 * gain <= free
    ):
        whole = sim.energy(q, v)[0]
        for _ in ticks(sim, 0.02):
            worst = max(worst, unbooked(sim) / whole)
        expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="A torque-driven press of more than 100 weights on a flat foot that slides on mu = "
    "0.01: large forces, but no paradox.",
    naive="Mistakes a large force for a wedged foot and stops it dead.",
    law="Coulomb: a sliding foot loses speed by mu N / m, and no more.",
    criterion="speed lost within 10 us",
    unit="m/s",
    limit=0.15,
)
def pressed_foot(lab: Lab) -> float:
    changes = {
        "start": {"support_leg": "right", "q": STANCE, "v": {"y0": 1.0}},
        "ice.friction": {"kind": "coulomb", "mu": 0.01, "capture_speed": 0.01},
        "control.lifting": {"K_p": [0.0, 0.0, 1e6], "ahead": 0.0, "height": 2.0},
    }
    sim = lab.simulator(pushing(standing()), changes)
    expect(sim.contact_forces[0, 1] > 100.0 * weight(sim), "the press is too weak")
    sim.advance(1e-5)
    return float(1.0 - sim.v[0])


@CHAPTER.case(
    setup="100 random postures on two feet that slide against each other at 1 m/s, mu = 5: "
    "friction of each foot presses the other.",
    naive="Iterates for ever, or returns the last iterate as if it were a solution.",
    law="Where no contact state is consistent the simulation ends with `jam`, where friction "
    "makes a heel hop without end, with `step_limit`; until then Signorini and Coulomb hold.",
    criterion="pull, or friction outside the cone, while it goes on",
    unit="weights",
    limit=1e-11,
    methods=EVENTS,
    excluded="its forces are means over steps in which contact states change",
)
def feet_that_block(lab: Lab) -> float:
    ice = {"ice.friction": {"kind": "coulomb", "mu": 5.0, "capture_speed": 0.01}}
    sim, worst = lab.simulator(pushing(standing()), ice), 0.0
    rng = np.random.default_rng(4)
    for _ in range(100):
        q, v = _astride(sim, rng)
        try:
            sim.reset(q, v)
        except ValueError as refused:
            expect("no motion is possible from this start: jam" in str(refused), str(refused))
            continue
        worst = max(worst, outside(sim), worst_of(sim, 0.03, outside))
        expect(
            sim.termination in (None, "fall", "jam", "step_limit"), f"ended with {sim.termination}"
        )
    return worst


def _astride(sim: Simulator, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw a posture with both soles flat on the ice, and rates that slide them."""
    q = np.zeros(len(sim.q))
    lower, upper = 0.4, 0.38
    reach = 2.0
    while reach > upper:
        # Angles of shank, thigh, thigh, shank to the vertical; the last thigh closes the chain.
        shank, thigh, waist, other = rng.uniform(-0.6, 0.6, 4)
        reach = lower * (np.cos(shank) - np.cos(other)) + upper * np.cos(thigh)
    last = rng.choice([-1.0, 1.0]) * np.arccos(reach / upper)
    q[ROOT : ROOT + 6] = np.diff([0.0, shank, thigh, waist, last, other, 0.0])
    v = np.zeros_like(q)
    v[0] = rng.choice([-1.0, 1.0])
    v[ROOT : ROOT + 6] = 2.0 * rng.standard_normal(6)
    return q, v


@CHAPTER.case(
    setup="Standing on both straight legs: six unknown forces, five equations that determine them.",
    naive="Divides by a pivot that is rounding, 1e-17: forces of any size, or a failed solve.",
    law="Statics: the forces carry the weight; among all that do, the least ones (Rockafellar "
    "1976).",
    criterion="normal forces of both feet less the weight",
    unit="weights",
    limit=1e-13,
)
def straight_legs(lab: Lab) -> float:
    sim = lab.simulator(standing())
    normal = float(sim.contact_forces[:, 1].sum())
    sim.advance(0.05)
    expect(sim.termination is None, f"ended with {sim.termination}")
    expect(abs(sim.contact_forces).max() < 2.0 * weight(sim), "forces grow")
    return abs(normal / weight(sim) - 1.0)


@CHAPTER.case(
    setup="Standing on both feet with knees bent by 1e-2 down to 1e-12 rad; the condition of the "
    "contact equations goes as the inverse square.",
    naive="Loses all digits of the forces between the legs: feet slip or fly apart.",
    law="Near its balance a robot answers in proportion: speeds after 0.1 s go as the bend.",
    criterion="largest speed of a joint after 0.1 s less the share that goes with 1e-2 rad",
    unit="rad/s",
    limit={"balanced": 1e-4, "reference": 1e-5, "rosenbrock": 1e-4, "rk4": 1e-5, "fast": 1e-5},
)
def nearly_straight(lab: Lab) -> float:
    speeds, bends = [], 10.0 ** np.arange(-12.0, -1.0)
    for bend in bends:
        half, names = 0.5 * bend, ("q2", "q3", "q4", "q5", "q6", "q7")
        posture = dict(zip(names, (-half, bend, -half, half, -bend, half), strict=True))
        sim = lab.simulator(standing(), {"start.q": posture})
        sim.advance(0.1)
        expect(sim.termination is None, f"knees of {bend:g} rad: {sim.termination}")
        expect(sim.violation()[0] < 1e-11, f"knees of {bend:g} rad: a foot moved")
        expect(
            set(sim.state_name.split("/")) == {"stick_flat"},
            f"knees of {bend:g} rad: {sim.state_name}",
        )
        speeds.append(abs(sim.v).max())
    return float(abs(speeds - speeds[-1] * bends / bends[-1]).max())


@CHAPTER.case(
    setup="Torques of up to 30 N m that bend and straighten both legs while both feet stand flat.",
    naive="Applies six constraint forces where five are independent, and lets the feet drift.",
    law="Constraints of position and velocity hold through the change of rank.",
    criterion="how far the free foot is off its contact",
    unit="m",
    limit={"balanced": 1e-10, "reference": 1e-10, "rosenbrock": 1e-10, "rk4": 1e-10, "fast": 1e-9},
)
def through_straight(lab: Lab) -> float:
    sim, worst = lab.simulator(standing()), 0.0
    torque = np.zeros(len(sim.q) - ROOT)
    for part in range(20):
        swing = 30.0 * np.sin(0.9 * part)
        torque[:6] = swing * np.array([-0.5, 1.0, -0.5, 0.5, -1.0, 0.5])
        if not sim.advance(0.01 * (part + 1), torque):
            break
        worst = max(worst, sim.violation()[0])
    expect(sim.termination in (None, "fall", "singular"), f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="Two-way contact: in 25 postures the free heel slides backward (mu = 0.9) where "
    "friction drags it down, and lands.",
    naive="Lands, lifts for its pull, lands again after the microsecond that 1e-11 m take, "
    "thousands of times.",
    law="No force is consistent, and in the air it would fall back: the heel is caught.",
    criterion="most events within 0.15 s",
    unit="events",
    limit=60.0,
    methods=EVENTS,
    excluded="it passes over what happens within a step",
)
def dragged_heel(lab: Lab) -> float:
    sim, most, found = lab.simulator(standing()), 0.0, 0
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
        expect(sim.termination in (None, "fall", "step_limit"), f"ended with {sim.termination}")
        most = max(most, sim.stats()["events"])
        found += 1
        if found == 25:
            return most
    raise Unexpected("too few postures of the wanted kind")


def _heel_jacobian(sim: Simulator, q: Array) -> Array:
    """Return how the free heel's y and z go with the joints (2, n - 3), by differences."""
    step = 1e-6
    columns = []
    for joint in range(ROOT, len(q)):
        moved = np.zeros_like(q)
        moved[joint] = step
        ends = [sim.link_segments(q + sign * moved)[_FREE_FOOT, 0, 1:] for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.stack(columns, axis=1)
