from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.build import detector_of, pilot_of
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError
from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Document, Topic
from flightd.core.types import AttitudeSetpoint, Phase
from flightd.replay.decision_compare import replay_decisions
from flightd.replay.log import Entry, read_log
from flightd.site.site import Site
from flightd.site.site_file import load_site, site_toml
from tests.command import Command
from tests.replay.synthetic_flight import picture, seen_lines
from tests.sim.ideal.ideal_flight import IdealFlight

ROOT = Path(__file__).parents[2]
_FOLLOWED = 100
"""Decisions to follow a line, of a flight's beginning."""


def _setting() -> tuple[Config, Site]:
    config = load_config(ROOT / "configs" / "sim.toml")
    visits = config.mission.model_copy(update={"nodes": ("A2",)})
    return config.model_copy(update={"mission": visits}), load_site(ROOT / "configs" / "site-demo.toml")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short flight by ideal sight, recorded as the daemon does."""
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    config, site = _setting()
    flight = IdealFlight(site, config)
    flight.pilot = pilot_of(config, site)
    step = flight.pilot.step
    with McapRecorder(path, when_full=wait_for_disk) as recorder:

        def recording(tick: TickInput) -> TickOutput:
            output = step(tick)
            recorder.record(Topic.TICK, tick.now_ns, tick)
            recorder.record(Topic.DECISION, tick.now_ns, output)
            return output

        recorder.record(Topic.CONFIG, 0, Document(config.model_dump_json()))
        recorder.record(Topic.MAP, 0, Document(site_toml(site)))
        flight.pilot.step = recording  # type: ignore[method-assign]
        flown = flight.fly(120.0)
    assert flown.phase is Phase.DONE
    return path


@pytest.fixture(scope="module")
def beginning(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of that flight what leads to its second second of following a line: for what one decision shows as
    well as a thousand.  Nobody writes there."""
    entries = read_log(log).entries
    follows = [entry for entry in entries if _phase(entry) is Phase.FOLLOW]
    path = tmp_path_factory.mktemp("beginning") / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        for entry in entries:
            if entry.stamp_ns <= follows[_FOLLOWED].stamp_ns:
                recorder.record(entry.topic, entry.stamp_ns, entry.message)
    return path


def _phase(entry: Entry) -> Phase | None:
    message: Any = entry.message
    return Phase(message["phase"]) if entry.topic == Topic.DECISION else None


def _step() -> Callable[[TickInput], TickOutput]:
    return pilot_of(*_setting()).step


def test_the_same_code_decides_the_same(log: Path) -> None:
    comparison = replay_decisions(read_log(log), _step())
    assert comparison.ticks > 500
    assert comparison.identical
    assert comparison.drifts == ()


def test_a_small_change_of_behaviour_is_told_with_its_size(beginning: Path) -> None:
    step = _step()

    def changed(tick: TickInput) -> TickOutput:
        output = step(tick)
        if output.setpoint is None or output.phase is not Phase.FOLLOW:
            return output
        more = dataclasses.replace(output.setpoint, roll_rad=output.setpoint.roll_rad + 0.001)
        return dataclasses.replace(output, setpoint=more)

    comparison = replay_decisions(read_log(beginning), changed)
    (drift,) = comparison.drifts
    assert drift.field == "setpoint.roll_rad"
    assert drift.largest == pytest.approx(0.001)
    assert drift.ticks == comparison.differing > 50
    assert not comparison.within(0.0)
    assert comparison.within(0.0011)


def test_a_decision_of_another_kind_is_beyond_any_tolerance(beginning: Path) -> None:
    step = _step()

    def changed(tick: TickInput) -> TickOutput:
        return dataclasses.replace(step(tick), goal="Z9", setpoint=None)

    comparison = replay_decisions(read_log(beginning), changed)
    assert {drift.field for drift in comparison.drifts} == {"goal", "setpoint"}
    assert not comparison.within(1e9)


def test_what_an_older_version_did_not_record_is_no_difference(beginning: Path) -> None:
    recorded = read_log(beginning, {Topic.TICK, Topic.DECISION})
    messages: list[Any] = [entry.message for entry in recorded.entries if entry.topic == Topic.DECISION]
    sensors = [message["tracks"]["sensors"] for message in messages if message["tracks"] is not None]
    for one in sensors:
        del one["mount_yaw_rad"]
    assert replay_decisions(recorded, _step()).identical
    for one in sensors:
        one["mount_roll_rad"] = 0.1
    assert not replay_decisions(recorded, _step()).identical


def test_gaps_in_the_record_are_told(beginning: Path) -> None:
    whole = read_log(beginning)
    lost = next(i for i, entry in enumerate(whole.entries) if entry.topic == Topic.DECISION and i > 400)
    holed = dataclasses.replace(whole, entries=whole.entries[:lost] + whole.entries[lost + 1 :])
    comparison = replay_decisions(holed, _step())
    assert (comparison.missing, comparison.differing) == (1, 0)
    assert not comparison.within(1.0)


def test_the_tick_that_a_log_was_cut_off_at_is_no_gap(beginning: Path) -> None:
    recorded = read_log(beginning)
    whole = replay_decisions(recorded, _step())
    assert recorded.entries[-1].topic == Topic.DECISION
    without_last = replace(recorded, entries=recorded.entries[:-1])
    assert replay_decisions(without_last, _step()).missing == 1
    cut = replay_decisions(replace(without_last, damage="cut off before its end"), _step())
    assert (cut.identical, cut.ticks) == (True, whole.ticks - 1)


def test_a_log_without_ticks_is_told(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
    with pytest.raises(InputError, match="holds no ticks"):
        replay_decisions(read_log(tmp_path / "flight.mcap"), _step())


def _run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flightd", "replay", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_command_finds_no_drift_in_a_new_process(log: Path) -> None:
    result = _run(log, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    assert told["identical"] is True
    assert told["passed"] is True
    assert told["drift"] == []


def test_the_command_tells_the_drift_of_another_configuration(
    flightd: Command, log: Path, tmp_path: Path
) -> None:
    config, _ = _setting()
    slower = config.control.model_copy(update={"max_tilt_deg": 2.0})
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        recorder.record(
            Topic.CONFIG, 0, Document(config.model_copy(update={"control": slower}).model_dump_json())
        )
        for entry in read_log(log, {Topic.MAP, Topic.TICK, Topic.DECISION}).entries:
            recorder.record(entry.topic, entry.stamp_ns, entry.message)
    result = flightd("replay", path)
    assert result.returncode == 1
    assert "setpoint.pitch_rad" in result.stdout
    assert len(result.stderr.splitlines()) == 1
    assert "decisions drift" in result.stderr


def test_exit_code_line_and_complaint_judge_the_pictures_by_the_same_figures(
    flightd: Command, beginning: Path, tmp_path: Path
) -> None:
    """Every line was recorded a pixel beside where it is seen now."""
    path, rng, detector = tmp_path / "flight.mcap", np.random.default_rng(3), detector_of(*_setting())()
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        for entry in read_log(beginning).entries:
            recorder.record(entry.topic, entry.stamp_ns, entry.message)
        for seq in range(1, 6):
            jpeg = picture(seen_lines(seq, seq, 0.0, rng), rng)
            frame = np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), np.uint8)
            seen = detector.detect(frame, seq, seq)
            beside = tuple(replace(line, rho_px=line.rho_px + 1.0) for line in seen.lines)
            recorder.record(Topic.LINES, seq, replace(seen, lines=beside))
            recorder.image(Topic.FRAME, seq, seq, jpeg)
    strict, loose = flightd("replay", path), flightd("replay", path, "--pixels", "1.5")
    assert (strict.returncode, loose.returncode) == (1, 0)
    figure = re.search(r"95 % of \d+ lines within (\d\.\d+) px \(0\.5 allowed\)", strict.stdout)
    assert figure is not None, strict.stdout
    assert f"95 % of the lines within {figure[1]} px, 0.5 allowed" in strict.stderr
    assert "(1.5 allowed)" in loose.stdout
    assert "0 gone and 0 new" in loose.stdout
    told = json.loads(flightd("replay", path, "--json").stdout)
    assert (told["passed"], told["identical"]) == (False, True)
    assert f"({told['pictures']['may_tip']} together allowed)" in strict.stdout


def test_a_log_without_its_map_is_one_line_and_exit_2(
    flightd: Command, tmp_path: Path, beginning: Path
) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        for entry in read_log(beginning, {Topic.CONFIG, Topic.TICK}).entries:
            recorder.record(entry.topic, entry.stamp_ns, entry.message)
    result = flightd("replay", path)
    assert (result.returncode, result.stdout) == (2, "")
    assert "holds no map" in result.stderr
