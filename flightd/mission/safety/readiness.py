"""What keeps a flight on the ground.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.mission.guidance import MissionInputs
from flightd.mission.reasons import AwaitsBattery, LatePictures, Plain, Reason, StartChargeLow, Unfit


def not_ready(s: MissionInputs, config: Config, ground_silent: bool) -> Reason | None:
    """Why the flight cannot start, None if it can; `ground_silent`: who attends it has fallen silent."""
    p, v, latency_s = config.mission, s.vehicle, config.hazards.latency_s
    if v is None or s.telemetry_age_s > p.telemetry_hold_s:
        return Plain.NO_TELEMETRY
    checks: tuple[tuple[bool, Reason], ...] = (
        (v.armed, Plain.ARMED_ALREADY),
        (bool(s.unfit or v.unfit), Unfit(s.unfit or v.unfit)),
        (math.isnan(s.height_m), Plain.NO_HEIGHT),
        (math.isnan(v.battery_frac), Plain.NO_CHARGE),
        (v.battery_frac < p.battery_start, StartChargeLow(v.battery_frac, p.battery_start)),
        (not s.frames_arrive, Plain.NO_PICTURE),
        (s.warnings.picture_age_s > latency_s, LatePictures(latency_s)),
        (ground_silent, Plain.GROUND_SILENT),
        (not s.aisle_closed, Plain.AISLE_OPEN),
    )
    return next((reason for failed, reason in checks if failed), None)


def not_fresh(s: MissionInputs, config: Config, stops_left: int) -> Reason | None:
    """Why the battery on the pad is not good enough to go on, None if it is."""
    full = config.battery.full
    if s.vehicle is None or s.vehicle.battery_frac >= full:
        return None
    return AwaitsBattery(stops_left, s.vehicle.battery_frac, full)
