"""The camera's delay, measured: somebody rocks the drone by hand, propellers off, above a painted line."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.config.schema import Config
from flightd.core.errors import FlightdError
from flightd.core.types import Attitude
from flightd.doctor.check import Check, error, ok, warning
from flightd.doctor.picture_of import picture_of
from flightd.ports import Clock
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest
from flightd.tracking.delay_by_tilt import LEAST_EXPLAINED, DelayByTilt, FollowedLines, delay_by_tilt
from flightd.vision.line_detector import Detector

_NAME = "delay"
_HOW = "hold it about 1 m above a painted line and rock it by 5 to 10 degrees, once or twice a second"
_POLL_S = 0.02
_AGREES_S, _SIGMAS = 0.010, 3.0


async def check_delay(
    config: Config, clock: Clock, detector: Detector, seconds: float, say: Callable[[str], None]
) -> tuple[Check, DelayByTilt | None]:
    """Look on for so long while the drone is rocked; `say` hears what a person is to do.  Whoever calls knows
    that the vehicle is not armed.  The delay itself is None where it could not be measured."""
    say(f"propellers off: {_HOW}, for {seconds:g} s from now")
    try:
        told = await _watched(config, clock, detector, seconds)
    except FlightdError as err:
        return error(_NAME, str(err), "mend what the lines of camera and vehicle say first"), None
    say("thank you, that is enough")
    return judge_delay(config.camera.latency_s, told), told if told.is_known else None


def judge_delay(configured_s: float, told: DelayByTilt) -> Check:
    """What was measured against the `configured_s` of `camera.latency_s`."""
    rocked = f"rocked by {math.degrees(told.tilt_rad):.1f} deg (rms) over {told.frames} lines"
    if not told.frames:
        return warning(_NAME, "not measured: no line was seen", _HOW)
    if not told.is_known:
        why = f"{rocked}, of whose motion the tilt explains {told.explained:.0%}"
        return warning(_NAME, f"not measured: {why}, {LEAST_EXPLAINED:.0%} are needed", _HOW)
    whole_s = configured_s - told.delay_s
    text = (
        f"{whole_s * 1e3:.0f} ms (sigma {told.sigma_s * 1e3:.1f}) from exposure to arrival, by the attitude;"
        f" {configured_s * 1e3:.0f} ms are configured; {rocked}"
    )
    if abs(told.delay_s) <= max(_AGREES_S, _SIGMAS * told.sigma_s):
        return ok(_NAME, text)
    if whole_s < 0.0:
        return error(_NAME, text, "frames are newer than the attitude: its telemetry is late, see its link")
    return warning(_NAME, text, f"camera.latency_s = {whole_s:.3f}")


async def _watched(config: Config, clock: Clock, detector: Detector, seconds: float) -> DelayByTilt:
    """What camera and attitude told.  FlightdError for an address that is none, or a device that ends."""
    vehicle = connect_vehicle(config.vehicle, clock, config.control)
    frames: Latest[FrameTicket] = Latest()
    camera = connect_camera(config.camera, clock, frames.put, lambda _: None, vehicle)
    followed = FollowedLines(config.camera.lens(), config.camera.readout_s)
    attitudes = list[Attitude]()

    async def look() -> None:
        while True:
            ticket = await frames.get()
            picture = picture_of(ticket)
            if picture is not None:  # in a thread: the attitudes' times are taken in this one
                seen = await asyncio.to_thread(detector.detect, picture, ticket.seq, ticket.stamp_ns)
                followed.add(ticket.stamp_ns, seen.lines)

    parts = [asyncio.ensure_future(part) for part in (vehicle.run(), camera.run(), look())]
    until_ns = clock.now_ns() + round(seconds * 1e9)
    try:
        while clock.now_ns() < until_ns and not any(part.done() for part in parts):
            await asyncio.wait(parts, timeout=_POLL_S, return_when=asyncio.FIRST_COMPLETED)
            attitudes += vehicle.attitudes()
    finally:
        for part in parts:
            part.cancel()
        ended = await asyncio.gather(*parts, return_exceptions=True)
    for error_of_part in ended:
        if isinstance(error_of_part, Exception):
            raise error_of_part
    return delay_by_tilt(followed.runs, attitudes)
