"""Derivatives where they grow without bound, where events meet, and over many steps."""

import copy

import numpy as np

from ..._core import Linearization, Scene, Simulator
from ...scenes import replace
from ..fixtures import PAPER_DAMPED
from .case import Array, CaseContext, CaseGroup
from .events import above_ice, lowest_toe, swinging_toe
from .fixtures import expect, motion, standing

GROUP = CaseGroup("derivatives", [])

_EXCLUDED = "rosenbrock has no derivatives, and those of time stepping hold the contact modes"
_STEPS = 100
_Z0, _Q1 = 1, 2


def _column(sim: Simulator, until: float, entry: int, step: float) -> Array:
    """Difference of fourth order by an entry of the state; infinite where the events change."""
    ends, passed = [], []
    for k in (2.0, 1.0, -1.0, -2.0):
        moved, dx = copy.copy(sim), np.zeros(len(sim.state_vector()))
        dx[entry] = k * step
        moved.displace(dx)
        moved.take_events()
        moved.advance(until)
        ends.append(moved.state_vector())
        passed.append([what for _, what, *_ in moved.take_events()])
    if any(one != passed[0] for one in passed):
        return np.full_like(ends[0], np.inf)
    return (8.0 * (ends[1] - ends[2]) - (ends[0] - ends[3])) / (12.0 * step)


def _exact(scene: Scene) -> Simulator:
    """Build a simulator whose differences are exact: looser steps depend on the start."""
    return Simulator(replace(scene, {"accuracy": 1e-13}))


def _error(lin: Linearization, entry: int, difference: Array) -> float:
    """Deviation of a column from a difference, relative to its largest entry."""
    column = lin.A[:, entry]
    expect(np.isfinite(lin.A).all(), "it is not finite")
    return float(np.abs(column - difference).max() / np.abs(column).max())


@GROUP.case(
    setup="The toe swings down and up again; its lowest point is 1 cm to 100 nm below or above the "
    "ice. The derivative by the height grows like the inverse root of the depth, up to 2e5.",
    naive="Leaves out that the impact's time changes: the error grows as the contact grazes.",
    law="The derivative is the limit of differences; beside the ice it is that of free flight.",
    criterion="largest deviation from a difference, relative to the largest entry",
    limit=1e-3,
    methods=("balanced", "reference", "rk4"),
    excluded=_EXCLUDED,
)
def grazing_derivative(context: CaseContext) -> float:
    scene = swinging_toe(context)
    lowest, worst = lowest_toe(context, scene), 0.0
    for depth in 10.0 ** np.arange(-2.0, -8.0, -1.0):
        for under in (depth, -depth):
            start = scene.with_values({"start.q.z0": 1.0 - lowest - float(under)})
            sim = context.watch(Simulator(start))
            lin = sim.linearize(until=0.12)
            expect(len(lin.events) == (under > 0.0), "it does not land as it should")
            # The free flight is smooth; a landing depends on the root of the depth.
            found = _column(sim, 0.12, _Z0, depth / (200.0 if under > 0.0 else 4.0))
            worst = max(worst, _error(lin, _Z0, found))
            sim.advance(0.12)
    return worst


@GROUP.case(
    setup="A foot lands level, rotated by 1e-12, 1e-10, 1e-6 and by 1e-3 rad either way.",
    naive="Differentiates one of the two orders of the impacts: the derivative is one-sided.",
    law="The motion has a kink where the order changes: its derivative is one-sided there.",
    criterion="landings without their flag, or with one too many [landings]",
    methods=("balanced", "reference", "rk4"),
    excluded=_EXCLUDED,
)
def derivative_of_two_landings(context: CaseContext) -> float:
    wrong = 0
    for angle in (0.0, 1e-12, -1e-12, 1e-10, -1e-10, 1e-6, -1e-6, 1e-3, -1e-3):
        sim = context.simulator(motion("landing"), above_ice(1e-3, angle))
        lin = sim.linearize(until=0.013)
        wrong += bool(lin.nonsmooth) != (abs(angle) < 1e-5)
        if not lin.nonsmooth:
            found = _column(_exact(sim.scene), 0.013, _Q1, 1e-5)
            wrong += _error(lin, _Q1, found) > 1e-3
        sim.advance(0.013)
    return float(wrong)


@GROUP.case(
    setup="A foot lands on one edge, rotated by 1e-2 to 1e-5 rad, and rattles until it rests.",
    naive="Takes the last impact of a series as one more event: rest keeps derivatives.",
    law="The derivative is the limit of differences.",
    criterion="largest deviation from a difference, relative to the largest entry, without a flag",
    limit={"balanced": 1e-2, "reference": 1e-5, "rk4": 1e-3},
    excluded=_EXCLUDED,
)
def rattling_derivative(context: CaseContext) -> float:
    worst = 0.0
    for angle in (1e-2, 1e-3, 1e-4, 1e-5, -1e-3, -1e-5):
        sim = context.simulator(motion("landing"), above_ice(1e-3, angle, -0.1))
        lin = sim.linearize(until=0.05)
        expect(not lin.nonsmooth, "it is flagged")
        found = _column(_exact(sim.scene), 0.05, _Q1, abs(angle) / 100.0)
        worst = max(worst, _error(lin, _Q1, found))
        sim.advance(0.05)
    return worst


@GROUP.case(
    setup="Standing on both legs, straight, and with knees bent by 1e-2 and 1e-3 rad.",
    naive="Divides by a pivot at rounding level and returns numbers of any size, or NaN.",
    law="Forces on straight legs are not determined; those on bent ones have derivatives.",
    criterion="postures without their flag, or with one too many [postures]",
    methods=("balanced", "reference", "rk4"),
    excluded=_EXCLUDED,
)
def derivative_of_straight_legs(context: CaseContext) -> float:
    wrong = 0
    for bend in (0.0, 1e-3, 1e-2):
        half, names = 0.5 * bend, ("q2", "q3", "q4", "q5", "q6", "q7")
        posture = dict(zip(names, (-half, bend, -half, half, -bend, half), strict=True))
        sim = context.simulator(standing(), {"start.q": posture})
        lin = sim.linearize(until=0.01)
        flagged = any(reason == "dependent" for reason, *_ in lin.nonsmooth)
        wrong += flagged != (bend == 0.0) or not (flagged or np.isfinite(lin.A).all())
        sim.advance(0.01)
    return float(wrong)


@GROUP.case(
    setup="`paper_damped`: derivatives of 100 gait steps along y and along a random direction.",
    naive="Errors of single events grow from step to step: the product overflows.",
    law="A translation stays a translation. The gait is stable: no other direction grows.",
    criterion="change of the translation, relative",
    limit=1e-8,
    methods=("balanced",),
    excluded="one accuracy suffices, and not every method has derivatives",
)
def derivative_of_100_steps(context: CaseContext) -> float:
    sim, made = context.simulator(PAPER_DAMPED), 0
    n = len(sim.q)
    shift = np.zeros(2 * n + 4)
    shift[[0, 2 * n]] = 1.0
    moved = np.column_stack([shift, np.random.default_rng(0).normal(size=len(shift))])
    while made < _STEPS:
        moved = sim.linearize().A @ moved
        expect(np.isfinite(moved).all() and np.abs(moved).max() < 1e6, f"it grows, step {made}")
        expect(sim.step(), f"ended with {sim.termination}")
        made += len(sim.take_steps())
    # The anchor counts where the free foot sticks.
    return float(np.abs(moved[: 2 * n, 0] - shift[: 2 * n]).max())
