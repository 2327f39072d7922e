"""An orderly end that takes longer than a person likes is cut short by his second signal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.rigs.event_loops import real
from tests.rigs.processes import of_session
from tests.rigs.waiting import until

ROOT = Path(__file__).parents[3]
AT_ONCE_S = 3.0
"""Less than a child lasts without its parent."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("how", ["waits", "hangs"])
def test_the_second_signal_ends_the_process_with_all_its_children(how: str, number: signal.Signals) -> None:
    command = [sys.executable, "-m", "tests.rigs.endings", how]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)}, start_new_session=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            assert process.stdout.readline() == "all are there\n"
            assert len(of_session(process.pid)) > 4, "resource tracker, fork server, a child of it, two more"
            process.send_signal(number)
            said = f"flightd: {number.name}: it ends in order; a second one ends it at once\n"
            assert process.stderr.readline() == said
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(0.3)
            process.send_signal(number)
            assert process.wait(AT_ONCE_S) == 128 + number
            real(until(lambda: not of_session(process.pid), AT_ONCE_S))
            assert process.stderr.read() == f"flightd: ended at once by {number.name}\n"
        finally:
            for pid in of_session(process.pid):
                os.kill(pid, signal.SIGKILL)
