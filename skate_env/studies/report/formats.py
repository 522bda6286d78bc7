"""Numbers and words in cells."""

EMPTY = "-"
"""A cell without a value."""


def significant(value: float | None, digits: int = 3) -> str:
    """Format a number without an exponent."""
    if value is None:
        return EMPTY
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10.0 ** (digits - 1) else f"{rounded:.{digits}g}"


def scientific(value: float | None) -> str:
    """Format a number with two digits and an exponent."""
    return EMPTY if value is None else f"{value:.1e}"


def escaped(words: str) -> str:
    """Escape characters that Markdown reads as markup."""
    return words.replace("*", r"\*").replace("<", r"\<").replace("|", r"\|")
