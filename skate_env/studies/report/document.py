"""Parts of a report, each for a terminal and as Markdown."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from .formats import escaped

WIDTH = 100
"""Width of notes on a terminal."""


@dataclass(frozen=True)
class Table:
    """Cells in rows and columns; the first column names the rows."""

    title: str
    """Empty for none."""
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    groups: Sequence[str] = ()
    """Heading above each column, the same for neighbours that belong together."""
    sections: Mapping[int, Sequence[str]] = field(default_factory=dict)
    """Lines above the rows with these numbers, on a terminal only."""
    gap: int = 2
    """Spaces between columns on a terminal."""

    def text(self) -> str:
        """Format for a terminal: first column left-aligned, the others right-aligned."""
        widths = self._widths()
        lines = [self.title] if self.title else []
        if self.groups:
            lines.append("  " + self._group_line(widths))
        lines.append("  " + self._line(self.head, widths))
        for number in range(len(self.rows) + 1):
            lines += self.sections.get(number, ())
            lines += ["  " + self._line(row, widths) for row in self.rows[number : number + 1]]
        return "\n".join(lines)

    def markdown(self) -> str:
        """Format as Markdown, with the title as a paragraph above the table."""
        head = self.head
        if self.groups:
            pairs = zip(self.groups, self.head, strict=True)
            head = [f"{group}: {title}" if group else title for group, title in pairs]
        lines = ["| " + " | ".join(map(escaped, cells)) + " |" for cells in (head, *self.rows)]
        lines.insert(1, "|---" + "|--:" * (len(head) - 1) + "|")
        return "\n".join([*([escaped(self.title), ""] if self.title else []), *lines])

    def _widths(self) -> list[int]:
        lines = (self.head, *self.rows)
        widths = [max(len(cells[k]) for cells in lines) for k in range(len(self.head))]
        for name, columns in self._spans():
            widths[columns[0]] += max(0, len(name) - self._span(columns, widths))
        return widths

    def _spans(self) -> list[tuple[str, list[int]]]:
        """Return each group of columns with its name."""
        numbers = range(len(self.groups))
        return [(name, list(part)) for name, part in groupby(numbers, self.groups.__getitem__)]

    def _span(self, columns: Sequence[int], widths: Sequence[int]) -> int:
        return sum(widths[k] for k in columns) + self.gap * (len(columns) - 1)

    def _group_line(self, widths: Sequence[int]) -> str:
        names = [
            name.center(self._span(columns, widths), "-" if name else " ")
            for name, columns in self._spans()
        ]
        return (" " * self.gap).join(names)

    def _line(self, cells: Sequence[str], widths: Sequence[int]) -> str:
        aligned = [cells[0].ljust(widths[0]), *map(str.rjust, cells[1:], widths[1:])]
        return (" " * self.gap).join(aligned).rstrip()


@dataclass(frozen=True)
class Notes:
    """Remarks, each a paragraph on a terminal and an item of a list in Markdown."""

    notes: Sequence[str]

    def text(self, width: int) -> str:
        """Format for a terminal."""
        return "\n".join(textwrap.fill(note, width, subsequent_indent="  ") for note in self.notes)

    def markdown(self) -> str:
        """Format as Markdown."""
        return "\n".join(f"- {escaped(note)}" for note in self.notes)


@dataclass(frozen=True)
class Heading:
    """A heading of a document, which a terminal does not show."""

    words: str
    level: int = 3

    def markdown(self) -> str:
        """Format as Markdown."""
        return f"{'#' * self.level} {self.words}"


Part = Table | Notes | Heading | str
"""A part of a report; words are printed as they are, Markdown included."""


def text(parts: Iterable[Part], width: int = WIDTH) -> str:
    """Format a report for a terminal, with notes of this width."""
    formatted = []
    for part in parts:
        if isinstance(part, Notes):
            formatted.append(part.text(width))
        elif not isinstance(part, Heading):
            formatted.append(part if isinstance(part, str) else part.text())
    return "\n\n".join(formatted)


def markdown(parts: Iterable[Part]) -> str:
    """Format a report as a document."""
    formatted = (part if isinstance(part, str) else part.markdown() for part in parts)
    return "\n\n".join(formatted) + "\n"
