"""A drone's sensors by one flight log: what was configured, what the flight estimated, what is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flightd.config.camera import CameraConfig
from flightd.replay.flown_by import FLOWN_BY, flown_config, flown_site
from flightd.replay.log import read_log
from flightd.studies.flight_fit.record import READ, flight_record
from flightd.studies.sensor_fit import FittedSensors, fit_sensors
from flightd.studies.sensor_fit_document import SensorRow, keys_to_set, sensor_rows, sensors_document


@dataclass(frozen=True, slots=True)
class FlightCalibration:
    """`camera` is the down camera as configured, `rows` everything that was asked of the flight."""

    found: FittedSensors
    camera: CameraConfig
    rows: list[SensorRow]

    @property
    def keys(self) -> dict[str, float | list[float]]:
        """Those of `[camera]` to be set: what differs surely."""
        return keys_to_set(self.rows, self.camera)

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        return sensors_document(self.found, self.rows, self.camera)


def calibrate_by_flight(path: Path) -> FlightCalibration:
    """Fit the sensors of the drone that flew a log.  InputError for a log that does not hold enough,
    RunError where its lines do not tell where it was."""
    log = read_log(path, READ | FLOWN_BY)
    config, record = flown_config(log), flight_record(log)
    found = fit_sensors(record, config, flown_site(log))
    return FlightCalibration(found, config.camera, sensor_rows(found, config.camera, record.sensors))
