"""The down camera's frames through the detector processes, in the order of their exposure."""

from __future__ import annotations

from flightd.app.detection.detector_pool import Detection, Detectors
from flightd.core.topics import Topic
from flightd.ports import Ground, Recorder
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest

_RATE_NS = 1_000_000_000


class DetectionPipeline:
    """Frames in by `frames`, as many `run` at once as there are detector processes, lines out by `fresh`.

    Pictures are kept for the recorder at up to `picture_fps` (0: none), for the ground when it asks."""

    def __init__(
        self, detectors: Detectors, recorder: Recorder | None, ground: Ground | None, picture_fps: float
    ) -> None:
        self._detectors = detectors
        self._recorder = recorder
        self._ground = ground
        self._period_ns = round(1e9 / picture_fps) if picture_fps else 0
        self.frames: Latest[FrameTicket] = Latest()
        self.lost = 0
        """Frames that a detector failed on or that were overtaken."""
        self._detections: list[Detection] = []
        self._newest_ns = -1
        self._picture_ns = 0
        self._rate: list[int] = []

    async def run(self) -> None:
        """One frame after the other."""
        while True:
            ticket = await self.frames.get()
            keep = self._is_kept(ticket)
            if keep:
                self._picture_ns = ticket.stamp_ns
            show = self._ground is not None and self._ground.picture_due(ticket.stamp_ns)
            detection = await self._detectors.detect(ticket, keep or show)
            if detection is None:
                self.lost += 1
                continue
            if detection.jpeg is not None and keep and self._recorder is not None:
                self._recorder.image(Topic.FRAME, ticket.stamp_ns, ticket.seq, detection.jpeg)
            if detection.jpeg is not None and show and self._ground is not None:
                self._ground.picture(ticket.seq, ticket.stamp_ns, detection.jpeg)
            self._detections.append(detection)

    def fresh(self, now_ns: int) -> list[Detection]:
        """Detections since the last tick in the order of their frames; one overtaken is dropped."""
        arrived, self._detections = sorted(self._detections, key=lambda d: d.ticket.stamp_ns), []
        fresh = [d for d in arrived if d.ticket.stamp_ns > self._newest_ns]
        self.lost += len(arrived) - len(fresh)
        if fresh:
            self._newest_ns = fresh[-1].ticket.stamp_ns
        self._rate = [stamp for stamp in self._rate if now_ns - stamp < _RATE_NS]
        self._rate.extend([now_ns] * len(fresh))
        return fresh

    @property
    def dropped(self) -> int:
        """Frames that never became lines."""
        return self.frames.dropped + self.lost

    @property
    def fps(self) -> float:
        """Frames flown by in the last second."""
        return float(len(self._rate))

    def _is_kept(self, ticket: FrameTicket) -> bool:
        recorded = bool(self._period_ns) and self._recorder is not None
        return recorded and ticket.stamp_ns - self._picture_ns >= self._period_ns
