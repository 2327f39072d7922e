"""Looks at an autopilot without flying it: is it there, what is it, are its parameters fit for the job?"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Hashable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware, MavlinkLink
from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.signing import Signing, setup_message
from flightd.adapters.vehicle.mavlink.link.transport import make_transport
from flightd.adapters.vehicle.mavlink.parameter_rule import ParameterFinding, Rule, judge_all
from flightd.adapters.vehicle.mavlink.pose_parameters import pose_rules
from flightd.adapters.vehicle.mavlink.pose_sharing import pose_use
from flightd.adapters.vehicle.mavlink.required_parameters import Job, advice_for, rules_for
from flightd.adapters.vehicle.mavlink.services.commands import Commander
from flightd.adapters.vehicle.mavlink.services.heartbeat_rate import BEATS_HZ, BeatPoll, Beats
from flightd.adapters.vehicle.mavlink.services.parameters import Parameters
from flightd.adapters.vehicle.mavlink.telemetry import cells_told, range_sample, version_words
from flightd.adapters.vehicle.range_finders import RangeSample
from flightd.core.errors import UnavailableError
from flightd.core.types import PoseUse
from flightd.ports import Clock

_BEATS_WINDOW_S = 1.0
_LOOK_US = 200_000


@dataclass(frozen=True, slots=True)
class ExaminationReport:
    """What was found.  `version` is "" when the autopilot does not tell; `unread` are parameters that it
    does not have, under their newest names; `heartbeat_hz` is the rate that it keeps when asked for ours."""

    firmware: Firmware
    version: str
    armed: bool
    findings: tuple[ParameterFinding, ...]
    unread: tuple[str, ...]
    heartbeat_hz: float
    range_finders: tuple[RangeSample, ...] = ()
    """The newest sample of each that looks down."""
    cells: int = 0
    """In series in the battery; 0 where it is not told."""
    pose_use: PoseUse = PoseUse.NONE


class Examination:
    """Examines one autopilot for a job, inside `async with examination.connected():`."""

    def __init__(
        self,
        url: str,
        clock: Clock,
        system_id: int = 1,
        signing: Signing | None = None,
        job: Job | None = None,
    ) -> None:
        self._url = url
        self._clock = clock
        self._system_id = system_id
        self._job = job or Job()
        transport = make_transport(parse_endpoint(url))
        codec = Codec(system_id, signing=signing)  # it is not the daemon, which the failsafe watches
        self._link = MavlinkLink(transport, codec, clock, system_id, self._take)
        self._commander = Commander(self._link, system_id)
        self._parameters = Parameters(self._link, system_id, bytewise=False)
        self._heard = asyncio.Event()
        self._armed = self._signs = False
        self._has_key = signing is not None
        self._version = ""
        self._beats = Beats(_BEATS_WINDOW_S)
        self._heartbeat_hz = math.nan
        self._ranges: dict[Hashable, RangeSample] = {}
        self._cells = 0

    @asynccontextmanager
    async def connected(self, patience_s: float = 5.0) -> AsyncIterator[None]:
        """Hold the link; UnavailableError when no autopilot is heard within `patience_s`."""
        line = asyncio.create_task(self._link.run(), name="examination link")
        heard = asyncio.create_task(self._heard.wait(), name="examination heartbeat")
        try:
            await asyncio.wait({line, heard}, timeout=patience_s, return_when=asyncio.FIRST_COMPLETED)
            if line.done():
                line.result()
            if not heard.done():
                text = f"no ArduPilot or PX4 heard in {patience_s:g} s; check cable, rate and power"
                raise UnavailableError(f"{self._url}: {text}")
            yield
        finally:
            for task in (line, heard):
                task.cancel()
            await asyncio.gather(line, heard, return_exceptions=True)

    @property
    def armed(self) -> bool:
        """Whether it is armed, by its newest heartbeat."""
        return self._armed

    def send_key(self, key: bytes, unix_time_s: float) -> None:
        """Give it the key of a signed link; it never answers that."""
        self._link.send(setup_message(self._system_id, key, unix_time_s))

    async def report(self) -> ExaminationReport:
        """Read afresh and judge every parameter of the firmware's table.  UnavailableError if none is
        answered."""
        firmware = self._link.firmware
        assert firmware is not None, "only while connected"
        rules = (*rules_for(firmware, self._job), *advice_for(firmware, self._job))
        self._parameters.forget()
        await self._commander.send(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        wanted = tuple(dict.fromkeys(rule.names for rule in rules))
        unread = [names[-1] for names in wanted if await self._parameters.read(names) is None]
        if len(unread) == len(wanted):
            remedy = "check the TX line"
            if self._signs and not self._has_key:
                remedy = "it signs its messages: give its key as vehicle.signing_key"
            raise UnavailableError(f"{self._url}: the autopilot is heard but does not answer; {remedy}")
        for rule in self._pose_rules(firmware):  # also where they are not even advised
            if not rule.optional and rule.names not in wanted:
                await self._parameters.read(rule.names)
        if math.isnan(self._heartbeat_hz):
            self._heartbeat_hz = await self._measure_beats()
        return ExaminationReport(
            firmware,
            self._version,
            self._armed,
            tuple(judge_all(rules, self._parameters.get)),
            tuple(unread),
            self._heartbeat_hz,
            tuple(self._ranges.values()),
            self._cells,
            self._pose_use(firmware),
        )

    def _pose_rules(self, firmware: Firmware) -> tuple[Rule, ...]:
        """What it would have to be set to for our motion; empty where it is not to be told of it."""
        job = self._job
        if job.pose_output == "none":
            return ()
        return pose_rules(firmware, job.pose_output, landing_target=job.landing_target)

    def _pose_use(self, firmware: Firmware) -> PoseUse:
        """What would become of our motion."""
        rules = self._pose_rules(firmware)
        return pose_use(rules, self._parameters.get) if rules else PoseUse.NONE

    async def fix(self, findings: Sequence[ParameterFinding]) -> list[ParameterFinding]:
        """Write the better values and read them back; the findings that remain.  Nothing is written to
        an armed vehicle."""
        remaining = []
        for finding in findings:
            better = finding.better
            if better is None or self._armed or not await self._parameters.write(finding.name, better):
                remaining.append(finding)
        return remaining

    async def _measure_beats(self) -> float:
        """The rate of its heartbeats once they were asked for as a flight does."""
        beat, period_us = dialect.MAVLINK_MSG_ID_HEARTBEAT, round(1e6 / BEATS_HZ)
        for message_id in (dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR, dialect.MAVLINK_MSG_ID_BATTERY_STATUS):
            await self._commander.send(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, _LOOK_US)
        await self._commander.send(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, beat, period_us)
        self._beats.start(self._clock.now_ns())
        poll = BeatPoll()
        while math.isnan(self._beats.rate_hz(self._clock.now_ns())):
            if poll.is_due(self._clock.now_ns(), self._beats.newest_ns):
                self._commander.post(dialect.MAV_CMD_REQUEST_MESSAGE, beat)
            await asyncio.sleep(BeatPoll.LOOK_S)
        return self._beats.rate_hz(self._clock.now_ns())

    def _take(self, message: Message, now_ns: int) -> None:
        match message.get_type():
            case "HEARTBEAT":
                self._beats.heard(now_ns)
                self._signs = bool(message.get_header().incompat_flags & dialect.MAVLINK_IFLAG_SIGNED)
                self._armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
                self._parameters.bytewise = self._link.firmware is Firmware.PX4
                self._heard.set()
            case "COMMAND_ACK":
                self._commander.acknowledged(message)
            case "PARAM_VALUE":
                self._parameters.value(message)
            case "DISTANCE_SENSOR":
                sample = range_sample(message)
                if sample is not None:
                    self._ranges[sample.sensor] = sample
            case "BATTERY_STATUS" if message.id == 0:
                self._cells = cells_told(message)
            case "AUTOPILOT_VERSION":
                self._version = version_words(message.flight_sw_version)
            case _:
                pass
