"""The gate between MAVSDK and the wire: set points pass only while the mission is alive.

MAVSDK repeats the newest attitude set point 20 times a second by itself, on a thread of its own, until
told otherwise: a dead control loop would be kept flying at its last tilt.
"""

from __future__ import annotations

SET_ATTITUDE_TARGET = 82

FRESH_NS = 200_000_000
"""A set point older than this does not go out any more; less than any autopilot's own time-out."""

_V1, _V2 = 0xFE, 0xFD


def message_id(frame: bytes) -> int | None:
    """Id of the message in one MAVLink frame, None when it is no frame."""
    if len(frame) >= 12 and frame[0] == _V2:
        return int.from_bytes(frame[7:10], "little")
    if len(frame) >= 8 and frame[0] == _V1:
        return frame[5]
    return None


class SetpointGate:
    """Passes every frame but attitude set points; those only for `FRESH_NS` after each `refresh`."""

    def __init__(self) -> None:
        self._until_ns = 0
        self.held_back = 0
        """Repeats of old set points that were kept from the wire."""

    def refresh(self, now_ns: int) -> None:
        """A set point was made now."""
        self._until_ns = now_ns + FRESH_NS

    def close(self) -> None:
        """The vehicle is not ours: no set point passes until the next `refresh`."""
        self._until_ns = 0

    def passes(self, frame: bytes, now_ns: int) -> bool:
        """Whether this frame may go out."""
        if now_ns < self._until_ns or message_id(frame) != SET_ATTITUDE_TARGET:
            return True
        self.held_back += 1
        return False
