"""Reading of regular files of limited size, and atomic writing.

A written file is complete and replaced at once, or it is unchanged.
"""

import csv
import io
import os
import re
import secrets
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, ParamSpec, TypeVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")
R = TypeVar("R")

# Longest part of a file's name that comes from a text.
_LONGEST_NAME = 100


def opened(path: Path) -> BinaryIO:
    """Open a regular file for reading.

    Raises
    ------
    ValueError
        If it is a device, a named pipe or another special file; nothing is read from it.
    OSError
        If it cannot be opened.
    """
    file = open(path, "rb", opener=_without_waiting)
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise ValueError("not a regular file")
    return file


def _without_waiting(path: str, flags: int) -> int:
    # Opening a named pipe would wait for a writer; Windows has none.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_bytes(path: Path, most: int) -> bytes:
    """Read a regular file of at most ``most`` bytes.

    Raises
    ------
    ValueError
        As in `opened`, and if it is larger.
    OSError
        If it cannot be read.
    """
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise ValueError(f"{size} bytes: at most {most} are possible")
        return file.read(size)


def read_text(path: Path, most: int) -> str:
    """Read a text in UTF-8; errors as of `read_bytes`, and ValueError for other contents."""
    data = read_bytes(path, most)
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise ValueError(f"not a text file: {error}") from None


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
    part, target = _part(Path(path))
    try:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _part(path: Path) -> tuple[Path, Path]:
    """Create a temporary file; return its path, and that of the file which it can replace."""
    # The target of a symbolic link is replaced, not the link.
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise OSError(f"{path}: not a regular file")
    part = target.with_name(f".{secrets.token_hex(8)}.part{target.suffix}")
    # Like any new file: permissions as of the process's mask.
    part.open("xb").close()
    return part, target


def prepare_file(path: Path) -> None:
    """Create the folder of a file, and check that the file can be written, before it is computed.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part, _ = _part(path)
    part.unlink()


def prepare_folder(folder: Path) -> None:
    """Create a folder, and check that files can be written into it; OSError if they cannot."""
    prepare_file(folder / secrets.token_hex(8))


def write_all(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together, each atomically; after an OSError none is replaced.

    Only if the last step fails, the renaming of complete files, some may be replaced.
    """
    with ExitStack() as stack:
        for path, data in contents.items():
            stack.enter_context(replaced(path)).write_bytes(data)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically; OSError as of `replaced`, and if the disk is full."""
    write_all({path: data})


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 atomically; errors as of `write_bytes`."""
    write_bytes(path, text.encode())


def write_csv(path: Path, rows: Iterable[Iterable[Any]]) -> None:
    """Write rows of a CSV table atomically; errors as of `write_bytes`."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    write_text(path, text.getvalue())


def own_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw figures in Matplotlib's default style, whatever the user's settings."""

    @wraps(draw)
    def drawn(*arguments: P.args, **keywords: P.kwargs) -> R:
        from matplotlib import style

        with style.context("default"):
            return draw(*arguments, **keywords)

    return drawn


def write_figure(path: Path, figure: "Figure", dpi: int) -> None:
    """Write a figure as PNG atomically; errors as of `write_bytes`."""
    write_bytes(path, png(figure, dpi))


def png(figure: "Figure", dpi: int) -> bytes:
    """Draw a figure as the contents of a PNG file."""
    data = io.BytesIO()
    figure.savefig(data, dpi=dpi, format="png")
    return data.getvalue()


def plain_name(text: str) -> str:
    """Make a part of a file's name from any text: other characters than A-Za-z0-9_.- become _."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", text[:_LONGEST_NAME])
