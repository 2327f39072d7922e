"""systemd's notification protocol over real sockets."""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd.adapters.systemd import Notifier, SystemdMonitor
from flightd.core.errors import InputError
from tests.unit.service.vitals import MS, START_NS, vitals

S = 1000 * MS


class Manager:
    """The service manager's end of the socket."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind("\0" + address[1:] if address.startswith("@") else address)
        self._socket.setblocking(False)

    def messages(self) -> list[dict[str, str]]:
        found: list[dict[str, str]] = []
        while True:
            try:
                datagram = self._socket.recv(65536).decode()
            except BlockingIOError:
                return found
            found.append(dict(line.split("=", 1) for line in datagram.split("\n")))

    def close(self) -> None:
        self._socket.close()


@pytest.fixture(params=["path", "abstract"])
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Manager]:
    name = f"@flightd-test-{os.getpid()}" if request.param == "abstract" else str(tmp_path / "notify")
    found = Manager(name)
    yield found
    found.close()


def monitor_of(manager: Manager, **more: str) -> SystemdMonitor:
    found = SystemdMonitor.of_environment({"NOTIFY_SOCKET": manager.address, **more})
    assert found is not None
    return found


def said(messages: list[dict[str, str]], key: str) -> list[str]:
    return [message[key] for message in messages if key in message]


def test_ready_is_said_once_when_vehicle_and_camera_are_there_and_not_before(manager: Manager) -> None:
    monitor = monitor_of(manager)
    monitor.tell(vitals(START_NS, heard_ns=None, fps=0.0))
    monitor.tell(vitals(START_NS + 2 * S, heard_ns=START_NS + 2 * S, fps=0.0))
    monitor.tell(vitals(START_NS + 4 * S, heard_ns=START_NS + 2 * S, fps=30.0))
    waiting = manager.messages()
    assert said(waiting, "READY") == []
    assert said(waiting, "STATUS") == [
        "waiting for the vehicle and the camera",
        "waiting for the camera",
        "waiting for the vehicle",
    ]
    monitor.tell(vitals(START_NS + 5 * S, heard_ns=START_NS + 5 * S))
    monitor.tell(vitals(START_NS + 6 * S, heard_ns=START_NS + 6 * S))
    monitor.tell(vitals(START_NS + 9 * S, heard_ns=START_NS + 6 * S, fps=0.0))
    assert said(manager.messages(), "READY") == ["1"]
    monitor.close()


def test_while_it_waits_only_running_ticks_put_the_start_time_out_off(manager: Manager) -> None:
    monitor = monitor_of(manager)
    for tenth in range(50):
        monitor.tell(vitals(START_NS + tenth * 100 * MS, heard_ns=None))
    extended = said(manager.messages(), "EXTEND_TIMEOUT_USEC")
    assert len(extended) == 5
    assert manager.messages() == [], "nothing comes without a tick"
    monitor.close()


def test_the_watchdog_is_fed_by_ticks_alone_and_often_enough(manager: Manager) -> None:
    monitor = monitor_of(manager, WATCHDOG_USEC="2000000", WATCHDOG_PID=str(os.getpid()))
    fed_at = []
    for tenth in range(100):
        now_ns = START_NS + tenth * 100 * MS
        monitor.tell(vitals(now_ns, heard_ns=now_ns))
        if said(manager.messages(), "WATCHDOG"):
            fed_at.append(tenth)
    gaps = [b - a for a, b in itertools.pairwise(fed_at)]
    assert set(gaps) == {5}, "four times in two seconds"
    assert manager.messages() == []
    monitor.close()


@pytest.mark.parametrize(
    "more", [{}, {"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "1"}, {"WATCHDOG_USEC": "x"}]
)
def test_no_watchdog_is_fed_that_is_not_ours(manager: Manager, more: dict[str, str]) -> None:
    monitor = monitor_of(manager, **more)
    for second in range(10):
        monitor.tell(vitals(START_NS + second * S))
    assert said(manager.messages(), "WATCHDOG") == []
    monitor.close()
    assert said(manager.messages(), "STOPPING") == ["1"]


def test_that_it_stops_is_said_once_and_before_anything_is_closed(manager: Manager) -> None:
    monitor = monitor_of(manager)
    monitor.over()
    assert said(manager.messages(), "STOPPING") == ["1"]
    monitor.close()
    assert manager.messages() == []


def test_the_status_is_one_line_for_a_person(manager: Manager) -> None:
    monitor = monitor_of(manager)
    monitor.tell(vitals(reason="lines\nlost"))
    assert said(manager.messages(), "STATUS") == ["follow (lines lost), 1/12 nodes, battery 81%"]
    monitor.close()


def test_a_manager_that_is_gone_or_full_never_holds_a_tick_up(manager: Manager) -> None:
    notifier = Notifier(manager.address)
    for _ in range(10_000):
        notifier.send(WATCHDOG=1)
    assert notifier.lost > 0, "a full socket loses messages, it does not wait"
    manager.close()
    before = notifier.lost
    notifier.send(WATCHDOG=1)
    assert notifier.lost == before + 1
    notifier.close()


def test_without_systemd_there_is_nobody_to_tell() -> None:
    assert SystemdMonitor.of_environment({}) is None


@pytest.mark.parametrize("address", ["x", "@", "vsock:2:1234"])
def test_an_address_that_is_none_is_named(address: str) -> None:
    with pytest.raises(InputError, match="NOTIFY_SOCKET"):
        Notifier(address)
