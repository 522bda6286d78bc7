"""The study: errors and cost of every motion for every method and setting."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from ...common import progress_bar
from .. import callgrind, timing
from ..motions.cases import Case, cases
from ..report import stamp
from ..timing import Block
from . import engine, independent, reference, walk
from .outcome import Errors, Outcome, errors, failure, other_states, root_mean_square
from .reference import Reference
from .settings import Setting, StudySize, full, milliseconds

ENGINE, MUJOCO = "skate_env", "mujoco"

# Packages that determine the results.
_PACKAGES = ("skate_env", "numpy", "scipy", "mujoco")


class Tool(Protocol):
    """A simulator of the motions."""

    def settings(self, case: Case) -> Sequence[Setting]:
        """Return its settings, coarse to fine within a method."""

    def run(self, case: Case, setting: Setting, start: int) -> Outcome:
        """Compute a motion; raise ValueError if that fails."""

    def limit(self, case: Case, setting: Setting) -> Outcome | None:
        """Return the limit of fine steps from the scene's start, or None if it is the reference."""

    def block(self, case: Case, setting: Setting) -> tuple[Block, float]:
        """Return a block to time, and its simulated time [s]."""


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
    instructions: float | None = None


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
    tools: dict[str, Tool] = {ENGINE: _Engine(size.settings)}
    try:
        import_module("mujoco")
        tools[MUJOCO] = _MuJoCo(size.thin)
    except ImportError:
        study.notes[MUJOCO] = "mujoco is not installed"
    try:
        independent.available()
    except independent.Unavailable as missing:
        study.notes["independent"] = str(missing)
        size = replace(size, solvers=())
    study.cases = [_case(case, tools, size) for case in chosen]
    if size.instructions:
        _count_instructions(study, chosen, size.settings)
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
            said = failure(outcome, true, setting.locates)
            row.other_states += other_states(outcome, true) is not None
        except ValueError as error:
            outcome, said = None, str(error)
        if start == 0 and outcome is not None:
            reaches = outcome.termination is None
            for name in ("evaluations", "factorisations", "steps"):
                if name in outcome.stats and outcome.time > 0.0:
                    setattr(row, name, outcome.stats[name] / outcome.time)
            limit = tool.limit(case, setting)
            if limit is not None and failure(outcome, limit) is None:
                row.to_limit = errors(outcome, limit)
        if said is not None or outcome is None:
            row.failures += 1
            row.failure = row.failure or f"start {start}: {said}"
        else:
            found.append(errors(outcome, true))
    if not row.failures:
        row.errors = root_mean_square(found)
    row.trusted = {name: truth.trusts(name, error) for name, error in asdict(row.errors).items()}
    return reaches


class _Engine:
    """The engine as a tool of the study."""

    def __init__(self, settings: Sequence[Setting]) -> None:
        self._settings = settings

    def settings(self, case: Case) -> Sequence[Setting]:
        return self._settings

    def run(self, case: Case, setting: Setting, start: int) -> Outcome:
        return engine.run(case, setting, start)

    def limit(self, case: Case, setting: Setting) -> Outcome | None:
        return None

    def block(self, case: Case, setting: Setting) -> tuple[Block, float]:
        return engine.block(case, setting)


class _MuJoCo:
    """MuJoCo as a tool of the study; raises ImportError if it is not installed."""

    def __init__(self, thin: bool) -> None:
        self._thin = thin
        self._module: Any = import_module(f"{__package__}.mujoco")
        self._limits: dict[tuple[str, str], Outcome] = {}

    def settings(self, case: Case) -> Sequence[Setting]:
        return [
            Setting(each.method, milliseconds(each.timestep), each.timestep, each, True)
            for each in self._module.settings(case, self._thin)
        ]

    def run(self, case: Case, setting: Setting, start: int) -> Outcome:
        outcome: Outcome = self._module.run(case, setting.accuracy, start)
        return outcome

    def limit(self, case: Case, setting: Setting) -> Outcome | None:
        cone, contact = setting.accuracy.cone, setting.accuracy.contact
        if contact != "default":
            return None
        key = case.name, cone
        if key not in self._limits:
            self._limits[key] = self._module.limit(case, cone, contact)
        return self._limits[key]

    def block(self, case: Case, setting: Setting) -> tuple[Block, float]:
        made: tuple[Block, float] = self._module.block(case, setting.accuracy)
        return made


def _count_instructions(study: Study, chosen: Sequence[Case], settings: Sequence[Setting]) -> None:
    """Count the instructions of the engine's timed settings."""
    known = {(setting.method, setting.label): setting for setting in settings}
    work = [
        (case, [row for row in made.rows if row.tool == ENGINE and row.time is not None])
        for case, made in zip(chosen, study.cases, strict=True)
    ]
    with progress_bar(sum(len(rows) for _, rows in work), "callgrind", "run") as bar:
        for case, rows in work:
            settings = [known[row.method, row.label] for row in rows]
            try:
                counts = engine.instructions(case, settings, bar.update)
            except callgrind.Unavailable as error:
                study.notes["instructions"] = str(error)
                return
            for row, count in zip(rows, counts, strict=True):
                row.instructions = count
