"""What is printed of fitted sensors, and what is to be configured."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from flightd.config.camera import CameraConfig
from flightd.core.tracks import NOT_SEEN, SensorEstimate
from flightd.studies.flight_fit.motion import BELIEVED, SENSORS, Sensor
from flightd.studies.sensor_fit import FittedSensors
from flightd.studies.sensor_fit_document import keys_to_set, sensor_rows, sensors_document

CAMERA = CameraConfig(mount_yaw_deg=90.0, fx_px=400.0, fy_px=400.0, latency_s=0.06)


def fitted(**values: float) -> FittedSensors:
    """All sensors known to a tenth of what was believed, those named off by so many."""
    found = np.zeros(SENSORS)
    for name, value in values.items():
        found[Sensor[name]] = value
    return FittedSensors(found, 0.1 * BELIEVED, frozenset(Sensor), math.pi, 1.0, 500)


def test_nothing_is_to_be_configured_where_nothing_differs() -> None:
    rows = sensor_rows(fitted(), CAMERA, NOT_SEEN)
    assert keys_to_set(rows, CAMERA) == {}
    assert all(row.online is None for row in rows)


def test_exposures_later_than_their_stamps_are_a_shorter_delay() -> None:
    rows = sensor_rows(fitted(DELAY=0.025), CAMERA, NOT_SEEN)
    assert keys_to_set(rows, CAMERA) == {"latency_s": 0.035}


def test_a_delay_is_never_below_nothing() -> None:
    assert keys_to_set(sensor_rows(fitted(DELAY=0.08), CAMERA, NOT_SEEN), CAMERA) == {"latency_s": 0.0}


def test_what_is_set_are_whole_values_not_differences() -> None:
    off = fitted(MOUNT_YAW=math.radians(-3.0), FOCAL=math.log(1.05), BEND=0.02)
    camera = CAMERA.model_copy(update={"distortion": (-0.05, 0.01, 0.0, 0.0, 0.0)})
    keys = keys_to_set(sensor_rows(off, camera, NOT_SEEN), camera)
    assert keys == {
        "mount_yaw_deg": 87.0,
        "fx_px": 420.0,
        "fy_px": 420.0,
        "distortion": [-0.07, 0.01, 0.0, 0.0, 0.0],
    }
    assert CameraConfig.model_validate(camera.model_dump() | keys).fx_px == 420.0


def test_what_was_not_told_is_said_and_not_set() -> None:
    found = fitted(MOUNT_ROLL=0.1, BIAS_ROLL=0.1)
    still = FittedSensors(found.values, found.sigmas, frozenset({Sensor.DELAY}), 0.1, 1.0, 500)
    rows = {row.name: row for row in sensor_rows(still, CAMERA, NOT_SEEN)}
    assert rows["mount roll"].fitted is None
    assert rows["mount roll"].note == "not told by this flight"
    assert "never turned" in rows["tilt bias roll"].note
    assert keys_to_set(list(rows.values()), CAMERA) == {}


def test_the_flight_s_own_estimate_stands_beside_it() -> None:
    online = SensorEstimate(0.01, 0.002, 0.02, 0.0, 0.005, 0.0, 0.0, 0.01, 0.0, 0.005, 0.002)
    found = fitted(DELAY=0.012)
    rows = sensor_rows(found, CAMERA, online)
    delay = next(row for row in rows if row.key == "camera.latency_s")
    assert delay.online == pytest.approx(0.05)
    assert delay.fitted == pytest.approx(0.048)
    assert sensors_document(found, rows, CAMERA)["sensors"][0]["online"] == 0.05


def test_what_is_not_known_is_null_in_json() -> None:
    half = SensorEstimate(delay_s=0.01, delay_sigma_s=0.002)  # as a log of before the mount's yaw was learnt
    found = replace(fitted(), misfit=math.nan)
    document = sensors_document(found, sensor_rows(found, CAMERA, half), CAMERA)
    json.dumps(document, allow_nan=False)
    told = {row["name"]: row["online"] for row in document["sensors"]}
    assert (told["camera delay"], told["mount yaw"], document["misfit"]) == (0.05, None, None)
