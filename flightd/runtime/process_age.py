"""How long this process has been there."""

from __future__ import annotations

import os
import time
from pathlib import Path

_STARTED_FIELD = 19
"""Of `/proc/PID/stat` behind the program's name: when it was started, in clock ticks since boot (proc(5))."""


def process_age_s() -> float | None:
    """Since the kernel started it, to a hundredth of a second: before the first import.  None where the
    system does not say."""
    try:
        told = Path("/proc/self/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    started_ticks = int(told.rpartition(")")[2].split()[_STARTED_FIELD])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - started_ticks / os.sysconf("SC_CLK_TCK")
