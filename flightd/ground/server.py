"""Runs the station: hub and HTTP server in one loop, until a signal ends both."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import re
import signal
import socket
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import uvicorn

from flightd.adapters.ground_link.client import Address
from flightd.config.ground import is_loopback
from flightd.core.errors import InputError, UnavailableError
from flightd.ground.access.access import Access
from flightd.ground.application import application
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.fleet.site_facts import SiteFacts
from flightd.ground.flights.flights import Flights
from flightd.ground.ground_store.feeder import Feeder
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.ground_store.webhooks import Webhook
from flightd.ground.guards import own_hosts
from flightd.ground.hub import Hub, Viewer
from flightd.ground.messages import MAX_PAGE_MESSAGE_BYTES
from flightd.ground.missions.mission_book import MissionBook
from flightd.ground.page_person import PagePeople
from flightd.ground.page_socket import PageSocket
from flightd.ground.quiet_log import quiet_log
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.schedules.night_shift import THIS_MACHINE, NightShift, StationClock
from flightd.ground.schedules.schedule_book import ScheduleBook
from flightd.ground.site_page.simulated_flight import SimulatedFlight
from flightd.ground.studio.studio import Studio
from flightd.ground.tls import Certificate
from flightd.runtime.ending_signals import end_on_signals

if TYPE_CHECKING:
    from flightd.ground.mqtt.fleet_link import FleetLink

PORT = 8080
_PING_S = 4.0
"""A page that does not answer for so long is closed: whoever cannot see does not attend."""
_LEAVE_S = 2
_HALT_S = 2.0
_LAST_PORT = 65535
_LISTEN = re.compile(r"(?P<host>\[[0-9a-fA-F:.%]+\]|[^:\[\]]+)(:(?P<port>\d{1,5}))?")


@dataclass(frozen=True, slots=True)
class Listening:
    """Where the station is asked."""

    host: str
    port: int = PORT
    secure: bool = False

    @property
    def url(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.secure else 'http'}://{host}:{self.port}"

    @property
    def is_beyond(self) -> bool:
        """Other machines reach it."""
        return not is_loopback(self.host)

    @classmethod
    def read(cls, text: str, option: str = "--listen", default_port: int = PORT) -> Listening:
        """HOST, HOST:PORT or [HOST]:PORT, given by an `option`.  InputError for anything else."""
        if text.isdecimal() and int(text) <= _LAST_PORT:
            raise InputError("is a port alone", key=f"{option} {text}", remedy=f"give 127.0.0.1:{text}")
        found = _LISTEN.fullmatch(text)
        host = text if found is None else found["host"]
        port = default_port if found is None or found["port"] is None else int(found["port"])
        if found is None:
            try:
                ipaddress.IPv6Address(text)
            except ValueError:
                raise InputError("expected ADDRESS or ADDRESS:PORT", key=f"{option} {text}") from None
        host = host.removeprefix("[").removesuffix("]")
        if port > _LAST_PORT:
            raise InputError("a port is at most 65535", key=f"{option} {text}")
        return cls("127.0.0.1" if host == "localhost" else host, port)


def check_reach(where: Listening, access: Access, certificate: Certificate | None) -> None:
    """InputError for a station that other machines would reach, and that lacks people or TLS: then a password
    could be read on the way, or nobody would be asked for one."""
    has_people = access.login and access.people > 0
    if access.login and not has_people and not where.is_beyond:
        raise InputError(
            "nobody could sign in", key="--login", remedy="flightd ground people add NAME --role admin"
        )
    if not where.is_beyond or (has_people and certificate is not None):
        return
    steps = [] if has_people else ["flightd ground people add NAME --role admin"]
    if certificate is None:
        steps.append("give --tls-cert FILE --tls-key FILE")
    raise InputError(
        f"reaches beyond this machine, and the station has {' and '.join(_lacks(has_people, certificate))}",
        key=f"--listen {where.host}",
        remedy=", then ".join(steps),
    )


def _lacks(has_people: bool, certificate: Certificate | None) -> list[str]:
    return ([] if has_people else ["nobody who could sign in"]) + ([] if certificate else ["no TLS"])


class _Server(uvicorn.Server):
    """Signals are the station's own matter."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def opened(listening: Listening, option: str = "--listen") -> tuple[socket.socket, Listening]:
    """The listening socket, and where it really listens (port 0: any free one).  UnavailableError where the
    address, given by an `option`, cannot be had."""
    family = socket.AF_INET6 if ":" in listening.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((listening.host, listening.port))
    except OSError as err:
        listener.close()
        raise UnavailableError(
            f"{listening.url}: {err.strerror or err}",
            remedy=f"give {option} an address of this machine and a free port",
        ) from None
    return listener, replace(listening, port=int(listener.getsockname()[1]))


def run(
    drones: Sequence[tuple[str, Address]],
    listening: Listening,
    on_ready: Callable[[Listening], None],
    access: Access,
    certificate: Certificate | None = None,
    folder: Path | None = None,
    viewers: Sequence[Viewer] = (),
    others: Sequence[ReadFolder] = (),
    fleet: FleetLink | None = None,
    store: GroundStore | None = None,
    hooks: Sequence[Webhook] = (),
    own_fleet: OwnFleet | None = None,
) -> signal.Signals | None:
    """Serve until a signal comes, which is returned; a second one ends the process at once.
    UnavailableError where the address cannot be had, InputError where it must not be listened at
    (`check_reach`)."""
    check_reach(listening, access, certificate)
    listener, where = opened(listening)
    came: list[signal.Signals] = []

    async def until_signal() -> None:
        serving = asyncio.ensure_future(
            serve(
                drones,
                listener,
                where,
                access,
                on_ready,
                certificate,
                folder,
                viewers,
                others,
                fleet,
                store,
                hooks,
                own_fleet,
            )
        )
        end_on_signals(serving, came, again_at_once=True)
        with contextlib.suppress(asyncio.CancelledError):
            await serving

    with listener:
        asyncio.run(until_signal())
    return came[0] if came else None


async def serve(
    drones: Sequence[tuple[str, Address]],
    listener: socket.socket,
    where: Listening,
    access: Access,
    on_ready: Callable[[Listening], None] = lambda _: None,
    certificate: Certificate | None = None,
    folder: Path | None = None,
    viewers: Sequence[Viewer] = (),
    others: Sequence[ReadFolder] = (),
    fleet: FleetLink | None = None,
    store: GroundStore | None = None,
    hooks: Sequence[Webhook] = (),
    own_fleet: OwnFleet | None = None,
    clock: StationClock = THIS_MACHINE,
) -> None:
    """Serve until cancelled; the pages are told that it ends.  `access` knows who asks, and is closed at the
    end; inventories and flights lie under `folder` and the `others`; `viewers` are told what pages are;
    `fleet` has the drones flown by somebody else's manager; `store` is fed with what lies there, asked by
    programs, and `hooks` are told of it; `own_fleet` is flown by the station itself; the schedules kept in
    `folder` go by the `clock`."""
    viewers = (*viewers, *(viewer for viewer in (fleet, own_fleet) if viewer is not None))
    managers = fleet if own_fleet is None else own_fleet
    hub = Hub(drones, viewers, attends=own_fleet is not None)
    flights = Flights(folder, others=others)
    uploads, maps = ReadingProcess(), ReadingProcess(refusal="too many maps are being checked")
    studio = None if folder is None else Studio(folder, flights)
    simulated = None if folder is None else SimulatedFlight(hub, folder, where.is_beyond)
    people = PagePeople(access, hub.drones)
    quiet_log()
    hosts = own_hosts(
        where.host,
        where.port,
        certificate is not None,
        () if certificate is None else certificate.names,
        where.is_beyond,
    )
    facts = SiteFacts(store, folder, others, uploads, clock.utc_ns)
    server = _Server(
        uvicorn.Config(
            application(
                hub,
                hosts,
                access,
                people,
                folder,
                flights,
                uploads,
                maps,
                facts,
                studio,
                simulated,
                others,
                managers,
                store,
                own_fleet,
                clock,
            ),
            http="h11",
            ws=PageSocket,
            lifespan="off",
            log_config=None,
            log_level="error",
            access_log=False,
            proxy_headers=False,
            server_header=False,
            ws_max_size=MAX_PAGE_MESSAGE_BYTES,
            ws_ping_interval=_PING_S,
            ws_ping_timeout=_PING_S,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=_LEAVE_S,
            ssl_certfile=None if certificate is None else certificate.cert,
            ssl_keyfile=None if certificate is None else certificate.key,
        )
    )
    async with asyncio.TaskGroup() as tasks:
        station = tasks.create_task(hub.run(), name="hub")
        tasks.create_task(flights.run(), name="flights")
        managed = [
            tasks.create_task(one.run(hub), name="fleet") for one in (fleet, own_fleet) if one is not None
        ]
        if folder is not None:
            books = ScheduleBook(folder), MissionBook(folder)
            shift = NightShift(*books, store, facts, hub.drones, access, managers, clock, own_fleet)
            tasks.create_task(shift.run(), name="schedules")
        if studio is not None:
            tasks.create_task(studio.run(), name="studio")
        if simulated is not None:
            tasks.create_task(simulated.run(), name="simulated flight")
        if store is not None:
            feeder = Feeder(store, folder, others, access.state)
            tasks.create_task(feeder.run(), name="ground store")
            for hook in hooks:
                tasks.create_task(hook.run(store), name="webhook")
        if access.login or store is not None:  # keys are for this machine's programs, too
            tasks.create_task(access.run(), name="people")
        if access.login:
            tasks.create_task(people.run(), name="people whose session is over")
        serving = tasks.create_task(server.serve([listener]), name="pages")
        try:
            while not server.started:  # noqa: ASYNC110 - it tells nobody
                await asyncio.sleep(0.01)
            on_ready(where)
            await asyncio.shield(station)  # the links outlive what is flown by them
        finally:
            server.should_exit = True
            for one in managed:
                one.cancel()
            if own_fleet is not None:
                await asyncio.wait([asyncio.ensure_future(own_fleet.leave())], timeout=_HALT_S)
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.shield(asyncio.wait([serving], timeout=_LEAVE_S + 2.0))
            uploads.close()
            maps.close()
            await asyncio.to_thread(access.close)
