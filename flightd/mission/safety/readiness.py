"""What keeps a flight on the ground.  Pure."""

from __future__ import annotations

import math

from flightd.config.hazards import LossAction
from flightd.config.schema import Config
from flightd.mission.guidance import FLOOR_M, MissionInputs
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


def obstacles(s: MissionInputs, config: Config, ground_silent: bool, *, arming: bool) -> tuple[Reason, ...]:
    """All that keeps the flight on the ground, worst first; `ground_silent`: who attends it has fallen
    silent, `arming`: it is being armed by us."""
    p, v, latency_s = config.mission, s.vehicle, config.hazards.latency_s
    clock_s = config.hazards.clock_error_s
    if v is None or s.telemetry_age_s > p.telemetry_hold_s:
        return (Plain.NO_TELEMETRY,)
    charge, battery = s.charge, config.battery
    cell_v = battery.cell_home_v if charge.loaded else battery.cell_start_v
    found = s.unfit or v.unfit
    unwritten = s.warnings.health.recorder_error
    checks: tuple[Reason | None, ...] = (
        Plain.ARMED_ALREADY if v.armed and not arming else None,
        None if v.clock_error_s <= clock_s else ClockUnsure(v.clock_error_s, clock_s),
        Unfit(found) if found else None,
        Plain.NO_HEIGHT if math.isnan(s.height_m) else None,
        Plain.HIGH_FLOOR if not v.armed and s.height_m > FLOOR_M else None,
        Plain.NO_CLIMB if math.isnan(v.climb_mps) else None,
        ChargeUnknown(charge.doubt) if charge.doubt else None,
        Plain.NO_CELLS if v.battery_stamp_ns and math.isnan(charge.cell_v) else None,
        Plain.OTHER_CELLS if 0 != v.battery_cells != (battery.cells or v.battery_cells) else None,
        StartChargeLow(charge.frac, p.battery_start) if charge.frac < p.battery_start else None,
        CellsLow(charge.cell_v, cell_v) if charge.cell_v < cell_v else None,
        None if s.frames_arrive else Plain.NO_PICTURE,
        LatePictures(latency_s) if s.warnings.frame_age_s > latency_s else None,
        Plain.GROUND_SILENT if ground_silent else None,
        None if s.aisle_closed else Plain.AISLE_OPEN,
        Plain.NO_RECORD if unwritten and config.hazards.record_lost is not LossAction.CONTINUE else None,
    )
    return tuple(reason for reason in checks if reason is not None)


def not_fresh(s: MissionInputs, config: Config, stops_left: int) -> Reason | None:
    """Why the battery on the pad is not good enough to go on, None if it is."""
    full = config.battery.full
    if s.charge.doubt is not None or s.charge.frac >= full:
        return None
    return AwaitsBattery(stops_left, s.charge.frac, full)
