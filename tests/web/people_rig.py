"""A station that knows people, and who they are."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from flightd.ground.access.passwords import hashed_password, hashed_secret, new_key
from flightd.ground.access.people_book import PeopleBook, Person
from flightd.ground.access.roles import Role
from tests.web.served import JSON, Station

PASSWORD = "correct horse battery"
PEOPLE = {"vera": Role.VIEWER, "otto": Role.OPERATOR, "ada": Role.ADMIN}


@cache
def _hash() -> str:
    return hashed_password(PASSWORD, "nobody")


def with_people(state: Path) -> dict[Role, str]:
    """Put a person of each role into the station's state, and a program; the programs' keys."""
    book = PeopleBook(state)
    keys = {role: new_key() for role in Role}
    for name, role in PEOPLE.items():
        book.add(Person(name, role, _hash()))
    for role, key in keys.items():
        book.add(Person(f"program-{role}", role, key=hashed_secret(key)))
    return keys


async def sign_in(station: Station, name: str, password: str = PASSWORD) -> str:
    """The cookie of somebody who signs in."""
    head, _ = await signing_in(station, name, password)
    found = re.search(r"set-cookie: ([^;]+);", head, re.IGNORECASE)
    assert found is not None, head
    return found[1]


async def signing_in(station: Station, name: str, password: str = PASSWORD) -> tuple[str, str]:
    """The head and the body of the answer to somebody who signs in."""
    body = json.dumps({"name": name, "password": password}).encode()
    return await station.answer("POST", "/api/session", {"Origin": station.origin, **JSON}, body)


def audited(state: Path) -> list[dict[str, Any]]:
    """The audit's lines so far."""
    return [json.loads(line) for line in (state / "audit.jsonl").read_text().splitlines()]
