"""PX4 through MAVSDK 4: attitude OFFBOARD, arming, landing and telemetry by the library's plugins.

As far as its API reaches: the setpoint carries no yaw rate (mask 7), only the heading that we integrate;
there is no signing; ArduPilot is left to the adapter of our own, since the library's offboard mode means
GUIDED there, which needs a position.  After the library's documentation and behaviour; not tried on
hardware.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from functools import partial
from typing import Any

from mavsdk.autopilot import Autopilot
from mavsdk.exceptions import MavsdkError
from mavsdk.plugins.offboard import Attitude as SdkAttitude
from mavsdk.plugins.server_utility import StatusTextType
from mavsdk.plugins.telemetry import FlightMode
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.transport import make_transport
from flightd.adapters.vehicle.mavlink.mode_manager import ModeArmingManager
from flightd.adapters.vehicle.mavlink.parameter_rule import Names
from flightd.adapters.vehicle.mavlink.refusal import BeyondLibrary, WrongSystemId, not_set_up
from flightd.adapters.vehicle.mavlink.required_parameters import Job, rules_for, way_down_rules
from flightd.adapters.vehicle.mavlink.services.clock_offset import ASK_FAST_S, ASK_S, ClockSync
from flightd.adapters.vehicle.mavlink.services.heartbeat_rate import BeatPoll
from flightd.adapters.vehicle.mavlink.services.stream_rates import StreamKeeper
from flightd.adapters.vehicle.mavlink.setpoint_shaper import SetpointShaper
from flightd.adapters.vehicle.mavsdk.commands import SdkCommander
from flightd.adapters.vehicle.mavsdk.connection import MavsdkConnection
from flightd.adapters.vehicle.mavsdk.gate import SetpointGate
from flightd.adapters.vehicle.mavsdk.library import Library, Plugins, whole_fields, whole_list
from flightd.adapters.vehicle.mavsdk.telemetry import MavsdkTelemetry
from flightd.config.battery import BatteryConfig
from flightd.core.refusal import Refusal
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Demand,
    Event,
    EventLevel,
    VehicleState,
)
from flightd.ports import Clock
from flightd.runtime.datagrams import OpenDatagrams, open_datagrams
from flightd.runtime.latest_slot import Latest
from flightd.runtime.supervisor import insisted

_LOG = logging.getLogger(__name__)

_RATES_HZ: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 20.0,  # a take-over must be seen within 100 ms
    dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: 20.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
}
_TEXT_TYPES = {
    EventLevel.INFO: StatusTextType.INFO,
    EventLevel.WARNING: StatusTextType.WARNING,
    EventLevel.ERROR: StatusTextType.ERROR,
}
_INFO = int(dialect.MAV_SEVERITY_INFO)
_SEVERITIES = {
    StatusTextType.WARNING: int(dialect.MAV_SEVERITY_WARNING),
    StatusTextType.ERROR: int(dialect.MAV_SEVERITY_ERROR),
    StatusTextType.CRITICAL: int(dialect.MAV_SEVERITY_CRITICAL),
    StatusTextType.ALERT: int(dialect.MAV_SEVERITY_ALERT),
    StatusTextType.EMERGENCY: int(dialect.MAV_SEVERITY_EMERGENCY),
}
_TEXT_MAX = 49
_TEXTS_MAX = 20

_YAW_LEAD_S = 0.2
"""The library sends no yaw rate to feed forward, so the heading leads by what the yaw loop lags."""

_IDLE_PERIOD_S = 0.05
_UNREAD_S, _READ_AGAIN_S = 1.0, 30.0
"""Between two readings of the autopilot's parameters, while some are missing and afterwards."""
_PUMP_SILENT_NS = 150_000_000


class MavsdkVehicle:
    """`ports.Vehicle` by MAVSDK, with the rules of the other MAVLink adapters: one arming per FLY demand,
    and after a take-over nothing until FLY follows HANDS_OFF or STANDBY."""

    flying_mode = int(FlightMode.OFFBOARD)
    landing_mode = int(FlightMode.LAND)
    prime_s = 1.3
    """PX4 wants setpoints for more than a second before it enters OFFBOARD."""

    def __init__(
        self,
        url: str,
        clock: Clock,
        system_id: int = 1,
        opener: OpenDatagrams = open_datagrams,
        *,
        cells: int | None = None,
    ) -> None:
        self._clock = clock
        self._system_id = system_id
        self._sync = ClockSync()
        self._readings = MavsdkTelemetry(self._sync)
        self.gate = SetpointGate()
        self._line = MavsdkConnection(make_transport(parse_endpoint(url), opener), self.gate, clock)
        self._commander = SdkCommander()
        self._modes = ModeArmingManager(self, self._commander, self._readings, clock)
        self._steering = SetpointShaper(self._modes, self._readings)
        self._setpoints: Latest[SdkAttitude] = Latest()
        self._texts: deque[tuple[StatusTextType, str]] = deque(maxlen=_TEXTS_MAX)
        self._text_waits = asyncio.Event()
        self._sent_ns = 0
        self._unfit: Refusal | None = None
        self._rules = rules_for(Firmware.PX4, Job(battery=BatteryConfig(cells=cells)))
        self._way_down = way_down_rules(self._rules)
        self._examined = False
        self._parameters: dict[str, tuple[str, float]] = {}

    # The port

    async def run(self) -> None:
        """Own link and library until cancelled, then hand the vehicle back: in the air it is told to land.

        UnavailableError when the link can never be opened (port in use, not a serial device).
        """
        library = Library(self._system_id)
        self._line.received = library.feed
        library.connect(self._line.send)
        try:
            async with asyncio.TaskGroup() as carrying:
                carrier = carrying.create_task(self._line.run(), name="mavsdk line")
                try:
                    await self._live(library)
                finally:
                    await library.close()  # the line still carries the last answers
                    carrier.cancel()
        except ExceptionGroup as group:
            if len(group.exceptions) == 1:
                raise group.exceptions[0] from None
            raise

    async def _live(self, library: Library) -> None:
        plugins = await library.vehicle()
        await self._look_at(plugins)
        self._commander.attach(library, plugins)
        async with asyncio.TaskGroup() as tasks:
            self._listen(tasks, library, plugins)
            try:
                await self._modes.run()
            finally:
                await self._modes.hand_back()

    def state(self) -> VehicleState | None:
        modes = self._modes
        now_ns = self._clock.now_ns()
        state = self._readings.state(now_ns, in_control=modes.in_control, refusal=modes.refusal)
        known = state and replace(state, unfit=modes.unfit, unheard=modes.is_silent)
        return known and self._steering.climb_of(known, now_ns)

    def attitudes(self) -> list[Attitude]:
        return self._readings.attitudes()

    def demand(self, demand: Demand) -> None:
        self._modes.demand(demand)
        self._mind_gate()

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        now_ns = self._clock.now_ns()
        heading_rad = self._steering.heading_rad(setpoint, now_ns)
        if heading_rad is None:
            return False
        thrust = self._steering.collective(setpoint, now_ns)
        self._sent_ns = now_ns
        heading_rad += setpoint.yaw_rate_radps * _YAW_LEAD_S
        self._steer(now_ns, setpoint.roll_rad, setpoint.pitch_rad, heading_rad, thrust)
        return True

    def notify(self, event: Event) -> None:
        text = f"{event.name}: {event.text}".encode("ascii", "replace").decode("ascii")
        self._texts.append((_TEXT_TYPES[event.level], text[:_TEXT_MAX]))
        self._text_waits.set()

    @property
    def dropped(self) -> int:
        """Frames of the library's that the link could not take."""
        return self._line.dropped

    # The firmware

    def mode_name(self, custom_mode: int) -> str:
        """The library's name of a mode."""
        return str(FlightMode(custom_mode).name)

    def mode_params(self, custom_mode: int) -> tuple[float, ...]:
        """The mode, for the commander to choose the library's call."""
        return (float(custom_mode),)

    def not_fit(self) -> Refusal | None:
        """Why the vehicle must not be flown by us; None where it may."""
        return self._unfit

    def not_set_up(self) -> Refusal | None:
        """Why the vehicle must not be armed: it would stay in the air if this computer died, or a parameter
        is wrong for the job; None where it may."""
        return not_set_up(self._way_down, self._rules, self._read, examined=self._examined)

    def _read(self, names: Names) -> tuple[str, float] | None:
        return next((self._parameters[name] for name in names if name in self._parameters), None)

    def keeps_climb(self) -> bool:
        """PX4 takes raw thrust, which our own height loop makes of measured climb rates."""
        return False

    # Listening

    async def _look_at(self, plugins: Plugins) -> None:
        found, kind = await plugins.system.get_system_id(), await plugins.system.autopilot_type()
        self._unfit = None
        if found != self._system_id:
            self._unfit = WrongSystemId(found, self._system_id)
        elif kind != Autopilot.PX4:
            self._unfit = BeyondLibrary(Autopilot(kind).name)

    def _listen(self, tasks: asyncio.TaskGroup, library: Library, plugins: Plugins) -> None:
        telemetry, readings = plugins.telemetry, self._readings
        streams = StreamKeeper(self._commander, self._clock, _RATES_HZ)
        sources: list[tuple[AsyncIterator[Any], int | None, Callable[[Any, int], None]]] = [
            (telemetry.subscribe_flight_mode(), dialect.MAVLINK_MSG_ID_HEARTBEAT, self._beat),
            (telemetry.subscribe_armed(), None, readings.take_armed),
            (
                plugins.direct.subscribe_message("ATTITUDE"),
                dialect.MAVLINK_MSG_ID_ATTITUDE,
                self._take_attitude,
            ),
            (
                telemetry.subscribe_position_velocity_ned(),
                dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
                readings.take_velocity,
            ),
            (
                plugins.direct.subscribe_message("DISTANCE_SENSOR"),
                dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR,
                self._take_range,
            ),
            (
                telemetry.subscribe_landed_state(),
                dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
                readings.take_landed,
            ),
            (telemetry.subscribe_battery(), dialect.MAVLINK_MSG_ID_BATTERY_STATUS, readings.take_battery),
            (telemetry.subscribe_status_text(), None, self._say),
            (plugins.direct.subscribe_message("TIMESYNC"), None, self._compare),
            (plugins.direct.subscribe_message("BATTERY_STATUS"), None, self._take_cells),
        ]
        for source, message_id, take in sources:
            tasks.create_task(self._take(source, streams, message_id, take), name=f"mavsdk {message_id}")
        beside: dict[str, Callable[[], Awaitable[None]]] = {
            "streams": streams.run,
            "parameters": partial(self._read_parameters, library),
            "timesync": partial(self._compare_clocks, library, plugins),
            "heartbeat poll": self._poll_beats,
            "texts": partial(self._tell, library, plugins),
        }
        for name, work in beside.items():
            tasks.create_task(insisted(work), name=f"mavsdk {name}")
        tasks.create_task(self._pass_on(library, plugins), name="mavsdk setpoints")
        tasks.create_task(self._idle(), name="mavsdk idle setpoints")

    async def _take(
        self,
        source: AsyncIterator[Any],
        streams: StreamKeeper,
        message_id: int | None,
        take: Callable[[Any, int], None],
    ) -> None:
        async for value in source:
            if message_id is not None:
                streams.count(message_id)
            take(value, self._clock.now_ns())

    def _beat(self, mode: FlightMode, now_ns: int) -> None:
        self._readings.take_mode(mode, now_ns)
        self._modes.heartbeat(now_ns)
        self._mind_gate()

    def _say(self, text: Any, now_ns: int) -> None:
        _LOG.info("autopilot: %s", text.text)
        self._modes.text(_SEVERITIES.get(text.type, _INFO), text.text, now_ns)

    def _compare(self, message: Any, now_ns: int) -> None:
        fields = whole_fields(message.fields_json, "tc1", "ts1")
        if fields is not None and fields[0] != 0:
            self._sync.answered(fields[1], fields[0], now_ns)

    def _take_attitude(self, message: Any, now_ns: int) -> None:
        if message.system_id == self._system_id and message.component_id == 1:
            self._readings.take_attitude(message.fields_json, now_ns)

    def _take_range(self, message: Any, now_ns: int) -> None:
        if message.system_id == self._system_id:
            self._readings.take_range(message.fields_json, now_ns)

    def _take_cells(self, message: Any, _now_ns: int) -> None:
        volts_mv = whole_list(message.fields_json, "voltages")
        ours = message.system_id == self._system_id and whole_fields(message.fields_json, "id") == (0,)
        if ours and volts_mv is not None:
            self._readings.take_cells(volts_mv)

    async def _read_parameters(self, library: Library) -> None:
        """Again and again: somebody may change them; what a version does not have only at first, for it takes
        its time to say so."""
        while self._unfit is None:
            for rule in self._rules:
                needed = rule in self._way_down or self._read(rule.names) is not None
                for name in rule.names if needed or not self._examined else ():
                    value = await library.parameter(name)
                    if value is not None:
                        self._parameters[name] = (name, value)
                        break
            missing = any(self._read(rule.names) is None for rule in self._way_down)
            self._examined = not missing
            await asyncio.sleep(_UNREAD_S if missing else _READ_AGAIN_S)

    async def _poll_beats(self) -> None:
        poll, beat = BeatPoll(), dialect.MAVLINK_MSG_ID_HEARTBEAT
        while True:
            if poll.is_due(self._clock.now_ns(), self._readings.heartbeat_ns):
                self._commander.post(dialect.MAV_CMD_REQUEST_MESSAGE, beat)
            await asyncio.sleep(BeatPoll.LOOK_S)

    async def _compare_clocks(self, library: Library, plugins: Plugins) -> None:
        while True:
            question = library.message("TIMESYNC", tc1=0, ts1=self._sync.ask(self._clock.now_ns()))
            with contextlib.suppress(MavsdkError):
                await library.call(plugins.direct.send_message(question))
            await asyncio.sleep(ASK_S if self._sync.is_settled else ASK_FAST_S)

    # Setpoints

    def _mind_gate(self) -> None:
        """Shut it as soon as nobody here may steer any more, or command."""
        self.gate.commanding = self._modes.may_command
        if not self._modes.may_steer and not self._modes.wants_flight:
            self.gate.close()

    def _steer(self, now_ns: int, roll_rad: float, pitch_rad: float, yaw_rad: float, thrust: float) -> None:
        """Have the library send this attitude, and let it pass the gate for a while."""
        self.gate.refresh(now_ns)
        degrees = map(math.degrees, (roll_rad, pitch_rad, yaw_rad))
        self._setpoints.put(SdkAttitude(*degrees, thrust))

    async def _pass_on(self, library: Library, plugins: Plugins) -> None:
        while True:
            attitude = await self._setpoints.get()
            with contextlib.suppress(MavsdkError):
                await library.call(plugins.offboard.set_attitude(attitude))

    async def _idle(self) -> None:
        """Setpoints while the mission makes none yet."""
        while True:
            await asyncio.sleep(_IDLE_PERIOD_S)
            now_ns = self._clock.now_ns()
            yaw_rad = self._readings.yaw_rad
            recently = now_ns - self._sent_ns < _PUMP_SILENT_NS
            thrust = self._steering.idle_thrust()
            if thrust is not None and yaw_rad is not None and not recently:
                self._steer(now_ns, 0.0, 0.0, yaw_rad, thrust)

    async def _tell(self, library: Library, plugins: Plugins) -> None:
        while True:
            await self._text_waits.wait()
            self._text_waits.clear()
            while self._texts:
                kind, text = self._texts.popleft()
                with contextlib.suppress(MavsdkError):
                    await library.call(plugins.texts.send_status_text(kind, text))
