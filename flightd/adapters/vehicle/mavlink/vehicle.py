"""What the MAVLink vehicles share: link, clock, telemetry, commands, the loop that works on the demand."""

from __future__ import annotations

import abc
import asyncio
import contextlib
import logging
import math
from collections import deque
from collections.abc import Awaitable, Callable
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.authority import Authority
from flightd.adapters.vehicle.mavlink.codec import Codec, Message
from flightd.adapters.vehicle.mavlink.commands import Answer, Commander
from flightd.adapters.vehicle.mavlink.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.height_loop import HeightLoop
from flightd.adapters.vehicle.mavlink.link import Firmware, MavlinkLink
from flightd.adapters.vehicle.mavlink.outputs import PoseForm, PoseOutput, landing_target
from flightd.adapters.vehicle.mavlink.parameters import Names, Parameters
from flightd.adapters.vehicle.mavlink.setpoint import Heading, attitude_target
from flightd.adapters.vehicle.mavlink.signing import Signing
from flightd.adapters.vehicle.mavlink.statustext import SEVERITIES, TextAssembler, make_texts
from flightd.adapters.vehicle.mavlink.streams import StreamKeeper
from flightd.adapters.vehicle.mavlink.telemetry import Telemetry
from flightd.adapters.vehicle.mavlink.timesync import ClockSync
from flightd.adapters.vehicle.mavlink.transport import make_transport
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Demand,
    Event,
    GridPose,
    LandedState,
    VehicleState,
)
from flightd.ports import Clock

_LOG = logging.getLogger(__name__)

RATES_HZ: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 20.0,  # a take-over must be seen within 100 ms
    dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: 20.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 25.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
}

_SILENT_NS = 3_000_000_000
_RECONCILE_S = 0.05
_SYNC_FAST_S, _SYNC_SLOW_S = 0.1, 1.0
_ARM_PAUSE_S = 1.0
_MODE_PAUSE_S = 0.5
_REASON_NS = 2_000_000_000
_HAND_BACK_S = 0.2
_HAND_BACK_ANSWER_S = 0.06
_ENGAGED = frozenset({Demand.FLY, Demand.LAND, Demand.DISARM})


class MavlinkVehicle(abc.ABC):
    """`ports.Vehicle` over MAVLink; the firmware's modes and the setpoint's thrust come from the subclass.

    One arming per FLY demand: a vehicle that was armed under it and is disarmed again (landed, timed
    out, the pilot's switch) is not armed anew until FLY follows another demand.  `in_control` also
    holds in the landing mode while LAND is demanded.  After a take-over by the pilot (or by a failsafe
    of the autopilot) nothing is sent until FLY follows HANDS_OFF or STANDBY.
    """

    firmware: ClassVar[Firmware]
    flying_mode: int
    """custom_mode in which the autopilot obeys setpoints."""
    landing_mode: int
    """custom_mode in which it lands where it is, without a position."""
    parameter_names: ClassVar[tuple[Names, ...]]
    """What has to be known of the autopilot's parameters."""
    rates_hz: ClassVar[dict[int, float]] = RATES_HZ

    def __init__(
        self,
        url: str,
        clock: Clock,
        system_id: int = 1,
        signing: Signing | None = None,
        pose_form: PoseForm | None = None,
    ) -> None:
        self._clock = clock
        self._system_id = system_id
        self._sync = ClockSync()
        self._telemetry = Telemetry(self._sync)
        self._authority = Authority()
        self._heading = Heading()
        self._height = HeightLoop()
        self._pose_output = None if pose_form is None else PoseOutput(pose_form)
        transport = make_transport(parse_endpoint(url))
        self.link = MavlinkLink(
            transport, Codec(system_id, signing=signing), clock, system_id, self._received
        )
        self._commander = Commander(self.link, system_id)
        self.streams = StreamKeeper(self._commander, clock, self.rates_hz)
        self.parameters = Parameters(self.link, system_id, bytewise=self.firmware is Firmware.PX4)
        self._texts = TextAssembler()
        self._reasons: deque[tuple[int, str]] = deque(maxlen=4)
        self._text_id = 0
        self._demand = Demand.STANDBY
        self._was_armed = False
        self._refused = ""
        self._refused_ns = 0
        self._heard = asyncio.Event()
        self._wake = asyncio.Event()

    # The port

    async def run(self) -> None:
        """Own the link until cancelled, then hand the vehicle back: in the air it is told to land.

        UnavailableError when the link can never be opened (port in use, not a serial device).
        """
        try:
            async with asyncio.TaskGroup() as tasks:
                self._serve(tasks)
                try:
                    await self._work()
                finally:
                    await self._hand_back()
        except ExceptionGroup as group:
            if len(group.exceptions) == 1:
                raise group.exceptions[0] from None
            raise

    def state(self) -> VehicleState | None:
        now_ns = self._clock.now_ns()
        mode = self._telemetry.custom_mode
        return self._telemetry.state(
            now_ns,
            "" if mode is None else self.mode_name(mode),
            in_control=self._authority.held is not None and not self._is_silent(now_ns),
            refusal=self._refusal(),
        )

    def attitudes(self) -> list[Attitude]:
        return self._telemetry.attitudes()

    def demand(self, demand: Demand) -> None:
        if demand is self._demand:
            return
        if demand not in _ENGAGED or self._demand not in _ENGAGED:
            self._authority.release()
        if demand is Demand.FLY:
            self._was_armed = False
        self._demand = demand
        self._refused = ""
        self.link.system_status = (
            dialect.MAV_STATE_ACTIVE if demand in _ENGAGED else dialect.MAV_STATE_STANDBY
        )
        self._wake.set()

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        now_ns = self._clock.now_ns()
        yaw_rad = self._telemetry.yaw_rad
        ours = self._demand in _ENGAGED and self._authority.held == self.flying_mode
        if not ours or yaw_rad is None or self._is_silent(now_ns):
            self._heading.release()
            self._height.release()
            return False
        if self._stands():
            self._heading.release()  # the vehicle may be turned by hand, its compass may still settle
        heading_rad = self._heading.step(now_ns, setpoint.yaw_rate_radps, yaw_rad)
        thrust = self._thrust(setpoint, now_ns)
        return self.link.send(attitude_target(now_ns, self._system_id, setpoint, heading_rad, thrust))

    def notify(self, event: Event) -> None:
        self._text_id = self._text_id % 65535 + 1
        for text in make_texts(SEVERITIES[event.level], f"{event.name}: {event.text}", self._text_id):
            self.link.send(text)

    def share_pose(self, pose: GridPose, pad_m: tuple[float, float] | None = None) -> None:
        """Give the autopilot's estimator the grid pose, at 30 Hz at most, if a `pose_form` was chosen; with
        `pad_m`, a place on the map, also the target of its precision landing."""
        now_ns = self._clock.now_ns()
        attitude, height_m = self._telemetry.attitude, self._telemetry.height_m(now_ns)
        if self._pose_output is None or attitude is None:
            return
        message = self._pose_output.make(now_ns, pose, attitude, height_m)
        if message is not None:
            self.link.send(message)
            if pad_m is not None:
                self.link.send(landing_target(self.firmware, pose, pad_m, height_m))

    # The firmware

    @abc.abstractmethod
    def mode_name(self, custom_mode: int) -> str:
        """The firmware's own name of a mode."""

    @abc.abstractmethod
    def _mode_params(self, custom_mode: int) -> tuple[float, ...]:
        """Parameters of DO_SET_MODE."""

    @abc.abstractmethod
    def _thrust(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        """The thrust field for a setpoint's climb rate."""

    def _not_fit(self) -> str:
        """Why the vehicle must not be flown by us, or an empty text."""
        if self.link.firmware is not None and self.link.firmware is not self.firmware:
            return f"the autopilot is {self.link.firmware.name}, the configuration says {self.firmware.name}"
        return ""

    def _serve(self, tasks: asyncio.TaskGroup) -> None:
        """Start what runs beside the demand loop."""
        tasks.create_task(self.link.run(), name="mavlink link")
        tasks.create_task(self._once_heard(self._compare_clocks), name="mavlink timesync")
        tasks.create_task(self._once_heard(self.streams.run), name="mavlink streams")
        tasks.create_task(self._once_heard(self._read_parameters), name="mavlink parameters")

    def _collective(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        """Raw thrust for the climb rate, by our own height loop."""
        return self._height.step(
            now_ns,
            setpoint.climb_mps,
            climb_mps=self._telemetry.climb_mps(now_ns),
            height_m=self._telemetry.height_m(now_ns),
            tilt_cos=math.cos(setpoint.roll_rad) * math.cos(setpoint.pitch_rad),
            on_floor=self._stands(),
        )

    # Receiving

    def _received(self, message: Message, now_ns: int) -> None:
        self.streams.count(message.get_msgId())
        match message.get_type():
            case "COMMAND_ACK":
                self._commander.acknowledged(message)
            case "TIMESYNC" if message.tc1 == 0:
                self.link.send(dialect.MAVLink_timesync_message(now_ns, message.ts1))
            case "TIMESYNC":
                self._sync.answered(message.ts1, message.tc1, now_ns)
            case "STATUSTEXT":
                self._say(message, now_ns)
            case "PARAM_VALUE":
                self.parameters.value(message)
            case _:
                if self._telemetry.take(message, now_ns):
                    self.parameters.forget()  # it rebooted: they may have changed
                if message.get_type() == "HEARTBEAT":
                    self._beat(now_ns)

    def _beat(self, now_ns: int) -> None:
        self._heard.set()
        mode = self._telemetry.custom_mode
        assert mode is not None
        if self._authority.heartbeat(mode, now_ns):
            _LOG.warning("%s: taken over by mode %s", self.link.endpoint, self.mode_name(mode))
            self._wake.set()
        if self._telemetry.armed and self._authority.held == self.flying_mode:
            self._was_armed = True

    def _say(self, message: Message, now_ns: int) -> None:
        for severity, text in self._texts.add(message):
            _LOG.info("autopilot: %s", text)
            if severity <= dialect.MAV_SEVERITY_WARNING:
                self._reasons.append((now_ns, text))

    # Working on the demand

    async def _work(self) -> None:
        while True:
            await self._reconcile(self._demand)
            await self._pause(_RECONCILE_S)

    async def _reconcile(self, demand: Demand) -> None:
        """One step from what the vehicle does towards what is demanded."""
        if demand not in _ENGAGED or self._authority.taken or self._is_silent(self._clock.now_ns()):
            return
        held = self._authority.held
        problem = self._not_fit() if demand is Demand.FLY else ""
        match demand:
            case Demand.FLY if problem:
                self._refuse(problem)
            case Demand.FLY if held != self.flying_mode:
                await self._ask_mode(self.flying_mode)
            case Demand.FLY if not self._telemetry.armed and not self._was_armed:
                await self._ask_arming()
            case Demand.LAND if held is not None and held != self.landing_mode:
                await self._ask_mode(self.landing_mode)
            case Demand.DISARM if held is not None and self._telemetry.armed:
                await self._ask_disarming()
            case _:
                pass

    async def _ask_mode(self, mode: int) -> None:
        demand = self._demand
        self._authority.ask(mode, self._telemetry.custom_mode)
        answer = await self._commander.send(
            dialect.MAV_CMD_DO_SET_MODE, *self._mode_params(mode), wanted=lambda: self._still(demand)
        )
        if answer.accepted:
            self._authority.accepted(mode, self._clock.now_ns())
        await self._settle(answer, f"mode {self.mode_name(mode)}", _MODE_PAUSE_S, demand)

    async def _ask_arming(self) -> None:
        demand = self._demand
        answer = await self._commander.send(
            dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1, wanted=lambda: self._still(demand)
        )
        await self._settle(answer, "arming", _ARM_PAUSE_S, demand)

    async def _ask_disarming(self) -> None:
        demand = self._demand
        answer = await self._commander.send(
            dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0, wanted=lambda: self._still(demand)
        )
        await self._settle(answer, "disarming", _ARM_PAUSE_S, demand)

    def _still(self, demand: Demand) -> bool:
        return self._demand is demand and not self._authority.taken

    async def _settle(self, answer: Answer, what: str, pause_s: float, demand: Demand) -> None:
        """Keep the refusal's reason and wait before the next attempt; after a success give the
        vehicle's heartbeat time to show it."""
        if not self._still(demand):
            return
        if answer.accepted:
            self._refused = ""
        else:
            self._refuse(f"{what}: {answer}")
        await self._pause(pause_s)

    async def _pause(self, duration_s: float) -> None:
        """Wait, or until the demand or the vehicle's owner changes."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(duration_s):
                await self._wake.wait()
        self._wake.clear()

    def _refuse(self, text: str) -> None:
        self._refused = text
        self._refused_ns = self._clock.now_ns()

    def _refusal(self) -> str:
        """What was refused and the autopilot's own words at that time."""
        if self._authority.taken:
            return "the pilot or a failsafe changed the mode"
        said = [text for at_ns, text in self._reasons if abs(at_ns - self._refused_ns) < _REASON_NS]
        return f"{self._refused} ({said[-1]})" if self._refused and said else self._refused

    async def _hand_back(self) -> None:
        """Leave the vehicle in a state that needs no companion: landing, or disarmed on the floor."""
        if self._authority.held != self.flying_mode or not self._telemetry.armed:
            return
        command: int = dialect.MAV_CMD_DO_SET_MODE
        params = self._mode_params(self.landing_mode)
        if self._telemetry.landed is LandedState.ON_GROUND:
            command, params = dialect.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_HAND_BACK_S):
                await self._commander.send(command, *params, patience_s=_HAND_BACK_ANSWER_S)

    def _stands(self) -> bool:
        """On the floor, as far as the autopilot knows."""
        return not self._telemetry.armed or self._telemetry.landed is LandedState.ON_GROUND

    # Clocks and liveness

    async def _once_heard(self, work: Callable[[], Awaitable[None]]) -> None:
        await self._heard.wait()
        await work()

    async def _read_parameters(self) -> None:
        await self.parameters.keep(self.parameter_names)

    async def _compare_clocks(self) -> None:
        while True:
            self.link.send(dialect.MAVLink_timesync_message(0, self._sync.ask(self._clock.now_ns())))
            await asyncio.sleep(_SYNC_SLOW_S if self._sync.is_settled else _SYNC_FAST_S)

    def _is_silent(self, now_ns: int) -> bool:
        return now_ns - self._telemetry.heartbeat_ns > _SILENT_NS
