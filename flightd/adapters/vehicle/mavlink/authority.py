"""Who flies: the modes we asked for against the mode the vehicle is in.  The pilot always wins."""

from __future__ import annotations

_GRACE_NS = 300_000_000
"""After our mode change was accepted, heartbeats of the mode before may still be under way for so long."""


class Authority:
    """Holds the vehicle only in a mode that we asked for.

    Once held, a HEARTBEAT with any other mode means that the pilot, or the autopilot's own failsafe, has
    taken over: then nothing is ours until `release` and a new request.
    """

    def __init__(self) -> None:
        self._asked: int | None = None
        self._held: int | None = None
        self._before: int | None = None
        self._before_until_ns: int | None = None
        self.taken = False

    @property
    def held(self) -> int | None:
        """The mode in which the vehicle is ours, None while it is not."""
        return None if self.taken else self._held

    def release(self) -> None:
        """Let go, and forget a take-over: the next request counts as new."""
        self._asked = self._held = self._before = self._before_until_ns = None
        self.taken = False

    def ask(self, mode: int, current: int | None) -> None:
        """We are about to ask for `mode`, the vehicle being in `current`."""
        if self.taken:
            raise RuntimeError("the pilot has the vehicle: nothing may be asked of it")
        self._asked = mode
        self._before = current
        self._before_until_ns = None

    def accepted(self, mode: int, now_ns: int) -> None:
        """The autopilot acknowledged our request.

        From one mode of ours to another only a HEARTBEAT leads: an acknowledgement names the command, not
        the mode, and may be the belated one of the request before.
        """
        if mode == self._asked and not self.taken and self._held is None:
            self._held = mode
            self._before_until_ns = now_ns + _GRACE_NS

    def heartbeat(self, mode: int, now_ns: int) -> bool:
        """Take the mode of a HEARTBEAT; True when it has just shown a take-over."""
        if self.taken:
            return False
        if mode == self._asked:
            self._held, self._before = mode, None
            return False
        if self._held is None or mode == self._held:
            return False
        in_grace = self._before_until_ns is None or now_ns <= self._before_until_ns
        if mode == self._before and in_grace:
            return False
        self.taken = True
        return True
