"""Recordings of motions, replays with the paper's figures, films, and players in the browser."""

from .page import PageServer
from .receipt import Verification
from .recorder import ResidualPolicy, record
from .recording import Array, Recording
from .replays import TAU8

__all__ = ["TAU8", "Array", "PageServer", "Recording", "ResidualPolicy", "Verification", "record"]
