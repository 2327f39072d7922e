"""What keeps a flight on the ground.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.mission.guidance import MissionInputs
from flightd.mission.reasons import (
    AwaitsBattery,
    CellsLow,
    ChargeUnknown,
    ClockUnsure,
    LatePictures,
    Plain,
    Reason,
    StartChargeLow,
    Unfit,
)
from flightd.tracking.battery_charge import ChargeDoubt


def not_ready(s: MissionInputs, config: Config, ground_silent: bool) -> Reason | None:
    """Why the flight cannot start, None if it can; `ground_silent`: who attends it has fallen silent."""
    p, v, latency_s = config.mission, s.vehicle, config.hazards.latency_s
    clock_s = config.hazards.clock_error_s
    if v is None or s.telemetry_age_s > p.telemetry_hold_s:
        return Plain.NO_TELEMETRY
    charge, battery = s.charge, config.battery
    cell_v = battery.cell_home_v if charge.loaded else battery.cell_start_v
    checks: tuple[tuple[bool, Reason], ...] = (
        (v.armed, Plain.ARMED_ALREADY),
        (not v.clock_error_s <= clock_s, ClockUnsure(v.clock_error_s, clock_s)),
        (bool(s.unfit or v.unfit), Unfit(s.unfit or v.unfit)),
        (math.isnan(s.height_m), Plain.NO_HEIGHT),
        (charge.doubt is not None, ChargeUnknown(charge.doubt or ChargeDoubt.UNKNOWN)),
        (charge.frac < p.battery_start, StartChargeLow(charge.frac, p.battery_start)),
        (charge.cell_v < cell_v, CellsLow(charge.cell_v, cell_v)),
        (not s.frames_arrive, Plain.NO_PICTURE),
        (s.warnings.frame_age_s > latency_s, LatePictures(latency_s)),
        (ground_silent, Plain.GROUND_SILENT),
        (not s.aisle_closed, Plain.AISLE_OPEN),
    )
    return next((reason for failed, reason in checks if failed), None)


def not_fresh(s: MissionInputs, config: Config, stops_left: int) -> Reason | None:
    """Why the battery on the pad is not good enough to go on, None if it is."""
    full = config.battery.full
    if s.charge.doubt is not None or s.charge.frac >= full:
        return None
    return AwaitsBattery(stops_left, s.charge.frac, full)
