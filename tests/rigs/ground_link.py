"""A ground link on real loopback sockets, with what the daemon would tell it made by hand."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.keys import load_pair, load_public, make_keys
from flightd.adapters.ground_link.link import ZmqGround
from flightd.config.ground import GroundConfig
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.tracks import SensorEstimate, TrackSet
from flightd.core.types import (
    Attitude,
    CommandKind,
    Demand,
    Event,
    EventLevel,
    GridPose,
    LandedState,
    Phase,
    VehicleState,
)
from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.site.site import Site
from flightd.site.site_file import load_site
from tests.rigs.possible_commands import possible_in

SITE = load_site(Path(__file__).parents[2] / "configs" / "site-demo.toml")


@dataclass(frozen=True)
class Keyring:
    """Keys of a daemon and of an operator, a viewer and a stranger, in a folder."""

    folder: Path

    @classmethod
    def make(cls, folder: Path) -> Keyring:
        for name in ("daemon", "operator", "viewer", "stranger"):
            make_keys(folder, name)
        lines = [f"{name} {load_public(folder / f'{name}.key')} {name}\n" for name in ("operator", "viewer")]
        (folder / "clients").write_text("".join(lines))
        return cls(folder)

    def config(self, **more: Any) -> GroundConfig:
        """All addresses of this machine, any free ports."""
        files = {"server_key": "daemon.key_secret", "clients": "clients", "audit": "audit.jsonl"}
        paths = {key: self.folder / name for key, name in files.items()}
        return GroundConfig(listen="0.0.0.0", status_port=0, command_port=0, **paths, **more)

    def address(self, link: ZmqGround, name: str) -> Address:
        pair = load_pair(self.folder / f"{name}.key_secret")
        return replace(address_of(link), keys=pair, server_key=load_public(self.folder / "daemon.key"))


def local(**more: Any) -> GroundConfig:
    return GroundConfig(**{"listen": "127.0.0.1", "status_port": 0, "command_port": 0, **more})


def address_of(link: ZmqGround) -> Address:
    status, command = (int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints)
    return Address("127.0.0.1", status, command)


@contextlib.asynccontextmanager
async def serving(config: GroundConfig, site: Site = SITE, **more: Any) -> AsyncIterator[ZmqGround]:
    """The link, answering."""
    with ZmqGround(config, site, LoopClock(), **more) as link:
        async with asyncio.TaskGroup() as tasks:
            running = tasks.create_task(link.run())
            try:
                yield link
            finally:
                running.cancel()


@contextlib.asynccontextmanager
async def telling(link: ZmqGround, phase: Phase = Phase.FOLLOW) -> AsyncIterator[None]:
    """Statuses in quick succession, as a daemon gives them: armed but in the preflight."""

    async def tell() -> None:
        while True:
            tell_once(link, phase, armed=phase is not Phase.PREFLIGHT)
            await asyncio.sleep(0.02)

    async with asyncio.TaskGroup() as tasks:
        told = tasks.create_task(tell())
        try:
            yield
        finally:
            told.cancel()


async def connected(client: GroundClient, link: ZmqGround) -> None:
    """Until what is published reaches the client (a subscription takes its time)."""
    async with Within(20), telling(link):
        async for _ in client.published():
            return


def tell_once(
    link: ZmqGround,
    phase: Phase = Phase.FOLLOW,
    x_m: float = 1.0,
    battery_frac: float = 0.8,
    *,
    armed: bool = True,
) -> None:
    now_ns = LoopClock().now_ns()
    attitude = Attitude(now_ns - 10_000_000, 0.01, -0.02, 0.0)
    vehicle = VehicleState(
        attitude,
        1.6,
        now_ns,
        0.0,
        "GUIDED_NOGPS",
        True,
        armed,
        LandedState.IN_AIR if armed else LandedState.ON_GROUND,
        battery_frac,
        12.1,
        now_ns - 500_000_000,
    )
    pose = GridPose(now_ns, "A2", x_m - 1.5, 0.01, 0.0, x_m, 0.01, 0.4, 0.3, 1.6, (0.0,) * 9, 0.99)
    known = 0.01, 0.002, 0.02, -0.01, 0.005, 0.001, 0.0, 0.01, -0.02, 0.01, 0.003, 0.02, 0.004, 0.051, 0.012
    seen = SensorEstimate(*known)
    tracks = TrackSet(now_ns, now_ns, 0.0, 0.01, 0.4, 0.0, 0.0, 0.0, (), (), sensors=seen)
    output = TickOutput(None, Demand.FLY, phase, "arrived", "A2", 1, 12, pose, tracks)
    latency_ms = {"detection": 5.0, "total": 71.0}
    told = Snapshot(TickInput(now_ns, vehicle=vehicle), output, 1, 12, 300, 2, 29.0, latency_ms)
    possible = possible_in(phase) - (frozenset() if armed else {CommandKind.PAUSE})  # no start is under way
    link.tell(replace(told, possible=possible))


def event(text: str, name: str = "test") -> Event:
    return Event(LoopClock().now_ns(), EventLevel.WARNING, name, text)
