"""What becomes of the daemon's children when it is killed, as by the service manager's watchdog."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from flightd.adapters.recorder.mcap_repair import is_whole
from flightd.runtime.child_process import LAST_S
from tests.rigs.event_loops import real
from tests.rigs.processes import of_session
from tests.rigs.waiting import until

ROOT = Path(__file__).parents[3]
KINDS = 8
"""Fork server and resource tracker, writer, detector, reader, camera, LED, and one that hangs."""


def test_all_children_of_a_killed_daemon_end_by_themselves(tmp_path: Path) -> None:
    (tmp_path / "pictures").mkdir()
    (tmp_path / "led").mkdir()
    (tmp_path / "led" / "max_brightness").write_text("255")
    (tmp_path / "led" / "brightness").write_text("0")
    command = [sys.executable, "-m", "tests.rigs.orphans", str(tmp_path)]
    here = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, env=here, start_new_session=True
    ) as daemon:
        try:
            assert daemon.stdout is not None
            lines = iter(daemon.stdout.readline, b"")
            assert any(line.startswith(b"all are there") for line in lines)
            assert len(of_session(daemon.pid) - {daemon.pid}) == KINDS
        finally:
            daemon.kill()
    real(until(lambda: not of_session(daemon.pid), LAST_S + 20.0))
    assert is_whole(tmp_path / "flight.mcap"), "its writer finished it"
    assert (tmp_path / "led" / "brightness").read_text() == "0"
