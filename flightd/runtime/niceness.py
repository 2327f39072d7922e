"""Processes that leave the processor to the flight."""

from __future__ import annotations

import contextlib
import os


def give_way(by: int, pid: int = 0) -> None:
    """Have the process `pid` (0: this one) come after those whose niceness is lower by up to `by`.

    Where that is forbidden, as a service's own limits may do, it runs on as it is: its work matters more."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, pid, os.getpriority(os.PRIO_PROCESS, pid) + by)
