"""Reports of studies: tables and notes as text and Markdown; CSV, JSON and pictures in a folder."""

from .document import Heading, Notes, Part, Table, markdown, text
from .formats import EMPTY, escaped, scientific, significant
from .machine import described, installed_version, machine, stamp
from .output import as_csv, as_json, write

__all__ = [
    "EMPTY",
    "Heading",
    "Notes",
    "Part",
    "Table",
    "as_csv",
    "as_json",
    "described",
    "escaped",
    "installed_version",
    "machine",
    "markdown",
    "scientific",
    "significant",
    "stamp",
    "text",
    "write",
]
