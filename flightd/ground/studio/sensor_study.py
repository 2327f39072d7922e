"""What a recorded flight says of the drone's sensors, as `flightd calibrate --from-log` finds it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec

from flightd.ground.flights.log_folder import path_of
from flightd.studies.flight_calibration import calibrate_by_flight


class SensorStudy(msgspec.Struct, frozen=True):
    """`sensors` as `studies.sensor_fit_document` has them; `config` is what differs surely, as a
    configuration has it, "" where nothing does."""

    frames: int
    sensors: list[dict[str, Any]]
    config: str


def study_sensors(root: Path, relative: str) -> SensorStudy:
    """In the reading process.  InputError for a log that does not hold enough, RunError where its lines do
    not tell where it was."""
    fitted = calibrate_by_flight(path_of(root, relative))
    keys = [f"{key} = {json.dumps(value)}" for key, value in fitted.keys.items()]
    document = fitted.document()
    config = "\n".join(["[camera]", *keys]) if keys else ""
    return SensorStudy(document["frames"], document["sensors"], config)
