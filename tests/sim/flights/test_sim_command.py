"""`flightd sim` as its first user meets it: interrupted, watched, set by hand."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulator_config import simulator_config
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.snapshot import Snapshot
from flightd.sim.scenario.scenario import Scenario
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real
from tests.rigs.processes import of_session
from tests.rigs.waiting import until
from tests.sim.ideal.ideal_flight import IdealFlight

ROOT = Path(__file__).parents[3]
CONFIGS = ROOT / "configs"
PATIENCE_S = 120.0


def started(folder: Path, *options: str, new_session: bool = False) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "flightd", "sim", "--out", str(folder), *options]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=new_session,
    )  # fmt: skip


def until_flown(process: subprocess.Popen[str], log: Path, most_bytes: int = 200_000) -> None:
    """Until so much of the flight is on the disk."""
    give_up_s = time.monotonic() + PATIENCE_S
    while not log.exists() or log.stat().st_size < most_bytes:
        assert time.monotonic() < give_up_s, "it does not fly"
        try:
            process.wait(0.1)
        except subprocess.TimeoutExpired:
            continue
        raise AssertionError(process.communicate())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_flight_leaves_what_was_flown_so_far(tmp_path: Path, number: signal.Signals) -> None:
    process = started(tmp_path, "--json")
    until_flown(process, tmp_path / "flight.mcap")
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + number, err
    assert "Traceback" not in err
    summary = json.loads(out)
    assert summary == json.loads((tmp_path / "summary.json").read_text())
    assert summary["mission"] == "aborted"
    assert re.fullmatch(rf"interrupted by {number.name} in phase \w+", summary["reason"])
    assert summary["frames"] > 0
    assert "<html" in (tmp_path / "report.html").read_text()


def test_a_second_ctrl_c_ends_it_at_once_where_a_disk_keeps_it(tmp_path: Path) -> None:
    process = started(tmp_path, "--json", new_session=True)
    assert process.stderr is not None
    try:
        until_flown(process, tmp_path / "flight.mcap", 50_000)
        for pid in of_session(process.pid):
            if b"recorder.writer_process" in Path(f"/proc/{pid}/cmdline").read_bytes():
                os.kill(pid, signal.SIGSTOP)
        process.send_signal(signal.SIGINT)
        said = "flightd: SIGINT: it ends in order; a second one ends it at once\n"
        assert said in iter(process.stderr.readline, "")
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.0)
        process.send_signal(signal.SIGINT)
        assert process.wait(3.0) == 128 + signal.SIGINT
        real(until(lambda: not of_session(process.pid), 3.0))
        assert process.stderr.read() == "flightd: ended at once by SIGINT\n"
    finally:
        for pid in of_session(process.pid):
            os.kill(pid, signal.SIGKILL)
        process.communicate()


@pytest.mark.realtime
def test_metrics_are_served_in_real_time(tmp_path: Path) -> None:
    port = 19469
    process = started(tmp_path, "--speed", "1", "--set", f"metrics.listen=127.0.0.1:{port}")
    try:
        give_up_s, told = time.monotonic() + PATIENCE_S, ""
        while 'flightd_phase{phase="preflight"}' not in told:
            assert time.monotonic() < give_up_s, "nothing is served"
            assert process.poll() is None, process.communicate()
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=5) as answer:
                    told = answer.read().decode()
            except (urllib.error.URLError, ConnectionError):
                continue
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + signal.SIGINT


def test_metrics_that_lockstep_cannot_serve_are_told_in_a_line(tmp_path: Path) -> None:
    said: list[str] = []
    options = SimOptions(settings=("metrics.listen=127.0.0.1:9469",))
    prepare(options, Scenario(), tmp_path, said.append)
    assert said == ["metrics.listen is off in lockstep; --speed 1 turns it on"]


@pytest.mark.parametrize("setting", ["mission.nodes=A2", 'mission.nodes=["A2"]'])
def test_a_bare_word_for_a_list_is_a_list_of_one(setting: str) -> None:
    config, _ = simulator_config(None, None, Scenario(), [setting])
    assert config.mission.nodes == ("A2",)


def test_a_bare_word_for_a_number_is_still_refused() -> None:
    with pytest.raises(InputError, match=r"mission\.height_m"):
        simulator_config(None, None, Scenario(), ["mission.height_m=high"])


@pytest.mark.parametrize("key", ["camera.width_px", "front_camera.height_px"])
def test_a_picture_size_that_no_simulated_camera_takes_is_refused(key: str) -> None:
    section, name = key.split(".")
    remedy = rf"{section}\.{name}: 320, .* in \[{section}\] of a scenario"
    with pytest.raises(InputError, match=remedy):
        simulator_config(None, str(ROOT / "configs" / "site-racks-small.toml"), Scenario(), [f"{key}=320"])
    simulated = Scenario.model_validate({section: {name: 320}})
    config, _ = simulator_config(None, None, simulated, [f"{key}=320"])
    assert getattr(getattr(config, section), name) == 320


def test_a_node_to_which_the_route_comes_twice_is_one_node() -> None:
    site = load_site(CONFIGS / "site-demo.toml")
    told: list[Snapshot] = []
    config = load_config(CONFIGS / "sim.toml")
    flight = IdealFlight(site, config, visits=("A1", "A2", "A1"), observers=[told.append])
    flown = flight.fly(120)
    assert flown.visited == ["A1", "A2", "A1"]
    assert flight.pilot.plan.nodes == 2, "what the summary counts"
    assert (told[-1].nodes_done, told[-1].nodes_planned) == (2, 2), "and what all others are told"
