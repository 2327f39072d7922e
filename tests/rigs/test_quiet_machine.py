"""Who took the machine from a test that flies by the clock, and what that excuses."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.rigs.machine import Load, Meter, Needs, busy_s

ROOT = Path(__file__).parents[2]
BURN_S = 0.4
BURN = f"import time\nwhile time.process_time() < {BURN_S}: pass"


@pytest.mark.parametrize(
    ("taken_cores", "pause_s", "lacks"),
    [(0.2, 0.02, ""), (0.8, 0.02, r"others took 0\.8 of 2"), (0.2, 0.4, r"paused for 0\.40 s")],
)
def test_what_others_took_and_how_long_all_stood_still_are_named(
    taken_cores: float, pause_s: float, lacks: str
) -> None:
    missing = Needs(cores=1.5, pause_s=0.25).missing(Load(10.0, 2, 1.2, taken_cores, pause_s))
    assert bool(missing) == bool(lacks)
    assert re.search(lacks, missing)


def test_what_the_test_itself_burns_is_no_excuse() -> None:
    assert not Needs(cores=1.5).missing(Load(10.0, 2, used_cores=2.0, taken_cores=0.0, pause_s=0.4))


def test_what_is_niced_gives_way_but_to_what_is_niced_itself() -> None:
    """The columns of a processor: user, nice, system, idle, iowait, irq, softirq, steal."""
    stat = "cpu 0 0 0 0 0 0 0 0\ncpu0 100 400 20 9 9 3 2 5 0 0\ncpu7 1 1 1 1 1 1 1 1 0 0\nintr 5\n"
    ticks_per_s = os.sysconf("SC_CLK_TCK")
    assert busy_s(stat, {0}, niced=False) * ticks_per_s == pytest.approx(130)
    assert busy_s(stat, {0}, niced=True) * ticks_per_s == pytest.approx(530)


def test_what_the_test_and_its_children_use_counts_as_its_own() -> None:
    meter = Meter()
    with meter.running():
        burner = [sys.executable, "-c", f"{BURN}\nprint(flush=True)\ninput()"]
        pipe = subprocess.PIPE
        with subprocess.Popen(burner, stdin=pipe, stdout=pipe) as child:
            assert child.stdout is not None
            child.stdout.readline()
            _burn()
            child.communicate(b"\n")
    assert meter.load.used_cores * meter.load.seconds > 1.8 * BURN_S


def _burn() -> None:
    until_s = time.process_time() + BURN_S
    while time.process_time() < until_s:
        pass


FLIGHTS = """
import pytest

@pytest.mark.realtime(cores=0.0, pause_s=1e9)
def test_broken_code():
    raise AssertionError("broken")

@pytest.mark.realtime(cores=0.0, pause_s=1e9)
def test_sound(): ...

@pytest.mark.realtime(cores=1e9)
def test_needs_more_than_there_is():
    raise AssertionError("late")

@pytest.mark.realtime(cores=1e9)
def test_does_with_less(): ...

def test_by_no_clock():
    raise AssertionError("broken")
"""


@pytest.mark.parametrize("ci", [False, True])
def test_a_busy_machine_excuses_a_failure_and_a_quiet_one_does_not(ci: bool, tmp_path: Path) -> None:
    file = tmp_path / "test_flights.py"
    file.write_text(FLIGHTS)
    done = subprocess.run(
        [
            *(sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml"), "-p", "tests.conftest"),
            *("-o", "realtime_patience_s=0", "-rA", str(file)),
        ],
        cwd=ROOT,
        env=os.environ | {"CI": "true" if ci else ""},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert set(re.findall(r"^FAILED .*::(\w+)", done.stdout, re.MULTILINE)) == {
        "test_broken_code",
        "test_by_no_clock",
    }, done.stdout
    passed = set(re.findall(r"^PASSED .*::(\w+)", done.stdout, re.MULTILINE))
    assert passed == ({"test_sound", "test_does_with_less"} if ci else {"test_sound"})
    assert "too busy: others took" in done.stdout
    assert ("it failed by AssertionError: late" in done.stdout) == ci
