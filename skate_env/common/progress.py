"""Progress bars."""

import sys
from typing import Any, TypeAlias

from tqdm import tqdm

ProgressBar: TypeAlias = "tqdm[Any]"


def progress_bar(total: int, what: str, unit: str, initial: int = 0) -> ProgressBar:
    """Make a progress bar on stderr; it prints nothing where that is closed or no terminal."""
    return tqdm(
        total=total,
        initial=initial,
        desc=what,
        unit=unit,
        unit_scale=total >= 100_000,
        file=sys.stderr,
        # None: unless it is a terminal.
        disable=True if sys.stderr is None else None,
    )
