"""Archives of arrays (``.npz``) from strangers: sizes are checked before anything is unpacked."""

import io
import json
import os
import struct
import zipfile
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .files import opened, write_bytes

# Type of an array, and its shape, in which a text is any length, the same in all arrays.
Layout = tuple[Any, tuple[int | str, ...]]

# Limits on the number of entries, and on an array's header and a JSON text [bytes].
_MOST_ENTRIES, _MOST_HEADER, _MOST_TEXT = 256, 512, 2 * 2**20
# No deflated data is smaller than this fraction of the unpacked data.
_DEFLATE_RATIO = 1100
_SUFFIX = ".npy"
# The end of an archive: a record that `zipfile` believes if its locator follows, which archives
# larger than 2 GB have, and the usual record. Each has a signature; both have the number of entries
# and the size of the directory, the locator has the place of the first.
_RECORDS = struct.Struct("<4s28xQQ8x 4s4xQ4x 4s6xHI6x")
_LARGE_END, _LOCATOR, _END = b"PK\x06\x06", b"PK\x06\x07", b"PK\x05\x06"


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
        A regular file, else ValueError.
    text
        Name of the text's array.
    check
        Called with the headers of the other arrays by name and with the parsed object, before
        these arrays are read; raises TypeError or ValueError to refuse them.

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
    with opened(path) as file:
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
                try:
                    check(headers, parsed)
                except TypeError as error:
                    raise ValueError(str(error)) from None
                return {name: _array(archive, name) for name in headers}, parsed
        except ValueError:
            raise
        # Damaged archives raise many types of exceptions.
        except Exception as error:
            raise ValueError(f"damaged: {type(error).__name__}: {error}") from None


def check_names(what: str, given: Collection[str], names: Collection[str]) -> None:
    """Check that exactly these names are given; raise ValueError."""
    for name in names:
        if name not in given:
            raise ValueError(f"{what} {name!r} is missing")
    for name in given:
        if name not in names:
            raise ValueError(f"unknown {what} {name!r}")


def check_arrays(
    headers: Mapping[str, Header], layouts: Mapping[str, Layout], most: int
) -> dict[str, int]:
    """Check names, types, shapes and total size of arrays, before they are read.

    Returns the lengths that the layouts name.

    Raises
    ------
    ValueError
        If they do not have these layouts, or more than ``most`` bytes.
    """
    check_names("array", headers, layouts)
    lengths: dict[int | str, int] = {}
    for name, (dtype, shape) in layouts.items():
        header = headers[name]
        # The first array with a length's name sets it.
        fits = len(shape) == len(header.shape) and all(
            size == lengths.setdefault(key, size if isinstance(key, str) else key)
            for key, size in zip(shape, header.shape, strict=True)
        )
        if header.dtype != dtype or not fits:
            wanted = " x ".join(map(str, shape)) or "()"
            found = f"{header.dtype}, shape {header.shape}"
            raise ValueError(f"{name}: {found}: must be {np.dtype(dtype)}, shape {wanted}")
    total = sum(header.size for header in headers.values())
    if total > most:
        raise ValueError(f"{total} bytes of arrays: at most {most} are possible")
    return {key: size for key, size in lengths.items() if isinstance(key, str)}


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a JSON object; raise ValueError if a name occurs twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("an object has a name twice")
    return found


def _parse(archive: zipfile.ZipFile, name: str, header: Header | None) -> dict[str, Any]:
    if header is None:
        raise ValueError(f"{name!r} is missing")
    if header.dtype.kind != "U" or header.shape != () or header.size > _MOST_TEXT:
        raise ValueError(f"{name!r} is not a text of at most {_MOST_TEXT} bytes")
    try:
        parsed = json.loads(str(_array(archive, name)), object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"its text is not JSON: {error}") from None
    if not isinstance(parsed, dict):
        raise ValueError("its text is not a JSON object")
    return parsed


def _check_directory(file: IO[bytes]) -> None:
    """Check the number of entries, because `zipfile` reads the whole directory at once."""
    place = file.seek(0, os.SEEK_END) - _RECORDS.size
    file.seek(max(place, 0))
    last = file.read().rjust(_RECORDS.size, b"\0")
    file.seek(0)
    large, *numbers, locator, named, end, entries, length = _RECORDS.unpack(last)
    # NumPy writes no comment, which would follow.
    if end != _END:
        raise ValueError("not an .npz file")
    if locator == _LOCATOR and (large, named, *numbers) != (_LARGE_END, place, entries, length):
        raise ValueError("its directory has two sizes")
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
        # A header may claim to be of any length.
        begin = io.BytesIO(file.read(_MOST_HEADER))
        # NumPy writes later versions for names that no array here has.
        if (version := np.lib.format.read_magic(begin)) != (1, 0):
            raise ValueError(f"{name!r}: unknown version {version}")
        shape, _, dtype = np.lib.format.read_array_header_1_0(begin)
    if dtype.hasobject:
        raise ValueError(f"{name!r} holds Python objects")
    size = dtype.itemsize
    for length in shape:
        size *= length
    if min(shape, default=0) < 0 or begin.tell() + size != entry.file_size:
        raise ValueError(f"{name!r}: its size is wrong")
    return Header(shape, dtype, size)


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(name + _SUFFIX) as file:
        array: NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
        # The check sum is checked at the end.
        if file.read(1):
            raise ValueError(f"{name!r}: its size is wrong")
        return array
