"""The cameras: do they open, give the configured pictures at the configured rate, and are they of use?"""

from __future__ import annotations

import asyncio
import statistics
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field

from flightd.adapters.camera.connect import connect_camera
from flightd.config.camera import CameraConfig
from flightd.config.front_camera import FrontCameraConfig
from flightd.config.schema import Config
from flightd.core.errors import TransientError, UnavailableError
from flightd.core.exposure import ExposureState
from flightd.core.types import Image
from flightd.doctor.check import Check, error, ok, warning
from flightd.doctor.picture_of import picture_of
from flightd.mission.plan.flight_plan import counts_shelves
from flightd.ports import Clock, TellsExposure, Vehicle
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest
from flightd.site.site import Site
from flightd.vision.floor.brightness import Brightness, brightness_of
from flightd.vision.line_detector import Detector

_FIRST_S = 6.0
_WATCH_S = 2.0
_LEAST_PICTURES = 5
_SLOW = 0.85
_DARK, _BRIGHT = 12.0, 243.0
_BUSY = 0.8
_LOOKS = 7


@dataclass(slots=True)
class Pictures:
    """What came: arrival times, the newest picture of a second ago or later, what was refused, the delays
    since mid-exposure, how bright the pictures were, and how the camera was read back."""

    arrivals_ns: list[int] = field(default_factory=list)
    picture: Image | None = None
    trouble: str = ""
    delays_s: list[float] = field(default_factory=list)
    series: list[Brightness] = field(default_factory=list)
    exposure: ExposureState | None = None

    @property
    def rate_hz(self) -> float:
        """Pictures per second; 0 for fewer than two."""
        if len(self.arrivals_ns) < 2:
            return 0.0
        return (len(self.arrivals_ns) - 1) * 1e9 / max(self.arrivals_ns[-1] - self.arrivals_ns[0], 1)


async def watch(
    config: CameraConfig | FrontCameraConfig, clock: Clock, vehicle: Vehicle | None = None
) -> Pictures:
    """Let the camera run for some seconds.  InputError for a wrong address."""
    pictures = Pictures()
    first = asyncio.Event()
    newest: Latest[FrameTicket] = Latest()

    def take(ticket: FrameTicket) -> None:
        pictures.arrivals_ns.append(ticket.arrival_ns)
        pictures.delays_s.append((ticket.arrival_ns - ticket.stamp_ns) * 1e-9)
        first.set()
        if pictures.picture is None and len(pictures.arrivals_ns) >= _LEAST_PICTURES:
            pictures.picture = picture_of(ticket)  # the first ones are exposed badly
        if pictures.picture is not None:
            newest.put(ticket)

    async def measure() -> None:
        async for brightness in brightness_series(newest):
            pictures.series.append(brightness)

    def complain(text: str) -> None:
        pictures.trouble = text

    camera = connect_camera(config, clock, take, complain, vehicle)
    running = asyncio.ensure_future(camera.run())
    started = asyncio.ensure_future(first.wait())
    measuring = asyncio.ensure_future(measure())
    try:
        await asyncio.wait({running, started}, timeout=_FIRST_S, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait({running}, timeout=_WATCH_S if first.is_set() else 0.0)
        if isinstance(camera, TellsExposure):
            pictures.exposure = camera.exposure_state
    finally:
        for task in (started, measuring, running):
            task.cancel()
        ended = await asyncio.gather(running, started, measuring, return_exceptions=True)
    if isinstance(ended[0], TransientError | UnavailableError):
        pictures.trouble = str(ended[0])
    else:
        for error_of_part in ended:
            if isinstance(error_of_part, Exception):
                raise error_of_part
    return pictures


async def brightness_series(tickets: Latest[FrameTicket]) -> AsyncIterator[Brightness]:
    """How bright the pictures behind these tickets are, as long as they come; those that are gone are left
    out."""
    while True:
        picture = picture_of(await tickets.get())
        if picture is not None:
            yield await asyncio.to_thread(brightness_of, picture)


async def watch_front(config: Config, clock: Clock) -> Pictures | None:
    """The same of the front camera; None where there is none."""
    front = config.front_camera
    return await watch(front, clock) if front.is_fitted else None


def judge_camera(config: Config, found: Pictures) -> list[Check]:
    """Size (pictures of another are refused by the adapter), rate and brightness."""
    camera, rate_hz = config.camera, found.rate_hz
    if len(found.arrivals_ns) < _LEAST_PICTURES:
        text = found.trouble or f"{camera.url}: no picture in {_FIRST_S:g} s"
        return [error("camera", text, "check camera.url, cable, rights (group video) and who else uses it")]
    text = f"{camera.url}: {camera.width_px}x{camera.height_px} px, {rate_hz:.1f} pictures a second"
    checks = []
    least_hz = 2.0 / config.mission.lines_hold_s
    if rate_hz < least_hz:
        remedy = (
            f"at least {least_hz:.0f} are needed (mission.lines_hold_s); more light, another size or format"
        )
        checks.append(error("camera", text, remedy))
    elif rate_hz < _SLOW * camera.fps:
        remedy = f"camera.fps is {camera.fps:g}: more light, another size or format, or correct the key"
        checks.append(warning("camera", text, remedy))
    else:
        checks.append(ok("camera", text))
    if found.trouble:
        remedy = "nobody flies by frames of a doubtful time; flightd guide cameras says what is needed"
        checks.append(warning("camera", found.trouble, remedy))
    if found.picture is not None and not _DARK < (level := float(found.picture.mean())) < _BRIGHT:
        word = "black" if level <= _DARK else "white"
        checks.append(error("camera", f"pictures are {word}", "take off the lens cap; check the exposure"))
    return checks


def judge_front_camera(config: Config, site: Site, found: Pictures) -> Check:
    """Size, as of the down camera, and rate.  Who counts no shelves flies without its pictures."""
    name, camera, rate_hz = "front camera", config.front_camera, found.rate_hz
    if not rate_hz:
        text = found.trouble or f"{camera.url}: no picture in {_FIRST_S:g} s"
        complaint = error if counts_shelves(config, site) else warning
        remedy = "check front_camera.url, cable, rights (group video) and who else uses it"
        return complaint(name, text, remedy)
    text = f"{camera.url}: {camera.width_px}x{camera.height_px} px, {rate_hz:.1f} pictures a second"
    if rate_hz < _SLOW * camera.fps:
        remedy = f"front_camera.fps is {camera.fps:g}: more light, another size or format, or correct the key"
        return warning(name, text, remedy)
    if found.trouble:
        remedy = "labels are placed by these times; flightd guide cameras says what is needed"
        return warning(name, found.trouble, remedy)
    return ok(name, text)


def check_vision(config: Config, detector: Detector, picture: Image | None) -> list[Check]:
    """What the detector finds in a picture, and whether the detectors keep up with the camera."""
    name = f"{config.vision.method}, profile {detector.profile.name}"
    if picture is None:
        return [warning("vision", f"{name}: loads, had no picture to look at", "see the camera's line")]
    usual_s, lines = look(detector, picture)
    text = f"{name}: {usual_s * 1000:.0f} ms a picture, {lines} lines seen"
    busy = usual_s * config.camera.fps / config.vision.workers
    checks = []
    if busy > _BUSY:
        remedy = "more vision.workers, smaller pictures or a lower camera.fps; pictures will be dropped"
        checks.append(warning("vision", f"{text}: detectors are {busy:.0%} busy", remedy))
    if not lines:
        remedy = "none may be in view here; else train the colour: flightd train-colour"
        checks.append(warning("vision", text, remedy))
    return checks or [ok("vision", text)]


def look(detector: Detector, picture: Image) -> tuple[float, int]:
    """The usual time of a look at a picture, s (the median of several), and the lines in it."""
    took_s, lines = list[float](), 0
    for _ in range(_LOOKS):
        start_s = time.perf_counter()
        lines = len(detector.detect(picture).lines)
        took_s.append(time.perf_counter() - start_s)
    return statistics.median(took_s), lines
