"""Frames pass in the order of their exposure, and not when they are old: nobody flies by the past."""

from __future__ import annotations

from collections.abc import Callable

_STALE_NS = 1_000_000_000
"""On top of the camera's own delay; far more than a flight tolerates (`hazards.latency_s`)."""
_TELL_NS = 5_000_000_000

OUT_OF_ORDER = "a frame came out of order"


class FrameOrder:
    """Asked with each frame of a camera whose frames are `latency_ns` old at best; what it refuses is counted
    and told to `on_trouble`, a line for a person, at most once in five seconds."""

    def __init__(self, camera: str, latency_ns: int, on_trouble: Callable[[str], None]) -> None:
        self._camera = camera
        self._oldest_ns = latency_ns + _STALE_NS
        self._on_trouble = on_trouble
        self._newest_ns: int | None = None
        self._told_ns: int | None = None
        self.refused = 0

    def passes(self, stamp_ns: int, now_ns: int) -> bool:
        """Whether a frame exposed at `stamp_ns` may be flown by."""
        if self._newest_ns is not None and stamp_ns <= self._newest_ns:
            self.refuse(OUT_OF_ORDER, now_ns)
            return False
        if now_ns - stamp_ns > self._oldest_ns:
            self.refuse(f"a frame was exposed {(now_ns - stamp_ns) * 1e-9:.1f} s ago", now_ns)
            return False
        self._newest_ns = stamp_ns
        return True

    def refuse(self, reason: str, now_ns: int) -> None:
        """Count a frame, or what should have told of one, as refused."""
        self.refused += 1
        if self._told_ns is None or now_ns - self._told_ns >= _TELL_NS:
            self._told_ns = now_ns
            self._on_trouble(f"camera {self._camera}: {reason} ({self.refused} refused so far)")
