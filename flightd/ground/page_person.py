"""Who sits at a page that is open, and what is left of a session that ends while a drone flies."""

from __future__ import annotations

import asyncio
import enum
from collections.abc import Mapping
from typing import Protocol

from starlette.datastructures import Headers
from starlette.types import Scope

from flightd.ground.access.access import Access
from flightd.ground.access.people_book import Person
from flightd.ground.access.roles import Identity
from flightd.ground.messages import SessionState

_LOOK_S = 1.0


class Flies(Protocol):
    """A drone, as far as it matters here."""

    @property
    def flies(self) -> bool:
        """It is in the air."""
        ...


class Standing(enum.Enum):
    """What somebody is to the station by now."""

    SIGNED_IN = enum.auto()
    CHANGED = enum.auto()
    """With another role."""
    OVER = enum.auto()
    """His session is over, a drone that flew then flies still: he attends, stops and pauses."""
    GONE = enum.auto()


class PagePerson:
    """Asked again and again: whose session the clock ends stays for STOP and Pause until each drone that flew
    then has landed.  Who signed out, was removed or got another password or role does not."""

    def __init__(self, who: Identity, access: Access, drones: Mapping[str, Flies]) -> None:
        self.who = who
        self._access = access
        self._drones = drones
        self._outlived: Person | None = None
        self._flying: tuple[Flies, ...] | None = None
        """Those that flew as the session ended."""

    def standing(self) -> Standing:
        """By now."""
        if self._flying is None:
            now = self._access.renewed(self.who)
            if now is not None:
                return Standing.SIGNED_IN if now == self.who else Standing.CHANGED
            self._outlived = self._access.outlived(self.who)
            self._flying = tuple(drone for drone in self._drones.values() if drone.flies)
        if self._outlived is None or not self._access.is_known(self._outlived):
            return Standing.GONE
        return Standing.OVER if any(drone.flies for drone in self._flying) else Standing.GONE

    def session_state(self) -> SessionState:
        """For the page."""
        return self._access.session_state(self.who, over=self.standing() is Standing.OVER)


class PagePeople:
    """Whose page's socket breaks, or is loaded anew, after his session ended in flight is known again by the
    cookie of that session, as long as there is something left of it."""

    def __init__(self, access: Access, drones: Mapping[str, Flies]) -> None:
        self._access = access
        self._drones = drones
        self._over: dict[bytes, PagePerson] = {}

    async def run(self) -> None:
        """Forget those whose drones have landed, until cancelled: who took off since is none of theirs."""
        while True:
            await asyncio.sleep(_LOOK_S)
            self.look()

    def look(self) -> None:
        self._over = {
            session: person for session, person in self._over.items() if person.standing() is Standing.OVER
        }

    def at(self, who: Identity) -> PagePerson:
        """The person at a page that opens."""
        return self._over.get(who.session) or PagePerson(who, self._access, self._drones)

    def keep(self, person: PagePerson) -> None:
        """Something is left of this person's session."""
        self._over[person.who.session] = person

    def returning(self, scope: Scope) -> Identity | None:
        """Who opens a page with the cookie of a session that has ended; `at` says what is left of it."""
        if not self._access.login:
            return None
        person = self._over.get(self._access.session_of(Headers(scope=scope)))
        return self._access.ended(scope) if person is None else person.who
