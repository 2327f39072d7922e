"""Commands with their acknowledgement: repeated when unanswered, the reason told when refused."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import COMPANION, Message
from flightd.adapters.vehicle.mavlink.link.connection import MavlinkLink
from flightd.runtime.within import Within

_RESULTS = {
    dialect.MAV_RESULT_ACCEPTED: "accepted",
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "temporarily rejected",
    dialect.MAV_RESULT_DENIED: "denied",
    dialect.MAV_RESULT_UNSUPPORTED: "unsupported",
    dialect.MAV_RESULT_FAILED: "failed",
    dialect.MAV_RESULT_IN_PROGRESS: "in progress",
    dialect.MAV_RESULT_COMMAND_LONG_ONLY: "wants COMMAND_LONG",
    dialect.MAV_RESULT_COMMAND_INT_ONLY: "wants COMMAND_INT",
}

_ANSWER_S = 0.3
_IN_PROGRESS = int(dialect.MAV_RESULT_IN_PROGRESS)
_IN_PROGRESS_S, _IN_PROGRESS_MAX_S = 3.0, 10.0
_LOOK_S = 0.05
_ATTEMPTS = 4


@dataclass(frozen=True, slots=True)
class Answer:
    """MAV_RESULT of a command; None when nothing came back however often it was sent."""

    result: int | None

    @property
    def accepted(self) -> bool:
        return self.result == int(dialect.MAV_RESULT_ACCEPTED)

    def __str__(self) -> str:
        if self.result is None:
            return "no answer"
        return _RESULTS.get(self.result, f"result {self.result}")


class Commander:
    """Sends COMMAND_LONG to the autopilot, one of each command id at a time."""

    def __init__(self, link: MavlinkLink, system_id: int) -> None:
        self._link = link
        self._system_id = system_id
        self._locks: dict[int, asyncio.Lock] = {}
        self._waiting: dict[int, asyncio.Future[int]] = {}

    async def send(
        self,
        command: int,
        *params: float,
        patience_s: float = _ANSWER_S,
        wanted: Callable[[], bool] = lambda: True,
    ) -> Answer:
        """Send with confirmation 0, 1, 2, 3 until answered within `patience_s`; an answer `in progress`
        extends the wait, up to 10 s.  Once `wanted` says that nobody wants it any more it is not
        repeated, nor waited for while in progress: what is wanted instead must not wait behind it."""
        async with self._locks.setdefault(command, asyncio.Lock()):
            for confirmation in range(_ATTEMPTS):
                if not wanted():
                    break
                result = await self._once(command, confirmation, params, patience_s, wanted)
                if result is not None:
                    return Answer(result)
        return Answer(None)

    async def _once(
        self,
        command: int,
        confirmation: int,
        params: tuple[float, ...],
        patience_s: float,
        wanted: Callable[[], bool],
    ) -> int | None:
        self._post(command, confirmation, params)
        waiting = self._waiting[command] = asyncio.get_running_loop().create_future()
        try:
            async with Within(patience_s):
                result: int = await waiting
        except TimeoutError:
            return None
        finally:
            self._waiting.pop(command, None)
        return result if result != _IN_PROGRESS else await self._outcome(command, wanted)

    async def _outcome(self, command: int, wanted: Callable[[], bool]) -> int | None:
        """The result of a command in progress; None when it falls silent or is not wanted any more."""
        loop = asyncio.get_running_loop()
        last_s, until_s = loop.time() + _IN_PROGRESS_MAX_S, loop.time() + _IN_PROGRESS_S
        waiting = self._waiting[command] = loop.create_future()
        try:
            while wanted():
                rest_s = until_s - loop.time()
                if rest_s <= 0.0:
                    return _IN_PROGRESS if until_s >= last_s else None
                await asyncio.wait([waiting], timeout=min(rest_s, _LOOK_S))
                if not waiting.done():
                    continue
                result: int = waiting.result()
                if result != _IN_PROGRESS:
                    return result
                until_s = min(loop.time() + _IN_PROGRESS_S, last_s)
                waiting = self._waiting[command] = loop.create_future()
            return None
        finally:
            self._waiting.pop(command, None)

    def post(self, command: int, *params: float) -> None:
        """Send once, whether anybody answers or not."""
        self._post(command, 0, params)

    def _post(self, command: int, confirmation: int, params: tuple[float, ...]) -> None:
        filled = [*params, *[0.0] * (7 - len(params))]
        target = dialect.MAV_COMP_ID_AUTOPILOT1
        self._link.send(
            dialect.MAVLink_command_long_message(self._system_id, target, command, confirmation, *filled)
        )

    def acknowledged(self, ack: Message) -> None:
        """Take a COMMAND_ACK; those for other clients are left alone."""
        if ack.target_system not in {0, self._system_id} or ack.target_component not in {0, COMPANION}:
            return
        waiting = self._waiting.get(ack.command)
        if waiting is not None and not waiting.done():
            waiting.set_result(int(ack.result))
