"""What `flightd doctor` makes of what it reads: machine, lens and pictures, each complaint with a remedy."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flightd.adapters.vehicle.mavlink.examination import ExaminationReport
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import Rule
from flightd.adapters.vehicle.mavlink.parameter_rule import judge as judge_parameter
from flightd.adapters.vehicle.mavlink.required_parameters import Job, rules_for
from flightd.adapters.vehicle.range_finders import RangeSample
from flightd.app.build import pilot_of
from flightd.cli.planned_flight import planned_in_words
from flightd.config.battery import BatteryConfig
from flightd.config.camera import CameraConfig
from flightd.config.recorder import RecorderConfig
from flightd.config.schema import Config, load_config
from flightd.config.vehicle import VehicleConfig
from flightd.doctor.calibration import check_calibration
from flightd.doctor.camera import Pictures, check_vision, judge_camera, judge_front_camera, look
from flightd.doctor.check import Check, CheckLevel
from flightd.doctor.computer import check_fitness
from flightd.doctor.label_text import check_text
from flightd.doctor.labels import check_labels
from flightd.doctor.latency import (
    KnownDelay,
    Stages,
    delay_as_measured,
    delay_before_a_flight,
    judge_latency,
    measure_stages,
)
from flightd.doctor.machine import (
    Load,
    check_disk,
    judge_clock,
    judge_count_clock,
    judge_disk,
    judge_processor,
)
from flightd.doctor.vehicle import judge as judge_vehicle
from flightd.doctor.written_files import check_written
from flightd.site.site_file import load_site
from flightd.tracking.delay_by_tilt import DelayByTilt
from flightd.vision.line_detector import Detector
from tests.rigs import denied_calls
from tests.unit.mission.shelves import FITTED
from tests.unit.store.test_learnt_sensors import kept

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
FIT = Load(cores=4, load=0.5, hottest_c=55.0, governor="schedutil", memory_bytes=2_000_000_000)
ROOM = 50_000_000_000


def levels(checks: list[Check]) -> list[CheckLevel]:
    for check in checks:
        assert "\n" not in check.text + check.remedy
        assert bool(check.remedy) is (check.level is not CheckLevel.OK)
    return [check.level for check in checks]


@pytest.mark.parametrize(
    ("change", "word", "level"),
    [
        ({}, "4 cores", CheckLevel.OK),
        ({"cores": 2}, "detectors and the control loop", CheckLevel.WARNING),
        ({"load": 3.5}, "busy before the flight", CheckLevel.WARNING),
        ({"hottest_c": 85.0}, "85 degrees", CheckLevel.WARNING),
        ({"hottest_c": None}, "4 cores", CheckLevel.OK),
        ({"governor": "powersave"}, "powersave", CheckLevel.WARNING),
        ({"memory_bytes": 100_000_000}, "100 MB", CheckLevel.ERROR),
    ],
)
def test_the_processor(change: dict[str, Any], word: str, level: CheckLevel) -> None:
    checks = judge_processor(replace(FIT, **change), workers=2)
    assert levels(checks) == [level]
    assert word in checks[0].text


@pytest.mark.parametrize(
    ("resolution_s", "year", "synchronised", "level"),
    [
        (1e-9, 2026, True, CheckLevel.OK),
        (1e-9, 2026, False, CheckLevel.WARNING),
        (1e-9, 2026, None, CheckLevel.UNSEEN),
        (1e-9, 1970, None, CheckLevel.WARNING),
        (1e-9, 1970, True, CheckLevel.WARNING),
        (0.015, 2026, True, CheckLevel.ERROR),
    ],
)
def test_the_clock(resolution_s: float, year: int, synchronised: bool | None, level: CheckLevel) -> None:
    assert levels([judge_clock(resolution_s, year, synchronised=synchronised)]) == [level]


@pytest.mark.skipif(not denied_calls.is_known(), reason="no filter for this processor")
def test_a_clock_that_may_not_be_asked_is_no_complaint() -> None:
    command = [sys.executable, "-c", _ASKS_THE_CLOCK]
    told = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3])
    assert told.stdout == "unseen whether anything keeps the date right: the clock may not be asked here\n"


_ASKS_THE_CLOCK = """
from flightd.doctor.machine import check_clock
from tests.rigs.denied_calls import deny
deny("adjtimex")
deny("clock_adjtime")
found = check_clock()
print(found.level, found.text)
"""


@pytest.mark.parametrize(
    ("newest_ns", "found"),
    [
        (0, []),
        (10**18, []),
        (10**18 + 3600 * 10**9, [CheckLevel.WARNING]),
        (10**18 + 2 * 86_400 * 10**9, [CheckLevel.ERROR]),
    ],
)
def test_a_clock_behind_the_newest_look_of_the_inventory(newest_ns: int, found: list[CheckLevel]) -> None:
    checks = judge_count_clock(10**18, newest_ns)
    assert levels(checks) == found
    for check in checks:
        assert "2001-09-09T01:46:40" in check.text
        assert "set the clock" in check.remedy


@pytest.mark.parametrize(
    ("free_bytes", "level"),
    [(ROOM, CheckLevel.OK), (2_500_000_000, CheckLevel.WARNING), (900_000_000, CheckLevel.ERROR)],
)
def test_room_on_the_disk(free_bytes: int, level: CheckLevel) -> None:
    assert levels([judge_disk(Path("flights"), free_bytes, 1_000_000_000)]) == [level]


def test_the_recorders_folder(tmp_path: Path) -> None:
    assert levels([check_disk(RecorderConfig())]) == [CheckLevel.WARNING]  # not recorded at all
    folder = tmp_path / "not" / "there" / "yet"
    assert check_disk(RecorderConfig(folder=folder, reserve_gb=0)).level is not CheckLevel.ERROR
    assert not folder.exists()  # it only looked
    file = tmp_path / "file"
    file.touch()
    assert levels([check_disk(RecorderConfig(folder=file))]) == [CheckLevel.ERROR]


def test_a_place_that_the_system_does_not_even_look_at_is_an_error_in_a_line(tmp_path: Path) -> None:
    place = tmp_path / ("x" * 300) / "kept"
    disk = check_disk(RecorderConfig(folder=place))
    files = check_written(config().with_values(inventory={"folder": place}))
    assert levels([disk, *files]) == [CheckLevel.ERROR, CheckLevel.ERROR]
    assert disk.text.endswith("cannot be written: File name too long")


@pytest.mark.parametrize(
    ("keys", "word"),
    [
        ({"fx_px": 30.0, "fy_px": 30.0}, "is no lens"),
        ({"fx_px": 5000.0, "fy_px": 5000.0}, "is no lens"),
        ({"fx_px": 381.0, "fy_px": 500.0}, "differ"),
        ({"fx_px": 381.0, "fy_px": 381.0, "cx_px": 10.0}, "far from the picture's middle"),
        ({"fx_px": 381.0, "fy_px": 381.0, "distortion": (-0.6, 0.0, 0.0, 0.0, 0.0)}, "folds"),
        ({}, "a guess is used"),
    ],
)
def test_a_lens_that_cannot_be_is_named(keys: dict[str, Any], word: str) -> None:
    checks = check_calibration(CameraConfig(**keys), SITE, 1.6)
    assert CheckLevel.OK not in levels(checks)
    assert any(word in check.text for check in checks)


def test_a_calibrated_lens_is_fit_where_its_lines_are_wide_enough() -> None:
    camera = CameraConfig(fx_px=381.0, fy_px=382.0, distortion=(-0.1, 0.02, 0.0, 0.0, 0.0))
    assert levels(check_calibration(camera, SITE, 1.6)) == [CheckLevel.OK]
    assert CheckLevel.ERROR in levels(check_calibration(camera, SITE, 12.0))


def pictures(rate_hz: float, grey: int = 120) -> Pictures:
    stamps = [round(i * 1e9 / rate_hz) for i in range(20)]
    return Pictures(stamps, np.full((360, 640, 3), grey, np.uint8))


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (pictures(30.0), [CheckLevel.OK]),
        (pictures(20.0), [CheckLevel.WARNING]),
        (pictures(4.0), [CheckLevel.ERROR]),
        (pictures(30.0, grey=3), [CheckLevel.OK, CheckLevel.ERROR]),
        (pictures(30.0, grey=254), [CheckLevel.OK, CheckLevel.ERROR]),
        (replace(pictures(30.0), trouble="camera x: no time"), [CheckLevel.OK, CheckLevel.WARNING]),
        (Pictures(), [CheckLevel.ERROR]),
        (Pictures(trouble="pictures are 800x600, the configuration says 640x360"), [CheckLevel.ERROR]),
    ],
)
def test_the_cameras_pictures(found: Pictures, expected: list[CheckLevel]) -> None:
    checks = judge_camera(config(), found)
    assert levels(checks) == expected
    assert any(found.trouble in check.text for check in checks)


def test_a_floor_without_lines_is_a_warning_only() -> None:
    checks = check_vision(config(), Detector("combined", "yellow"), pictures(30.0).picture)
    assert set(levels(checks)) == {CheckLevel.WARNING}
    assert levels(check_vision(config(), Detector("combined", "yellow"), None)) == [CheckLevel.WARNING]


@pytest.mark.parametrize(
    ("late_s", "expected"), [(0.0, CheckLevel.OK), (4.7, CheckLevel.WARNING), (5.1, CheckLevel.ERROR)]
)
def test_pictures_that_come_too_late_to_fly_by_are_told_before_the_flight(
    late_s: float, expected: CheckLevel
) -> None:
    allowed = config().hazards.model_copy(update={"latency_s": 5.0})
    found, settings = pictures(30.0), config().model_copy(update={"hazards": allowed})
    assert measure_stages(settings, Detector("combined", "yellow"), found) is None, "nothing was measured"
    found.delays_s += [settings.camera.latency_s, settings.camera.latency_s + late_s]
    stages = measure_stages(settings, Detector("combined", "yellow"), found)
    assert stages is not None
    assert stages.late_s == pytest.approx(late_s)
    check = judge_latency(settings, stages, delay_before_a_flight(settings))
    assert levels([check]) == [expected]
    assert "hazards.latency_s" in check.remedy or expected is CheckLevel.OK


def test_a_look_takes_the_usual_time_and_not_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    took_s = [0.001, 0.009, 0.009, 0.002, 0.008, 0.009, 0.100]
    clock = iter([moment for at, took in enumerate(took_s) for moment in (float(at), at + took)])
    monkeypatch.setattr("flightd.doctor.camera.time", SimpleNamespace(perf_counter=lambda: next(clock)))
    usual_s, lines = look(Detector("combined", "yellow"), np.zeros((36, 64, 3), np.uint8))
    assert usual_s == pytest.approx(0.009)
    assert lines == 0


def test_the_line_of_latency_says_what_is_not_in_it() -> None:
    settings = config()
    text = judge_latency(settings, Stages(0.0, 0.01), delay_before_a_flight(settings)).text
    assert "the line to the vehicle take is not in it" in text


def test_a_delay_that_is_configured_or_learnt_is_not_told_as_measured(tmp_path: Path) -> None:
    stages = Stages(late_s=0.004, detector_s=0.01)
    settings = config().with_values(tracking={"learnt": tmp_path / "sensors.json"})
    configured_ms = settings.camera.latency_s * 1e3

    def said(known: KnownDelay) -> str:
        return judge_latency(settings, stages, known).text

    assert f"camera {configured_ms + 4.0:.0f} (as camera.latency_s has it, unmeasured: --rock" in said(
        delay_before_a_flight(settings)
    )
    kept(tmp_path / "sensors.json", settings)
    assert f"camera {configured_ms + 35.0:.0f} (as learnt in flight, sigma 4: --rock" in said(
        delay_before_a_flight(settings)
    )
    measured = delay_as_measured(settings, DelayByTilt(-0.02, 0.0015, 0.99, 0.1, 300))
    assert f"camera {configured_ms + 24.0:.0f} (as measured by rocking it, sigma 1.5)" in said(measured)
    (tmp_path / "sensors.json").write_text("{")
    assert "unmeasured" in said(delay_before_a_flight(settings)), "the line of what was learnt says why"


@pytest.mark.parametrize(
    ("found", "counts", "level", "word"),
    [
        (pictures(4.0), True, CheckLevel.OK, "4.0 pictures a second"),
        (pictures(2.0), True, CheckLevel.WARNING, "2.0 pictures a second"),
        (replace(pictures(4.0), trouble="camera x: no time"), True, CheckLevel.WARNING, "no time"),
        (Pictures(trouble="no such device"), True, CheckLevel.ERROR, "no such device"),
        (Pictures(), False, CheckLevel.WARNING, "no picture in 6 s"),
    ],
)
def test_the_front_cameras_pictures(found: Pictures, counts: bool, level: CheckLevel, word: str) -> None:
    site = load_site(CONFIGS / "site-racks-small.toml") if counts else SITE
    check = judge_front_camera(config().with_values(front_camera={"url": "device:/dev/video2"}), site, found)
    assert levels([check]) == [level]
    assert word in check.text


def config() -> Config:
    return load_config(CONFIGS / "sim.toml")


def sample(sensor: int, distance_m: float, least_m: float = 0.2) -> RangeSample:
    return RangeSample(sensor, distance_m, least_m, 8.0)


@pytest.mark.parametrize(
    ("heard", "wanted", "level", "told"),
    [
        ((sample(0, 0.3),), None, CheckLevel.OK, "0.30 m as it stands"),
        ((sample(0, 0.0),), None, CheckLevel.OK, "on the floor, lower than 0.2 m"),
        ((sample(0, 0.0, 0.5),), None, CheckLevel.ERROR, "minimum of 0.5 m"),
        ((sample(0, 0.0), sample(1, 0.25)), None, CheckLevel.WARNING, "1 is flown by"),
        ((sample(0, 0.0), sample(1, 0.25)), 1, CheckLevel.OK, "0.25 m"),
        ((sample(0, 0.3),), 2, CheckLevel.WARNING, "2 is not heard"),
        ((), None, CheckLevel.WARNING, "none that looks down"),
    ],
)
def test_the_range_finder_as_the_vehicle_stands(
    heard: tuple[RangeSample, ...], wanted: int | None, level: CheckLevel, told: str
) -> None:
    report = ExaminationReport(Firmware.ARDUPILOT, "", False, (), (), 20.0, heard, 3)
    checks = judge_vehicle(VehicleConfig(range_finder=wanted), report)
    (check,) = [check for check in checks if check.name == "range finder"]
    assert check.level is level
    assert told in check.text


@pytest.mark.parametrize(
    ("cells", "told", "level"),
    [
        (None, 0, CheckLevel.ERROR),
        (4, 3, CheckLevel.ERROR),
        (4, 0, CheckLevel.OK),
        (None, 3, CheckLevel.OK),
    ],
)
def test_the_cells_of_the_battery(cells: int | None, told: int, level: CheckLevel) -> None:
    report = ExaminationReport(Firmware.ARDUPILOT, "", False, (), (), 20.0, (sample(0, 0.3),), told)
    checks = judge_vehicle(VehicleConfig(), report, cells)
    (check,) = [check for check in checks if check.name == "battery"]
    assert check.level is level


@pytest.mark.parametrize(("volts", "cells", "fits"), [(9.9, 3, True), (9.9, 4, False), (13.2, 4, True)])
def test_a_low_voltage_for_three_cells_does_not_pass_on_four(volts: float, cells: int, fits: bool) -> None:
    rule = _low_volt(BatteryConfig(cells=cells))
    assert (judge_parameter(rule, ("BATT_LOW_VOLT", volts)) is None) is fits


@pytest.mark.parametrize(
    ("home_v", "land_v", "least", "most"),
    [(3.45, 3.3, 9.6, 10.2), (3.1, 2.9, 8.4, 9.15), (3.6, 3.58, 10.44, 10.74)],
)
def test_the_autopilot_lands_by_its_voltage_after_the_way_home_and_not_before(
    home_v: float, land_v: float, least: float, most: float
) -> None:
    rule = _low_volt(BatteryConfig(cells=3, cell_start_v=3.7, cell_home_v=home_v, cell_land_v=land_v))
    assert rule.better is not None
    assert rule.fits(rule.better)
    for volts, fits in ((least - 0.01, False), (least, True), (most, True), (most + 0.01, False)):
        assert rule.fits(volts) is fits


def _low_volt(battery: BatteryConfig) -> Rule:
    (rule,) = (
        rule
        for rule in rules_for(Firmware.ARDUPILOT, Job(battery=battery))
        if rule.names == ("BATT_LOW_VOLT",)
    )
    return rule


@pytest.mark.parametrize(
    ("module_m", "mode", "says"),
    [
        (0.003, "sweep", ""),
        (0.0025, "sweep", ""),  # a stop looks from nearer
        (0.0022, "sweep", "48 places: labels are not surely read"),
        (0.0005, "sweep", "48 places: labels cannot be read"),
        (0.0005, "stop", "48 places: labels cannot be read"),
    ],
)
def test_labels_that_are_too_small_to_be_read_are_told_before_the_flight_and_in_its_plan(
    module_m: float, mode: str, says: str
) -> None:
    site = load_site(CONFIGS / "site-racks-small.toml")
    scan = {"mode": mode, "sweep": {"module_m": module_m}}
    params = config().with_values(front_camera=FITTED, scan=scan)
    checks = check_labels(params, site)
    assert [check.text for check in checks] == [says] * bool(says)
    assert set(levels(checks)) <= {CheckLevel.WARNING}, "other states are counted"
    assert checks == [check for check in check_fitness(params, site) if check.name == "labels"]
    planned = pilot_of(params, site).mission.planned((), best_order=False)
    words = planned_in_words(planned)
    assert (planned.unread is not None) is bool(says)
    if planned.unread is not None:
        assert f"48 places counted, the labels of {planned.unread.places} too small" in words[1]
        assert words[2].startswith(
            f"{says}; labels get {module_m * 1e3 / 1.2:.2f} px per module, 2.5 are needed"
        )
        assert "or take a longer lens or larger labels" in words[2]
        assert all(says.split(": ")[1] in each.text for each in planned.sweeps)
    assert not check_labels(config(), site), "it counts nothing"


def test_printed_text_that_nothing_is_there_to_read_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    text = {"text": [{"kind": "lot", "pattern": "LOT (.*)"}]}
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert check_text(config()) == []
    checks = check_text(config().with_values(scan=text))
    assert levels(checks) == [CheckLevel.WARNING]
    assert "[[scan.text]]: printed text is not read" in checks[0].text
    assert "-m pip install" in checks[0].remedy
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    assert check_text(config().with_values(scan=text)) == []


def test_what_the_daemon_keeps_between_flights_must_be_its_own_to_write(tmp_path: Path) -> None:
    shut = tmp_path / "etc"
    shut.write_text("")  # a file in the place of a folder: nobody may write below it, not even root
    kept = {
        "mission": {"progress": shut / "progress.json"},
        "inventory": {"folder": tmp_path / "new" / "inventory"},
        "tracking": {"learnt": tmp_path / "sensors.json"},
    }
    (check,) = check_written(config().with_values(**kept))
    assert check.level is CheckLevel.ERROR
    assert check.text == f"mission.progress {shut / 'progress.json'} cannot be written"
    del kept["mission"]
    (check,) = check_written(config().with_values(**kept))
    assert (check.level, check.text) == (CheckLevel.OK, "can write inventory.folder, tracking.learnt")
    assert not (tmp_path / "new").exists()
