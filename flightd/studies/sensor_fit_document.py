"""Fitted sensors as configuration keys, as JSON and as rows for people."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from flightd.config.camera import CameraConfig
from flightd.core.tracks import SensorEstimate
from flightd.studies.flight_fit.motion import Sensor
from flightd.studies.sensor_fit import FittedSensors

_SURE_SIGMAS = 2.0
"""A value is changed where it is off by more than so many sigmas."""


@dataclass(frozen=True, slots=True)
class SensorRow:
    """One quantity in the unit of its configuration key, if it has one: as configured, as fitted with its
    sigma (None where it was not told), and as the flight itself had it at its end (None where it does not).
    `change`: the fitted value is worth configuring; `note` says what else is to be known."""

    name: str
    unit: str
    key: str
    configured: float
    fitted: float | None
    sigma: float | None
    online: float | None
    online_sigma: float | None
    change: bool
    note: str = ""


def sensor_rows(found: FittedSensors, camera: CameraConfig, online: SensorEstimate) -> list[SensorRow]:
    """Everything that is asked of one flight."""
    values, known = found.values, online.is_known
    degrees = math.degrees

    def row(
        one: Sensor,
        name: str,
        unit: str,
        key: str,
        configured: float,
        add: float,
        sigma: float,
        *,
        seen: tuple[float, float] | None = None,
        note: str = "",
    ) -> SensorRow:
        told = one in found.told
        sure = told and bool(key) and abs(add) > _SURE_SIGMAS * sigma
        by_flight = seen if known and seen is not None and all(map(math.isfinite, seen)) else None
        return SensorRow(
            name,
            unit,
            key,
            configured,
            configured + add if told else None,
            sigma if told else None,
            None if by_flight is None else configured + by_flight[0],
            None if by_flight is None else by_flight[1],
            sure,
            note if told else note or "not told by this flight",
        )

    def at(one: Sensor) -> tuple[float, float]:
        return float(values[one]), float(found.sigmas[one])

    def turned(one: Sensor) -> tuple[float, float]:
        value, sigma = at(one)
        return degrees(value), degrees(sigma)

    delay_s, delay_sigma_s = at(Sensor.DELAY)
    focal, focal_sigma = at(Sensor.FOCAL)
    bend, bend_sigma = at(Sensor.BEND)
    still = "" if found.turned else "the drone never turned far: a steady draught looks the same"
    mount = online.mount_sigma_rad
    tilt = online.tilt_sigma_rad
    return [
        row(
            Sensor.DELAY,
            "camera delay",
            "s",
            "camera.latency_s",
            camera.latency_s,
            -delay_s,
            delay_sigma_s,
            seen=(-online.delay_s, online.delay_sigma_s),
            note="against the attitude's times",
        ),
        row(
            Sensor.MOUNT_ROLL,
            "mount roll",
            "deg",
            "camera.mount_roll_deg",
            camera.mount_roll_deg,
            *turned(Sensor.MOUNT_ROLL),
            seen=(degrees(online.mount_roll_rad), degrees(mount)),
        ),
        row(
            Sensor.MOUNT_PITCH,
            "mount pitch",
            "deg",
            "camera.mount_pitch_deg",
            camera.mount_pitch_deg,
            *turned(Sensor.MOUNT_PITCH),
            seen=(degrees(online.mount_pitch_rad), degrees(mount)),
        ),
        row(
            Sensor.MOUNT_YAW,
            "mount yaw",
            "deg",
            "camera.mount_yaw_deg",
            camera.mount_yaw_deg,
            *turned(Sensor.MOUNT_YAW),
            seen=(degrees(online.mount_yaw_rad), degrees(online.mount_yaw_sigma_rad)),
        ),
        row(
            Sensor.FOCAL,
            "focal length",
            "px",
            "camera.fx_px",
            camera.fx_px,
            camera.fx_px * math.expm1(focal),
            camera.fx_px * focal_sigma,
            seen=(camera.fx_px * online.focal_share, camera.fx_px * online.scale_sigma),
            note="if the range finder is right",
        ),
        row(
            Sensor.FOCAL,
            "height scale",
            "1",
            "",
            1.0,
            math.expm1(-focal),
            focal_sigma,
            note="if camera.fx_px is right: pictures tell height and focal length only together",
        ),
        row(
            Sensor.BEND,
            "lens residual k1",
            "1",
            "camera.distortion[0]",
            camera.distortion[0],
            -bend,
            bend_sigma,
            note="by the lines' width towards the edge; a board tells it better: flightd calibrate PATH…",
        ),
        row(
            Sensor.BIAS_ROLL,
            "tilt bias roll",
            "deg",
            "",
            0.0,
            *turned(Sensor.BIAS_ROLL),
            seen=(degrees(online.tilt_roll_rad), degrees(tilt)),
            note=still or "true less told: level the autopilot",
        ),
        row(
            Sensor.BIAS_PITCH,
            "tilt bias pitch",
            "deg",
            "",
            0.0,
            *turned(Sensor.BIAS_PITCH),
            seen=(degrees(online.tilt_pitch_rad), degrees(tilt)),
            note=still or "true less told: level the autopilot",
        ),
        row(Sensor.LEAK, "attitude leak", "1/s", "", 0.0, *at(Sensor.LEAK), note="rate towards what is felt"),
    ]


def keys_to_set(rows: list[SensorRow], camera: CameraConfig) -> dict[str, float | list[float]]:
    """The keys of `[camera]` whose fitted values differ surely from the configured ones, ready to be set."""
    changed = {row.key.removeprefix("camera."): row for row in rows if row.change and row.fitted is not None}
    keys: dict[str, float | list[float]] = {}
    for key, row in changed.items():
        assert row.fitted is not None
        match key:
            case "latency_s":
                keys[key] = round(max(row.fitted, 0.0), 4)
            case "fx_px":
                share = row.fitted / camera.fx_px
                keys |= {"fx_px": round(row.fitted, 1), "fy_px": round(camera.fy_px * share, 1)}
            case "distortion[0]":
                keys["distortion"] = [round(row.fitted, 4), *camera.distortion[1:]]
            case _:
                keys[key] = round(row.fitted, 2)
    return keys


def sensors_document(found: FittedSensors, rows: list[SensorRow], camera: CameraConfig) -> dict[str, Any]:
    """As JSON has it: null for what is not known."""
    return {
        "frames": found.frames,
        "turned_deg": round(math.degrees(found.turned_rad), 1),
        "misfit": round(found.misfit, 3) if math.isfinite(found.misfit) else None,
        "sensors": [
            {
                name: round(value, 5) if isinstance(value, float) else value
                for name, value in asdict(row).items()
            }
            for row in rows
        ],
        "camera": keys_to_set(rows, camera),
    }
