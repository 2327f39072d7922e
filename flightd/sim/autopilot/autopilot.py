"""What every simulated autopilot does, whatever its firmware: clock, steps, link, telemetry, truth."""

from __future__ import annotations

import abc
import asyncio
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.ports import Clock
from flightd.sim.autopilot.climb_loop import ClimbLoop
from flightd.sim.autopilot.external_vision import ExternalVision, Taken
from flightd.sim.autopilot.link import Address, MavlinkChannel, Message, UdpLink
from flightd.sim.autopilot.parameters import ParameterServer
from flightd.sim.autopilot.radio import PERFECT, RadioParams
from flightd.sim.autopilot.streams import HEARTBEAT_ID, MessageStreams, whole
from flightd.sim.autopilot.telemetry import Instruments
from flightd.sim.leap import NEVER, Leap, LeapInFlight
from flightd.sim.plant.airframe import Airframe, AirframeCommand
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.truth_history import TruthHistory
from flightd.sim.sensors.instruments import SensorParams, Sensors

_NS_PER_MS = 1_000_000
_BOOT_WRAP_MS = 2**32
_TRUTH_EVERY = 2
_TRUTH_SAMPLES = 1000
_TEXTS_KEPT = 50
_BURST_NS = 50_000_000
_CATCH_UP_NS = 2_000 * _NS_PER_MS
"""A process that slept longer than this goes on from now instead of simulating what it missed."""


@dataclass(frozen=True, slots=True)
class Sticks:
    """The pilot's wishes in the modes he flies himself: angles, yaw rate and climb rate."""

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rate_radps: float = 0.0
    climb_mps: float = 0.0


@dataclass(frozen=True, slots=True)
class PeerConfig:
    """Where the autopilot listens and how it starts.

    `remotes` are addresses it talks to unasked (a companion that only listens).  `ready_s` after boot
    it can be armed (a real one takes about 20 s).  Its boot clock runs `clock_ppm` fast, and
    is set once by `clock_leap`.
    It has no estimate of its position unless `has_position`, and stands at `place_deg` on earth (latitude
    and longitude).  `radio` lies between it and the companion,
    `radio_up` on the way to it where that is another.
    """

    host: str = "127.0.0.1"
    port: int = 0
    remotes: tuple[Address, ...] = ()
    system_id: int = 1
    ready_s: float = 3.0
    has_position: bool = False
    place_deg: tuple[float, float] = (51.4778, 0.0)
    step_ns: int = 2_500_000
    clock_ppm: float = 20.0
    clock_leap: Leap = NEVER
    sensors: SensorParams = field(default_factory=SensorParams)
    seed: int = 0
    home_leap_m: float = 1.4
    """PX4: by so much the height above home leaps when it is armed."""
    second_range_m: float | None = None
    """A second range finder beside the first reads so much more, and nothing on the floor; None: there is
    none."""
    signing_key: bytes | None = None
    radio: RadioParams = PERFECT
    radio_up: RadioParams | None = None
    parameters: dict[str, float] = field(default_factory=dict)
    parameter_queue: int | None = None
    """So many parameters are told of those asked for within 50 ms, the rest of the burst is dropped; None:
    all."""


class AutopilotPeer(abc.ABC):
    """An autopilot with its airframe on the running loop's time.

    Steps are `step_ns` apart on the loop's clock; whoever asks (a timer, a datagram, the renderer) brings
    it up to the present first, so the flight does not depend on who asks when.
    """

    takes_keys = False
    """Whether SETUP_SIGNING is obeyed (on the ground)."""

    pilots_mode: int
    """The mode into which a pilot's switch takes it: he flies, it keeps the height."""

    landing_mode: int

    unasked_ns: ClassVar[Mapping[int, int]] = {}
    """Periods of the messages that everybody gets who speaks to it, by message id."""

    fixed_rates: ClassVar[frozenset[int]] = frozenset()
    """Messages whose rate cannot be changed, by id."""

    refused_arming: int
    """The MAV_RESULT of an arming that something is against."""

    def __init__(
        self, clock: Clock, airframe: Airframe, config: PeerConfig, parameters: ParameterServer
    ) -> None:
        self.airframe = airframe
        self.sensors = Sensors(config.sensors, config.seed)
        self.sensors.battery.update(0.0, airframe)  # whoever arms it at once has a voltage to be refused for
        self.instruments = Instruments(airframe, self.sensors, config.second_range_m)
        self.parameters = parameters
        self.link = UdpLink(
            config.system_id, dialect.MAV_COMP_ID_AUTOPILOT1, self.received, config.signing_key, config.seed
        )
        self.link.down.params = config.radio
        self.link.up.params = config.radio if config.radio_up is None else config.radio_up
        self._config = config
        self._clock = clock
        self._now_ns = self._boot_ns = clock.now_ns()
        self._clock_ppm = config.clock_ppm
        self._clock_leap = LeapInFlight(config.clock_leap)
        self.streams = MessageStreams(self.link, self, self._now_ns, config.step_ns)
        self._steps = 0
        self._truth = TruthHistory(_TRUTH_SAMPLES)
        self._truth.add(airframe.kinematics(self._now_ns))
        self.vision = ExternalVision(self.sensors, self._truth.at)
        self._address: Address | None = None
        self.armed = False
        self.landed = True
        self.sticks = Sticks()
        self.arming_block = ""
        """A sensor fault: the reason with which arming is refused while it is not empty."""
        self.reports_landed = True
        """Otherwise it reports to be in the air for ever."""
        self.texts: deque[str] = deque(maxlen=_TEXTS_KEPT)
        self.lamp_lit = False
        """Whether its output that a lamp hangs on is switched on."""
        """What others gave it to show, newest last."""
        self._climb_loop = ClimbLoop()
        self._stick_yaw_rad = 0.0
        self._idle_s = 0.0
        self._settled_s = 0.0
        self._burst_ns = self._burst = 0

    async def open(self) -> Address:
        """Bind the socket and greet the remotes; the address bound.  OSError when the port is taken."""
        if self._address is None:
            self._address = await self.link.open(self._config.host, self._config.port)
            for remote in self._config.remotes:
                self.link.channel(remote)
        return self._address

    async def run(self) -> None:
        """Serve until cancelled."""
        await self.open()
        try:
            while True:
                now_ns = self._clock.now_ns()
                self.advance(now_ns)
                self._refresh(now_ns)
                self.streams.send_due(now_ns)
                await asyncio.sleep(max(0, self.streams.next_due_ns(now_ns) - self._clock.now_ns()) / 1e9)
        finally:
            self.close()

    def close(self) -> None:
        """Free the socket; `open` binds it again."""
        self.link.close()
        self._address = None

    @property
    def address(self) -> Address | None:
        """Where it listens; None while it does not."""
        return self._address

    def advance(self, now_ns: int) -> None:
        """Step the vehicle up to `now_ns`."""
        step_ns = self._config.step_ns
        if now_ns - self._now_ns > _CATCH_UP_NS:
            self._now_ns = now_ns - step_ns
        dt_s = step_ns / 1e9
        while self._now_ns + step_ns <= now_ns:
            self._now_ns += step_ns
            self.airframe.step(dt_s, self._control(dt_s))
            self.sensors.update(dt_s, self.airframe)
            self._steps += 1
            self.vision.step(dt_s, self.airframe)
            if self._steps % _TRUTH_EVERY == 0:
                self._truth.add(self.airframe.kinematics(self._now_ns))

    def truth(self) -> Kinematics:
        """The true motion now."""
        return self.truth_at(self._clock.now_ns())

    def truth_at(self, stamp_ns: int) -> Kinematics:
        """The true motion at a moment of the last seconds, of the loop's clock."""
        self.advance(min(stamp_ns, self._clock.now_ns()))
        return self._truth.at(stamp_ns)

    def pilot_mode(self, custom_mode: int, sticks: Sticks | None = None) -> bool:
        """The pilot moves his mode switch; False when the autopilot refuses."""
        self.advance(self._clock.now_ns())
        self.sticks = sticks or Sticks()
        return self._set_mode(custom_mode) == int(dialect.MAV_RESULT_ACCEPTED)

    def pilot_arm(self) -> bool:
        """The pilot's arming switch; False when the autopilot refuses."""
        self.advance(self._clock.now_ns())
        return self._arm() == int(dialect.MAV_RESULT_ACCEPTED)

    def pilot_disarm(self) -> None:
        """The pilot's disarm switch: motors stop at once, wherever the vehicle is."""
        self.advance(self._clock.now_ns())
        self._disarm()

    def say(self, severity: int, text: str) -> None:
        """STATUSTEXT to everyone."""
        self.link.broadcast(
            dialect.MAVLink_statustext_message(severity, text.encode("ascii", "replace")[:50])
        )

    def jump_clock(self, jump_ns: int) -> None:
        """The boot clock goes on from elsewhere; streams keep their rates."""
        self._boot_ns -= jump_ns
        self.instruments.clock_changed()

    def pace_clock(self, ppm: float) -> None:
        """The boot clock runs so much fast from now on."""
        now_ns = self._clock.now_ns()
        told_ns = self.boot_clock_ns(now_ns)
        self._clock_ppm = ppm
        self._boot_ns = now_ns - round(told_ns / (1.0 + ppm * 1e-6))

    def reboot(self) -> None:
        """Power cycle: the boot clock starts again, streams are forgotten, motors stop."""
        self._boot_ns = self._now_ns
        self.instruments.clock_changed()
        for channel in self.link.channels.values():
            channel.intervals_ns.clear()
            channel.due_ns.clear()
            channel.greeted = False

    @property
    def up_s(self) -> float:
        """Seconds since boot by the autopilot's own clock."""
        return self.boot_clock_ns(self._now_ns) / 1e9

    @property
    def is_ready(self) -> bool:
        return self.up_s >= self._config.ready_s

    @abc.abstractmethod
    def _control(self, dt_s: float) -> AirframeCommand:
        """One pass of the flight code: what the airframe shall do during the next step."""

    @abc.abstractmethod
    def _heartbeat(self) -> Message: ...

    def _base_mode(self) -> int:
        """HEARTBEAT.base_mode of what every firmware says there."""
        base = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
        return int(base | (dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0))

    @abc.abstractmethod
    def _command(self, command: int, params: tuple[float, ...]) -> int:
        """Obey a command of this firmware's own; the MAV_RESULT."""

    @abc.abstractmethod
    def _set_output(self, command: int, params: tuple[float, ...]) -> int:
        """Switch what a lamp hangs on; the MAV_RESULT."""

    @abc.abstractmethod
    def _set_mode(self, custom_mode: int) -> int:
        """Change the mode on a client's wish; the MAV_RESULT."""

    def _mode_of(self, params: tuple[float, ...]) -> int:
        """custom_mode in the parameters of DO_SET_MODE."""
        return whole(params[1])

    def _arm(self) -> int:
        """Arm if nothing is against it; the MAV_RESULT."""
        if self.armed:
            return int(dialect.MAV_RESULT_ACCEPTED)
        reason = self._arming_refusal()
        if reason:
            self.say(dialect.MAV_SEVERITY_CRITICAL, reason)
            return self.refused_arming
        self.armed, self.landed = True, True
        self._idle_s = 0.0
        self._on_armed()
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _disarm(self) -> None:
        """Stop the motors."""
        if self.armed:
            self.armed, self.landed = False, True
            self._on_disarmed()

    @abc.abstractmethod
    def _arming_refusal(self) -> str | None:
        """What is against arming, as the autopilot says it; None where nothing is."""

    @abc.abstractmethod
    def _on_armed(self) -> None: ...

    @abc.abstractmethod
    def _on_disarmed(self) -> None: ...

    @abc.abstractmethod
    def _setpoint(self, message: Message) -> None:
        """Take a SET_ATTITUDE_TARGET that is addressed to this system."""

    @abc.abstractmethod
    def _taken(self) -> Taken:
        """What its parameters say of poses that it is told."""

    @abc.abstractmethod
    def _exposed_ns(self, stamp_ns: int, now_ns: int) -> int:
        """The moment of a pose that its sender's clock says is of `stamp_ns`, as the autopilot reckons it."""

    def _take_pose(self, message: Message, now_ns: int) -> None:
        stamp_us = message.time_usec if message.get_type() == "ODOMETRY" else message.usec
        exposed_ns = min(self._exposed_ns(stamp_us * 1000, now_ns), now_ns)
        self.vision.take(message, self._taken(), exposed_ns, now_ns)

    def _client_beat(self, system_id: int) -> None:  # noqa: B027 - PX4 goes by the setpoints alone
        """Take the HEARTBEAT of somebody on the link."""

    def _hold_climb(self, dt_s: float, climb_mps: float) -> float:
        """The collective by which the autopilot's own height loop keeps a climb rate."""
        sensors = self.sensors
        return self._climb_loop.step(
            dt_s,
            climb_mps,
            height_m=sensors.height_m,
            speed_mps=sensors.climb_mps,
            accel_mps2=sensors.accel_mps2,
            tilt_cos=sensors.tilt_cos,
        )

    def _fly(
        self, roll_rad: float, pitch_rad: float, yaw_rad: float, yaw_rate_radps: float, collective: float
    ) -> AirframeCommand:
        """Attitude in the autopilot's own estimate to the airframe's truth."""
        sensors = self.sensors
        return AirframeCommand(
            motors=True,
            roll_rad=roll_rad - sensors.roll_error_rad,
            pitch_rad=pitch_rad - sensors.pitch_error_rad,
            yaw_rad=yaw_rad - sensors.yaw_error_rad,
            yaw_rate_radps=yaw_rate_radps,
            collective=collective,
        )

    def knows(self, message_id: int) -> bool:
        """Whether it has such a message to send."""
        return message_id == HEARTBEAT_ID or self.instruments.knows(message_id)

    def messages(self, message_id: int) -> tuple[Message, ...]:
        """The messages with that id, as things are now: one for each sensor of the kind."""
        if message_id == HEARTBEAT_ID:
            return (self._heartbeat(),)
        return self.instruments.messages(message_id)

    def boot_clock_ns(self, now_ns: int) -> int:
        """The time since boot by the autopilot's own clock."""
        elapsed_ns = now_ns - self._boot_ns
        leapt_ns = self._clock_leap.ns(now_ns, self.airframe.height_m)
        return elapsed_ns + round(elapsed_ns * self._clock_ppm * 1e-6) + leapt_ns

    def _refresh(self, now_ns: int) -> None:
        self.instruments.boot_ms = self.boot_clock_ns(now_ns) // _NS_PER_MS % _BOOT_WRAP_MS
        self.instruments.healthy = self.is_ready

    def _greet(self, channel: MavlinkChannel, now_ns: int) -> None:
        """Begin what everybody gets."""
        if not channel.greeted:
            channel.greeted = True
            for message_id, period_ns in self.unasked_ns.items():
                channel.stream(message_id, period_ns, now_ns)

    def received(self, channel: MavlinkChannel, message: Message) -> None:
        """Take a message that came in by `channel`."""
        now_ns = self._clock.now_ns()
        self.advance(now_ns)
        self._greet(channel, now_ns)
        target = getattr(message, "target_system", 0)
        if target not in {0, self._config.system_id}:
            return
        match message.get_type():
            case "COMMAND_LONG":
                self._answer(channel, message, now_ns)
            case "SET_ATTITUDE_TARGET":
                self._setpoint(message)
            case "HEARTBEAT":
                self._client_beat(message.get_srcSystem())
            case "ODOMETRY" | "VISION_POSITION_ESTIMATE":
                self._take_pose(message, now_ns)
            case "SET_MODE":
                self._set_mode(message.custom_mode)
            case "TIMESYNC" if message.tc1 == 0:
                stamp_ns = self.boot_clock_ns(now_ns)
                self.link.send(channel, dialect.MAVLink_timesync_message(stamp_ns, message.ts1))
            case "REQUEST_DATA_STREAM":
                self.streams.set_data_stream(channel, message, now_ns)
            case "STATUSTEXT":
                self.texts.append(message.text)
            case "SETUP_SIGNING" if self.takes_keys and not self.armed:
                self.link.sign(bytes(message.secret_key), message.initial_timestamp)
            case "PARAM_REQUEST_READ" | "PARAM_REQUEST_LIST" | "PARAM_SET" if self._queues(message, now_ns):
                self.parameters.answer(message, lambda reply: self.link.send(channel, reply))
            case _:
                pass

    def _queues(self, message: Message, now_ns: int) -> bool:
        """Whether there is room for another request for a parameter."""
        if message.get_type() != "PARAM_REQUEST_READ":
            return True
        if now_ns - self._burst_ns > _BURST_NS:
            self._burst_ns, self._burst = now_ns, 0
        self._burst += 1
        return self._config.parameter_queue is None or self._burst <= self._config.parameter_queue

    def _answer(self, channel: MavlinkChannel, message: Message, now_ns: int) -> None:
        params = tuple(float(getattr(message, f"param{i}")) for i in range(1, 8))
        match message.command:
            case dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
                result = int(dialect.MAV_RESULT_FAILED)
                if whole(params[0]) not in self.fixed_rates:
                    result = self.streams.set_interval(channel, params[0], params[1], now_ns)
            case dialect.MAV_CMD_REQUEST_MESSAGE:
                self._refresh(now_ns)
                result = self.streams.send_now(channel, params[0])
            case dialect.MAV_CMD_DO_SET_MODE:
                custom = params[0] == params[0] and int(params[0]) & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                result = self._set_mode(self._mode_of(params)) if custom else dialect.MAV_RESULT_DENIED
            case dialect.MAV_CMD_DO_SET_RELAY | dialect.MAV_CMD_DO_SET_ACTUATOR:
                result = self._set_output(message.command, params)
            case _:
                result = self._command(message.command, params)
        header = message.get_header()
        ack = dialect.MAVLink_command_ack_message(
            message.command, result, 0, 0, header.srcSystem, header.srcComponent
        )
        self.link.send(channel, ack)
