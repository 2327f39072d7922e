"""`flightd ground` itself: serves the ground station."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.ground.state import State, state_folder
from flightd.cli.store.options import Pictures, opened
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import Address
    from flightd.fleet.vda5050.codec import Version
    from flightd.fleet.vehicle.drone_factsheet import Measures
    from flightd.ground.access.access import Access
    from flightd.ground.fleet.own_fleet import OwnFleet
    from flightd.ground.foxglove_view.live_server import FoxgloveServer
    from flightd.ground.ground_store.webhooks import Webhook
    from flightd.ground.mqtt.fleet_link import FleetLink
    from flightd.ground.read_folders import ReadFolder
    from flightd.ground.server import Listening

EXAMPLES = """Examples:

  flightd ground                               the flightd on this machine; open http://127.0.0.1:8080
  flightd ground --drone north=drone-1 --key ann.key_secret --server-key drone-1.key
  flightd ground --drone a=127.0.0.1 --drone b=127.0.0.1:6571/6572    two simulators, by their ports
  flightd ground --folder out                  with the flights and inventories under out
  flightd ground --listen 127.0.0.1:9000
  flightd ground --foxglove 127.0.0.1          for Foxglove, too: it connects to ws://127.0.0.1:8765
  flightd ground --mqtt mqtt://broker --mqtt-version 3.0    for a fleet's manager, by VDA 5050
  flightd ground --mqtt mqtt://broker --mqtt-orders         the manager flies them, as long as no person does
  flightd ground --drone a=drone-1 --drone b=drone-2 --fleet    the station flies them together
  flightd ground --folder out --store counts.db             and the ground store, for programs
  flightd ground --listen 0.0.0.0:8443 --tls-cert station.pem --tls-key station.key    for others, who sign in
"""


def ground(
    ctx: typer.Context,
    drone: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HOST",
            help="A drone to watch, several by several options; HOST:STATUS/COMMAND where its ports are not"
            " 5571/5572.  Default: the flightd on this machine.",
            show_default=False,
        ),
    ] = None,
    listen: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Where browsers find the page.  Beyond this machine it needs people and TLS.",
        ),
    ] = "127.0.0.1:8080",
    folder: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Where flights, inventories, site files, picture sets and profiles lie; what was flown is"
            " only read.",
        ),
    ] = None,
    flights: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="DIR",
            help="Another folder with flights and inventories, several by several options: what a daemon of"
            " this machine leaves, or a copy from a drone.  Nothing is written there.",
            show_default=False,
        ),
    ] = None,
    key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_KEY", help="Your secret key: NAME.key_secret.")
    ] = None,
    server_key: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]FILE",
            envvar="FLIGHTCTL_SERVER_KEY",
            help="A drone's public key: NAME.key; without NAME= that of all.",
        ),
    ] = None,
    tls_cert: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The station's certificate, with its chain: PEM.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The secret key of the certificate: PEM.")
    ] = None,
    login: Annotated[
        bool,
        typer.Option("--login", help="Ask who they are on this machine, too; beyond it that is always so."),
    ] = False,
    foxglove: Annotated[
        str | None,
        typer.Option(
            metavar="HOST[:PORT]",
            help="Serve Foxglove there too, live: warehouse, drones, cameras; this machine's addresses only."
            " The port is 8765 unless given.",
            show_default=False,
        ),
    ] = None,
    mqtt: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            envvar="FLIGHTD_MQTT",
            help="Tell a fleet's manager of the drones, too, by VDA 5050 at this broker:"
            " mqtt[s]://[USER:PASSWORD@]HOST[:PORT].",
            show_default=False,
        ),
    ] = None,
    mqtt_version: Annotated[str, typer.Option(metavar="VERSION", help="Of VDA 5050: 2.1 or 3.0.")] = "2.1",
    mqtt_body: Annotated[
        str,
        typer.Option(
            metavar="LxWxH", help="The drones' size with propellers, m: for factsheets and --fleet."
        ),
    ] = "0.6x0.6x0.3",
    mqtt_orders: Annotated[
        bool,
        typer.Option(
            "--mqtt-orders", help="The fleet's manager flies the drones, as long as no person does."
        ),
    ] = False,
    mqtt_hold: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            help="A drone that holds without an order, or without the broker, flies home after so long;"
            " with --fleet, too.",
        ),
    ] = 60.0,
    fleet: Annotated[
        bool,
        typer.Option(
            "--fleet",
            help="The station flies the drones itself, together on one floor, as long as no person does.",
        ),
    ] = False,
    fleet_charged: Annotated[
        float,
        typer.Option(
            metavar="PERCENT",
            help="A drone of the fleet that stands on a charge pad takes new work from so much battery on.",
        ),
    ] = 0.0,
    store: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|URL",
            envvar="FLIGHTD_STORE",
            help="Feed the ground store with what lies in the folders, and let programs ask it: a file, or"
            " postgresql://USER@HOST/DATABASE.",
            show_default=False,
        ),
    ] = None,
    evidence: Pictures = None,
    webhook: Annotated[
        list[str] | None,
        typer.Option(
            metavar="URL",
            help="Tell this address of new runs, differences and decisions in the store, several by several"
            " options; signed with the secret in FLIGHTD_WEBHOOK_SECRET.",
            show_default=False,
        ),
    ] = None,
    state: State = None,
) -> None:
    """Watch and command drones in the browser: map, cameras, hazards, events; start, pause, go to, STOP.

    It is a client of the ground link, as flightctl is: the drone flies on without it.  While a page is open,
    it attends the flight; closing the last one is losing the ground (ground.lost_action).  Ctrl-C ends it,
    a second one at once.

    On this machine it asks nobody who he is.  Beyond it everybody signs in, by TLS: see people.
    """
    if ctx.invoked_subcommand is not None:
        return
    try:
        from flightd.ground.access.access import Access
        from flightd.ground.server import Listening, run
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd ground") from None
    from flightd.ground.drone_names import drone_addresses
    from flightd.ground.mqtt.broker_address import read_body, read_version
    from flightd.ground.station_lock import only_station
    from flightd.ground.tls import read_certificate

    if mqtt_orders and mqtt is None:
        raise InputError("there is no broker", key="--mqtt-orders", remedy="give --mqtt mqtt://HOST")
    if mqtt_orders and fleet:
        raise InputError(
            "the fleet's manager flies the drones, and a drone has one master",
            key="--fleet",
            remedy="leave out --fleet or --mqtt-orders",
        )
    if evidence is not None and store is None:
        raise InputError(
            "there is no store whose pictures could lie there", key="--evidence", remedy="give --store FILE"
        )
    version, body = read_version(mqtt_version), read_body(mqtt_body)
    if not 5.0 <= mqtt_hold <= 3600.0:
        raise InputError("expected 5 to 3600 s", key=f"--mqtt-hold {mqtt_hold:g}")
    if not 0.0 <= fleet_charged <= 100.0:
        raise InputError("expected 0 to 100 %", key=f"--fleet-charged {fleet_charged:g}")
    if fleet_charged and not fleet:
        raise InputError(
            "there is no fleet whose drones could wait for their charge",
            key=f"--fleet-charged {fleet_charged:g}",
            remedy="give --fleet, or leave it out",
        )
    if folder is not None and not folder.is_dir():
        what = "is a file, no folder" if folder.exists() else "there is no such folder"
        raise InputError(what, key=f"--folder {folder}")
    others = _others(folder, flights or ())
    drones = drone_addresses(drone or (), key, server_key or ())
    certificate = read_certificate(tls_cert, tls_key)
    where = replace(Listening.read(listen), secure=certificate is not None)
    access = Access(state_folder(state), login or where.is_beyond, where.secure)
    with contextlib.ExitStack() as stack:
        stack.enter_context(only_station(state_folder(state)))
        viewer = None
        if foxglove is not None:
            viewer = stack.enter_context(_foxglove_server(foxglove, access.login, drones))
        at = "" if viewer is None else viewer.url
        hold_s = mqtt_hold if mqtt_orders else None
        link = None if mqtt is None else _fleet_link(mqtt, version, body, drones, access, hold_s)
        own_fleet = (
            _own_fleet(body, drones, access, mqtt_hold, state_folder(state), fleet_charged / 100.0)
            if fleet
            else None
        )
        viewers = () if viewer is None else (viewer,)
        hooks = _webhooks(webhook or (), store)
        kept = None if store is None else stack.enter_context(opened(store, evidence))
        ended_by = run(
            drones,
            where,
            partial(_say_where, at),
            access,
            certificate,
            folder,
            viewers,
            others,
            link,
            kept,
            hooks,
            own_fleet,
        )
    if ended_by is not None:
        print(f"flightd: the ground station was ended by {ended_by.name}", file=sys.stderr)


def _others(folder: Path | None, flights: Sequence[Path]) -> tuple[ReadFolder, ...]:
    """The folders to be read beside `folder`.  One that is not there yet may come: a line says so."""
    from flightd.ground.read_folders import read_folders

    if flights and folder is None:
        raise InputError(
            "is read beside a folder of the station's own", key="--flights", remedy="give --folder DIR"
        )
    for path in flights:
        if not path.is_dir():
            what = "is no folder" if path.exists() else "there is no such folder yet"
            print(f"flightd: --flights {path}: {what}", file=sys.stderr)
    return read_folders(flights)


def _webhooks(urls: Sequence[str], store: str | None) -> list[Webhook]:
    from flightd.ground.ground_store.webhooks import SECRET, Webhook

    if urls and store is None:
        raise InputError("there is no store to tell of", key="--webhook", remedy="give --store FILE")
    return [Webhook(url, os.environ.get(SECRET, "")) for url in urls]


def _foxglove_server(address: str, login: bool, drones: Sequence[tuple[str, Address]]) -> FoxgloveServer:
    from flightd.ground.foxglove_view.reach import foxglove_address

    where = foxglove_address(address, login)
    try:
        from flightd.ground.foxglove_view.live_server import FoxgloveServer
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("foxglove", "flightd ground --foxglove") from None
    return FoxgloveServer(where, [name for name, _ in drones])


def _fleet_link(
    url: str,
    version: Version,
    body: Measures,
    drones: Sequence[tuple[str, Address]],
    access: Access,
    hold_s: float | None,
) -> FleetLink:
    """With orders where a drone `hold_s` without one."""
    from flightd.ground.mqtt.broker_address import read_broker

    broker = read_broker(url)
    try:
        from flightd.ground.mqtt.fleet_link import MANAGER, FleetLink
        from flightd.ground.mqtt.managed_drone import OrderRules
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd ground --mqtt") from None

    def write_down(act: str, drone: str, outcome: str, text: str) -> None:
        access.write_down(MANAGER, broker.shown, act, drone, outcome=outcome, text=text)

    rules = None if hold_s is None else OrderRules(hold_s, write_down)
    return FleetLink([name for name, _ in drones], broker, version, body, rules)


def _own_fleet(
    body: Measures,
    drones: Sequence[tuple[str, Address]],
    access: Access,
    hold_s: float,
    folder: Path,
    charged_frac: float,
) -> OwnFleet:
    from flightd.ground.fleet.fleet_memory import FleetMemory
    from flightd.ground.fleet.own_fleet import TRAFFIC, OwnFleet
    from flightd.ground.mqtt.managed_drone import OrderRules

    def write_down(act: str, drone: str, outcome: str, text: str) -> None:
        access.write_down(TRAFFIC, "", act, drone, outcome=outcome, text=text)

    rules, memory = OrderRules(hold_s, write_down), FleetMemory(folder)
    return OwnFleet([name for name, _ in drones], body, rules, memory=memory, charged_frac=charged_frac)


def _say_where(foxglove: str, where: Listening) -> None:
    from flightd.adapters.systemd import Notifier

    if address := os.environ.get("NOTIFY_SOCKET"):
        manager = Notifier(address)
        manager.send(READY=1, STATUS=f"at {where.url}")
        manager.close()
    print(f"flightd: the ground station is at {where.url} (Ctrl-C ends it)", file=sys.stderr, flush=True)
    if foxglove:
        print(f"flightd: Foxglove finds it at {foxglove}", file=sys.stderr, flush=True)
