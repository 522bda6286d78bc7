"""Archives of arrays (``.npz``) from strangers: sizes are checked before anything is unpacked."""

import io
import json
import os
import stat
import warnings
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .files import write_bytes

# Limits on an archive's directory and on a JSON text in it [bytes].
_MOST_ENTRIES, _MOST_TEXT = 256, 2 * 2**20
# No deflated data is smaller than this fraction of the unpacked data.
_DEFLATE_RATIO = 1100
_SUFFIX = ".npy"
# End of the directory: signature, size, and offset of the number of entries.
_END, _END_SIZE, _ENTRIES = b"PK\x05\x06", 22, 10


@dataclass(frozen=True)
class Header:
    """Shape, type and size [bytes] of an array."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    size: int


def write(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays by name to a compressed archive, atomically; raise OSError if that fails."""
    data = io.BytesIO()
    np.savez_compressed(data, **arrays)
    write_bytes(path, data.getvalue())


def read(
    path: Path, text: str, check: Callable[[dict[str, Header], dict[str, Any]], None]
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read an archive of arrays, one of which is the text of a JSON object.

    Parameters
    ----------
    path
        A regular file.
    text
        Name of the text's array.
    check
        Called with the headers of the other arrays by name and with the parsed object, before
        these arrays are read; raises ValueError to refuse them.

    Returns
    -------
    arrays, parsed
        The other arrays by name, and the object.

    Raises
    ------
    ValueError
        If the file is damaged, or is not an archive of arrays without objects.
    OSError
        If it cannot be opened.
    """
    with path.open("rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise ValueError("not a regular file")
        _check_directory(file)
        try:
            with zipfile.ZipFile(file) as archive:
                headers = {
                    entry.filename.removesuffix(_SUFFIX): _header(archive, entry)
                    for entry in archive.infolist()
                }
                if len(headers) < len(archive.infolist()):
                    raise ValueError("two entries have the same name")
                parsed = _parse(archive, text, headers.pop(text, None))
                check(headers, parsed)
                return {name: _array(archive, name) for name in headers}, parsed
        except ValueError:
            raise
        # Damaged archives raise many types of exceptions.
        except Exception as error:
            raise ValueError(f"damaged: {type(error).__name__}: {error}") from None


def check_size(headers: Mapping[str, Header], limit: int) -> None:
    """Check the size of all arrays [bytes]; raise ValueError."""
    total = sum(header.size for header in headers.values())
    if total > limit:
        raise ValueError(f"{total} bytes of arrays: at most {limit} are possible")


def _parse(archive: zipfile.ZipFile, name: str, header: Header | None) -> dict[str, Any]:
    if header is None:
        raise ValueError(f"{name!r} is missing")
    if header.dtype.kind != "U" or header.shape != () or header.size > _MOST_TEXT:
        raise ValueError(f"{name!r} is not a text of at most {_MOST_TEXT} bytes")
    try:
        parsed = json.loads(str(_array(archive, name)))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"its text is not JSON: {error}") from None
    if not isinstance(parsed, dict):
        raise ValueError("its text is not a JSON object")
    return parsed


def _check_directory(file: IO[bytes]) -> None:
    """Check the number of entries, because `zipfile` reads the whole directory at once."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - _END_SIZE, 0))
    end = file.read()
    file.seek(0)
    # NumPy writes no comment, which would follow.
    if len(end) < _END_SIZE or not end.startswith(_END):
        raise ValueError("not an .npz file")
    entries = int.from_bytes(end[_ENTRIES : _ENTRIES + 2], "little")
    length = int.from_bytes(end[_ENTRIES + 2 : _ENTRIES + 6], "little")
    if entries > _MOST_ENTRIES or length > 2**10 * _MOST_ENTRIES:
        raise ValueError(f"{entries} entries: at most {_MOST_ENTRIES} are possible")


def _header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Header:
    """Read the beginning of an entry only."""
    name = entry.filename
    if not name.endswith(_SUFFIX):
        raise ValueError(f"{name!r} is not an array")
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{name!r}: unknown compression")
    if entry.file_size > _DEFLATE_RATIO * (entry.compress_size + 1):
        raise ValueError(f"{name!r}: its size is wrong")
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read_header = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read_header is None:
            raise ValueError(f"{name!r}: unknown version {version}")
        with warnings.catch_warnings():
            # NumPy warns of headers of Python 2.
            warnings.simplefilter("ignore")
            shape, _, dtype = read_header(file)
        begin = file.tell()
    if dtype.hasobject:
        raise ValueError(f"{name!r} holds Python objects")
    size = dtype.itemsize
    for length in shape:
        size *= length
    if min(shape, default=0) < 0 or begin + size != entry.file_size:
        raise ValueError(f"{name!r}: its size is wrong")
    return Header(shape, dtype, size)


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(name + _SUFFIX) as file:
        array: NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
        # The check sum is checked at the end.
        if file.read(1):
            raise ValueError(f"{name!r}: its size is wrong")
        return array
