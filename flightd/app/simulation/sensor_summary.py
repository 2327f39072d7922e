"""What a simulated flight found out of its own sensors, beside what was drawn of them."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from flightd.adapters.vehicle.mavlink.required_parameters import FIRMWARES
from flightd.app.simulation.simulation import Simulation
from flightd.core.tracks import SensorEstimate

Known: TypeAlias = dict[str, float | None]


def sensor_summary(simulation: Simulation, seen: SensorEstimate, *, leapt: bool) -> dict[str, Any]:
    """The summary's part on the sensors, of which the lines said `seen` last: `estimated`, `estimated_sigma`
    and `drawn`, the same keys each.  The camera's delay is the one after its leap where it had `leapt` when
    that was said.

    The camera's delay is whole, configuration included; `delay_to_attitude_s` is that beside the told
    attitude, which is what the lines tell: by half of what the ways there and back differ, all attitudes of a
    MAVLink autopilot are stamped wrong once clocks have been compared (Mills, RFC 5905).  The mount's angles
    and the focal length are beyond the configured ones; the height is by how much the told one is too small
    for good, which no world draws; the tilt bias is by how much the told roll and pitch are too large, as two
    angles and their hypotenuse.
    None for what nobody estimates, and before any line was seen."""
    return {
        "estimated": _estimated(seen, simulation.config.camera.latency_s),
        "estimated_sigma": _sigma(seen),
        "drawn": _drawn(simulation, leapt=leapt),
    }


def _estimated(seen: SensorEstimate, latency_s: float) -> Known:
    return _rounded(
        camera_delay_s=latency_s - seen.delay_s,
        delay_to_attitude_s=latency_s - seen.delay_s,
        mount_roll_deg=math.degrees(seen.mount_roll_rad),
        mount_pitch_deg=math.degrees(seen.mount_pitch_rad),
        mount_yaw_deg=math.degrees(seen.mount_yaw_rad),
        tilt=(-math.degrees(seen.tilt_roll_rad), -math.degrees(seen.tilt_pitch_rad)),
        shares=(seen.focal_share, seen.height_share),
    )


def _sigma(seen: SensorEstimate) -> Known:
    mount_deg, tilt_deg = math.degrees(seen.mount_sigma_rad), math.degrees(seen.tilt_sigma_rad)
    known = _rounded(
        camera_delay_s=seen.delay_sigma_s,
        delay_to_attitude_s=seen.delay_sigma_s,
        mount_roll_deg=mount_deg,
        mount_pitch_deg=mount_deg,
        mount_yaw_deg=math.degrees(seen.mount_yaw_sigma_rad),
        tilt=(tilt_deg, tilt_deg),
        shares=(seen.scale_sigma, seen.height_sigma),
    )
    return known | {"tilt_bias_deg": known["tilt_roll_deg"]}


def _drawn(simulation: Simulation, *, leapt: bool) -> Known:
    unknowns, configured = simulation.unknowns, simulation.scenario.camera.camera()
    roll_rad, pitch_rad = unknowns.tilt_bias_rad or (math.nan, math.nan)
    leap_s = unknowns.camera_leap.by_s if leapt else 0.0
    delay_s = simulation.camera.latency_s(unknowns.camera(configured)) + leap_s
    down, up = unknowns.radio(simulation.scenario.vehicle.radio())
    is_autopilot = simulation.config.vehicle.kind in FIRMWARES and not simulation.truth_url
    late_s = 0.5 * (down.delay_s - up.delay_s) if is_autopilot else math.nan
    return _rounded(
        camera_delay_s=delay_s,
        delay_to_attitude_s=delay_s - late_s,
        mount_roll_deg=math.degrees(unknowns.mount_roll_rad),
        mount_pitch_deg=math.degrees(unknowns.mount_pitch_rad),
        mount_yaw_deg=math.degrees(unknowns.mount_yaw_rad),
        tilt=(math.degrees(roll_rad), math.degrees(pitch_rad)),
        shares=(unknowns.focal_share - 1.0, 0.0),
    )


def _rounded(
    *,
    camera_delay_s: float,
    delay_to_attitude_s: float,
    mount_roll_deg: float,
    mount_pitch_deg: float,
    mount_yaw_deg: float,
    tilt: tuple[float, float],
    shares: tuple[float, float],
) -> Known:
    values = {
        "camera_delay_s": camera_delay_s,
        "delay_to_attitude_s": delay_to_attitude_s,
        "mount_roll_deg": mount_roll_deg,
        "mount_pitch_deg": mount_pitch_deg,
        "mount_yaw_deg": mount_yaw_deg,
        "tilt_bias_deg": math.hypot(*tilt),
        "tilt_roll_deg": tilt[0],
        "tilt_pitch_deg": tilt[1],
        "focal_percent": 100.0 * shares[0],
        "height_percent": 100.0 * shares[1],
    }
    return {key: None if math.isnan(value) else round(value, 4) for key, value in values.items()}
