"""What the whole daemon takes of a processor and of memory in a simulated flight in real time.

Every process of the daemon counts (control loop, detectors and what forks them, the black box's writer);
the simulated world, a process of its own with children of its own, does not.  Memory is the sum of the
proportional set sizes (PSS), the processor's share is time spent per second of flight.

python tools/measure_daemon.py [--nodes A1,A2,...] [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PERIOD_S = 0.5
WARM_UP_S = 4.0
"""Imports and the start of the processes are no flight."""


@dataclass(frozen=True)
class Use:
    """`cores` on average; memory in MB, at its highest and process by process at that time."""

    seconds: float
    cores: float
    pss_mb: float
    processes: dict[str, float]
    mission: str
    frames_dropped: int
    setpoint_interval_ms: dict[str, float]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--nodes", default="A1,A2,A3")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        use = measure(Path(folder), options.nodes.split(","))
    if options.json:
        print(json.dumps(asdict(use), indent=1))
        return
    print(f"{use.cores:.2f} cores and {use.pss_mb:.0f} MB over {use.seconds:.0f} s ({use.mission})")
    for name, mb in use.processes.items():
        print(f"  {mb:6.1f} MB  {name}")


def measure(folder: Path, nodes: list[str]) -> Use:
    """Fly these nodes at 640x360 and 30 frames a second, with the black box and the ground link."""
    settings = [f"mission.nodes={json.dumps(nodes)}", "ground.listen=127.0.0.1", "ground.status_port=0"]
    settings += ["ground.command_port=0"]
    options = [word for setting in settings for word in ("--set", setting)]
    command = [
        sys.executable,
        "-m",
        "flightd",
        "sim",
        "--speed",
        "1",
        "--json",
        "--out",
        str(folder),
        *options,
    ]
    with (folder / "out").open("w+") as out:
        process = subprocess.Popen(command, cwd=ROOT, stdout=out)  # noqa: S603
        time.sleep(WARM_UP_S)
        began_s, before_s = time.monotonic(), processor_s(daemon_of(process.pid))
        highest: dict[int, float] = {}
        ended_s, spent_s = began_s, 0.0
        while process.poll() is None:
            pids = daemon_of(process.pid)
            if len(pids) > 2:  # until its children end
                ended_s, spent_s = time.monotonic(), processor_s(pids) - before_s
                sizes = {pid: pss_mb(pid) for pid in pids}
                names = {pid: _name(pid) for pid in pids}
                if sum(sizes.values()) > sum(highest.values()):
                    highest, told = sizes, names
            time.sleep(PERIOD_S)
        out.seek(0)
        summary = json.load(out)
    return Use(
        seconds=round(ended_s - began_s, 1),
        cores=round(spent_s / (ended_s - began_s), 3),
        pss_mb=round(sum(highest.values()), 1),
        processes={f"{told[pid]} ({pid})": round(mb, 1) for pid, mb in highest.items()},
        mission=summary["mission"],
        frames_dropped=summary["frames_dropped"],
        setpoint_interval_ms=summary["setpoint_interval_ms"],
    )


def daemon_of(root: int) -> list[int]:
    """The process and all that descends from it, without the world's."""
    return family_of(root, lambda pid: "spawn_main" not in _command(pid))


def family_of(root: int, belongs: Callable[[int], bool] = lambda _pid: True) -> list[int]:
    """The process and its descendants, as far as they and those between belong."""
    parents = {
        int(path.name): _parent(int(path.name)) for path in Path("/proc").iterdir() if path.name.isdigit()
    }
    found, young = [root], [root]
    while young:
        young = [pid for pid, parent in parents.items() if parent in young and belongs(pid)]
        found += young
    return found


def processor_s(pids: list[int]) -> float:
    """Time spent by these, and by children of theirs that have ended."""
    ticks = 0
    for pid in pids:
        ticks += sum(map(int, _stat(pid)[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def pss_mb(pid: int) -> float:
    """Proportional set size; 0 for a process that has ended."""
    for line in _read(pid, "smaps_rollup").splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1000
    return 0.0


def _name(pid: int) -> str:
    command = _command(pid)
    for word, name in (
        ("recorder.writer", "black box"),
        ("forkserver", "detector, or what forks it"),
        ("resource_tracker", "resource tracker"),
    ):
        if word in command:
            return name
    return "control loop"


def _parent(pid: int) -> int:
    stat = _stat(pid)
    return int(stat[1]) if stat[1:] else 0


def _stat(pid: int) -> list[str]:
    return _read(pid, "stat").rpartition(")")[2].split()


def _command(pid: int) -> str:
    return _read(pid, "cmdline").replace("\0", " ")


def _read(pid: int, name: str) -> str:
    try:
        return Path(f"/proc/{pid}/{name}").read_text()
    except OSError:
        return ""


if __name__ == "__main__":
    main()
