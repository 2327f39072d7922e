"""A station that flies a fleet is killed, as a process of its own; the next one goes on."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from flightd.core.types import Phase
from flightd.runtime.free_ports import free_ports
from tests.rigs.event_loops import real
from tests.rigs.waiting import until
from tests.web.live_flight import LiveFlight
from tests.web.own_fleet_rig import CONFIG, Watched, waiting

_SPEED = 4.0


class StationProcess:
    """`flightd ground --fleet` over drones in flight; `state` is its folder."""

    def __init__(self, flights: Mapping[str, LiveFlight], state: Path) -> None:
        (self._port,) = free_ports(1)
        self._drones = [
            f"--drone={name}=127.0.0.1:{'/'.join(map(str, f.ports))}" for name, f in flights.items()
        ]
        self._state = state
        self.process: asyncio.subprocess.Process | None = None

    async def start(self) -> None:
        """Until it is killed."""
        listen = f"--listen=127.0.0.1:{self._port}"
        command = ("flightd", "ground", "--fleet", listen, f"--state={self._state}", *self._drones)
        self.process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", *command, stderr=asyncio.subprocess.DEVNULL
        )

    async def kill(self) -> None:
        """As a power cut does."""
        assert self.process is not None
        self.process.send_signal(signal.SIGKILL)
        await self.process.wait()

    async def ask(self, told: Any = None) -> dict[str, Any]:
        """GET /api/fleet, or POST of a tour; empty while it does not answer."""
        body = b"" if told is None else json.dumps(told).encode()
        path = "GET /api/fleet" if told is None else "POST /api/fleet/tour"
        origin = f"http://127.0.0.1:{self._port}"
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", self._port)
        except OSError:
            return {}
        writer.write(
            f"{path} HTTP/1.1\r\nHost: 127.0.0.1:{self._port}\r\nOrigin: {origin}\r\nConnection: close\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode()
            + body
        )
        head, _, answer = (await reader.read()).partition(b"\r\n\r\n")
        writer.close()
        assert b" 200 " in head.splitlines()[0], (head, answer)
        return dict(json.loads(answer))


@pytest.mark.realtime(cores=1.2)
def test_a_station_that_is_killed_twice_has_its_tours_flown_to_their_end(tmp_path: Path) -> None:
    async def go(flights: dict[str, LiveFlight]) -> None:
        fleet, station = Watched(flights, _SPEED), StationProcess(flights, tmp_path)
        a, b = flights["a"], flights["b"]
        watching = asyncio.ensure_future(fleet.watch())

        async def told(key: str, wanted: Any, within_s: float = 150.0) -> None:
            for _ in range(round(within_s / 0.3)):
                if (said := (await station.ask()).get(key)) == wanted:
                    return
                await asyncio.sleep(0.3)
            raise AssertionError(f"{key}: {said}")

        try:
            await station.start()
            await told("flies", True)
            await station.ask({"nodes": ["B3"], "drone": "b"})
            await station.ask({"nodes": ["A3"], "drone": "a"})
            await until(lambda: min(a.at_m[2], b.at_m[2]) > 1.0, 60)
            for _ in range(2):
                await station.kill()
                await station.start()
                await told("flies", True)
                await asyncio.sleep(4.0)
            for _ in range(400):
                if sorted((await station.ask())["done"]) == ["A3", "B3"]:
                    break
                await asyncio.sleep(0.3)
            await until(lambda: a.phase is b.phase is Phase.DONE, 150)
            assert "A3" in fleet.passed["a"]
            assert "B3" in fleet.passed["b"]
            assert fleet.judge.faults == []
        finally:
            watching.cancel()
            if station.process is not None and station.process.returncode is None:
                await station.kill()

    # without a station they hold: else all would fly home at once, each by itself
    holds = CONFIG.with_values(ground={"lost_action": "hold"})
    with waiting("ab", holds) as flights:
        real(go(flights))
