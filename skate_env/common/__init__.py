"""What every part uses: files and archives, checks of arguments, messages, progress bars."""

from .arguments import (
    array_of,
    between,
    checked,
    count,
    finite,
    items,
    known,
    real,
    seed_of,
    table,
    whole,
)
from .files import (
    opened,
    plain_name,
    prepare_file,
    prepare_folder,
    read_bytes,
    read_text,
    replaced,
    write_bytes,
    write_csv,
    write_figure,
    write_text,
)
from .messages import literal, printable, shown
from .npz import check_names, unique
from .progress import ProgressBar, progress_bar
from .shares import share_text, wilson

__all__ = [
    "ProgressBar",
    "array_of",
    "between",
    "check_names",
    "checked",
    "count",
    "finite",
    "items",
    "known",
    "literal",
    "opened",
    "plain_name",
    "prepare_file",
    "prepare_folder",
    "printable",
    "progress_bar",
    "read_bytes",
    "read_text",
    "real",
    "replaced",
    "seed_of",
    "share_text",
    "shown",
    "table",
    "unique",
    "whole",
    "wilson",
    "write_bytes",
    "write_csv",
    "write_figure",
    "write_text",
]
