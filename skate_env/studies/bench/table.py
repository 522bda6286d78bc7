"""What is measured, and what that came to."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...progress import progress_bar
from .. import timing
from ..timing import Block
from .load import Load
from .peers import Missing

OURS = "IceSkate"


@dataclass(frozen=True)
class Error:
    """How exact what is timed is [rad]."""

    median: float
    tenth: float
    """That one in ten exceeds."""


@dataclass(frozen=True)
class Entry:
    """One piece of work that takes its turn with others."""

    case: str
    """Entries of a case are compared with the first of them."""
    label: str
    tool: str
    what: str
    """Exactly what is timed."""
    block: Block | None = None
    per: float = 1.0
    """Units in a block, of which the time of one is asked for."""
    size: float | None = None
    """Where a curve is drawn: how many."""
    error: Error | None = None
    reason: str | None = None
    """Why there is no block."""


@dataclass
class Row:
    """What an entry took; None where `reason` says why not."""

    case: str
    label: str
    tool: str
    what: str
    time: float | None = None
    """Of one unit [s]."""
    ratio: float | None = None
    """To the first row of the case."""
    size: float | None = None
    error: Error | None = None
    reason: str | None = None


@dataclass
class Group:
    """Rows that were measured in turn."""

    title: str
    unit: str
    """What the time of a row is the time of."""
    rounds: int
    rows: list[Row]
    time_error: float = 0.0
    """Largest relative disagreement of a time between both halves of the rounds."""
    others: float | None = None
    """Cores that other processes kept busy meanwhile; None where nobody knows."""
    notes: list[str] = field(default_factory=list)
    rates: bool = False
    """How many a second says more than the time of one."""

    def of(self, case: str) -> list[Row]:
        """Give the rows of a case that have a figure."""
        return [row for row in self.rows if row.case == case and row.time is not None]


def attempted(case: str, label: str, tool: str, make: Callable[[], Iterable[Entry]]) -> list[Entry]:
    """Make the entries of a peer, or one that says why there are none."""
    try:
        return list(make())
    except Missing as missing:
        return [Entry(case, label, tool, "", reason=str(missing))]


def measure(title: str, unit: str, entries: Sequence[Entry], rounds: int) -> Group:
    """Time entries in turn, with a progress bar on stderr."""
    rows = [
        Row(
            entry.case,
            entry.label,
            entry.tool,
            entry.what,
            size=entry.size,
            error=entry.error,
            reason=entry.reason,
        )
        for entry in entries
    ]
    timed = [(row, entry) for row, entry in zip(rows, entries, strict=True) if entry.block]
    blocks = [entry.block for _, entry in timed if entry.block]
    load = Load()
    with progress_bar(rounds, title.lower(), "round") as bar:
        times = timing.interleaved(blocks, rounds, bar.update)
    group = Group(title, unit, rounds, rows, others=load.others())
    whole, *halves = timing.least(times)
    group.time_error = float((np.maximum(*halves) / whole - 1.0).max())
    for (row, entry), seconds in zip(timed, whole.tolist(), strict=True):
        row.time = seconds / entry.per
    compare(rows)
    return group


def compare(rows: Iterable[Row]) -> None:
    """Divide the times by that of the first row of the case."""
    first: dict[str, float | None] = {}
    for row in rows:
        own = first.setdefault(row.case, row.time)
        row.ratio = None if row.time is None or own is None else row.time / own
