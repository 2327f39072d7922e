"""The frames of a flight as if all rows of each had been exposed at once, by the motion that is fitted."""

from __future__ import annotations

from typing import Final

from flightd.core.types import LineSet
from flightd.studies.flight_fit.linearised import FlightState
from flightd.studies.flight_fit.motion import VX, VY, Sensor
from flightd.tracking.rolling_shutter import ImageMotion, as_of_one_moment

_RATE_S: Final = 0.02
"""The told attitude's rates are taken over so long before and after, as in flight."""


def frames_of_one_moment(flight: FlightState, readout_s: float) -> tuple[LineSet, ...]:
    """By rates as told, and velocity, height, mount and lens as they are believed now."""
    record = flight.record
    if not readout_s:
        return record.frames
    when_s = record.frame_s + flight.sensors[Sensor.DELAY]
    before, after = (record.attitudes.at(when_s + step_s) for step_s in (-_RATE_S, _RATE_S))
    rates_radps = ((after - before) / (2.0 * _RATE_S)).tolist()
    velocities_mps = flight.states[:, [VX, VY]].tolist()
    poses, mount, lens = flight.poses(), flight.believed_mount(), flight.believed_lens()
    motions = (
        ImageMotion.of(tuple(rates), tuple(velocity), yaw_rad, height_m, mount)
        for rates, velocity, yaw_rad, height_m in zip(
            rates_radps, velocities_mps, poses.yaw_rad.tolist(), poses.height_m.tolist(), strict=True
        )
    )
    return tuple(
        as_of_one_moment(seen, lens, motion, readout_s)
        for seen, motion in zip(record.frames, motions, strict=True)
    )
