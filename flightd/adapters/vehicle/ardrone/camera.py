"""The drone's one video stream as the daemon's cameras: pictures in shared memory, a ticket for each."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

from flightd.adapters.vehicle.ardrone.settings import DroneCamera
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.ardrone.video import DecodedFrame, VideoStream
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameRing, FrameTicket

SLOTS = 8


class ArDroneCamera:
    """Hands a ticket for each picture to the taker of the camera that the stream shows.

    `latency_s` is the least delay from mid-exposure to arrival.  Both cameras come through one channel,
    `vehicle.select_camera` chooses.  Pictures exposed while the drone is switching may be of either and go
    to nobody (`unassigned` counts them), whenever they are read.
    """

    def __init__(
        self,
        vehicle: ArDroneVehicle,
        latency_s: float,
        clock: Clock,
        on_frame: dict[DroneCamera, Callable[[FrameTicket], None]],
        hold: Hold = nullcontext,
    ) -> None:
        self._vehicle = vehicle
        self._on_frame = on_frame
        self._address = vehicle.video_address
        self._clock = clock
        self._latency_s = latency_s
        self._hold = hold
        self._ring: FrameRing | None = None
        self._stream: VideoStream | None = None
        self._seq = 0
        self.unassigned = 0

    @property
    def frames(self) -> int:
        """Pictures delivered so far."""
        return self._seq

    @property
    def refused(self) -> int:
        """Pictures of neither camera, and those out of order by the encoder's clock."""
        return self.unassigned + (0 if self._stream is None else self._stream.out_of_order)

    def expose(self, part: float, gain: float) -> None:
        """The drone exposes by itself: its pictures stay as they are."""

    async def run(self) -> None:
        """Receive until cancelled; the shared memory lives as long.  Raises `UnavailableError` when
        PyAV is missing."""
        try:
            self._stream = VideoStream(self._address, self._latency_s, self._clock, self._show, self._hold)
            await self._stream.run()
        finally:
            if self._ring is not None:
                self._ring.close()
                self._ring = None  # started again, it needs another

    def _show(self, picture: DecodedFrame) -> None:
        since_ns = self._vehicle.camera_since_ns
        take = self._on_frame.get(self._vehicle.camera)
        if take is None or since_ns is None or picture.stamp_ns < since_ns:
            self.unassigned += 1
            return
        height_px, width_px = picture.bgr.shape[:2]
        ring = self._ring_for(width_px, height_px)
        slot = ring.begin(self._seq)
        ring.pixels(slot)[:] = picture.bgr
        ring.publish(slot, self._seq, picture.stamp_ns)
        ticket = FrameTicket(
            ring.name, slot, SLOTS, self._seq, picture.stamp_ns, picture.arrival_ns, width_px, height_px
        )
        self._seq += 1
        take(ticket)

    def _ring_for(self, width_px: int, height_px: int) -> FrameRing:
        ring = self._ring
        if ring is None or (ring.width_px, ring.height_px) != (width_px, height_px):
            if ring is not None:
                ring.close()
            self._ring = ring = FrameRing.create(SLOTS, width_px, height_px)
        return ring
