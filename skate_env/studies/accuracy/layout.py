"""Tables, laid out for a terminal or for a document."""

from collections.abc import Sequence
from dataclasses import dataclass

EMPTY = "-"
_GAP = 2


@dataclass(frozen=True)
class Table:
    """Words in rows and columns; the first column is what a row is about."""

    title: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]

    def text(self) -> str:
        """Lay out for a terminal: the first column to the left, the others to the right."""
        lines = [self.head, *self.rows]
        widths = [max(len(line[k]) for line in lines) for k in range(len(self.head))]
        return "\n".join([self.title, *("  " + _line(line, widths) for line in lines)])

    def markdown(self) -> str:
        """Write for a document, the title as a paragraph before the table."""
        ruler = "|---" + "|--:" * (len(self.head) - 1) + "|"
        lines = ["| " + " | ".join(map(escaped, line)) + " |" for line in (self.head, *self.rows)]
        return "\n".join([f"{escaped(self.title)}", "", lines[0], ruler, *lines[1:]])


def escaped(words: str) -> str:
    """Keep what a document would read as markup."""
    return words.replace("*", r"\*").replace("<", r"\<").replace("|", r"\|")


def significant(value: float | None, digits: int = 3) -> str:
    """Write a number without an exponent."""
    if value is None:
        return EMPTY
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10.0 ** (digits - 1) else f"{rounded:.{digits}g}"


def scientific(value: float | None) -> str:
    """Write a small number with two digits."""
    return EMPTY if value is None else f"{value:.1e}"


def length(metres: float) -> str:
    """Write a bound of the slide distance."""
    return f"{1e3 * metres:g} mm" if metres >= 1e-5 else f"{1e6 * metres:g} um"


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *others = zip(cells, widths, strict=True)
    gap = " " * _GAP
    return (first[0].ljust(first[1]) + "".join(gap + x.rjust(n) for x, n in others)).rstrip()
