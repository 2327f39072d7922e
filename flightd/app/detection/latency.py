"""How long each frame took, stage by stage, from mid-exposure to the setpoint on the wire."""

from __future__ import annotations

from collections import deque
from itertools import pairwise

from flightd.app.detection.detector_pool import Detection
from flightd.runtime.bounded_series import Series
from flightd.runtime.frame_ring import FrameTicket

_SAME_TICK_NS = 40_000_000
_RECENT_NS = 1_000_000_000
_RECENT_MAX = 256
"""More frames than that no camera gives in a second."""


class LatencyBook:
    """Follows frames: `taken` when a tick used their lines, `sent` when its setpoint was on the wire."""

    def __init__(self) -> None:
        self._waiting: list[tuple[Detection, int]] = []
        self._totals_ms, self._ours_ms = Series(), Series()
        self._since: list[dict[str, float]] = []
        self._recent: deque[tuple[int, float]] = deque(maxlen=_RECENT_MAX)
        self._before: FrameTicket | None = None
        self.newest: dict[str, float] = {}

    def taken(self, detection: Detection, now_ns: int) -> None:
        """The tick at `now_ns` used these lines.  Those whose setpoints were never sent are forgotten."""
        self._waiting = [one for one in self._waiting if now_ns - one[1] <= _SAME_TICK_NS]
        self._waiting.append((detection, now_ns))

    def sent(self, now_ns: int) -> None:
        """The setpoint of that tick left at `now_ns`."""
        for detection, taken_ns in self._waiting:
            if now_ns - taken_ns > _SAME_TICK_NS:  # its own setpoint was never sent
                continue
            ticket = detection.ticket
            marks = (
                ticket.stamp_ns,
                ticket.arrival_ns,
                detection.started_ns,
                detection.finished_ns,
                taken_ns,
                now_ns,
            )
            capture, transport, detect, track, wire = ((b - a) * 1e-6 for a, b in pairwise(marks))
            total = (now_ns - ticket.stamp_ns) * 1e-6
            self.newest = {
                "capture": capture,
                "transport": transport,
                "detection": detect,
                "track": track,
                "wire": wire,
                "total": total,
            }
            self._since.append(self.newest)
            self._totals_ms.add(total)
            self._ours_ms.add(total - capture)
            self._recent.append((now_ns, (now_ns - self._oldest_ns(ticket)) * 1e-6))
            self._before = ticket
        self._waiting.clear()

    def drain(self) -> tuple[dict[str, float], ...]:
        """The stages' times in ms of each frame since the last call, oldest first."""
        since, self._since = tuple(self._since), []
        return since

    def forget(self) -> None:
        """No setpoint goes out (not flying): the frames in waiting count for nothing."""
        self._waiting.clear()
        self._before = None

    def recent_p99_s(self, now_ns: int) -> float:
        """p99 of the whole way over the last second, seconds, from the oldest frame that the one flown by
        overtook: where most are dropped, those that are not may well be fast.  0 when none was flown by."""
        while self._recent and now_ns - self._recent[0][0] > _RECENT_NS:
            self._recent.popleft()
        totals = sorted(total for _, total in self._recent)
        return totals[min(int(0.99 * len(totals)), len(totals) - 1)] * 1e-3 if totals else 0.0

    def _oldest_ns(self, ticket: FrameTicket) -> int:
        """Exposure of the first frame after the one flown by before."""
        last = self._before
        if last is None or ticket.seq <= last.seq:
            return ticket.stamp_ns
        return last.stamp_ns + (ticket.stamp_ns - last.stamp_ns) // (ticket.seq - last.seq)

    def quantiles_ms(self) -> dict[str, float]:
        """p50 and p99 of the whole way, rounded to a hundredth; zeros before any frame was flown by."""
        return _quantiles(self._totals_ms)

    def arrival_to_wire_ms(self) -> dict[str, float]:
        """The same without the camera's own delay: from the frame's arrival on."""
        return _quantiles(self._ours_ms)


def _quantiles(ms: Series) -> dict[str, float]:
    return {name: round(ms.quantile(share), 2) for name, share in (("p50", 0.5), ("p99", 0.99))}
