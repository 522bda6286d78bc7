"""The study: errors and cost of every motion for every method and setting."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ...common import progress_bar
from .. import timing
from ..motions.cases import Case, cases
from ..motions.mujoco_model import package
from ..report import stamp
from ..timing import Block
from . import engine, independent, mujoco, reference, walk
from .outcome import Errors, Outcome, errors, failure, other_states, root_mean_square
from .reference import Reference
from .settings import Setting, StudySize, full, milliseconds

ENGINE, MUJOCO = "skate_env", "mujoco"

# Packages that determine the results.
_PACKAGES = ("skate_env", "numpy", "scipy", "mujoco")


@dataclass(frozen=True)
class Tool:
    """A simulator of the motions."""

    settings: Callable[[Case], Sequence[Setting]]
    """Settings of a case, coarse to fine within a method."""
    run: Callable[[Case, Setting, int], Outcome]
    """Computes a motion from a start; raises ValueError if that fails."""
    block: Callable[[Case, Setting], tuple[Block, float]]
    """Returns a block to time, and its simulated time [s]."""
    limit: Callable[[Case, Setting], Outcome | None] = lambda case, setting: None
    """Returns the limit of fine steps from the scene's start, None if it is the reference."""


@dataclass
class Row:
    """Errors and costs of one setting for one motion; None where not measured."""

    case: str
    tool: str
    method: str
    label: str
    value: float | None
    """Tolerance, or step [s]."""
    fixed_step: bool
    starts: int
    failures: int = 0
    """Number of starts with a different motion; with any there are no errors."""
    failure: str | None = None
    """Description of the first failure."""
    other_states: int = 0
    """Number of starts with other contact states, which is no failure of time-stepping."""
    errors: Errors = field(default_factory=Errors)
    """Root mean square over the starts."""
    trusted: dict[str, bool] = field(default_factory=dict)
    """Which errors are large compared with those of the references."""
    to_limit: Errors | None = None
    """Distance from the tool's own limit for the scene's start, if that is not the reference."""
    time: float | None = None
    """Wall time [s]; like all costs, per simulated second."""
    evaluations: float | None = None
    """Evaluations of the right-hand side."""
    factorisations: float | None = None
    steps: float | None = None


@dataclass
class CaseStudy:
    """All results of one motion."""

    name: str
    title: str
    duration: float
    """[s]"""
    smooth: bool
    starts: int
    reference: Reference
    rows: list[Row]
    time_error: float = 0.0
    """Largest relative difference of a time between both halves of the rounds."""


@dataclass
class Study:
    """All results, and the versions and machine they were measured with."""

    stamp: dict[str, str]
    rounds: int
    cases: list[CaseStudy]
    walks: list[walk.Walk]
    """Long simulations."""
    notes: dict[str, str] = field(default_factory=dict)
    """Parts that are missing, with reasons."""

    def summary(self) -> dict[str, Any]:
        """Return all results as JSON values, without the outcomes of the reference."""
        whole = asdict(self)
        for case, study in zip(whole["cases"], self.cases, strict=True):
            first = study.reference.outcomes[0]
            case["states"], case["event_times"] = first.states, first.event_times
            case["disagreement"] = asdict(study.reference.disagreement)
            del case["reference"]["outcomes"]
        return whole


def make(names: Sequence[str] = (), size: StudySize | None = None) -> Study:
    """Run the study for the named motions (all if none), with progress bars on stderr.

    Raises
    ------
    ValueError
        If a name is unknown.
    """
    known, size = cases(), size or full()
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"no motion {unknown[0]!r}: name one of {', '.join(known)}")
    chosen = [known[name] for name in names or known]
    study = Study(stamp(_PACKAGES), size.rounds, [], [])
    tools: dict[str, Tool] = {ENGINE: _engine(size.settings)}
    try:
        tools[MUJOCO] = _mujoco(size.thin)
    except ImportError:
        study.notes[MUJOCO] = "mujoco is not installed"
    try:
        independent.available()
    except independent.Unavailable as missing:
        study.notes["independent"] = str(missing)
        size = replace(size, solvers=())
    study.cases = [_case(case, tools, size) for case in chosen]
    if size.steps:
        study.walks = walk.walk(size.settings, size.steps)
    return study


def _case(case: Case, tools: dict[str, Tool], size: StudySize) -> CaseStudy:
    starts = size.starts_of(case)
    solvers = [(solver, min(count, starts)) for solver, count in size.solvers]
    with progress_bar(starts + sum(n for _, n in solvers), f"{case.name}: reference", "run") as bar:
        truth = reference.find(case, starts, solvers, bar.update)
    study = CaseStudy(case.name, case.title, case.duration, case.smooth, starts, truth, [])
    todo = [
        (name, tool, setting)
        for name, tool in tools.items()
        if name == ENGINE or case.in_mujoco
        for setting in tool.settings(case)
    ]
    timed: list[tuple[Row, Block, float]] = []
    with progress_bar(len(todo), f"{case.name}: errors", "setting") as bar:
        for name, tool, setting in todo:
            row = Row(
                case.name,
                name,
                setting.method,
                setting.label,
                setting.value,
                setting.fixed_step,
                starts,
            )
            study.rows.append(row)
            if _measure(row, case, tool, setting, truth):
                timed.append((row, *tool.block(case, setting)))
            bar.update()
    with progress_bar(size.rounds, f"{case.name}: time", "round") as bar:
        times = timing.interleaved([block for _, block, _ in timed], size.rounds, bar.update)
    whole, *halves = timing.least(times)
    study.time_error = float((np.maximum(*halves) / whole - 1.0).max())
    for (row, _, simulated), seconds in zip(timed, whole.tolist(), strict=True):
        row.time = seconds / simulated
    return study


def _measure(row: Row, case: Case, tool: Tool, setting: Setting, truth: Reference) -> bool:
    """Fill in errors and counts; return whether the scene's own start reaches the end."""
    found, reaches = [], False
    for start, true in enumerate(truth.outcomes):
        try:
            outcome = tool.run(case, setting, start)
            reason = failure(outcome, true, setting.locates)
            row.other_states += other_states(outcome, true) is not None
        except ValueError as error:
            outcome, reason = None, str(error)
        if start == 0 and outcome is not None:
            reaches = outcome.termination is None
            for name in ("evaluations", "factorisations", "steps"):
                if name in outcome.stats and outcome.time > 0.0:
                    setattr(row, name, outcome.stats[name] / outcome.time)
            limit = tool.limit(case, setting)
            if limit is not None and failure(outcome, limit) is None:
                row.to_limit = errors(outcome, limit)
        if reason is not None or outcome is None:
            row.failures += 1
            row.failure = row.failure or f"start {start}: {reason}"
        else:
            found.append(errors(outcome, true))
    if not row.failures:
        row.errors = root_mean_square(found)
    row.trusted = {name: truth.trusts(name, error) for name, error in asdict(row.errors).items()}
    return reaches


def _engine(settings: Sequence[Setting]) -> Tool:
    """Return the engine as a tool of the study."""
    return Tool(lambda case: settings, engine.run, engine.block)


def _mujoco(thin: bool) -> Tool:
    """Return MuJoCo as a tool of the study; raise ImportError if it is not installed."""
    package()
    limits: dict[tuple[str, str], Outcome] = {}

    def settings(case: Case) -> list[Setting]:
        return [
            Setting(each.method, milliseconds(each.timestep), each.timestep, each, True)
            for each in mujoco.settings(case, thin)
        ]

    def limit(case: Case, setting: Setting) -> Outcome | None:
        cone, contact = setting.accuracy.cone, setting.accuracy.contact
        if contact != "default":
            return None
        if (case.name, cone) not in limits:
            limits[case.name, cone] = mujoco.limit(case, cone, contact)
        return limits[case.name, cone]

    return Tool(
        settings,
        lambda case, setting, start: mujoco.run(case, setting.accuracy, start),
        lambda case, setting: mujoco.block(case, setting.accuracy),
        limit,
    )
