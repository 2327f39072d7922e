"""How much of the machine a test that flies by the clock had for itself, and whether that was enough.

A process beside the test counts what the processors did for others than the test and its children, and how
late a short timer came.  Only others' work excuses a failure: what the test itself burns never does, nor what
gives way to it, for it is niced."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

CALIBRATION_S = 0.5
BEAT_S = 0.02
_SAMPLE_BEATS = 20
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
_STAT = Path("/proc/stat")


@dataclass(frozen=True)
class Needs:
    """What a promise about time assumes of the machine."""

    cores: float = 1.0
    """Processors' worth of time that nobody else takes."""
    pause_s: float = 0.25
    """The longest time for which the machine may stop everything."""

    def missing(self, load: Load) -> str:
        """What was missing, in words; empty when the promise holds on this machine."""
        if load.free_cores < self.cores:
            return (
                f"too busy: others took {load.taken_cores:.1f} of {load.cores} processors, "
                f"{self.cores:g} have to be free"
            )
        if load.pause_s > self.pause_s and load.used_cores < 0.9 * load.cores:
            return f"too busy: the machine paused for {load.pause_s:.2f} s, {self.pause_s:g} s may be"
        return ""


@dataclass(frozen=True)
class Load:
    """What was measured over `seconds`."""

    seconds: float
    cores: int
    used_cores: float
    """By the test and what it started."""
    taken_cores: float
    """By everybody else."""
    pause_s: float
    """How late the latest timer came."""

    @property
    def free_cores(self) -> float:
        return self.cores - self.taken_cores


class Meter:
    """Runs beside the block; `load` stands when it has ended."""

    load: Load

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        command = [sys.executable, str(Path(__file__)), str(os.getpid())]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()  # it measures from now on
            try:
                yield
            finally:
                found, _ = process.communicate("\n")
                self.load = Load(**json.loads(found))


def measured(seconds: float = CALIBRATION_S) -> Load:
    """The load of this moment."""
    meter = Meter()
    with meter.running():
        threading.Event().wait(seconds)
    return meter.load


class Patience:
    """Waits for a quiet machine, over all tests together no longer than `seconds`."""

    def __init__(self, seconds: float) -> None:
        self._left_s = seconds

    def wait_for(self, needs: Needs) -> str:
        """What the machine still lacks when patience ends; empty once it gives what is needed."""
        began_s = time.monotonic()
        while (missing := needs.missing(measured())) and time.monotonic() - began_s < self._left_s:
            pass
        self._left_s -= time.monotonic() - began_s - CALIBRATION_S
        return missing


class _Family:
    """A process and all that descends from it, also after a parent has died."""

    def __init__(self, root: int) -> None:
        self._members = {root}
        self._niced: set[int] = set()
        self._used: dict[int, float] = {}

    def used_s(self) -> tuple[float, float]:
        """Processor time of all its members so far, and of those that are not niced; what was used since the
        last look by one that is gone is missing."""
        parents: dict[int, int] = {}
        times: dict[int, float] = {}
        for folder in Path("/proc").iterdir():
            if folder.name.isdigit():
                with contextlib.suppress(OSError):
                    fields = (folder / "stat").read_text().rpartition(")")[2].split()
                    pid = int(folder.name)
                    parents[pid], times[pid] = int(fields[1]), (int(fields[11]) + int(fields[12])) * _TICK_S
                    if int(fields[16]) > 0:
                        self._niced.add(pid)
        found = True
        while found:
            found = False
            for pid, parent in parents.items():
                if parent in self._members and pid not in self._members:
                    self._members.add(pid)
                    found = True
        self._used |= {pid: times[pid] for pid in self._members & times.keys()}
        return sum(self._used.values()), sum(self._used[pid] for pid in self._used.keys() - self._niced)


def busy_s(stat: str, cores: set[int], *, niced: bool) -> float:
    """Time for which these processors did anything, what is `niced` only if so, or were not given to this
    machine, by what /proc/stat says."""
    busy = 0
    for line in stat.splitlines():
        name, *counts = line.split()
        if name.startswith("cpu") and name[3:].isdigit() and int(name[3:]) in cores:
            user, nice, system, _, _, irq, softirq, steal = map(int, counts[:8])
            busy += user + nice * niced + system + irq + softirq + steal
    return busy * _TICK_S


def _measure(root: int) -> Load:
    """Until the standard input says something."""
    cores = os.sched_getaffinity(0)
    family = _Family(root)
    niced = os.getpriority(os.PRIO_PROCESS, 0) > 0  # what is niced gives way to none that is
    (used_s, urgent_s), began, began_s = family.used_s(), _STAT.read_text(), time.monotonic()
    print(flush=True)
    pause_s, beats = 0.0, 0
    while True:
        due_s = time.monotonic() + BEAT_S
        if select.select([sys.stdin], [], [], BEAT_S)[0]:
            break
        pause_s = max(pause_s, time.monotonic() - due_s)
        beats += 1
        if beats % _SAMPLE_BEATS == 0:
            family.used_s()
    seconds = time.monotonic() - began_s
    all_s, of_it_urgent_s = family.used_s()
    used_s, urgent_s = all_s - used_s, of_it_urgent_s - urgent_s
    taken_s = busy_s(_STAT.read_text(), cores, niced=niced) - busy_s(began, cores, niced=niced)
    taken_s -= used_s if niced else urgent_s
    taken_cores = min(max(taken_s, 0.0) / seconds, len(cores))  # the counters are coarse
    return Load(seconds, len(cores), used_s / seconds, taken_cores, pause_s)


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):  # whoever asked was killed
        print(json.dumps(asdict(_measure(int(sys.argv[1])))), flush=True)
