"""What keeps a flight on the ground, in words for people.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.mission.guidance import MissionInputs


def not_ready(s: MissionInputs, config: Config, ground_silent: bool) -> str:
    """Why the flight cannot start, or an empty text; `ground_silent`: who attends it has fallen silent."""
    p, v, latency_s = config.mission, s.vehicle, config.hazards.latency_s
    if v is None or s.telemetry_age_s > p.telemetry_hold_s:
        return "no telemetry from the vehicle"
    low = f"battery at {v.battery_frac:.0%}, {p.battery_start:.0%} needed to start"
    checks = {
        "the vehicle is armed already: disarm it first": v.armed,
        "no height from the vehicle's range finder": math.isnan(s.height_m),
        "no battery level from the vehicle": math.isnan(v.battery_frac),
        low: v.battery_frac < p.battery_start,
        "no picture from the down camera": not s.frames_arrive,
        f"pictures are more than {latency_s * 1e3:.0f} ms old when they have been looked at": (
            s.warnings.picture_age_s > latency_s
        ),
        "the ground station that attends this flight fell silent": ground_silent,
    }
    return next((reason for reason, failed in checks.items() if failed), "")


def not_fresh(s: MissionInputs, config: Config, stops_left: int) -> str:
    """Why the battery on the pad is not good enough to go on, or an empty text."""
    full = config.battery.full
    if s.vehicle is None or s.vehicle.battery_frac >= full:
        return ""
    return (
        f"{stops_left} stops left: waiting for a battery at {full:.0%}, it is at {s.vehicle.battery_frac:.0%}"
    )
