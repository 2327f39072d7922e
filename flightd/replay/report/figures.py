"""The figures of merit: how the flight ended, and the numbers it is judged by.

`summary.json` decides where it speaks; what it leaves open is worked out from the log, and against
the truth if that was recorded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flightd.core.types import Phase
from flightd.replay.report.flight import Array, RecordedFlight, Track
from flightd.replay.report.markup import clock, number


@dataclass(frozen=True, slots=True)
class FlightOutcome:
    """`tone` is good, bad or open (the log ends in flight)."""

    headline: str
    detail: str
    tone: str


@dataclass(frozen=True, slots=True)
class Figure:
    """One key figure; `tone` is "" for a plain one, else good or bad."""

    label: str
    value: str
    unit: str = ""
    note: str = ""
    tone: str = ""


def outcome(flight: RecordedFlight) -> FlightOutcome:
    """How the mission ended, by the summary or else by the last status."""
    mission, reason = flight.summary.get("mission"), str(flight.summary.get("reason") or "")
    last = flight.last_status
    if mission == "completed" or (mission is None and last is not None and last.phase == Phase.DONE):
        return FlightOutcome("Mission completed", reason, "good")
    if mission == "aborted" or (last is not None and last.phase == Phase.ABORTED):
        return FlightOutcome("Mission aborted", reason or (last.reason if last else ""), "bad")
    if last is None:
        return FlightOutcome("No flight in this log", flight.log.damage, "open")
    return FlightOutcome(
        "Mission not finished", f"the log ends in phase {last.phase.replace('_', ' ')}", "open"
    )


def key_figures(flight: RecordedFlight) -> tuple[Figure, ...]:
    """The tiles at the top of the page, only those that can be given."""
    made = (
        _nodes(flight),
        _cross_track(flight),
        _hover(flight),
        _position(flight),
        _smoothing(flight),
        _landing(flight),
        _codes(flight.summary),
        _flight_time(flight),
        _latency(flight),
        _delay(flight),
        _tilt_bias(flight),
        _scales(flight),
        _frames(flight),
        _battery(flight),
    )
    return tuple(figure for figure in made if figure is not None)


def _number(summary: Mapping[str, object], key: str) -> float | None:
    value = summary.get(key)
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    return None


def _centimetres(value_m: float) -> str:
    return number(value_m * 100, 1)


def _nodes(flight: RecordedFlight) -> Figure | None:
    visited, planned = _number(flight.summary, "nodes_visited"), _number(flight.summary, "nodes_planned")
    last = flight.last_status
    if visited is None and last is not None:
        visited, planned = last.nodes_done, last.nodes_planned
    if visited is None:
        return None
    miscounted = _number(flight.summary, "nodes_miscounted")
    note = f"{number(miscounted)} miscounted" if miscounted is not None else ""
    complete = planned is None or visited >= planned
    tone = "good" if complete and not miscounted else "bad"
    return Figure(
        "Nodes visited", number(visited), f"of {number(planned)}" if planned is not None else "", note, tone
    )


def _cross_track(flight: RecordedFlight) -> Figure | None:
    rms_m, note = _number(flight.summary, "cross_track_rms_m"), "RMS, true"
    if rms_m is None:
        track, note = (
            (flight.truth, note) if flight.truth is not None else (flight.estimate, "RMS, estimated")
        )
        distance = flight.cross_track_m(track)
        distance = distance[np.isfinite(distance)]
        if not len(distance):
            return None
        rms_m = float(np.sqrt(np.mean(distance**2)))
    return Figure("Cross-track", _centimetres(rms_m), "cm", note)


def _hover(flight: RecordedFlight) -> Figure | None:
    p95_m, note = _number(flight.summary, "hover_error_p95_m"), "p95 at the nodes, true"
    if p95_m is None:
        errors = [visit.true_error_m for visit in flight.visits if math.isfinite(visit.true_error_m)]
        note = "p95 at the worst node, true"
        if not errors:
            errors = [
                visit.believed_error_m for visit in flight.visits if math.isfinite(visit.believed_error_m)
            ]
            note = "p95 at the worst node, estimated"
        if not errors:
            return None
        p95_m = max(errors)
    return Figure("Hover error", _centimetres(p95_m), "cm", note)


def _position(flight: RecordedFlight) -> Figure | None:
    """How far the drone was from where it thought it was."""
    if flight.truth is None:
        return None
    error_m = _apart_m(flight, flight.estimate, flight.truth)
    if not len(error_m):
        return None
    note = "p95, believed against true"
    smoothed_m = _apart_m(flight, flight.smoothed, flight.truth)
    if len(smoothed_m):
        note += f"; smoothed {_centimetres(float(np.percentile(smoothed_m, 95)))} cm"
    return Figure("Position error", _centimetres(float(np.percentile(error_m, 95))), "cm", note)


def _smoothing(flight: RecordedFlight) -> Figure | None:
    """How far the drone believed itself from where the whole flight says that it was."""
    apart_m = _apart_m(flight, flight.estimate, flight.smoothed)
    if not len(apart_m):
        return None
    rms_m = float(np.sqrt(np.mean(apart_m**2)))
    return Figure("Live pose", _centimetres(rms_m), "cm", "RMS, believed against smoothed")


def _apart_m(flight: RecordedFlight, track: Track, other: Track) -> Array:
    """Horizontal distances between two tracks in flight, where both are known."""
    x, y = other.at(track.t_s)
    apart_m = np.hypot(track.x_m - x, track.y_m - y)[flight.flying(track.t_s)]
    known: Array = apart_m[np.isfinite(apart_m)]
    return known


def _landing(flight: RecordedFlight) -> Figure | None:
    error_m = _number(flight.summary, "landed_error_m")
    return (
        None
        if error_m is None
        else Figure("Landing error", _centimetres(error_m), "cm", "from the pad's centre")
    )


def _codes(summary: Mapping[str, object]) -> Figure | None:
    read, expected = _number(summary, "codes_read"), _number(summary, "codes_expected")
    if read is None or not expected:
        return None
    wrong = _number(summary, "codes_wrong") or 0.0
    tone = "bad" if wrong else "good" if read >= expected else ""
    return Figure("Codes read", number(read), f"of {number(expected)}", f"{number(wrong)} wrong", tone)


def flight_time_s(flight: RecordedFlight) -> float | None:
    """Time in the air, by the summary or else by the phases; None when it never flew."""
    seconds = _number(flight.summary, "flight_time_s")
    if seconds is None:
        airborne = [span.end_s - span.start_s for span in flight.phases if span.phase not in _ON_GROUND]
        seconds = sum(airborne) if airborne else None
    return seconds


def _flight_time(flight: RecordedFlight) -> Figure | None:
    seconds = flight_time_s(flight)
    return None if seconds is None else Figure("Flight time", clock(seconds), "min")


_ON_GROUND = frozenset({Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP, Phase.DONE, Phase.ABORTED})


def _latency(flight: RecordedFlight) -> Figure | None:
    told = flight.summary.get("latency_ms")
    if isinstance(told, dict) and (p99 := _number(told, "p99")) is not None:
        p50 = _number(told, "p50")
    elif "total" in flight.latency.stages:
        total = flight.latency.stage("total")
        p50, p99 = (float(np.nanpercentile(total, percent)) for percent in (50, 99))
    else:
        return None
    note = "p99, picture to setpoint" if p50 is None else f"p99; p50 {number(p50, 1)} ms"
    return Figure("Latency", number(p99, 1), "ms", note)


def _delay(flight: RecordedFlight) -> Figure | None:
    """The camera's delay as the lines have it, against the configured one."""
    seen = flight.sensors
    if not seen.is_known:
        return None
    sigma = number(seen.delay_sigma_s * 1e3, 1)
    tilted = f"{_degrees(seen.mount_roll_rad, seen.mount_pitch_rad)}° ± {_degrees(seen.mount_sigma_rad)}"
    turned = f"{_degrees(seen.mount_yaw_rad)}° ± {_degrees(seen.mount_yaw_sigma_rad)}"
    note = f"± {sigma}, more than configured; mounted {tilted} off in roll and pitch, {turned} in yaw"
    return Figure("Camera delay", f"{-seen.delay_s * 1e3:+.0f}", "ms", note)


def _tilt_bias(flight: RecordedFlight) -> Figure | None:
    """What the lines found the told roll and pitch to be wrong by; None of a log that does not tell."""
    seen = flight.sensors
    if math.isnan(seen.tilt_sigma_rad):
        return None
    note = f"± {_degrees(seen.tilt_sigma_rad)}, told too small in roll and pitch at the end"
    return Figure("Tilt bias", _degrees(seen.tilt_roll_rad, seen.tilt_pitch_rad), "°", note)


def _degrees(*angles_rad: float) -> str:
    return " / ".join("-" if math.isnan(angle) else number(math.degrees(angle), 1) for angle in angles_rad)


def _scales(flight: RecordedFlight) -> Figure | None:
    """The height as the lines have it, against the one told; None of an older log."""
    seen = flight.sensors
    if math.isnan(seen.height_share):
        return None
    focal, focal_sigma = (number(100.0 * share, 1) for share in (seen.focal_share, seen.scale_sigma))
    sigma = number(100.0 * seen.height_sigma, 1)
    note = f"± {sigma}, more than told; focal length {focal} % ± {focal_sigma} more than configured"
    return Figure("Height", f"{100.0 * seen.height_share:+.1f}", "%", note)


def _frames(flight: RecordedFlight) -> Figure | None:
    frames, dropped = _number(flight.summary, "frames"), _number(flight.summary, "frames_dropped")
    last = flight.last_status
    if frames is None and last is not None:
        frames, dropped = float(last.frames), float(last.frames_dropped)
    if frames is None:
        return None
    note = "" if dropped is None else f"{number(dropped)} dropped"
    return Figure("Frames", f"{frames:,.0f}".replace(",", "\u202f"), "", note)


def _battery(flight: RecordedFlight) -> Figure | None:
    charge = flight.telemetry.battery_frac[np.isfinite(flight.telemetry.battery_frac)]
    if not len(charge):
        return None
    used = float(charge[0] - charge[-1])
    return Figure("Battery", number(charge[-1] * 100, 0), "%", f"{number(used * 100, 0)} % used")
