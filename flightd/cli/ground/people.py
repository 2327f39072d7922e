"""`flightd ground people`: who may come in, and as what."""

from __future__ import annotations

import getpass
import json
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.application import group
from flightd.cli.ground.state import State, state_folder
from flightd.cli.options import AsJson
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from flightd.ground.access.people_book import PeopleBook

Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the person, or the program.")]
RoleWord = Annotated[str, typer.Option(metavar="ROLE", help="viewer, operator or admin.")]


def register(app: typer.Typer) -> None:
    """Hang `people` with its commands under `app`."""
    commands = group(
        "flightd ground people add ann --role admin\n"
        "flightd ground people add stock-export --role viewer --key\n"
        "flightd ground people list"
    )
    for name, command in (
        ("add", add), ("list", listed), ("role", role), ("password", password), ("key", key),
        ("remove", remove),
    ):  # fmt: skip
        commands.command(name)(command)
    app.add_typer(commands, name="people", help="Who may come in: add, list, role, password, key, remove.")


def add(
    name: Name,
    role: RoleWord = "operator",
    key: Annotated[
        bool, typer.Option("--key", help="A program: it gets a key, which is printed once, and no password.")
    ] = False,
    state: State = None,
    as_json: AsJson = False,
) -> None:
    """Let somebody in; the password is typed, twice (or is a line of standard input).

    A viewer looks on, and stops; an operator flies; an admin may everything.

    \b
    Examples:
      flightd ground people add ann --role admin
      flightd ground people add stock-export --role viewer --key
    """
    from flightd.ground.access.passwords import hashed_password, hashed_secret, new_key
    from flightd.ground.access.people_book import Person
    from flightd.ground.access.roles import read_role

    of, book = read_role(role, "--role"), _book(state)
    if any(person.name.casefold() == name.casefold() for person in book.people()):
        raise InputError(f"there is a {name} already")
    if key:
        secret = new_key()
        book.add(Person(name, of, key=hashed_secret(secret)))
        _tell_key(name, of.value, secret, as_json)
        return
    book.add(Person(name, of, hashed_password(_typed(name), name)))
    _tell({"name": name, "role": of.value}, f"{name} may come in as {of}", as_json)


def listed(state: State = None, as_json: AsJson = False) -> None:
    """List everybody, with role and what they come in with.

    \b
    Examples:
      flightd ground people list
    """
    people = [
        {
            "name": person.name,
            "role": person.role.value,
            "password": bool(person.password),
            "key": bool(person.key),
        }
        for person in _book(state).people()
    ]
    if as_json:
        print(json.dumps({"people": people}))
        return
    if not people:
        print("nobody yet: flightd ground people add NAME --role admin")
    for one in people:
        means = " and ".join(what for what in ("password", "key") if one[what])
        print(f"{one['name']:<24} {one['role']:<9} {means}")


def role(
    name: Name,
    to: Annotated[str, typer.Argument(metavar="ROLE", help="viewer, operator or admin.")],
    state: State = None,
    as_json: AsJson = False,
) -> None:
    """Give somebody another role; it holds within seconds, on open pages, too.

    \b
    Examples:
      flightd ground people role ann operator
    """
    from flightd.ground.access.roles import read_role

    of = read_role(to, "ROLE")
    _book(state).set_role(name, of)
    _tell({"name": name, "role": of.value}, f"the role of {name} is {of} now", as_json)


def password(name: Name, state: State = None, as_json: AsJson = False) -> None:
    """Set somebody's password, typed twice; all sessions of that person end.

    \b
    Examples:
      flightd ground people password ann
    """
    from flightd.ground.access.passwords import hashed_password

    book = _book(state)
    if all(person.name.casefold() != name.casefold() for person in book.people()):
        raise InputError(f"there is no {name!r} here", remedy="see flightd ground people list")
    book.set_password(name, hashed_password(_typed(name), name))
    _tell({"name": name}, f"{name} has a new password, and is signed out everywhere", as_json)


def key(name: Name, state: State = None, as_json: AsJson = False) -> None:
    """Make a new key for a program, printed once; the one before is void.

    \b
    Examples:
      flightd ground people key stock-export
    """
    from flightd.ground.access.passwords import hashed_secret, new_key

    secret = new_key()
    _book(state).set_key(name, hashed_secret(secret))
    _tell_key(name, "", secret, as_json)


def remove(name: Name, state: State = None, as_json: AsJson = False) -> None:
    """Let somebody in no longer; sessions and key end within seconds.

    \b
    Examples:
      flightd ground people remove ann
    """
    _book(state).remove(name)
    _tell({"name": name}, f"{name} is removed", as_json)


def _book(state: Path | None) -> PeopleBook:
    try:
        import argon2  # noqa: F401 - of the same extra as the station
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd ground people") from None
    from flightd.ground.access.people_book import PeopleBook

    return PeopleBook(state_folder(state))


def _typed(name: str) -> str:
    """The new password: typed twice without being shown; from a pipe its first line."""
    if not sys.stdin.isatty():
        line = sys.stdin.readline().rstrip("\r\n")
        if not line:
            raise InputError("there is no password on standard input", remedy="type it at a terminal")
        return line
    first = getpass.getpass(f"Password for {name}: ")
    if getpass.getpass("Again: ") != first:
        raise InputError("the two are not the same", remedy="try again")
    return first


def _tell(document: dict[str, str], words: str, as_json: bool) -> None:
    print(json.dumps(document) if as_json else words)


def _tell_key(name: str, of: str, secret: str, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"name": name, "key": secret, **({"role": of} if of else {})}))
        return
    print(secret)
    print(f"the key of {name}, shown this once; send it as  Authorization: Bearer KEY", file=sys.stderr)
