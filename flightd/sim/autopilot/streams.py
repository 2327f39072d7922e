"""What an autopilot sends by itself: heartbeats, TIMESYNC, and each channel's messages at their rates."""

from __future__ import annotations

from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.sim.autopilot.link import MavlinkChannel, Message, UdpLink
from flightd.sim.autopilot.telemetry import DATA_STREAMS

HEARTBEAT_ID = dialect.MAVLINK_MSG_ID_HEARTBEAT

_TICK_NS = 10_000_000
_HEARTBEAT_NS = 1_000_000_000
_TIMESYNC_NS = 10_000_000_000


class MessageSource(Protocol):
    """Makes the messages of one autopilot."""

    def knows(self, message_id: int) -> bool: ...

    def messages(self, message_id: int) -> tuple[Message, ...]: ...

    def boot_clock_ns(self, now_ns: int) -> int: ...


class MessageStreams:
    """The due times of one autopilot's messages; none is due more often than every `step_ns`."""

    def __init__(self, link: UdpLink, source: MessageSource, now_ns: int, step_ns: int) -> None:
        self._link = link
        self._source = source
        self._step_ns = step_ns
        self._heartbeat_due_ns = now_ns
        self.timesync_ns = _TIMESYNC_NS
        """How often clocks are compared."""
        self._timesync_ns = now_ns

    def send_due(self, now_ns: int) -> None:
        """Send what is due; what was missed is not sent later."""
        if now_ns >= self._heartbeat_due_ns:
            self._heartbeat_due_ns = max(self._heartbeat_due_ns + _HEARTBEAT_NS, now_ns)
            for channel in self._link.channels.values():
                if HEARTBEAT_ID not in channel.intervals_ns:
                    self._send(channel, HEARTBEAT_ID)
        if now_ns - self._timesync_ns >= self.timesync_ns:
            self._timesync_ns = now_ns
            boot_ns = self._source.boot_clock_ns(now_ns)
            self._link.broadcast(dialect.MAVLink_timesync_message(0, boot_ns))
        for channel in self._link.channels.values():
            for message_id, due_ns in channel.due_ns.items():
                if now_ns >= due_ns:
                    period_ns = channel.intervals_ns[message_id]
                    missed = (now_ns - due_ns) // period_ns
                    channel.due_ns[message_id] = due_ns + (1 + missed) * period_ns
                    self._send(channel, message_id)

    def next_due_ns(self, now_ns: int) -> int:
        """When something may be due again."""
        due_ns = now_ns + _TICK_NS
        for channel in self._link.channels.values():
            due_ns = min(due_ns, *channel.due_ns.values()) if channel.due_ns else due_ns
        return max(due_ns, now_ns + self._step_ns)

    def set_interval(self, channel: MavlinkChannel, message_id: float, period_us: float, now_ns: int) -> int:
        """SET_MESSAGE_INTERVAL; the MAV_RESULT."""
        wanted, period = whole(message_id), whole(period_us)
        if not self._source.knows(wanted):
            return int(dialect.MAV_RESULT_DENIED)
        channel.stream(wanted, 0 if period <= 0 else max(period * 1000, self._step_ns), now_ns)
        return int(dialect.MAV_RESULT_ACCEPTED)

    def send_now(self, channel: MavlinkChannel, message_id: float) -> int:
        """REQUEST_MESSAGE; the MAV_RESULT."""
        wanted = whole(message_id)
        if not self._source.knows(wanted):
            return int(dialect.MAV_RESULT_FAILED)
        self._send(channel, wanted)
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _send(self, channel: MavlinkChannel, message_id: int) -> None:
        for message in self._source.messages(message_id):
            self._link.send(channel, message)

    @staticmethod
    def set_data_stream(channel: MavlinkChannel, request: Message, now_ns: int) -> None:
        """REQUEST_DATA_STREAM, the old way to ask for groups of messages."""
        rate_hz = request.req_message_rate if request.start_stop else 0
        period_ns = 1_000_000_000 // rate_hz if rate_hz else 0
        for stream, message_ids in DATA_STREAMS.items():
            if request.req_stream_id in {dialect.MAV_DATA_STREAM_ALL, stream}:
                for message_id in message_ids:
                    channel.stream(message_id, period_ns, now_ns)


def whole(value: float) -> int:
    """A command parameter that means a whole number; -1 for what is none."""
    return int(value) if abs(value) < 2**31 else -1  # NaN compares false
