"""A simulated camera: a peer that renders into shared memory and tells of each picture by UDP.

It exposes at its own rate, renders in a process of its own and delivers after the capture delay, with
jitter, as a real camera and its driver do.  Its clock is not the daemon's.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import random
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import cv2

from flightd.core.errors import InputError, RunError, TransientError
from flightd.core.geometry import Lens
from flightd.core.types import Image
from flightd.ports import Clock
from flightd.runtime.child_process import Child
from flightd.runtime.clock import Hold
from flightd.runtime.frame_notice import FrameNotice, decode_request, encode_notice
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.sim.leap import NEVER, Leap, LeapInFlight
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import USUALLY, Taking

_SPARE_SLOTS = 8
_EXPOSURES, _GAINS = (0.05, 8.0), (0.25, 8.0)
"""Parts of its usual exposure and gain that a camera is able to."""
_CLOCK_OFFSET_NS = 7_300_000_000_000


class Optics(Protocol):
    """What a peer must know of its camera."""

    @property
    def lens(self) -> Lens: ...

    @property
    def fps(self) -> float: ...

    @property
    def capture_delay_s(self) -> float: ...

    @property
    def jitter_s(self) -> float: ...


class PictureMaker(Protocol):
    """Renders one camera's pictures."""

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image: ...


class _RenderWorker:
    """Inside the process: answers (kinematics, seq, slot, how) by rendering into the ring, with an empty
    text; from the first error on with that, in words."""

    def __init__(self, make: Callable[[], PictureMaker], camera: Optics, ring: str) -> None:
        self._ring = FrameRing.attach(ring, _slots(camera), camera.lens.width_px, camera.lens.height_px)
        self._make = make
        self._problem = _problem_of(self._begin)

    def __call__(self, request: tuple[Kinematics, int, int, Taking]) -> str:
        self._problem = self._problem or _problem_of(partial(self._render, *request))
        return self._problem

    def _begin(self) -> None:
        self._renderer = self._make()

    def _render(self, kinematics: Kinematics, seq: int, slot: int, how: Taking) -> None:
        self._renderer.render(kinematics, seq, self._ring.pixels(slot), how)


def _problem_of(act: Callable[[], None]) -> str:
    """What `act` died of, in one line; the error itself need not survive the way to another process."""
    try:
        act()
    except Exception as err:  # noqa: BLE001 - whatever it is, the world has to hear of it
        raised = traceback.extract_tb(err.__traceback__)[-1]
        text = " ".join(str(err).split())
        return f"{type(err).__name__}: {text} ({Path(raised.filename).name}:{raised.lineno})"
    return ""


@dataclass(slots=True)
class CameraTrouble:
    """What is wrong with a camera just now."""

    gone: bool = False
    late_s: float = 0.0
    straggler_s: float = 0.0
    straggler_every: int = 1
    """One frame of so many is late by `straggler_s`, the others come before it."""
    frozen: bool = False
    level: int | None = None
    """Every pixel is of this grey level."""
    turn_deg: float = 0.0
    """The picture turned clockwise about its middle."""


class _Requests(asyncio.DatagramProtocol):
    """What the daemon asks of a camera; anything else is dropped."""

    def __init__(self, expose: Callable[[float, float], None]) -> None:
        self._expose = expose

    def datagram_received(self, data: bytes, addr: Any) -> None:  # noqa: ARG002 - asyncio names it
        with contextlib.suppress(InputError):
            wanted = decode_request(data)
            self._expose(_within(wanted.exposure, _EXPOSURES), _within(wanted.gain, _GAINS))


class CameraPeer:
    """Takes pictures of what `truth_at` says until cancelled, and sends notices of them to the daemon at
    `address`; or, with `show`, hands the pictures themselves to a vehicle that transmits them.

    `make` is called in the rendering process (it must be picklable); `seed` draws the delivery's jitter.
    While `wanted` says no, no picture is taken; `lamp` is that of `PictureMaker`; after the `leap` all
    pictures come later.  `drawn` hears of each picture that lies in memory, by this clock, long before its
    notice is sent.  Time is held by `hold` while one is being drawn.  A renderer that fails ends it with
    a RunError that has the camera's `name`: a flight that goes on blind for a fault of its world tells
    nothing."""

    def __init__(
        self,
        camera: Optics,
        make: Callable[[], PictureMaker],
        seed: str,
        address: tuple[str, int],
        truth_at: Callable[[int], Kinematics],
        clock: Clock,
        show: Callable[[Image, int], None] | None = None,
        wanted: Callable[[], bool] = lambda: True,
        hold: Hold = contextlib.nullcontext,
        name: str = "camera",
        lamp: Callable[[], float] = float,
        leap: Leap = NEVER,
        drawn: Callable[[FrameTicket], None] = lambda _: None,
    ) -> None:
        self._name, self._leap, self._drawn = name, LeapInFlight(leap), drawn
        self._lamp = lamp
        self._wanted = wanted
        self._hold = hold
        self._show = show
        self._camera = camera
        self._period_ns = round(1e9 / camera.fps)
        self._address = address
        self._truth_at = truth_at
        self._clock = clock
        self._random = random.Random(seed)
        self._make = partial(_RenderWorker, make, camera)
        self._ready = asyncio.Event()
        self._turn = asyncio.Lock()
        self.late = 0
        """Pictures that the machine was too slow to take."""
        self._how = USUALLY
        self.trouble = CameraTrouble()
        self._kept: Image | None = None
        self._newest = 0

    async def run(self) -> None:
        loop, lens = asyncio.get_running_loop(), self._camera.lens
        transport, _ = await loop.create_datagram_endpoint(
            lambda: _Requests(self._expose_with), remote_addr=self._address
        )
        self._ring = FrameRing.create(_slots(self._camera), lens.width_px, lens.height_px)
        make = partial(self._make, self._ring.name)
        # one that dies before it is ready says so when it is asked for the first picture
        child = Child(make, lambda _: self._ready.set(), lambda _: self._ready.set())
        try:
            with self._hold():
                await self._ready.wait()
            async with asyncio.TaskGroup() as pictures:
                await self._expose(child, transport, pictures)
        finally:
            child.kill()
            child.join(1.0)
            transport.close()
            self._ring.close()

    def _expose_with(self, part: float, gain: float) -> None:
        self._how = Taking(part, gain)

    async def _expose(self, child: Child, transport: Any, pictures: asyncio.TaskGroup) -> None:
        """Take a picture each period; each is rendered and delivered by a task of its own."""
        period_ns = self._period_ns
        exposure_ns = self._clock.now_ns()
        seq = 0
        while True:
            exposure_ns += period_ns
            behind_ns = self._clock.now_ns() - exposure_ns
            if behind_ns > 4 * period_ns:  # the machine cannot keep up: the camera skips, it does not queue
                missed = behind_ns // period_ns
                exposure_ns += missed * period_ns
                seq += missed
                self.late += missed
            await asyncio.sleep(max((exposure_ns - self._clock.now_ns()) * 1e-9, 0.0))
            if self._wanted() and not self.trouble.gone:
                jitter_s = self._random.random() * self._camera.jitter_s
                due_ns = exposure_ns + round((self._camera.capture_delay_s + jitter_s) * 1e9)
                truth = self._truth_at(exposure_ns)
                straggles = seq % self.trouble.straggler_every == 0
                late_s = self.trouble.late_s + (self.trouble.straggler_s if straggles else 0.0)
                due_ns += round(late_s * 1e9) + self._leap.ns(exposure_ns, truth.height_m)
                how = replace(self._how, lamp=self._lamp())
                pictures.create_task(self._deliver(child, transport, truth, seq, due_ns, how))
            seq += 1

    async def _deliver(
        self, child: Child, transport: Any, truth: Kinematics, seq: int, due_ns: int, how: Taking
    ) -> None:
        early_s = self._camera.capture_delay_s + self._camera.jitter_s
        # a late picture is drawn late: the ring holds no more than the usual delay's
        await asyncio.sleep(max((due_ns - self._clock.now_ns()) * 1e-9 - early_s, 0.0))
        rendering = asyncio.ensure_future(self._render(child, truth, seq, how, due_ns + self._period_ns))
        try:
            await asyncio.sleep((due_ns - self._clock.now_ns()) * 1e-9)
            with self._hold():
                slot = await rendering
        except TransientError:
            self.late += 1
            return
        finally:
            rendering.cancel()
        if self._show is not None:
            self._show(self._ring.pixels(slot), truth.stamp_ns)
            return
        lens = self._camera.lens
        notice = FrameNotice(
            self._ring.name,
            self._ring.slots,
            slot,
            seq,
            truth.stamp_ns + _CLOCK_OFFSET_NS,
            lens.width_px,
            lens.height_px,
            how.exposure,
            how.gain,
        )
        transport.sendto(encode_notice(notice))

    async def _render(self, child: Child, truth: Kinematics, seq: int, how: Taking, latest_ns: int) -> int:
        """The slot of the picture.  TransientError when its turn did not come until `latest_ns`, RunError
        when it cannot be drawn at all."""
        async with self._turn:
            if self._clock.now_ns() > latest_ns:  # a slow machine costs pictures; queued, they would be old
                raise TransientError(f"picture {seq}: the renderer is behind")
            slot = self._ring.begin(seq)
            try:
                problem = await child.ask((truth, seq, slot, how))
            except TransientError as err:
                problem = str(err)
            if problem:
                raise RunError(f"the simulated {self._name} cannot draw picture {seq}: {problem}")
            self._spoil(self._ring.pixels(slot))
            self._newest = slot
            self._ring.publish(slot, seq, truth.stamp_ns)
            if self._show is None:
                self._drawn(self._ticket(slot, seq, truth.stamp_ns, how))
            return slot

    def _ticket(self, slot: int, seq: int, stamp_ns: int, how: Taking) -> FrameTicket:
        ring, lens, now_ns = self._ring, self._camera.lens, self._clock.now_ns()
        size = lens.width_px, lens.height_px
        return FrameTicket(ring.name, slot, ring.slots, seq, stamp_ns, now_ns, *size, how.exposure, how.gain)

    def _spoil(self, picture: Image) -> None:
        """What is wrong with the camera shows."""
        trouble = self.trouble
        if not trouble.frozen:
            self._kept = None
        elif self._kept is None:
            self._kept = self._ring.pixels(self._newest).copy()
        if self._kept is not None:
            picture[:] = self._kept
        if trouble.level is not None:
            picture[:] = trouble.level
        if trouble.turn_deg:
            lens = self._camera.lens
            middle = (lens.width_px - 1) / 2, (lens.height_px - 1) / 2
            turn = cv2.getRotationMatrix2D(middle, -trouble.turn_deg, 1.0)
            size = lens.width_px, lens.height_px
            picture[:] = cv2.warpAffine(picture, turn, size, borderMode=cv2.BORDER_REPLICATE)


def _within(part: float, able: tuple[float, float]) -> float:
    return min(max(part, able[0]), able[1])


def _slots(camera: Optics) -> int:
    """As many pictures as are on their way at once, and some that are being looked at."""
    return math.ceil(camera.fps * (camera.capture_delay_s + 4 * camera.jitter_s)) + _SPARE_SLOTS
