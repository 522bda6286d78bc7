"""Entries to measure, and the rows and groups of their results."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from skate_env.common import progress_bar
from skate_env.studies import timing
from skate_env.studies.timing import Block

from .peers import Unavailable

OURS = "IceSkate"


@dataclass(frozen=True)
class Error:
    """Error of the timed work [rad]."""

    median: float
    tenth: float
    """90 % quantile."""


@dataclass
class Work:
    """Work that is timed alternately with other work."""

    case: str
    """Ratios are relative to the first work of the case."""
    label: str
    tool: str
    what: str
    """Description of the timed work."""
    size: float | None = field(default=None, kw_only=True)
    """Abscissa of a curve, such as the number of environments."""
    error: Error | None = field(default=None, kw_only=True)
    reason: str | None = field(default=None, kw_only=True)
    """Why it was not measured."""


@dataclass
class Entry(Work):
    """Work to measure."""

    block: Block | None = None
    """None if there is a `reason`."""
    per: float = 1.0
    """Units of work per block; results are times of one unit."""


@dataclass
class Row(Work):
    """Result of an entry."""

    time: float | None = None
    """Time of one unit [s]; None if there is a `reason`."""
    ratio: float | None = None
    """Ratio to the first row of the case."""


@dataclass
class Group:
    """Rows that were measured alternately."""

    title: str
    unit: str
    """The unit of work whose time is measured."""
    rounds: int
    rows: list[Row]
    time_error: float = 0.0
    """Largest relative difference of a time between both halves of the rounds."""
    notes: list[str] = field(default_factory=list)
    rates: bool = False
    """Whether reports show rates in addition to times."""

    def of(self, case: str) -> list[Row]:
        """Return the measured rows of a case."""
        return [row for row in self.rows if row.case == case and row.time is not None]


def attempted(case: str, label: str, tool: str, make: Callable[[], Iterable[Entry]]) -> list[Entry]:
    """Return the entries of `make`, or an entry with the reason if it raises `Unavailable`."""
    try:
        return list(make())
    except Unavailable as error:
        return [Entry(case, label, tool, "", reason=str(error))]


def measure(title: str, unit: str, entries: Sequence[Entry], rounds: int) -> Group:
    """Time entries alternately, with a progress bar on stderr."""
    shared = [item.name for item in fields(Work)]
    rows = [Row(**{name: getattr(entry, name) for name in shared}) for entry in entries]
    timed = [(row, entry) for row, entry in zip(rows, entries, strict=True) if entry.block]
    blocks = [entry.block for _, entry in timed if entry.block]
    with progress_bar(rounds, title.lower(), "round") as bar:
        times = timing.interleaved(blocks, rounds, bar.update)
    group = Group(title, unit, rounds, rows)
    whole, *halves = timing.least(times)
    group.time_error = float((np.maximum(*halves) / whole - 1.0).max())
    for (row, entry), seconds in zip(timed, whole.tolist(), strict=True):
        row.time = seconds / entry.per
    compare(rows)
    return group


def compare(rows: Iterable[Row]) -> None:
    """Set the ratios to the time of the first row of the case."""
    first: dict[str, float | None] = {}
    for row in rows:
        own = first.setdefault(row.case, row.time)
        row.ratio = None if row.time is None or own is None else row.time / own
