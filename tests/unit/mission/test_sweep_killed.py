"""What is left of a count in passing whose process is killed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.rigs.patience import COMMAND_S

ROOT = Path(__file__).parents[3]


def test_killed_at_random_moments_of_a_sweep_nothing_booked_is_lost_or_counted_twice(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.unit.mission.kill_a_sweep", "5", "3", str(tmp_path / "store")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=COMMAND_S)
    result = json.loads(done.stdout)
    assert result["kills"] == 5
    never = ("lost", "double", "again", "stood", "once", "unsound")
    assert {key: result[key] for key in never} == dict.fromkeys(never, 0)
    assert result["contradicted"] > 0, "one pallet is at two places"
    assert result["completed"] > 0, "what was killed is gone on with to its end"
    assert result["writes"] > 50
