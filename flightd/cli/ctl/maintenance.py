"""`flightctl doctor`, `settings`, `set`, `take-back`, `restart`: looks after a drone that stands disarmed."""

from __future__ import annotations

import json
import tomllib
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson
from flightd.core.errors import InputError, RunError

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import GroundClient
    from flightd.adapters.ground_link.messages.maintenance import DoctorAnswer, SettingsAnswer

Person = Annotated[str, typer.Option("--person", help="Who asks: for the audit log and the versions.")]


def register(app: typer.Typer) -> None:
    """Hang the commands under `app`."""
    app.command("doctor")(doctor)
    app.command("settings")(settings)
    app.command("set")(set_keys)
    app.command("take-back")(take_back)
    app.command("restart")(restart)


def doctor(
    context: typer.Context,
    fix: Annotated[
        str, typer.Option(help="Set this parameter of the autopilot right first.", show_default=False)
    ] = "",
    person: Person = "",
    as_json: AsJson = False,
) -> None:
    """Tell what a drone that stands finds of itself; exit 1 when it is not fit to fly.

    What can only be looked at without the daemon is named: for that, `flightd doctor` on the drone itself.

    \b
    Examples:
      flightctl doctor
      flightctl doctor --fix GUID_TIMEOUT --person ann
    """
    from flightd.adapters.ground_link.protocol import encode

    link: DaemonConnection = context.obj
    report = link.ask(lambda client: client.fix(fix, person) if fix else client.doctor())
    print(encode(report).decode() if as_json else "\n".join(_report_lines(report)))
    if not report.fit:
        raise RunError("not fit to fly")


def settings(context: typer.Context, as_json: AsJson = False) -> None:
    """Print the settings that a drone's file gives, and the versions that it keeps (--json: all there are).

    \b
    Examples:
      flightctl settings
      flightctl settings --json | jq .keys
    """
    from flightd.adapters.ground_link.protocol import encode

    link: DaemonConnection = context.obj
    told = link.ask(lambda client: client.settings())
    print(encode(told).decode() if as_json else "\n".join(_settings_lines(told)))


def set_keys(
    context: typer.Context,
    changes: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE", help="As in the file; without a value: the default.")
    ],
    person: Person = "",
    as_json: AsJson = False,
) -> None:
    """Change settings of a drone that stands disarmed; it checks them, and takes them at its next start.

    \b
    Examples:
      flightctl set mission.height_m=1.8
      flightctl set 'mission.nodes=["A1", "A2"]' scan.pictures= --person ann
    """
    link, given = context.obj, dict(map(_change, changes))

    async def propose(client: GroundClient) -> SettingsAnswer:
        return await client.propose((await client.settings()).tag, given, person)

    _say_changed(link.ask(propose), as_json)


def take_back(
    context: typer.Context,
    version: Annotated[int, typer.Argument(min=1, help="As `flightctl settings` lists it.")],
    person: Person = "",
    as_json: AsJson = False,
) -> None:
    """Bring back the settings as they stood before a change.

    \b
    Examples:
      flightctl take-back 3 --person ann
    """
    link: DaemonConnection = context.obj

    async def back(client: GroundClient) -> SettingsAnswer:
        return await client.take_back((await client.settings()).tag, version, person)

    _say_changed(link.ask(back), as_json)


def restart(context: typer.Context, person: Person = "", as_json: AsJson = False) -> None:
    """Start the daemon of a drone that stands disarmed anew, by its changed settings.

    \b
    Examples:
      flightctl restart --person ann
    """
    from flightd.adapters.ground_link.protocol import encode

    link: DaemonConnection = context.obj
    accepted = link.ask(lambda client: client.restart(person))
    print(encode(accepted).decode() if as_json else "restart: accepted")


def _change(text: str) -> tuple[str, Any]:
    """A key and its value, written as in the file; what is no TOML is text."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"{text!r}: expected KEY=VALUE, such as mission.height_m=1.8")
    if not value.strip():
        return key.strip(), None
    try:
        read = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        read = value.strip()
    return key.strip(), read if isinstance(read, bool | int | float | str | list) else str(read)


def _say_changed(told: SettingsAnswer, as_json: bool) -> None:
    from flightd.adapters.ground_link.protocol import encode

    if as_json:
        print(encode(told).decode())
        return
    print("\n".join(_version_lines(told)[:1]))
    print("taken at the next start of flightd" + (": flightctl restart" if told.restarts else ""))


def _report_lines(report: DoctorAnswer) -> list[str]:
    lines = [report.outcome] if report.outcome else []
    for check in report.checks:
        word = check.level if check.level in {"ok", "unseen"} else check.level.upper()
        lines.append(f"{word:<8}{check.name:<12} {check.text}")
        if check.remedy:
            lines.append(f"{'':<16} -> {check.remedy}")
    return [*lines, ", ".join(f"{name} {version}" for name, version in report.versions.items())]


def _settings_lines(told: SettingsAnswer) -> list[str]:
    lines = [told.file, *_table_lines(told.table), *_version_lines(told)]
    if told.pending:
        lines.append("flightd still runs by older settings: it takes these at its next start")
    return [*lines, f"only to look at: {told.locked}"] if told.locked else lines


def _table_lines(table: dict[str, Any], prefix: str = "") -> list[str]:
    lines: list[str] = []
    for key, value in table.items():
        if isinstance(value, dict):
            lines += _table_lines(value, f"{prefix}{key}.")
        else:
            lines.append(f"{prefix}{key} = {json.dumps(value)}")
    return lines


def _version_lines(told: SettingsAnswer) -> list[str]:
    return [
        f"version {version.number}: {version.utc} {version.person or version.client}: "
        + ", ".join(
            f"{change.key} {_shown(change.before)} -> {_shown(change.after)}" for change in version.changes
        )
        for version in told.versions
    ]


def _shown(value: object) -> str:
    return "default" if value is None else json.dumps(value)
