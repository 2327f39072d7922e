"""What gives way to the flight also works where the service's limits forbid that."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from flightd.replay.log import read_log
from tests.rigs import denied_calls

ROOT = Path(__file__).parents[3]
_RECORDS = """
import sys
from pathlib import Path
from flightd.adapters.recorder.recorder import McapRecorder
from tests.rigs.denied_calls import deny
deny("setpriority")
with McapRecorder(Path(sys.argv[1])) as recorder:
    recorder.record("/some", 1, {"value": 1})
print(recorder.written, recorder.restarts)
"""
_GIVES_WAY = """
import os, sys
from flightd.app.counting.code_readers import read_frame
from flightd.app.counting import code_readers
from flightd.ground import reading_process
from tests.rigs.denied_calls import deny
if sys.argv[1] == "denied":
    deny("setpriority")
before = os.getpriority(os.PRIO_PROCESS, 0)
assert code_readers._shelf_reader() is read_frame
assert reading_process._begin() is reading_process._done
print(os.getpriority(os.PRIO_PROCESS, 0) - before)
"""
needs_filter = pytest.mark.skipif(not denied_calls.is_known(), reason="no filter for this processor")


def run(code: str, *words: str) -> str:
    ended = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False, cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, "")
    return ended.stdout.strip()


@needs_filter
def test_a_log_is_written_where_nothing_may_give_way(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    assert run(_RECORDS, str(log)) == "1 0"
    assert len(read_log(log).entries) == 1


@needs_filter
@pytest.mark.parametrize(("limits", "gave_way_by"), [("none", 10), ("denied", 0)])
def test_readers_give_way_where_they_may_and_read_on_where_not(limits: str, gave_way_by: int) -> None:
    assert run(_GIVES_WAY, limits) == str(gave_way_by)
