"""systemd's notification protocol (sd_notify): ready, status, watchdog, all from the control tick itself.

The messages are lines of KEY=VALUE in one datagram to the socket that NOTIFY_SOCKET names, a path or,
with a leading @, a name in the abstract space.

Own code: sdnotify 0.3.2 waits where the manager does not read (after 11 messages, for ever; here the control
tick calls), counts nothing that is lost, and writes Latin-1 where systemd reads UTF-8.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping

from flightd.core.errors import InputError
from flightd.core.snapshot import Snapshot
from flightd.core.types import Event

_FRESH_NS = 1_000_000_000
_STATUS_NS = 1_000_000_000
_EXTEND_NS = 1_000_000_000
_EXTEND_US = 15_000_000
"""While the drone is being waited for, the ticks put the start's time-out off by so much."""


class Notifier:
    """Sends to the service manager; never waits, and what it does not take now is lost (counted)."""

    def __init__(self, address: str) -> None:
        """InputError when `address` is no socket's name."""
        if not address.startswith(("/", "@")) or len(address) < 2:
            raise InputError(f"NOTIFY_SOCKET {address!r}: expected a path or @NAME; unset it outside systemd")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)
        self.lost = 0

    def send(self, **values: str | int) -> None:
        """One datagram: READY=1, STATUS=..., as named."""
        text = "\n".join(f"{key}={str(value).replace(chr(10), ' ')}" for key, value in values.items())
        try:
            self._socket.sendto(text.encode(), self._address)
        except OSError:
            self.lost += 1

    def close(self) -> None:
        self._socket.close()


class SystemdMonitor:
    """`ports.Monitor`: READY=1 once the vehicle is heard and frames come through the detector, WATCHDOG=1
    with the ticks' statuses, a line of STATUS for people, STOPPING=1 when no tick follows.

    The watchdog's messages go out four times in the period that systemd asks for, so long as the control
    tick runs: no timer of its own could stand in for a tick that hangs.
    """

    def __init__(self, notifier: Notifier, watchdog_us: int = 0) -> None:
        self._notifier = notifier
        self._watchdog_ns = watchdog_us * 1000 // 4
        self._ready = self._stopping = False
        self._fed_ns = self._extended_ns = self._told_ns = -(10**18)
        self._told = ""

    @classmethod
    def of_environment(cls, environment: Mapping[str, str]) -> SystemdMonitor | None:
        """What systemd asks of this process, None where no systemd started it.  InputError as in Notifier."""
        address = environment.get("NOTIFY_SOCKET", "")
        if not address:
            return None
        asked = environment.get("WATCHDOG_USEC", "")
        meant = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        return cls(Notifier(address), int(asked) if asked.isdigit() and meant else 0)

    @property
    def ready(self) -> bool:
        """READY=1 was said."""
        return self._ready

    def tell(self, snapshot: Snapshot) -> None:
        now_ns = snapshot.stamp_ns
        missing = _missing(snapshot)
        if not self._ready and not missing:
            self._ready = True
            self._notifier.send(READY=1)
        if not self._ready and now_ns - self._extended_ns >= _EXTEND_NS:
            self._extended_ns = now_ns
            self._notifier.send(EXTEND_TIMEOUT_USEC=_EXTEND_US)
        if self._watchdog_ns and now_ns - self._fed_ns >= self._watchdog_ns:
            self._fed_ns = now_ns
            self._notifier.send(WATCHDOG=1)
        self._say(now_ns, _line(snapshot, missing if not self._ready else []))

    def event(self, event: Event) -> None:
        """Events are the log's."""

    def over(self) -> None:
        """Say STOPPING=1: the watchdog, which no tick feeds any more, is off from then on, and files may take
        until the stop's own time-out to be finished."""
        if not self._stopping:
            self._stopping = True
            self._notifier.send(STOPPING=1)

    def close(self) -> None:
        self.over()
        self._notifier.close()

    def _say(self, now_ns: int, line: str) -> None:
        if line != self._told and now_ns - self._told_ns >= _STATUS_NS:
            self._told, self._told_ns = line, now_ns
            self._notifier.send(STATUS=line)


def _missing(snapshot: Snapshot) -> list[str]:
    """What must come before the daemon is ready; config, keys and map were checked before the first tick."""
    vehicle = snapshot.vehicle
    heard = vehicle is not None and snapshot.stamp_ns - vehicle.attitude.stamp_ns < _FRESH_NS
    return [what for what, there in (("the vehicle", heard), ("the camera", snapshot.fps > 0)) if not there]


def _line(snapshot: Snapshot, missing: list[str]) -> str:
    if missing:
        return f"waiting for {' and '.join(missing)}"
    done = f"{snapshot.nodes_done}/{snapshot.nodes_planned} nodes"
    reason = f" ({snapshot.reason})" if snapshot.reason else ""
    return f"{snapshot.phase}{reason}, {done}, battery {snapshot.battery_text}"
