"""Cameras, streams and recordings that OpenCV opens: a process of their own reads them into shared memory."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from flightd.adapters.camera.capture_process import SLOTS, Captured, CaptureOver, capture
from flightd.adapters.camera.exposure_times import TimeSource
from flightd.adapters.camera.frame_order import FrameOrder
from flightd.adapters.camera.source import Source
from flightd.core.errors import TransientError
from flightd.core.exposure import ExposureMismatch, ExposureState
from flightd.ports import Clock
from flightd.runtime.child_process import LinkedProcess
from flightd.runtime.frame_ring import FrameRing, FrameTicket

_GIVING_BACK_S = 1.0
"""So long a capture process may take to end by itself."""


class CaptureCamera:
    """Hands the ticket of each frame to `on_frame`, exposed when driver or stream say so; where they say
    nothing, `on_trouble` hears what error remains, and what a camera does not do as it was set.

    `clock` is the machine's monotonic one.  `run` raises TransientError when the source cannot be opened,
    ends or gives frames of another size; started again it tries anew.
    """

    def __init__(
        self,
        source: Source,
        latency_s: float,
        clock: Clock,
        on_frame: Callable[[FrameTicket], None],
        on_trouble: Callable[[str], None],
    ) -> None:
        self._source = source
        self._latency_ns = round(latency_s * 1e9)
        self._clock = clock
        self._on_frame = on_frame
        self._on_trouble = on_trouble
        self._order = FrameOrder(self._name, self._latency_ns, on_trouble)
        self._without_time = self._without_time_before = 0
        self._wanted = 1.0, 1.0
        self._process: LinkedProcess | None = None
        self._asked = False
        self._mismatches: tuple[ExposureMismatch, ...] = ()
        self._state: ExposureState | None = None
        self.frames = 0

    @property
    def refused(self) -> int:
        """Frames that were not delivered: out of order, old, or of no known time."""
        return self._order.refused + self._without_time_before + self._without_time

    @property
    def pid(self) -> int | None:
        """The capture process, None while there is none."""
        return None if self._process is None else self._process.pid

    @property
    def exposure_state(self) -> ExposureState | None:
        """As it was read back last; None while nothing was."""
        return self._state

    def expose(self, part: float, gain: float) -> None:
        """Ask the device for frames of these parts of its usual exposure and gain; streams and recordings are
        as they are."""
        if (part, gain) != self._wanted:
            self._wanted = part, gain
            self._ask()

    async def run(self) -> None:
        source = self._source
        ring = await _memory_for(source)
        over: asyncio.Future[str] = asyncio.get_running_loop().create_future()

        def end(reason: str) -> None:
            if not over.done():
                over.set_result(reason)

        def take(message: Any) -> None:
            if isinstance(message, Captured):
                self._deliver(ring, message)
            elif isinstance(message, CaptureOver):
                end(message.reason)
            elif isinstance(message, ExposureState):
                self._take_state(message)
            elif message is TimeSource.ARRIVAL:
                self._on_trouble(
                    f"camera {self._name} does not tell when a frame was exposed: its time is that of its"
                    f" arrival, up to {1000 / source.fps:.0f} ms late"
                )

        arguments = (source, ring.name, self._latency_ns)
        process = LinkedProcess(capture, arguments, take, lambda _: end("the capture process died"))
        self._process, self._asked = process, not source.order.is_empty
        try:
            if self._wanted != (1.0, 1.0):
                self._ask()
            raise TransientError(f"camera {self._name}: {await over}")
        finally:
            self._process = self._state = None
            self._without_time_before, self._without_time = self.refused - self._order.refused, 0
            await self._ended(process, ring)

    @property
    def _name(self) -> str:
        return self._source.name

    def _take_state(self, state: ExposureState) -> None:
        self._state = state
        found = state.mismatches(self._source.order)
        if found and found != self._mismatches:
            self._on_trouble(f"camera {self._name}: {'; '.join(map(str, found))}")
        self._mismatches = found

    async def _ended(self, process: LinkedProcess, ring: FrameRing) -> None:
        process.hang_up()
        try:
            if self._asked:  # the process gives the device's own exposure back
                await asyncio.to_thread(process.join, _GIVING_BACK_S)
        finally:
            process.kill()
            try:
                # in a thread: a driver may keep even a killed process
                await asyncio.to_thread(process.join, 1.0)
            finally:
                ring.close()

    def _ask(self) -> None:
        if self._process is not None and self._source.kind.is_told:
            self._asked = True
            self._process.send(self._wanted)

    def _deliver(self, ring: FrameRing, frame: Captured) -> None:
        now_ns = self._clock.now_ns()
        self._without_time = frame.refused
        try:
            ring.check(frame.slot, frame.seq)
        except TransientError as err:  # it waited here for so long
            self._order.refuse(str(err), now_ns)
            return
        if self._order.passes(frame.stamp_ns, now_ns):
            self.frames += 1
            self._on_frame(
                FrameTicket(
                    ring.name,
                    frame.slot,
                    SLOTS,
                    frame.seq,
                    frame.stamp_ns,
                    frame.arrival_ns,
                    ring.width_px,
                    ring.height_px,
                    frame.exposure,
                    frame.gain,
                )
            )


async def _memory_for(source: Source) -> FrameRing:
    """In a thread: the memory is taken at once, tens of megabytes of it."""
    taken = asyncio.ensure_future(
        asyncio.to_thread(FrameRing.create, SLOTS, source.width_px, source.height_px)
    )
    try:
        return await asyncio.shield(taken)
    except asyncio.CancelledError:
        (await taken).close()
        raise
