"""Tables for a terminal or a document."""

from collections.abc import Sequence
from dataclasses import dataclass

EMPTY = "-"
_GAP = 2


@dataclass(frozen=True)
class Table:
    """Cells in rows and columns; the first column names the rows."""

    title: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]

    def text(self) -> str:
        """Format for a terminal: first column left-aligned, the others right-aligned."""
        lines = [self.head, *self.rows]
        widths = [max(len(line[k]) for line in lines) for k in range(len(self.head))]
        return "\n".join([self.title, *("  " + _line(line, widths) for line in lines)])

    def markdown(self) -> str:
        """Format as Markdown, with the title as a paragraph above the table."""
        ruler = "|---" + "|--:" * (len(self.head) - 1) + "|"
        lines = ["| " + " | ".join(map(escaped, line)) + " |" for line in (self.head, *self.rows)]
        return "\n".join([f"{escaped(self.title)}", "", lines[0], ruler, *lines[1:]])


def escaped(words: str) -> str:
    """Escape characters that Markdown reads as markup."""
    return words.replace("*", r"\*").replace("<", r"\<").replace("|", r"\|")


def significant(value: float | None, digits: int = 3) -> str:
    """Format a number without an exponent."""
    if value is None:
        return EMPTY
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10.0 ** (digits - 1) else f"{rounded:.{digits}g}"


def scientific(value: float | None) -> str:
    """Format a number with two digits and an exponent."""
    return EMPTY if value is None else f"{value:.1e}"


def length(metres: float) -> str:
    """Format a bound of the slide distance."""
    return f"{1e3 * metres:g} mm" if metres >= 1e-5 else f"{1e6 * metres:g} um"


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *others = zip(cells, widths, strict=True)
    gap = " " * _GAP
    return (first[0].ljust(first[1]) + "".join(gap + x.rjust(n) for x, n in others)).rstrip()
