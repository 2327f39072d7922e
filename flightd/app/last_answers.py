"""What is taken for the answer of a part that fails: never that all is well.  Pure."""

from __future__ import annotations

from dataclasses import replace

from flightd.core.types import HEALTHY, Health, VehicleState

_BORNE_NS = 1_000_000_000
"""So long what was answered last stands for what a part is not able to tell."""
_SLOW_S = 10.0
"""A latency that nobody can tell is none to fly by."""
_UNTOLD = "it does not tell how it does"


class LastAnswers:
    """Give each answer at each tick, None where the part failed."""

    def __init__(self) -> None:
        self._heard: tuple[int, float] | None = None
        self._vision = self._recorder = HEALTHY
        self._vision_ns: int | None = None
        self._recorder_ns: int | None = None
        self._vehicle: VehicleState | None = None

    def vehicle(self, told: tuple[VehicleState | None] | None) -> VehicleState | None:
        """What a vehicle that fails told last: it grows old by its own stamps.  None of it would say that the
        drone is not armed."""
        if told is not None:
            (self._vehicle,) = told
        return self._vehicle

    def ground_silent_s(self, now_ns: int, silent_s: float | None) -> float:
        """A link that fails is silent from its last answer on; nobody is missed who did not attend then."""
        if silent_s is not None:
            self._heard = now_ns, silent_s
            return silent_s
        if self._heard is None:
            self._heard = now_ns, 1e-3
        at_ns, before_s = self._heard
        return before_s + (now_ns - at_ns) * 1e-9 if before_s > 0.0 else 0.0

    def health(self, now_ns: int, vision: Health | None, recorder: Health | None) -> Health:
        """Of the part of each that it tells, or told lately; after that the pictures are too slow to fly by,
        and the log cannot be written."""
        if vision is not None or self._vision_ns is None:
            self._vision, self._vision_ns = vision or HEALTHY, now_ns
        if recorder is not None or self._recorder_ns is None:
            self._recorder, self._recorder_ns = recorder or HEALTHY, now_ns
        slow = now_ns - self._vision_ns > _BORNE_NS
        unwritten = now_ns - self._recorder_ns > _BORNE_NS
        return replace(
            self._recorder,
            latency_p99_s=_SLOW_S if slow else self._vision.latency_p99_s,
            detectors_replaced=self._vision.detectors_replaced,
            recorder_error=_UNTOLD if unwritten else self._recorder.recorder_error,
        )
