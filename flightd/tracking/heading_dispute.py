"""Lines against the vehicle's own heading: who is right when they contradict each other.  Pure."""

from __future__ import annotations

import enum
import math
from collections import deque

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude
from flightd.tracking.carried_heading import FASTEST_RADPS, GAP_S, LEAP_RAD
from flightd.tracking.heading_vote import HeadingVote

_SAME_RAD = math.radians(3.0)
_DISPUTE_NS, _SHOWN_NS = 600_000_000, 1_500_000_000
_SURE_LEAD = 2
"""Lines that lead by so many are believed after that time; by fewer, as a lone one, later in proportion."""
_AT_ONCE_NS = 300_000_000
"""What turns within this time leaps: no drone turns its camera so, and no compass is led astray so fast."""
_SHARE = 0.5
"""Of a leap by more than this share of an error that error comes."""


class Turned(enum.Enum):
    """What has turned where lines contradict the heading: what is told of it, or the camera's mount."""

    HEADING = enum.auto()
    CAMERA = enum.auto()


class HeadingDispute:
    """Lines that outvote the vehicle's heading, and by the same angle, frame after frame.  Whose fault
    it is shows in who leapt: a mount that was knocked turns the picture at once while the told heading goes
    on as before.  Call `told` with each attitude, `step` with each frame."""

    def __init__(self) -> None:
        self.error_rad = 0.0
        self._heard_ns = self._voted_ns = 0
        self._settled_ns: int | None = None
        self._agreed_ns: int | None = None
        self._agreed_rad = 0.0
        self._leap_rad = 0.0
        self._gap_ns = 0
        self._heading: Attitude | None = None
        self._leaps: deque[tuple[int, float]] = deque(maxlen=64)

    def told(self, sample: Attitude) -> None:
        """Take a sample of telemetry."""
        last, self._heading = self._heading, sample
        if last is None:
            return
        turn_rad, dt_s = wrap_pi(sample.yaw_rad - last.yaw_rad), (sample.stamp_ns - last.stamp_ns) * 1e-9
        if dt_s > GAP_S:
            self._gap_ns = sample.stamp_ns
        if abs(turn_rad) > LEAP_RAD + FASTEST_RADPS * max(dt_s, 0.0):
            self._leaps.append((sample.stamp_ns, turn_rad))

    def step(self, vote: HeadingVote | None, stamp_ns: int) -> Turned | None:
        """Take what one frame's lines say; what has turned once the lines have it.  The error is then shown
        for a while longer, so that nobody overlooks it."""
        if self._settled_ns is not None:
            if stamp_ns - self._settled_ns > _SHOWN_NS:
                self._settled_ns, self.error_rad = None, 0.0
            return None
        if vote is None or vote.holds:
            self.error_rad = 0.0
            if vote is not None:
                self._agreed_ns, self._agreed_rad = stamp_ns, vote.error_rad
            return None
        error = vote.error_rad
        if not self.error_rad:
            at_once = self._agreed_ns is not None and stamp_ns - self._agreed_ns < _AT_ONCE_NS
            self._leap_rad = error - self._agreed_rad if at_once else 0.0
        if not self.error_rad or abs(error - self.error_rad) > _SAME_RAD:
            self._heard_ns = 0
        else:
            self._heard_ns += (stamp_ns - self._voted_ns) * min(vote.lead, _SURE_LEAD) // _SURE_LEAD
        self.error_rad, self._voted_ns = error, stamp_ns
        if self._heard_ns < _DISPUTE_NS:
            return None
        self._settled_ns = stamp_ns
        return self._turned(error)

    def _turned(self, error_rad: float) -> Turned:
        agreed_ns = self._agreed_ns or 0
        picture_leapt = abs(error_rad - self._leap_rad) < _SHARE * abs(error_rad)
        if self._gap_ns > agreed_ns - _AT_ONCE_NS:
            return Turned.HEADING  # nobody knows what the told heading did
        leapt_rad = sum(turn for stamp_ns, turn in self._leaps if stamp_ns > agreed_ns - _AT_ONCE_NS)
        explained = abs(error_rad + leapt_rad) < _SHARE * abs(error_rad)
        return Turned.CAMERA if picture_leapt and not explained else Turned.HEADING
