"""The `flightctl` command: watch and command a running flightd over the ground link."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

import typer

from flightd.cli.exits import run_app
from flightd.core.errors import InputError, UnavailableError

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import Address, GroundClient
    from flightd.adapters.ground_link.protocol import StatusReport

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None
)

AsJson: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
]
Context: TypeAlias = typer.Context
_T = TypeVar("_T")


@app.callback()
def flightctl(
    context: Context,
    host: Annotated[
        str, typer.Option(envvar="FLIGHTCTL_HOST", help="Where flightd listens: a name or an address.")
    ] = "127.0.0.1",
    status_port: Annotated[int, typer.Option(envvar="FLIGHTCTL_STATUS_PORT", help="Its status port.")] = 5571,
    command_port: Annotated[
        int, typer.Option(envvar="FLIGHTCTL_COMMAND_PORT", help="Its command port.")
    ] = 5572,
    key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_KEY", help="Your secret key: NAME.key_secret.")
    ] = None,
    server_key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_SERVER_KEY", help="The daemon's public key: NAME.key.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for an answer.", min=0.1, max=60)] = 3.0,
) -> None:
    """Watch and command a running flightd.

    Each option before the command may also come from the environment: FLIGHTCTL_HOST, FLIGHTCTL_KEY ...

    \b
    flightctl status
    flightctl --host drone-1 --key ann.key_secret --server-key drone-1.key watch
    """
    context.obj = {
        "host": host,
        "status_port": status_port,
        "command_port": command_port,
        "key": key,
        "server_key": server_key,
        "timeout_s": timeout,
    }


@app.command()
def status(context: Context, as_json: AsJson = False) -> None:
    """Tell what flies where, once.

    \b
    flightctl status
    flightctl status --json
    """
    report = _with_client(context, lambda client: client.status())
    if report is None:
        raise UnavailableError("flightd answers but does not fly yet; try again in a moment")
    if as_json:
        _print_message(report)
    else:
        print("\n".join(status_lines(report)))


def status_lines(report: StatusReport) -> list[str]:
    """The status for a person, a line for each matter."""
    at, vehicle, link = report.position, report.vehicle, report.link
    lines = [
        f"{report.phase}: {report.reason}",
        f"node     {report.node or '-'} -> {report.goal}",
        f"visited  {report.nodes_done} of {report.nodes_planned} nodes",
    ]
    if at is not None:
        lines.append(
            f"position x {at.x_m:.2f} m, y {at.y_m:.2f} m, heading {math.degrees(at.yaw_rad):.0f} deg, "
            f"{at.speed_mps:.2f} m/s" + (f", height {report.height_m:.2f} m" if report.height_m else "")
        )
    age = "never" if report.lines_age_s is None else f"{report.lines_age_s * 1e3:.0f} ms ago"
    lines.append(f"lines    {len(report.lines)} tracked, seen {age}, {report.fps:.0f} pictures/s")
    if vehicle is not None:
        battery = "-" if vehicle.battery_frac is None else f"{vehicle.battery_frac:.0%}"
        armed = "armed" if vehicle.armed else "disarmed"
        lines.append(
            f"vehicle  {vehicle.mode}, {armed}, battery {battery}"
            + (f", refused: {vehicle.refusal}" if vehicle.refusal else "")
        )
    lines.append(f"latency  {report.latency_ms.get('total', 0.0):.0f} ms from exposure to setpoint")
    lines.append(
        f"link     {link.attending} attending, {link.refused} of {link.requests} requests refused, "
        f"{link.denied} connections denied"
    )
    return lines


def _order(context: Context, kind: str, node: str, as_json: bool) -> None:
    from flightd.core.types import CommandKind

    async def order(client: GroundClient) -> Any:
        await client.hello()
        return await client.order(CommandKind(kind), node)

    accepted = _with_client(context, order)
    if as_json:
        _print_message(accepted)
    else:
        print(f"{kind} {node}".strip() + ": accepted")


def _add_order(kind: str, text: str) -> None:
    def order(context: Context, as_json: AsJson = False) -> None:
        _order(context, kind, "", as_json)

    app.command(kind, help=f"{text}\n\n\b\nflightctl {kind}")(order)


for _kind, _text in {
    "start": "Start the mission that waits in preflight.",
    "pause": "Hold the position until `resume`.",
    "resume": "Go on after `pause`.",
    "home": "Fly home along the lines and land on the pad.",
    "land": "Land here and now.",
    "stop": "End the mission: down at once, wherever it is.",
}.items():
    _add_order(_kind, _text)


@app.command()
def goto(
    context: Context,
    node: Annotated[str, typer.Argument(help="A node of the map, like A4.")],
    as_json: AsJson = False,
) -> None:
    """Fly to a node along the lines, then home.

    \b
    flightctl goto B3
    """
    _order(context, "goto", node, as_json)


@app.command()
def inventory(context: Context, as_json: AsJson = False) -> None:
    """Tell what has been counted, place by place.

    \b
    flightctl inventory --json
    """
    places = _with_client(context, lambda client: client.inventory())
    if as_json:
        print(json.dumps({"places": places}))
        return
    for place in places:
        print("  ".join(place.values()))
    print(f"{len(places)} places")


@app.command()
def picture(
    context: Context,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="JPEG file to write.")] = Path("picture.jpg"),
    as_json: AsJson = False,
) -> None:
    """Fetch the down camera's next picture.

    \b
    flightctl picture now.jpg
    """
    answer, jpeg = _with_client(context, lambda client: client.picture())
    try:
        out.write_bytes(jpeg)
    except OSError as err:
        raise InputError(f"{out}: cannot write: {err.strerror}") from None
    if as_json:
        print(json.dumps({"picture": str(out), "seq": answer.seq, "stamp_ns": answer.stamp_ns}))
    else:
        print(out)


@app.command()
def keygen(
    name: Annotated[str, typer.Argument(help="Of the drone, the person or the ground station.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the two files.")] = Path(),
    role: Annotated[str, typer.Option(help="operator or viewer.")] = "operator",
    as_json: AsJson = False,
) -> None:
    """Make a pair of keys: NAME.key may be given away, NAME.key_secret stays where it is.

    \b
    flightctl keygen drone-1 --out /etc/flightd/keys
    flightctl keygen ann --role viewer
    """
    from flightd.adapters.ground_link.keys import load_public, make_keys
    from flightd.adapters.ground_link.protocol import Role

    if role not in set(Role):
        raise InputError(f"--role {role}: expected {' or '.join(Role)}")
    public, secret = make_keys(out, name)
    line = f"{role} {load_public(public)} {name}"
    if as_json:
        print(json.dumps({"public": str(public), "secret": str(secret), "client": line}))
        return
    print(f"{public}  (public)\n{secret}  (secret: keep it here, readable by you alone)\n")
    print("A drone's: name the secret file as ground.server_key, give the public one to its clients.")
    print(f"A client's: add this line to the drone's list of clients (ground.clients):\n{line}")


@app.command()
def protocol(as_json: AsJson = False) -> None:
    """Print every message and field of the ground link (--json: as a JSON Schema), for other clients.

    \b
    flightctl protocol
    """
    from flightd.adapters.ground_link.protocol_text import markdown, schema

    print(json.dumps(schema(), indent=1) if as_json else markdown())


@app.command()
def watch(
    context: Context,
    attend: Annotated[
        bool, typer.Option(help="Tell the daemon that somebody watches: it notices when the link is lost.")
    ] = True,
) -> None:
    """Watch the flight in the terminal, full screen: map, state, link, events; keys to pause, land, stop.

    \b
    flightctl watch
    flightctl watch --no-attend
    """
    try:
        from flightd.cli.watch import WatchApp
    except ModuleNotFoundError as err:
        raise InputError(f"watch needs {err.name}: pip install 'flightd[ground]'") from None

    async def show(client: GroundClient) -> None:
        await WatchApp(client, await client.hello(), attend).run_async()

    _with_client(context, show)


def _with_client(context: Context, use: Callable[[GroundClient], Awaitable[_T]]) -> _T:
    from flightd.adapters.ground_link.client import GroundClient

    address = _address(context.obj)

    async def connected() -> _T:
        async with GroundClient(address, timeout_s=context.obj["timeout_s"]) as client:
            return await use(client)

    return asyncio.run(connected())


def _address(options: dict[str, Any]) -> Address:
    from flightd.adapters.ground_link.client import Address
    from flightd.adapters.ground_link.keys import load_pair, load_public

    key, server_key = options["key"], options["server_key"]
    if (key is None) != (server_key is None):
        raise InputError("--key and --server-key belong together: yours, and the daemon's public one")
    return Address(
        options["host"],
        options["status_port"],
        options["command_port"],
        load_pair(key) if key is not None else None,
        load_public(server_key) if server_key is not None else None,
    )


def _print_message(message: Any) -> None:
    from flightd.adapters.ground_link.protocol import encode

    print(encode(message).decode())


def main() -> None:
    """Entry point of the `flightctl` script."""
    run_app(app, "flightctl")


if __name__ == "__main__":
    main()
