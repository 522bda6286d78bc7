"""Files of a report."""

import csv
import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ...common import files


def as_csv(records: Iterable[Mapping[str, Any]], units: Mapping[str, str] | None = None) -> str:
    """Format records with equal keys as a CSV table; the heading is ``name [unit]``."""
    rows, known = list(records), units or {}
    names = rows[0] if rows else ()
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(f"{name} [{known[name]}]" if name in known else name for name in names)
    writer.writerows(row.values() for row in rows)
    return text.getvalue()


def as_json(values: Any) -> str:
    """Format values as JSON, which has no NaN."""
    return json.dumps(values, indent=1, allow_nan=False) + "\n"


def write(folder: Path, texts: Mapping[str, str], figures: Mapping[str, Figure]) -> None:
    """Write texts, and figures as PNG at their own resolution, under these names into a folder."""
    contents = {folder / name: text.encode() for name, text in texts.items()}
    contents |= {
        folder / name: files.png(figure, round(figure.dpi)) for name, figure in figures.items()
    }
    files.write_all(contents)
