"""What a fleet's manager says to a drone, until the drone's next step takes it.

Nothing waits for a drone that is not heard: what would send it off is refused as soon as it is heard again,
however long that takes; what holds it back, or only asks, is taken then.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Iterator
from typing import Final

import msgspec

from flightd.fleet.vda5050.errors import ErrorType
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vehicle.refusals import Refusal
from flightd.fleet.vehicle.signals import Input, Missed, Said

_LOG = logging.getLogger(__name__)
_LATE_S: Final = 5.0
"""As a drone's own for what is ordered by an old status."""
_MOST_WAITING: Final = 32
_MOST_URGENT: Final = 8
"""Beside these."""
_MOST_REFUSED: Final = 24
"""Messages that there was no room for, of which each is told as refused: with all that wait they are as many
as instant actions whose states are told."""
_URGENT: Final = frozenset({"startPause", "cancelOrder"})
_SEND_ON: Final = frozenset({"stopPause"})
"""Nobody is sent on by a manager who could not know how it was."""
_NOT_HEARD: Final = "the station did not hear the drone when this came: look, and send it anew"
_TOO_MANY: Final = f"{_MOST_WAITING} messages wait already: send it anew"


class ManagerInbox:
    """Bounded: what comes where it is full is refused, the newest of these one by one.  `dropped` counts all
    that was not obeyed."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._waiting: list[tuple[Said | Missed, float]] = []
        self._beyond: deque[Said | Missed] = deque(maxlen=_MOST_REFUSED)
        """The newest of those for which there was no room."""
        self.dropped = 0

    def hear(self, one: Said, now_s: float) -> None:
        """It is said now."""
        urgent = isinstance(one, InstantActions) and any(each.action_type in _URGENT for each in one.actions)
        if len(self._waiting) < _MOST_WAITING + urgent * _MOST_URGENT:
            self._waiting.append((one, now_s))
            return
        if not self._beyond:
            _LOG.warning("%s: more messages of its manager than are taken", self._name)
        self.dropped += 1
        if isinstance(one, Order | InstantActions):
            self._beyond.append(_refused(one, ErrorType.INSUFFICIENT_MEMORY, _TOO_MANY))
        else:
            self._beyond.append(one)

    def see_late(self, now_s: float) -> None:
        """The drone is not heard: what waits for too long is not obeyed."""
        self._waiting = [
            (part, at_s)
            for one, at_s in self._waiting
            for part in (self._late(one) if now_s - at_s > _LATE_S else (one,))
        ]

    def take(self) -> list[Input]:
        """What was said since, for the drone's next step."""
        taken: list[Input] = [*(one for one, _ in self._waiting), *self._beyond]
        self._waiting = []
        self._beyond.clear()
        return taken

    def _late(self, one: Said | Missed) -> Iterator[Said | Missed]:
        if isinstance(one, Order):
            self.dropped += 1
            yield _refused(one, ErrorType.DRONE_NOT_HEARD, _NOT_HEARD)
        elif isinstance(one, InstantActions):
            late = [each for each in one.actions if each.action_type in _SEND_ON]
            yield msgspec.structs.replace(one, actions=[each for each in one.actions if each not in late])
            if late:
                self.dropped += 1
                of_late = msgspec.structs.replace(one, actions=late)
                yield _refused(of_late, ErrorType.DRONE_NOT_HEARD, _NOT_HEARD)
        else:
            yield one


def _refused(one: Order | InstantActions, order_error: ErrorType, what: str) -> Missed:
    """By the standard's name for an instant action that cannot be done, or by that of an order."""
    error = order_error if isinstance(one, Order) else ErrorType.INVALID_INSTANT_ACTION
    return Missed(one, Refusal(error, what))
