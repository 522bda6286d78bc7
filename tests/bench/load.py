"""Load of other processes during a measurement."""

import os
import time
from pathlib import Path

# Fields of the first line of /proc/stat: user, nice, system, irq, softirq, steal.
_BUSY = (1, 2, 3, 6, 7, 8)


class Load:
    """Load since the creation of this object."""

    def __init__(self) -> None:
        self._begun = _now()

    def others(self) -> float | None:
        """Return the mean number of cores busy with other processes; None if unknown."""
        begun, now = self._begun, _now()
        if begun is None or now is None or now[0] == begun[0]:
            return None
        wall, everyone, own = (after - before for before, after in zip(begun, now, strict=True))
        return max(0.0, (everyone - own) / wall)


def _now() -> tuple[float, float, float] | None:
    """Return wall time, busy time of all cores and CPU time of this process [s]."""
    try:
        fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
        ticks = sum(int(fields[i]) for i in _BUSY)
        everyone = ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return None
    mine = os.times()
    return time.perf_counter(), everyone, mine.user + mine.system
