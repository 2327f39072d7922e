"""How long a process has been there, its own start included."""

from __future__ import annotations

import subprocess
import sys
import time

from flightd.runtime.process_age import process_age_s

_TICK_S = 0.02
"""More than the kernel's clock ticks are apart."""


def test_the_age_includes_what_came_before_the_first_line() -> None:
    code = (
        "import time; began = time.monotonic(); from flightd.runtime.process_age import process_age_s;"
        "print(process_age_s(), time.monotonic() - began)"
    )
    before = time.monotonic()
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    age_s, since_first_line_s = map(float, told.split())
    assert since_first_line_s < age_s < time.monotonic() - before + _TICK_S


def test_it_goes_on_by_the_clock() -> None:
    first_s, start = process_age_s(), time.monotonic()
    later_s = process_age_s()
    assert first_s is not None
    assert later_s is not None
    assert 0.0 <= later_s - first_s <= time.monotonic() - start + 0.01
