"""Recordings of motions, replays with the paper's figures, films, and players in the browser."""

from .page import PageServer
from .recording import Array, Recording, ResidualPolicy, record
from .replays import TAU8

__all__ = ["TAU8", "Array", "PageServer", "Recording", "ResidualPolicy", "record"]
