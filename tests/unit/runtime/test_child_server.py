"""What children are forked from is there before the first one is wanted, and ends with its parent."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path

from tests.rigs.event_loops import real
from tests.rigs.waiting import until

STARTS_IT = """
import os
from flightd.runtime.child_process import start_child_server
start_child_server()
for pid in open(f"/proc/self/task/{os.getpid()}/children").read().split():
    if "forkserver" in open(f"/proc/{pid}/cmdline").read():
        print(pid)
"""


START_S = 60.0


def test_the_server_of_children_starts_when_told_and_ends_with_its_parent(tmp_path: Path) -> None:
    told = tmp_path / "server"
    with told.open("w") as out:  # a pipe would be held open by the server
        subprocess.run([sys.executable, "-c", STARTS_IT], stdout=out, check=True, timeout=START_S)
    (server,) = told.read_text().split()
    real(asyncio.wait_for(until(lambda: not Path("/proc", server, "exe").exists()), 20.0))
