"""The down camera's frames through the detector processes, in the order of their exposure."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from flightd.app.detection.detector_pool import Detection, Detectors
from flightd.app.detection.latency import LatencyBook
from flightd.app.flight import Tasks
from flightd.app.record_pace import RecordPace
from flightd.core.geometry import Lens
from flightd.core.preview import CameraName, Preview, found_lines
from flightd.core.topics import Topic
from flightd.core.types import LineSet
from flightd.ports import Ground, Recorder
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest

_RATE_NS = 1_000_000_000


class DetectionPipeline:
    """`app.flight.Vision`: frames in by `frames`, lines out by `fresh`; `workers` are looked at at once.

    Frames are kept for the recorder at up to `picture_fps` (0: none) as its `pace` allows, for the ground
    when it asks.
    `lens` says where its pictures show the lines, `latency` hears from the pump when a setpoint is on the
    wire."""

    def __init__(
        self,
        detectors: Detectors,
        workers: int,
        recorder: Recorder,
        ground: Ground,
        picture_fps: float,
        lens: Lens,
        pace: RecordPace,
    ) -> None:
        self._detectors = detectors
        self._workers = workers
        self._recorder = recorder
        self._ground = ground
        self._lens = lens
        self._pace = pace
        self._period_ns = round(1e9 / picture_fps) if picture_fps else 0
        self.frames: Latest[FrameTicket] = Latest()
        self.latency = LatencyBook()
        self._lost = 0
        self._detections: list[Detection] = []
        self._arrived = asyncio.Event()
        self._newest_ns = -1
        self._picture_ns = 0
        self._rate: list[int] = []

    def tasks(self) -> Tasks:
        return {f"detect-{i}": self.run for i in range(self._workers)}

    async def run(self) -> None:
        """One frame after the other."""
        while True:
            ticket = await self.frames.get()
            keep = self._is_kept(ticket)
            if keep:
                self._picture_ns = ticket.stamp_ns
            show = self._ground.picture_due(ticket.stamp_ns)
            detection = await self._detectors.detect(ticket, keep or show)
            if detection is None:
                self._lost += 1
                continue
            if detection.jpeg is not None and keep:
                self._recorder.image(Topic.FRAME, ticket.stamp_ns, ticket.seq, detection.jpeg)
            if detection.jpeg is not None and show:
                lines = found_lines(detection.lines, self._lens)
                self._ground.picture(
                    Preview(CameraName.DOWN, ticket.seq, ticket.stamp_ns, detection.jpeg, lines)
                )
            self._detections.append(detection)
            self._arrived.set()

    async def arrival(self) -> None:
        """Until there are lines that no tick has taken."""
        await self._arrived.wait()

    def fresh(self, now_ns: int) -> tuple[LineSet, ...]:
        """Lines since the last tick in the order of their frames; a frame that was overtaken is dropped."""
        self._arrived.clear()
        arrived, self._detections = sorted(self._detections, key=lambda d: d.ticket.stamp_ns), []
        fresh = [d for d in arrived if d.ticket.stamp_ns > self._newest_ns]
        self._lost += len(arrived) - len(fresh)
        if fresh:
            self._newest_ns = fresh[-1].ticket.stamp_ns
        self._rate = [stamp for stamp in self._rate if now_ns - stamp < _RATE_NS]
        self._rate.extend([now_ns] * len(fresh))
        for detection in fresh:
            self.latency.taken(detection, now_ns)
        return tuple(detection.lines for detection in fresh)

    @property
    def dropped(self) -> Mapping[str, int]:
        """Frames that never became lines: overtaken before a detector was free, or lost by it."""
        return {"camera": self.frames.dropped, "detection": self._lost}

    @property
    def replaced(self) -> int:
        return self._detectors.replaced

    @property
    def fps(self) -> float:
        """Frames flown by in the last second."""
        return float(len(self._rate))

    @property
    def latency_ms(self) -> Mapping[str, float]:
        return self.latency.newest

    def latency_p99_s(self, now_ns: int) -> float:
        return self.latency.recent_p99_s(now_ns)

    def drain_latencies_ms(self) -> tuple[Mapping[str, float], ...]:
        return self.latency.drain()

    def latency_quantiles_ms(self) -> dict[str, float]:
        return self.latency.quantiles_ms()

    def arrival_to_wire_ms(self) -> dict[str, float]:
        return self.latency.arrival_to_wire_ms()

    def not_flying(self) -> None:
        self.latency.forget()

    def _is_kept(self, ticket: FrameTicket) -> bool:
        if not self._period_ns or ticket.stamp_ns - self._picture_ns < self._period_ns:
            return False
        return self._pace.due(Topic.FRAME, ticket.stamp_ns)
