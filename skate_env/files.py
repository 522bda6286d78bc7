"""Atomic writing: a file is complete and replaced at once, or it is unchanged."""

import csv
import io
import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Give the path of a temporary file in the same folder, which replaces ``path`` at the end.

    It has the same suffix. After an exception it is removed, and ``path`` is unchanged; after a
    kill of the process it stays, as ``.<random>.part<suffix>``.

    Raises
    ------
    OSError
        If the temporary file cannot be created, flushed to the disk, or renamed, or if ``path`` is
        not a regular file.
    """
    path = Path(path)
    # The target of a symbolic link is replaced, not the link.
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise OSError(f"{path}: not a regular file")
    part = target.with_name(f".{secrets.token_hex(8)}.part{target.suffix}")
    # Like any new file: permissions as of the process's mask.
    part.open("xb").close()
    try:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically; OSError as of `replaced`, and if the disk is full."""
    with replaced(path) as part:
        part.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 atomically; errors as of `write_bytes`."""
    write_bytes(path, text.encode())


def write_csv(path: Path, rows: Iterable[Iterable[Any]]) -> None:
    """Write rows of a CSV table atomically; errors as of `write_bytes`."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    write_text(path, text.getvalue())


def write_figure(path: Path, figure: "Figure", dpi: int) -> None:
    """Write a figure as PNG atomically; errors as of `write_bytes`."""
    data = io.BytesIO()
    figure.savefig(data, dpi=dpi, format="png")
    write_bytes(path, data.getvalue())
