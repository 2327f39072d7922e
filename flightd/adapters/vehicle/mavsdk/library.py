"""One MAVSDK instance inside this process, its asyncio plugins, and its orderly end."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import logging
import math
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from mavsdk import Configuration, Mavsdk
from mavsdk.asyncio import System
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.server_utility import ServerUtilityAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import LogLevel, log_subscribe
from mavsdk.plugins.mavlink_direct import MavlinkMessage

from flightd.adapters.vehicle.mavlink.link.codec import COMPANION
from flightd.adapters.vehicle.mavlink.services.commands import Answer

_LOG = logging.getLogger(__name__)
_LEVELS = {
    LogLevel.DEBUG: logging.DEBUG,
    LogLevel.INFO: logging.INFO,
    LogLevel.WARN: logging.INFO,  # it warns of what is in order here, as a connection made by hand
    LogLevel.ERROR: logging.WARNING,
}
_LAST_CALLS_S = 5.0
"""The library's own retries end within this."""

_ABANDONED: list[Mavsdk] = []
"""Instances with a thread inside; collecting one as garbage would take it down under that thread."""

T = TypeVar("T")


@functools.cache
def _route_log() -> None:
    """Once for the process: the library's threads must never find an older callback gone."""
    log_subscribe(_log)


def _log(level: LogLevel, message: str, _file: str | None, _line: int) -> bool:
    """The library's log goes where ours goes, not to standard output."""
    _LOG.log(_LEVELS.get(level, logging.INFO), "%s", message)
    return True


def _fields(document: str, names: tuple[str, ...], read: Callable[[Any], T]) -> tuple[T, ...] | None:
    """Fields out of the JSON in which the library hands a message over; None if one is missing or none."""
    try:
        fields = json.loads(document)
        return tuple(read(fields[name]) for name in names)
    except (ValueError, TypeError, KeyError, OverflowError):
        return None


def whole_fields(document: str, *names: str) -> tuple[int, ...] | None:
    """Whole numbers out of such a message; None if one is missing."""
    return _fields(document, names, int)


def real_fields(document: str, *names: str) -> tuple[float, ...] | None:
    """Numbers out of such a message, NaN where it has none; None if one is missing."""
    return _fields(document, names, lambda value: math.nan if value is None else float(value))


def whole_list(document: str, name: str) -> tuple[int, ...] | None:
    """A list of whole numbers out of such a message; None if it has none of that name."""
    try:
        return tuple(map(int, json.loads(document)[name]))
    except (ValueError, TypeError, KeyError, OverflowError):
        return None


class Plugins:
    """What the adapter uses of the library, for one vehicle."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.telemetry = TelemetryAsync(system)
        self.action = ActionAsync(system)
        self.offboard = OffboardAsync(system)
        self.direct = MavlinkDirectAsync(system)
        self.texts = ServerUtilityAsync(system)
        self.parameters = ParamAsync(system)


class Library:
    """Made inside the running loop, on which everything that it calls back runs."""

    def __init__(self, system_id: int) -> None:
        _route_log()
        self._loop = asyncio.get_running_loop()
        self._system_id = system_id
        self._sdk = Mavsdk(Configuration.create_manual(system_id, COMPANION, True))
        self._closed = False
        self._calls: set[asyncio.Task[Any]] = set()
        self._plugins: asyncio.Future[Plugins] = self._loop.create_future()
        self._waiting = self._sdk.first_autopilot_async(-1.0, lambda found: self._post(self._found, found))

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Begin to talk: `send(frame)` is called with each frame that should go out."""
        self._sdk.subscribe_raw_bytes_to_be_sent(lambda frame: self._post(send, frame))
        self._sdk.add_any_connection_with_handle("raw://")

    def feed(self, data: bytes) -> None:
        """Bytes from the wire; none once the library is down, where they would crash it."""
        if not self._closed:
            self._sdk.pass_received_raw_bytes(data)

    async def vehicle(self) -> Plugins:
        """The first autopilot heard, however long it takes."""
        return await asyncio.shield(self._plugins)

    async def call(self, work: Coroutine[Any, Any, T]) -> T:
        """Await a call into the library.  A cancelled caller leaves the call to finish by itself: its
        thread cannot be stopped, and the library must not be taken down under it."""
        return await asyncio.shield(self.begin(work))

    def begin(self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Start a call into the library that nobody may wait for."""
        task = asyncio.ensure_future(work)
        self._calls.add(task)
        task.add_done_callback(self._forget)
        return task

    async def command(self, command: int, *params: float) -> Answer:
        """COMMAND_LONG with its acknowledgement; the library repeats it."""
        plugins = await self.vehicle()
        try:
            ack = await self.call(plugins.direct.send_command(self.command_message(command, *params)))
        except MavsdkError:
            return Answer(None)
        fields = whole_fields(ack.fields_json, "result")
        return Answer(None if fields is None else fields[0])

    def command_message(self, command: int, *params: float) -> MavlinkMessage:
        """COMMAND_LONG to the autopilot."""
        fields: dict[str, float] = {"command": command, "confirmation": 0}
        for number in range(7):
            fields[f"param{number + 1}"] = float(params[number]) if number < len(params) else 0.0
        return self.message("COMMAND_LONG", **fields)

    def message(self, name: str, **fields: float) -> MavlinkMessage:
        """Any message to the autopilot."""
        fields = {"target_system": self._system_id, "target_component": 1, **fields}
        return MavlinkMessage(name, 0, 0, self._system_id, 1, json.dumps(fields))

    async def parameter(self, name: str) -> float | None:
        """A parameter of the autopilot, whatever its type; None where it is not told."""
        parameters = (await self.vehicle()).parameters
        for ask in (parameters.get_param_int, parameters.get_param_float):
            with contextlib.suppress(MavsdkError):
                return float(await self.call(ask(name)))
        return None

    async def close(self) -> None:
        """Wait for calls under way (bounded), then take the library down."""
        self._sdk.cancel_first_autopilot(self._waiting)
        if self._calls:
            await asyncio.wait(self._calls, timeout=_LAST_CALLS_S)
        self._closed = True
        if self._calls:
            _LOG.warning("MAVSDK: %d calls never came back", len(self._calls))
            _ABANDONED.append(self._sdk)
            abandoned = set(self._calls)
            for call in abandoned:
                call.cancel()  # its thread stays behind, nobody waits for it
            await asyncio.wait(abandoned)
            return
        self._sdk.destroy()

    def _forget(self, task: asyncio.Task[Any]) -> None:
        self._calls.discard(task)
        if not task.cancelled():
            task.exception()  # the caller may be gone: nobody else takes it

    def _post(self, function: Callable[[Any], None], value: Any) -> None:
        """From one of the library's threads onto the loop."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, value)

    def _found(self, system: Any) -> None:
        if system is not None and not self._plugins.done():
            self._plugins.set_result(Plugins(System(system)))
