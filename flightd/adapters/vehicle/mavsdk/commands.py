"""Commands by the library's own calls, answered as the other MAVLink adapters' are."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from mavsdk.exceptions import MavsdkError
from mavsdk.plugins.telemetry import FlightMode
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.services.commands import Answer
from flightd.adapters.vehicle.mavsdk.library import Library, Plugins

_RESULTS: dict[str, int | None] = {
    "BUSY": int(dialect.MAV_RESULT_TEMPORARILY_REJECTED),
    "COMMAND_DENIED": int(dialect.MAV_RESULT_DENIED),
    "COMMAND_DENIED_NOT_LANDED": int(dialect.MAV_RESULT_DENIED),
    "COMMAND_DENIED_LANDED_STATE_UNKNOWN": int(dialect.MAV_RESULT_DENIED),
    "UNSUPPORTED": int(dialect.MAV_RESULT_UNSUPPORTED),
    "TIMEOUT": None,
}
"""The library's results by name; every other one is a failure."""


class SdkCommander:
    """Arms, disarms, lands and enters OFFBOARD through the plugins; it repeats by itself what stays
    unanswered.  Any other command goes out as it is."""

    def __init__(self) -> None:
        self._library: Library | None = None
        self._plugins: Plugins | None = None

    def attach(self, library: Library, plugins: Plugins) -> None:
        """From now on there is somebody to command."""
        self._library, self._plugins = library, plugins

    async def send(
        self,
        command: int,
        *params: float,
        patience_s: float = 0.0,  # noqa: ARG002 - the library has its own
        wanted: Callable[[], bool] = lambda: True,  # noqa: ARG002 - nor does it ask again
    ) -> Answer:
        """The final answer; none when nobody is attached."""
        library, plugins = self._library, self._plugins
        if library is None or plugins is None:
            return Answer(None)
        work = self._call_for(plugins, command, params)
        if work is None:
            return await library.command(command, *params)
        try:
            await library.call(work)
        except MavsdkError as err:
            name = getattr(getattr(err, "result", None), "name", "")
            return Answer(_RESULTS.get(name, int(dialect.MAV_RESULT_FAILED)))
        return Answer(int(dialect.MAV_RESULT_ACCEPTED))

    def post(self, command: int, *params: float) -> None:
        """Send once, whether anybody answers or not.  A change of mode is not: its number is the library's,
        and NAV_LAND asks for the same landing."""
        if self._library is None or self._plugins is None or command == dialect.MAV_CMD_DO_SET_MODE:
            return
        message = self._library.command_message(command, *params)
        self._library.begin(self._plugins.direct.send_message(message))

    def _call_for(
        self, plugins: Plugins, command: int, params: tuple[float, ...]
    ) -> Coroutine[Any, Any, Any] | None:
        work: Coroutine[Any, Any, Any] | None = None
        match command:
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM:
                work = plugins.action.arm() if params[0] else plugins.action.disarm()
            case dialect.MAV_CMD_DO_SET_MODE if params[0] == FlightMode.OFFBOARD:
                work = plugins.offboard.start()
            case dialect.MAV_CMD_DO_SET_MODE if params[0] == FlightMode.LAND:
                work = plugins.action.land()
            case _:
                pass
        return work
