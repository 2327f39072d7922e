"""What the page Studio is told of a flight's sensors."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.core.tracks import NOT_SEEN
from flightd.ground.studio import sensor_study
from flightd.studies.flight_calibration import FlightCalibration
from flightd.studies.sensor_fit_document import sensor_rows
from tests.unit.studies.test_sensor_fit_document import CAMERA, fitted


@pytest.mark.parametrize(
    ("off_s", "config"), [(0.025, "[camera]\nlatency_s = 0.035"), (0.0, "")], ids=["off", "as configured"]
)
def test_the_keys_to_copy_are_those_that_differ(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, off_s: float, config: str
) -> None:
    (tmp_path / "flight.mcap").touch()
    found = fitted(DELAY=off_s)
    told = FlightCalibration(found, CAMERA, sensor_rows(found, CAMERA, NOT_SEEN))
    monkeypatch.setattr(sensor_study, "calibrate_by_flight", lambda _path: told)
    study = sensor_study.study_sensors(tmp_path, "flight.mcap")
    assert (study.frames, study.config) == (500, config)
    assert {one["name"] for one in study.sensors} >= {"camera delay", "mount yaw", "focal length"}
