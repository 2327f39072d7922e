"""The autopilot's parameters: read under the name of its version, set and read back."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import MavlinkLink
from flightd.adapters.vehicle.mavlink.parameter_rule import Names
from flightd.runtime.within import Within

_ANSWER_S = 0.4
_ATTEMPTS = 3
_AT_ONCE = (8, 4, 1)
"""ArduPilot's queue holds 20 requests, some of them under two names; what an autopilot with a shorter one
drops is asked for again in smaller groups, in the end alone."""
_AGAIN_S = 5.0
_REST_S = 1.0


@dataclass(frozen=True, slots=True)
class _Stored:
    value: float
    kind: int


class Parameters:
    """What is known of the autopilot's parameters.  An unknown name is answered by silence, hence the
    attempts.

    `bytewise`: PX4 puts the four bytes of an INT32 in the float's place, ArduPilot its value.
    """

    def __init__(self, link: MavlinkLink, system_id: int, *, bytewise: bool) -> None:
        self._link = link
        self._system_id = system_id
        self.bytewise = bytewise
        self._heard: dict[str, _Stored] = {}
        self._arrived = asyncio.Event()

    def get(self, names: Names) -> tuple[str, float] | None:
        """The name that answered and its value, or None."""
        for name in names:
            if name in self._heard:
                return name, self._heard[name].value
        return None

    def forget(self) -> None:
        """The autopilot rebooted: its parameters may have changed."""
        self._heard.clear()

    def value(self, message: Message) -> None:
        """Take a PARAM_VALUE, asked for by whomever."""
        value, kind = float(message.param_value), int(message.param_type)
        if self._as_bytes(kind):
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if math.isfinite(value):
            self._heard[str(message.param_id)] = _Stored(value, kind)
            self._arrived.set()

    async def keep(self, wanted: tuple[Names, ...], required: tuple[Names, ...] = ()) -> None:
        """Fill in what is missing of `wanted` until cancelled; what is `required` to fly comes first and is
        asked for without a pause: a vehicle found flying waits for it."""
        while True:
            missing = [names for names in required if self.get(names) is None]
            for names in missing or wanted:
                await self.read(names)
            if not missing:
                complete = all(self.get(names) is not None for names in wanted)
                await asyncio.sleep(_REST_S if complete else _AGAIN_S)

    async def read(self, names: Names) -> tuple[str, float] | None:
        """The parameter, asked for if it is not known yet; None when no name was answered."""
        if self.get(names) is None:
            await self._exchange(lambda: self._ask(names), lambda: self.get(names) is not None)
        return self.get(names)

    async def read_all(self, wanted: Sequence[Names]) -> None:
        """Read what is not known yet of these, a few at a time: an autopilot drops what it is asked in a
        burst."""
        for at_once in _AT_ONCE:
            missing = [names for names in wanted if self.get(names) is None]
            for first in range(0, len(missing), at_once):
                some = missing[first : first + at_once]
                await self._exchange(partial(self._ask_all, some), partial(self._known, some), attempts=1)

    async def read_again(self, wanted: Sequence[Names]) -> None:
        """Ask anew for what is known of these: somebody may have changed it, and it was not heard."""
        known = [found[0] for names in wanted if (found := self.get(names)) is not None]
        for name in known:
            self._ask((name,))
            await asyncio.sleep(_ANSWER_S / _AT_ONCE[0])

    async def write(self, name: str, value: float) -> bool:
        """Set a parameter that has been read; True when it read back as asked."""
        stored = self._heard.pop(name)

        def is_set() -> bool:
            now = self._heard.get(name)
            return now is not None and math.isclose(now.value, value, rel_tol=1e-5, abs_tol=1e-6)

        await self._exchange(lambda: self._set(name, value, stored.kind), is_set)
        self._heard.setdefault(name, stored)
        return is_set()

    async def _exchange(
        self, send: Callable[[], None], done: Callable[[], bool], attempts: int = _ATTEMPTS
    ) -> None:
        for _ in range(attempts):
            self._arrived.clear()
            send()
            try:
                async with Within(_ANSWER_S):
                    while not done():
                        await self._arrived.wait()
                        self._arrived.clear()
            except TimeoutError:
                continue
            return

    def _known(self, wanted: Sequence[Names]) -> bool:
        return all(self.get(names) is not None for names in wanted)

    def _ask_all(self, wanted: Sequence[Names]) -> None:
        for names in wanted:
            self._ask(names)

    def _ask(self, names: Names) -> None:
        target = dialect.MAV_COMP_ID_AUTOPILOT1
        for name in names:
            request = dialect.MAVLink_param_request_read_message(self._system_id, target, name.encode(), -1)
            self._link.send(request)

    def _set(self, name: str, value: float, kind: int) -> None:
        if self._as_bytes(kind):
            value = struct.unpack("<f", struct.pack("<i", round(value)))[0]
        target = dialect.MAV_COMP_ID_AUTOPILOT1
        self._link.send(
            dialect.MAVLink_param_set_message(self._system_id, target, name.encode(), value, kind)
        )

    def _as_bytes(self, kind: int) -> bool:
        return self.bytewise and kind == dialect.MAV_PARAM_TYPE_INT32
