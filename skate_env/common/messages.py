"""Texts in messages of errors and in pictures."""

# Characters of an object that a message shows.
_MOST = 200


def shown(given: object) -> str:
    """Return the beginning of an object's representation."""
    try:
        text = repr(given)
    # An int of more than 4300 digits has none, and other objects may raise anything.
    except Exception:
        return "?"
    return text if len(text) <= _MOST else f"{text[:_MOST]}..."


def printable(text: str) -> str:
    """Escape characters that control a terminal or the direction of a text, all but line ends."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


def literal(text: str) -> str:
    """Escape a text, as the name of a scene, so that Matplotlib finds no formulas in it."""
    return text.replace("$", r"\$")
