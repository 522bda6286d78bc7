"""Performance targets of the engine, and whether a run meets them."""

from collections.abc import Iterator
from dataclasses import dataclass

from . import environments as envs
from . import equal_steps, evaluations, scaling, suite
from . import learner as learning
from . import steps as steps_of
from .states import STEP, STEPPED
from .suite import Bench
from .table import OURS, Group

CONTACT = ("gliding", "free heel down", "free foot flat")
"""Cases of evaluations with a foot on the ice."""


@dataclass(frozen=True)
class Target:
    """A ratio and its minimum."""

    what: str
    wanted: float
    measured: float | None
    """None if a measurement is missing."""
    binds: bool = True
    """Whether it is a target; otherwise it is a comparison."""

    @property
    def holds(self) -> bool | None:
        """Whether the run meets the minimum; None if unknown."""
        return None if self.measured is None else self.measured >= self.wanted


def targets(bench: Bench) -> list[Target]:
    """Compare a run with the targets."""
    return list(_targets(bench.groups))


def _targets(groups: dict[str, Group]) -> Iterator[Target]:
    rhs, steps = groups[suite.EVALUATIONS], groups[suite.STEPS]
    call = _time(rhs, evaluations.PYTHON, evaluations.MUJOCO_CALL) or 0.0

    def forward(case: str, label: str) -> float | None:
        return _ratio(rhs, case, label, less=call)

    yield Target("mj_forward / right-hand side, in flight", 4.0, forward("flight", "MuJoCo"))
    for label, binds in ((evaluations.MUJOCO, True), (evaluations.MUJOCO_SOLVED, False)):
        worst = _least(forward(case, label) for case in CONTACT)
        said = "minimum over contact states"
        start = "" if binds else ", solver at its solution"
        yield Target(f"mj_forward{start} / right-hand side, {said}", 8.0, worst, binds)
    for kind in STEPPED[1:]:
        stable = [row.label for row in steps.of(kind.name) if row.tool != OURS]
        for own, how in ((OURS, "alone"), (steps_of.BATCH, "in a batch")):
            ratios = [_ratio(steps, kind.name, label, own, call) for label in stable]
            yield Target(
                f"mj_step, cheapest stable integrator / step of `fast` {how}, {kind.name}",
                10.0,
                _least(iter(ratios)) if ratios else None,
            )
    group = groups[suite.ENVIRONMENTS]
    for scene in envs.SCENES:
        ratio = _ratio(group, envs.case_of("balanced"), envs.MUJOCO_ENV, envs.batch(scene))
        said = f"{envs.MUJOCO_ENV} / batch of `balanced`, per core, {scene}"
        yield Target(said, 1.5, ratio)
    for label, wanted, binds in (
        (envs.MUJOCO_ENV, 20.0, True),
        (envs.ROLLOUT, 20.0, False),
        (envs.HUMANOID, 100.0, True),
        (envs.ENVPOOL, 100.0, False),
    ):
        for scene in envs.SCENES:
            ratio = _ratio(group, envs.case_of("fast"), label, envs.batch(scene))
            said = f"{label} / batch of `fast`, per core, {scene}"
            yield Target(said, wanted, ratio, binds)
    if (by_error := groups.get(suite.EQUAL_STEPS)) is not None:
        for ours, whose in ((True, "`fast`"), (False, f"MuJoCo with {1e3 * STEP:g} ms")):
            for scene in envs.SCENES:
                said = f"{envs.MUJOCO_ENV} / batch, per core, {scene}, at the error of {whose}"
                ratio = _at_error(by_error, scene, equal_steps.usual(by_error, scene, ours))
                yield Target(said, 20.0, ratio, binds=False)
    for accuracy, wanted in zip(envs.ACCURACIES, (2.0, 3.0), strict=True):
        for scene in envs.SCENES:
            case = envs.lanes_case(scene, accuracy)
            ratio = _ratio(group, case, envs.NO_LANES, envs.batch(scene))
            said = f"batch of `{accuracy}` without lanes / with lanes, {scene}"
            yield Target(said, wanted, ratio)
    threads = groups[suite.MORE_THREADS]
    for case in dict.fromkeys(row.case for row in threads.rows):
        shares = scaling.scaling(threads, case)
        most = max(shares)
        yield Target(
            f"parallel efficiency with {most} threads, {case.partition(', ')[2]}",
            0.9,
            shares[most] if most > 1 else None,
        )
    for size in learning.SIZES:
        learned = groups[suite.LEARNER]
        case = learning.case_of(*size)
        ratio = _ratio(learned, case, learning.NULL, learning.OWN)
        wanted = 0.9 if size[2] == "balanced" else 0.95
        yield Target(f"{case}: speed / speed with null environments", wanted, ratio)


def _time(group: Group, case: str, label: str) -> float | None:
    return next((row.time for row in group.rows if (row.case, row.label) == (case, label)), None)


def _ratio(
    group: Group, case: str, theirs: str, ours: str = OURS, less: float = 0.0
) -> float | None:
    """Return the time of another row, less that of a call, over IceSkate's."""
    other, own = _time(group, case, theirs), _time(group, case, ours)
    return None if other is None or own is None else (other - less) / own


def _at_error(group: Group, scene: str, error: float | None) -> float | None:
    """Return the ratio of the times of environment steps at equal errors."""
    if error is None:
        return None
    own, other = (equal_steps.cost(group, scene, ours, error) for ours in (True, False))
    return None if own is None or other is None else other / own


def _least(ratios: Iterator[float | None]) -> float | None:
    found = list(ratios)
    return None if None in found else min(x for x in found if x is not None)
