"""What the MAVLink vehicles share: link, clock, telemetry, commands, the loop that works on the demand."""

from __future__ import annotations

import abc
import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware, MavlinkLink
from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.signing import Signing
from flightd.adapters.vehicle.mavlink.link.transport import make_transport
from flightd.adapters.vehicle.mavlink.mode_manager import ModeArmingManager
from flightd.adapters.vehicle.mavlink.parameter_rule import Names, ParameterFinding, judge_all
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm
from flightd.adapters.vehicle.mavlink.pose_parameters import pose_rules
from flightd.adapters.vehicle.mavlink.pose_sharing import PoseSharing
from flightd.adapters.vehicle.mavlink.refusal import SharedSystemId, WrongFirmware, not_set_up
from flightd.adapters.vehicle.mavlink.required_parameters import Job, advice_for, rules_for, way_down_rules
from flightd.adapters.vehicle.mavlink.services.clock_offset import ASK_FAST_S, ASK_S, ClockSync
from flightd.adapters.vehicle.mavlink.services.commands import Commander
from flightd.adapters.vehicle.mavlink.services.heartbeat_rate import BEATS_HZ, BeatPoll, Beats, too_slow
from flightd.adapters.vehicle.mavlink.services.parameters import Parameters
from flightd.adapters.vehicle.mavlink.services.statustext import SEVERITIES, TextAssembler, make_texts
from flightd.adapters.vehicle.mavlink.services.stream_rates import StreamKeeper
from flightd.adapters.vehicle.mavlink.services.switched_output import SwitchedOutput
from flightd.adapters.vehicle.mavlink.setpoint import attitude_target
from flightd.adapters.vehicle.mavlink.setpoint_shaper import SetpointShaper
from flightd.adapters.vehicle.mavlink.telemetry import ClimbSource, MavlinkTelemetry, version_words
from flightd.config.vehicle import DEFAULT_ORIGIN_DEG
from flightd.core.refusal import Refusal
from flightd.core.shared_pose import SharedPose
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Demand,
    Event,
    EventLevel,
    PoseUse,
    VehicleState,
)
from flightd.ports import Clock
from flightd.runtime.datagrams import OpenDatagrams, open_datagrams
from flightd.runtime.supervisor import insisted

_LOG = logging.getLogger(__name__)

RATES_HZ: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: BEATS_HZ,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: 20.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 25.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
}

_BEATS_SETTLE_S, _BEATS_WINDOW_S, _BEATS_CHECK_S = 5.0, 3.0, 1.0
_EXAMINE_S, _EXAMINE_AGAIN_S = 0.5, 10.0
_VERSION_LOOKS, _VERSION_S = 3, 0.2


@dataclass(frozen=True, slots=True)
class MavlinkOptions:
    """The vehicle's `system_id`, what its parameters have to be set up for (`job`), the key of a signed link,
    the form in which the autopilot's estimator is told of our motion (None: not at all), and latitude and
    longitude for an estimator that has to have some."""

    system_id: int = 1
    job: Job = field(default_factory=Job)
    signing: Signing | None = None
    pose_form: PoseForm | None = None
    origin_deg: tuple[float, float] = DEFAULT_ORIGIN_DEG
    opener: OpenDatagrams = open_datagrams
    """What opens its UDP socket."""


DEFAULTS = MavlinkOptions()


class MavlinkVehicle(abc.ABC):
    """`ports.Vehicle` over MAVLink; the firmware's modes and the setpoint's thrust come from the subclass.

    `in_control` also holds in the landing mode while LAND is demanded.  After a take-over by the pilot
    (or by a failsafe of the autopilot) nothing is sent until FLY follows HANDS_OFF or STANDBY.
    """

    firmware: ClassVar[Firmware]
    flying_mode: int
    """custom_mode in which the autopilot obeys setpoints."""
    landing_mode: int
    """custom_mode in which it lands where it is, without a position."""
    prime_s: float = 0.0
    """How long setpoints have to stream before the flying mode is entered."""
    parameter_names: ClassVar[tuple[Names, ...]]
    """What is asked for of the autopilot's parameters."""
    required_names: ClassVar[tuple[Names, ...]] = ()
    """Those of them without which it is not flown."""
    rates_hz: ClassVar[dict[int, float]] = RATES_HZ
    climb_from: ClassVar[ClimbSource] = ClimbSource.GLOBAL_POSITION
    watches_beats: ClassVar[bool] = False
    """Whether its failsafe goes by the heartbeats of one system, which has to be this computer alone."""

    def __init__(self, url: str, clock: Clock, options: MavlinkOptions = DEFAULTS) -> None:
        system_id, job = options.system_id, options.job
        self._clock = clock
        self._system_id, self._own_system_id = system_id, job.own_system_id
        self._sync = ClockSync()
        self._telemetry = MavlinkTelemetry(self._sync, self.climb_from, job.range_finder)
        transport = make_transport(parse_endpoint(url), options.opener)
        codec = Codec(system_id, signing=options.signing)
        beats = Codec(job.own_system_id, signing=options.signing) if self.watches_beats else codec
        self.link = MavlinkLink(
            transport, codec, clock, system_id, self._received, beats, self._holds_failsafe
        )
        self._commander = Commander(self.link, system_id)
        self._modes = ModeArmingManager(self, self._commander, self._telemetry, clock)
        self._steering = SetpointShaper(self._modes, self._telemetry)
        self.streams = StreamKeeper(self._commander, clock, self.rates_hz)
        self.parameters = Parameters(self.link, system_id, bytewise=self.firmware is Firmware.PX4)
        self._texts = TextAssembler()
        self._text_id = 0
        self._rules, self._advice = rules_for(self.firmware, job), advice_for(self.firmware, job)
        taken = pose_rules(self.firmware, job.pose_output, landing_target=job.landing_target)
        self._pose = PoseSharing(options.pose_form, self.firmware, taken, self.parameters.get)
        self._way_down = way_down_rules(self._rules)
        self._examined = False
        """All that the autopilot answers of its parameters was read."""
        self._told_use = PoseUse.NONE
        wanted = self._advice or job.pose_output != "auto"
        self._untaken = EventLevel.WARNING if wanted else EventLevel.INFO
        self._reboots = 0
        self._version = ""
        self._heard = asyncio.Event()
        self._beats = Beats(_BEATS_WINDOW_S)
        self._poll = BeatPoll()

    # The port

    async def run(self) -> None:
        """Own the link until cancelled, then hand the vehicle back: in the air it is told to land.

        UnavailableError when the link can never be opened (port in use, not a serial device).
        """
        try:
            async with asyncio.TaskGroup() as carrying:
                carrier = carrying.create_task(self.link.run(), name="mavlink link")
                try:
                    await self._live()
                finally:
                    carrier.cancel()  # it has carried what handing back took
        except ExceptionGroup as group:
            if len(group.exceptions) == 1:
                raise group.exceptions[0] from None
            raise

    async def _live(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            self._serve(tasks)
            try:
                await self._modes.run()
            finally:
                await self._modes.hand_back()

    def state(self) -> VehicleState | None:
        now_ns = self._clock.now_ns()
        mode = self._telemetry.custom_mode
        state = self._telemetry.state(
            now_ns,
            "" if mode is None else self.mode_name(mode),
            in_control=self._modes.in_control,
            refusal=self._modes.refusal,
        )
        known = state and replace(
            state,
            unfit=self._modes.unfit,
            keeps_climb=self.keeps_climb(),
            pose_use=self._pose.use,
            unheard=self._modes.is_silent,
        )
        return known and self._steering.climb_of(known, now_ns)

    def attitudes(self) -> list[Attitude]:
        return self._telemetry.attitudes()

    def demand(self, demand: Demand) -> None:
        self._modes.demand(demand)
        engaged = self._modes.is_engaged
        self.link.system_status = dialect.MAV_STATE_ACTIVE if engaged else dialect.MAV_STATE_STANDBY

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        now_ns = self._clock.now_ns()
        heading_rad = self._steering.heading_rad(setpoint, now_ns)
        if heading_rad is None:
            return False
        thrust = self._thrust(setpoint, now_ns)
        return self.link.send(attitude_target(now_ns, self._system_id, setpoint, heading_rad, thrust))

    def notify(self, event: Event) -> None:
        self._text_id = self._text_id % 65535 + 1
        for text in make_texts(SEVERITIES[event.level], f"{event.name}: {event.text}", self._text_id):
            self.link.send(text)

    @property
    def dropped(self) -> int:
        """Messages that the link could not take."""
        return self.link.dropped

    def share_pose(self, pose: SharedPose | None, pad_m: tuple[float, float] | None = None) -> None:
        """Tell the autopilot's estimator of the motion, at 30 Hz at most, if a `pose_form` was chosen and it
        takes it; with `pad_m`, a place on the map, also the target of its precision landing while it is
        near."""
        now_ns = self._clock.now_ns()
        state = self._telemetry.state(now_ns, "", in_control=False, refusal=None)
        if state is not None:
            for message in self._pose.messages(now_ns, state, pose, pad_m):
                self.link.send(message)

    @property
    def gives_pose(self) -> bool:
        """Whether the autopilot's estimator is told of the motion."""
        return self._pose.use is PoseUse.GIVEN

    def output(self, number: int) -> SwitchedOutput:
        """One of the autopilot's own outputs."""
        return SwitchedOutput(self._commander, self.firmware, number)

    # For who looks after it on the ground

    @property
    def is_examined(self) -> bool:
        """Whether all that it answers of its parameters was read."""
        return self._examined

    def findings(self) -> list[ParameterFinding]:
        """The parameters that are wrong for the job, of those that were read."""
        return judge_all((*self._rules, *self._advice), self.parameters.get)

    async def set_right(self, finding: ParameterFinding) -> bool:
        """Write its better value; True when it read back as written.  An armed vehicle is left as it is."""
        is_known = self.parameters.get((finding.name,)) is not None
        if finding.better is None or self._telemetry.armed or not is_known:
            return False
        return await self.parameters.write(finding.name, finding.better)

    async def version(self) -> str:
        """What its firmware says of itself; "" where it does not tell."""
        for _ in range(_VERSION_LOOKS):
            if self._version or not self._heard.is_set():
                break
            message = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            self._commander.post(dialect.MAV_CMD_REQUEST_MESSAGE, message)
            await asyncio.sleep(_VERSION_S)
        return self._version

    # The firmware

    @abc.abstractmethod
    def mode_name(self, custom_mode: int) -> str:
        """The firmware's own name of a mode."""

    @abc.abstractmethod
    def mode_params(self, custom_mode: int) -> tuple[float, ...]:
        """Parameters of DO_SET_MODE."""

    def not_set_up(self) -> Refusal | None:
        """Why the vehicle must not be armed: it would stay in the air if this computer died, or a parameter
        is wrong for the job; None where it may."""
        if self.link.hears_namesake(self._clock.now_ns()):
            return SharedSystemId(self._own_system_id)
        return not_set_up(self._way_down, self._rules, self.parameters.get, examined=self._examined)

    def keeps_climb(self) -> bool:
        """Whether the autopilot itself keeps a setpoint's climb rate; not where our own height loop does."""
        return False

    def _holds_failsafe(self) -> bool:
        """Whether our heartbeats go out, which keep the autopilot from landing by itself."""
        return True

    @abc.abstractmethod
    def _thrust(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        """The thrust field for a setpoint's climb rate."""

    def not_fit(self) -> Refusal | None:
        """Why the vehicle must not be flown by us; None where it may."""
        found = self.link.firmware
        if found is not None and found is not self.firmware:
            return WrongFirmware(found.name, self.firmware.name)
        return None

    def _serve(self, tasks: asyncio.TaskGroup) -> None:
        """Start what runs beside the demand loop."""
        tasks.create_task(self._once_heard(self._compare_clocks), name="mavlink timesync")
        tasks.create_task(self._once_heard(self.streams.run), name="mavlink streams")
        tasks.create_task(self._once_heard(self._read_parameters), name="mavlink parameters")
        tasks.create_task(self._once_heard(self._examine), name="mavlink examination")
        tasks.create_task(self._once_heard(self._mind_beats), name="mavlink heartbeat rate")
        tasks.create_task(self._once_heard(self._poll_beats), name="mavlink heartbeat poll")

    # Receiving

    def _received(self, message: Message, now_ns: int) -> None:
        self.streams.count(message.get_msgId())
        match message.get_type():
            case "COMMAND_ACK":
                self._commander.acknowledged(message)
                unsupported = message.result == dialect.MAV_RESULT_UNSUPPORTED
                if message.command == dialect.MAV_CMD_REQUEST_MESSAGE and unsupported:
                    self._poll.refused(now_ns)
            case "TIMESYNC" if message.tc1 == 0:
                self.link.send(dialect.MAVLink_timesync_message(now_ns, message.ts1))
            case "TIMESYNC":
                self._sync.answered(message.ts1, message.tc1, now_ns)
            case "STATUSTEXT":
                self._say(message, now_ns)
            case "PARAM_VALUE":
                self.parameters.value(message)
            case "AUTOPILOT_VERSION":
                self._version = version_words(message.flight_sw_version)
            case _:
                if self._telemetry.take(message, now_ns):
                    self._rebooted()
                if message.get_type() == "HEARTBEAT":
                    self._heard.set()
                    self._beats.heard(now_ns)
                    self._modes.heartbeat(now_ns)

    def _rebooted(self) -> None:
        """The autopilot started anew: what was read of it and set in it may be so no longer."""
        self.parameters.forget()
        self._examined = False
        self._version = ""
        self._reboots += 1

    def _say(self, message: Message, now_ns: int) -> None:
        for severity, text in self._texts.add(message):
            _LOG.info("autopilot: %s", text)
            self._modes.text(severity, text, now_ns)

    # Beside the demand

    async def _once_heard(self, work: Callable[[], Awaitable[None]]) -> None:
        """Work that no flight ends for: what it raises is logged, and it begins anew."""
        await self._heard.wait()
        await insisted(work)

    async def _read_parameters(self) -> None:
        """Those by which it is flown; the rest is read on the ground, by the examination."""
        advised = (rule.names for rule in self._advice if not rule.optional)
        names = (*self.parameter_names, *advised, *self._pose.needed_names)
        await self.parameters.keep(tuple(dict.fromkeys(names)), self.required_names)

    async def _examine(self) -> None:
        """Read all that the doctor would look at, again and again on the ground; what this version does not
        have is never answered."""
        rules = (*self._way_down, *self._rules, *self._advice)
        names = tuple(dict.fromkeys(rule.names for rule in rules))
        while True:
            if not self._telemetry.armed:
                reboots = self._reboots
                if self._examined:
                    await self.parameters.read_again(names)
                await self.parameters.read_all(names)
                self._examined = reboots == self._reboots
                self._tell_pose_use()
            complete = all(rule.optional or self.parameters.get(rule.names) for rule in self._way_down)
            await asyncio.sleep(_EXAMINE_AGAIN_S if self._examined and complete else _EXAMINE_S)

    def _tell_pose_use(self) -> None:
        """Tell people whenever the autopilot's estimator begins or ceases to take our motion."""
        before, self._told_use = self._told_use, self._pose.use
        if self._told_use is before or self._told_use in {PoseUse.NONE, PoseUse.UNKNOWN}:
            return
        given = self._told_use is PoseUse.GIVEN
        text = "its estimator takes our motion" if given else "its estimator does not take our motion"
        _LOG.info("%s", text)
        level = EventLevel.INFO if given else self._untaken
        self.notify(Event(self._clock.now_ns(), level, "pose_output", text))

    async def _mind_beats(self) -> None:
        """Tell people once, when the heartbeats stay too far apart to see a take-over in time."""
        await asyncio.sleep(_BEATS_SETTLE_S)  # the rate has been asked for meanwhile
        self._beats.start(self._clock.now_ns())
        while True:
            await asyncio.sleep(_BEATS_CHECK_S)
            now_ns = self._clock.now_ns()
            problem = None if self._modes.is_silent else too_slow(self._beats.rate_hz(now_ns))
            if problem is not None:
                _LOG.warning("%s", problem)
                self.notify(Event(now_ns, EventLevel.WARNING, "heartbeat_rate", str(problem)))
                return

    async def _poll_beats(self) -> None:
        beat = dialect.MAVLINK_MSG_ID_HEARTBEAT
        while True:
            if self._poll.is_due(self._clock.now_ns(), self._telemetry.heartbeat_ns):
                self._commander.post(dialect.MAV_CMD_REQUEST_MESSAGE, beat)
            await asyncio.sleep(BeatPoll.LOOK_S)

    async def _compare_clocks(self) -> None:
        while True:
            self.link.send(dialect.MAVLink_timesync_message(0, self._sync.ask(self._clock.now_ns())))
            await asyncio.sleep(ASK_S if self._sync.is_settled else ASK_FAST_S)
