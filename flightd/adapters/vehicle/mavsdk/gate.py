"""The gate between MAVSDK and the wire: setpoints pass only while the mission is alive, changes of mode and
arming only while the vehicle is ours to command.

MAVSDK repeats the newest attitude setpoint 20 times a second by itself, on a thread of its own, until
told otherwise: a dead control loop would be kept flying at its last tilt.  It also repeats a command that was
not answered, for more than a second: the pilot who took over meanwhile would lose the vehicle again.
"""

from __future__ import annotations

SET_ATTITUDE_TARGET = 82
_SET_MODE, _COMMAND_INT, _COMMAND_LONG = 11, 75, 76
_COMMAND_AT = 28
"""Where both COMMAND messages have their command on the wire, from the payload's start."""
_NAV_LAND, _DO_SET_MODE, _ARM_DISARM = 21, 176, 400
"""The library asks for the landing mode by NAV_LAND."""

FRESH_NS = 200_000_000
"""A setpoint older than this does not go out any more; less than any autopilot's own time-out."""

_WHO_FLIES = frozenset({_NAV_LAND, _DO_SET_MODE, _ARM_DISARM})
_V1, _V2 = 0xFE, 0xFD


def message_id(frame: bytes) -> int | None:
    """Id of the message in one MAVLink frame, None when it is no frame."""
    if len(frame) >= 12 and frame[0] == _V2:
        return int.from_bytes(frame[7:10], "little")
    if len(frame) >= 8 and frame[0] == _V1:
        return frame[5]
    return None


def commands_flight(frame: bytes) -> bool:
    """Whether this frame changes the mode, lands, arms or disarms."""
    kind = message_id(frame)
    if kind not in {_COMMAND_INT, _COMMAND_LONG}:
        return kind == _SET_MODE
    at = _COMMAND_AT + (10 if frame[0] == _V2 else 6)
    return int.from_bytes(frame[at : at + 2], "little") in _WHO_FLIES


class SetpointGate:
    """Passes attitude setpoints only for `FRESH_NS` after each `refresh`, commands that change who flies
    only while it is `commanding`, everything else always."""

    def __init__(self) -> None:
        self._until_ns = 0
        self.commanding = False
        self.held_back = 0
        """Repeats of old setpoints and commands that were kept from the wire."""

    def refresh(self, now_ns: int) -> None:
        """A setpoint was made now."""
        self._until_ns = now_ns + FRESH_NS

    def close(self) -> None:
        """The vehicle is not ours: no setpoint passes until the next `refresh`."""
        self._until_ns = 0

    def passes(self, frame: bytes, now_ns: int) -> bool:
        """Whether this frame may go out."""
        if message_id(frame) == SET_ATTITUDE_TARGET:
            passes = now_ns < self._until_ns
        else:
            passes = self.commanding or not commands_flight(frame)
        if passes:
            return True
        self.held_back += 1
        return False
