"""The computer's processors."""

from __future__ import annotations

import os


def usable_cores() -> int:
    """Those on which this process may run: a service may be kept to a few."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
