"""The computer: clock, disk, processor, memory.  Reading (Linux) is apart from judging."""

from __future__ import annotations

import ctypes
import os
import shutil
import tempfile
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from flightd.config.recorder import RecorderConfig
from flightd.core.processors import usable_cores
from flightd.core.utc_time import utc_text
from flightd.doctor.check import Check, error, ok, unseen, warning
from flightd.doctor.nearest_folder import nearest_there

_TICK_RESOLUTION_S = 0.001
_OLDEST_YEAR = 2025
_DAY_NS = 86_400_000_000_000
_UNSYNCHRONISED = 5
"""TIME_ERROR, what adjtimex(2) returns while nothing disciplines the clock."""
_TIMEX_BYTES = 512
"""More than any `struct timex`; all zero it asks and changes nothing."""
_HOT_C = 80.0
_BUSY = 0.7
_MEMORY_MIN_BYTES = 300_000_000
_ROOM_BYTES = 2_000_000_000
"""Some half an hour of flights with pictures."""


@dataclass(frozen=True, slots=True)
class Load:
    """The processors as they are: how many we may use, the load average of a minute, temperature in
    degrees Celsius (None: no sensor), the frequency governor ("": none), free memory."""

    cores: int
    load: float
    hottest_c: float | None
    governor: str
    memory_bytes: int


def check_clock() -> Check:
    """The steps of the monotonic clock, the date, and whether something keeps the date right."""
    return judge_clock(
        time.get_clock_info("monotonic").resolution, datetime.now(UTC).year, synchronised=_is_synchronised()
    )


def judge_clock(resolution_s: float, year: int, *, synchronised: bool | None) -> Check:
    """The flight itself needs only fine monotonic steps; logs and signed links need the date.  `synchronised`
    is None where the system does not say."""
    if resolution_s > _TICK_RESOLUTION_S:
        text = f"the monotonic clock moves in steps of {resolution_s * 1000:g} ms"
        return error("clock", text, "use a kernel with high-resolution timers")
    if year < _OLDEST_YEAR:
        return warning("clock", f"the date says {year}", "set the clock: a signed link and logs need it")
    if synchronised is None:
        text = "whether anything keeps the date right: the clock may not be asked here"
        return unseen("clock", text, "ask timedatectl: logs and signed links need it")
    if not synchronised:
        text = "nothing keeps the date right"
        return warning("clock", text, "run systemd-timesyncd or chrony: logs and signed links need it")
    return ok("clock", "monotonic in fine steps, date synchronised")


def check_count_clock(newest_ns: int) -> list[Check]:
    """Whether the date lies before the newest look of the inventory (UTC; 0: none).  Of the looks at a place
    the one with the newest date counts, so that those of this flight are dated after it; beyond a day it is
    no clock that lost an hour."""
    return judge_count_clock(time.time_ns(), newest_ns)


def judge_count_clock(now_ns: int, newest_ns: int) -> list[Check]:
    if now_ns >= newest_ns:
        return []
    now, newest = utc_text(now_ns), utc_text(newest_ns)
    text = f"the inventory has a look of {newest}, and this computer's clock says {now}"
    if newest_ns - now_ns < _DAY_NS:  # a computer that was without power, and has no clock of its own
        return [
            warning("inventory clock", text, "set the clock: what is counted now is dated after that look")
        ]
    remedy = "set the clock, or begin another inventory.folder: no count can be dated by it"
    return [error("inventory clock", text, remedy)]


def _is_synchronised() -> bool | None:
    """None where the clock may not even be asked, as under the service's limits."""
    state = int(ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES)))
    return None if state < 0 else state != _UNSYNCHRONISED


def check_disk(recorder: RecorderConfig) -> Check:
    """The black box's folder: may it be written, is there room?"""
    folder = recorder.folder
    if folder is None:
        return warning("disk", "flights are not recorded", "set recorder.folder")
    try:
        there = nearest_there(folder)
        with tempfile.TemporaryFile(dir=there):
            pass
        free_bytes = shutil.disk_usage(there).free
    except OSError as err:
        text = f"recorder.folder {folder} cannot be written: {err.strerror}"
        return error("disk", text, "give its owner the right to write, or choose another folder")
    return judge_disk(folder, free_bytes, round(recorder.reserve_gb * 1e9))


def judge_disk(folder: Path, free_bytes: int, reserve_bytes: int) -> Check:
    """Less than what must stay free stops the recorder; little more than that stops it soon."""
    text = f"{folder}: {free_bytes / 1e9:.1f} GB free, {reserve_bytes / 1e9:g} GB of them stay free"
    if free_bytes < reserve_bytes:
        return error("disk", text, "delete something, or lower recorder.reserve_gb")
    if free_bytes < reserve_bytes + _ROOM_BYTES:
        return warning("disk", text, "make room: half an hour of flight takes up to 2 GB")
    return ok("disk", text)


def check_processor(workers: int) -> list[Check]:
    """Cores, load, heat and memory against what the daemon starts."""
    return judge_processor(_read_load(), workers)


def judge_processor(found: Load, workers: int) -> list[Check]:
    """One line for each complaint, or one that says all is well."""
    text = f"{found.cores} cores, load {found.load:.1f}, {found.memory_bytes / 1e9:.1f} GB of memory free"
    checks = []
    if found.cores < workers + 1:
        remedy = f"set vision.workers = {max(found.cores - 1, 1)}, or use a larger computer"
        checks.append(warning("cpu", f"{text}: {workers} detectors and the control loop share them", remedy))
    if found.load > _BUSY * found.cores:
        checks.append(warning("cpu", f"{text}: busy before the flight", "stop what else runs (see top)"))
    if found.hottest_c is not None and found.hottest_c > _HOT_C:
        checks.append(warning("cpu", f"{found.hottest_c:.0f} degrees Celsius", "cool it: it will slow down"))
    if found.governor == "powersave":
        remedy = "write performance or schedutil to cpufreq/scaling_governor"
        checks.append(warning("cpu", "the frequency governor is powersave", remedy))
    if found.memory_bytes < _MEMORY_MIN_BYTES:
        text = f"{found.memory_bytes / 1e6:.0f} MB of memory free"
        checks.append(error("memory", text, "stop what else runs; 300 MB are needed"))
    return checks or [ok("cpu", text)]


def _read_load() -> Load:
    zones = Path("/sys/class/thermal").glob("thermal_zone*/temp")
    temperatures = [int(text) / 1000 for path in zones if (text := _text(path)).lstrip("-").isdigit()]
    memory = dict(line.split(":", 1) for line in _text(Path("/proc/meminfo")).splitlines())
    return Load(
        cores=usable_cores(),
        load=os.getloadavg()[0],
        hottest_c=max(temperatures, default=None),
        governor=_text(Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")),
        memory_bytes=int(memory["MemAvailable"].split()[0]) * 1024,
    )


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii").strip()
    except OSError:
        return ""
