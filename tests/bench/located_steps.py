"""Cost and error of IceSkate and of Drake's CENIC, which chooses its steps by their error, too."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from skate_env._core import Scene, Simulator
from skate_env.common import progress_bar
from skate_env.scenes import replace
from skate_env.studies import timing
from skate_env.studies.motions.cases import cases

from .drake_body import CenicMotion, DrakeRobot
from .equal_steps import ANGLES, CENIC, FAST, Array, Progress, error, ratio_notes
from .peers import tool
from .sizes import Sizes
from .table import OURS, Entry, Group, attempted, measure

LANDINGS, FLIGHT = "landings", "flight"
# Height of the lowest end of a sole at the start [m].
_HEIGHTS = {LANDINGS: 0.01, FLIGHT: 1.0}
# Height at which no posture touches the ice [m].
_HIGH = 10.0

DURATION = 0.15
"""Time that a motion takes [s]."""

ACCURACIES = ("fast", "balanced", "reference")
CENIC_ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
# Accuracies of the limits that errors are relative to.
_OUR_LIMIT, _CENIC_LIMIT = 1e-13, 1e-8

# Number of angles of the supporting foot and of the joints of both legs.
_LEGS = 7

# Coefficient of friction in both directions, as Drake has it.
_MU = 0.2
# Standard deviations of angles and rates [rad, rad/s].
_ANGLE, _RATE = 0.1, 1.0
# Ranges of the speeds along y and z [m/s] and of the supporting foot's angle [rad].
_ALONG, _DOWN, _TILT = (0.0, 2.0), (-1.0, 0.0), (-0.2, 0.2)


@dataclass(frozen=True)
class Start:
    """Coordinates and rates (n,) at the start of a motion."""

    q: Array
    v: Array


def located_steps(sizes: Sizes) -> Group:
    """Measure random landings and flights, one robot at a time."""
    entries: list[Entry] = []
    motions = len(_HEIGHTS) * (2 + len(ACCURACIES) + len(CENIC_ACCURACIES))
    with progress_bar(motions, "errors", "motion") as bar:
        for case in _HEIGHTS:
            begun = starts(case, sizes.landings)
            entries += _ours(case, begun, bar.update)

            def theirs(case: str = case, begun: list[Start] = begun) -> Iterator[Entry]:
                return _cenic(case, begun, bar.update)

            entries += attempted(case, CENIC, "Drake", theirs)
    title, unit = "At equal errors, located steps", "one second of a motion"
    group = measure(title, unit, entries, sizes.long_rounds)
    group.notes = [
        f"{sizes.landings} random postures and velocities, {DURATION:g} s without torques on ice "
        f"that only pushes, friction {_MU:g}. The lowest end of a sole starts above the ice: "
        f"{' or '.join(f'{height:g} m ({case})' for case, height in _HEIGHTS.items())}.",
        "The error of a start is the largest error of an angle [rad] at the end, relative to the "
        f"simulator's own limit: a tolerance of {_OUR_LIMIT:g} for IceSkate, an accuracy of "
        f"{_CENIC_LIMIT:g} for CENIC. The softness of Drake's contact, its default, is therefore "
        "no error here.",
        *ratio_notes(group, "CENIC", [FAST, *(_label(a) for a in CENIC_ACCURACIES)]),
    ]
    return group


def scene(accuracy: str | float = "balanced") -> Scene:
    """Return the robot without torques on isotropic ice that only pushes."""
    friction = {"kind": "coulomb", "mu": _MU, "capture_speed": 0.0}
    return replace(cases()["landing"].scene, {"ice.friction": friction, "accuracy": accuracy})


def starts(case: str, count: int) -> list[Start]:
    """Draw starts; those of a flight are those of a landing, lifted."""
    sim, rng = Simulator(scene()), np.random.default_rng(0)
    posture, found = sim.q, []
    for _ in range(count):
        q = posture + rng.normal(0.0, _ANGLE, len(posture))
        v = rng.normal(0.0, _RATE, len(posture))
        q[:3] = 0.0, _HIGH, rng.uniform(*_TILT)
        v[:2] = rng.uniform(*_ALONG), rng.uniform(*_DOWN)
        sim.reset(q, v)
        q[1] += _HEIGHTS[case] - sim.gaps().min()
        found.append(Start(q, v))
    return found


def simulators(accuracy: str | float, begun: list[Start]) -> list[Simulator]:
    """Return a simulator in each start."""
    sims = [Simulator(scene(accuracy)) for _ in begun]
    for sim, start in zip(sims, begun, strict=True):
        sim.reset(start.q, start.v)
    return sims


def ends(accuracy: str | float, begun: list[Start]) -> Array:
    """Return the angles at the end of the motions (starts, angles) [rad].

    Rows of motions that ended are infinite.
    """
    sims = simulators(accuracy, begun)
    legs = [sim.support_leg for sim in sims]
    going = [sim.advance(DURATION) for sim in sims]
    found = np.array([angles(sim, leg) for sim, leg in zip(sims, legs, strict=True)])
    found[~np.array(going)] = np.inf
    return found


def angles(sim: Simulator, leg: str) -> Array:
    """Return the angles of the chain that begins at a leg, which may be the free one [rad]."""
    found = sim.q[ANGLES:]
    if sim.support_leg != leg:
        found[0] += found[1:_LEGS].sum()
        found[1:_LEGS] = -found[_LEGS - 1 : 0 : -1]
    return found


def cenic_ends(robot: DrakeRobot, accuracy: float, begun: list[Start]) -> Array:
    """Return the angles of `ends` in Drake."""
    motions = [CenicMotion(robot, start.q, start.v, accuracy) for start in begun]
    for motion in motions:
        motion.advance(DURATION)
    return np.array([motion.q[ANGLES:] for motion in motions])


def _ours(case: str, begun: list[Start], progress: Progress) -> Iterator[Entry]:
    limit = ends(_OUR_LIMIT, begun)
    progress()
    for accuracy in ACCURACIES:
        found = error(ends(accuracy, begun), limit)
        progress()
        sims = simulators(accuracy, begun)
        saved = [sim.snapshot() for sim in sims]

        def restore(sims: list[Simulator] = sims, saved: list[bytes] = saved) -> None:
            for sim, state in zip(sims, saved, strict=True):
                sim.restore(state)

        def work(sims: list[Simulator] = sims) -> None:
            for sim in sims:
                sim.advance(DURATION)

        what = f"Simulator.advance from {len(begun)} starts"
        block, per = timing.timed(work, restore), len(begun) * DURATION
        yield Entry(case, f"{OURS}, {accuracy}", OURS, what, block, per, error=found)


def _cenic(case: str, begun: list[Start], progress: Progress) -> Iterator[Entry]:
    robot = DrakeRobot(scene())
    for sim in simulators("reference", begun):
        robot.check(sim)
    limit = cenic_ends(robot, _CENIC_LIMIT, begun)
    progress()
    for accuracy in CENIC_ACCURACIES:
        found = error(cenic_ends(robot, accuracy, begun), limit)
        progress()
        motions = [CenicMotion(robot, start.q, start.v, accuracy) for start in begun]

        def restart(motions: list[CenicMotion] = motions) -> None:
            for motion in motions:
                motion.restart()

        def work(motions: list[CenicMotion] = motions) -> None:
            for motion in motions:
                motion.advance(DURATION)

        what = f"Simulator.AdvanceTo from these starts, point contact, accuracy={accuracy:g}"
        block, per = timing.timed(work, restart), len(begun) * DURATION
        yield Entry(case, _label(accuracy), tool("Drake", "drake"), what, block, per, error=found)


def _label(accuracy: float) -> str:
    return f"{CENIC}, {np.format_float_scientific(accuracy, trim='-', exp_digits=1)}"
