"""Who asks, of those whom the station knows: by session, by key, or whoever sits at this machine."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.types import Scope

from flightd.adapters.ground_link.audit import AuditLog
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.ground.access.attempts import Attempts
from flightd.ground.access.audit import StationEntry, audit_file
from flightd.ground.access.key_book import KeyBook, ScopedKey
from flightd.ground.access.passwords import PasswordCheck, hashed_secret
from flightd.ground.access.people_book import PeopleBook, Person, Session
from flightd.ground.access.roles import Identity, Role
from flightd.ground.bounded import Threads
from flightd.ground.messages import SessionState
from flightd.ground.own_database import make_private_file

_LOG = logging.getLogger(__name__)
IDLE_S, ABSOLUTE_S = 2 * 3600.0, 12 * 3600.0
"""A session ends so long after its last use (an open page uses it) and so long after its sign-in: a shift."""
_CLOCK_S = 60.0
"""A clock that was set back by no more ends no session."""
_READ_AGAIN_S, _NOTE_SEEN_S = 1.0, 60.0
_AT_ONCE, _MOST_WAITING = 2, 8
"""So many passwords are looked at together: each takes 64 MiB for a tenth of a second or longer."""
LOCAL = Identity("local", Role.ADMIN, "local")
"""Whoever asks a station that only this machine reaches, and that asks nobody who he is."""


class WrongKeyError(InputError):
    """A request bears a key that is nobody's."""


class Access:
    """Knows who is who.  With `login` off everybody is `LOCAL`, but for programs that bear a key.

    What each request asks is answered from memory: no disk lies before a STOP."""

    def __init__(
        self, state: Path, login: bool, secure: bool, now_s: Callable[[], float] = time.time
    ) -> None:
        """UnavailableError, InputError for a folder in which people and audit cannot be kept."""
        self.login = login
        self.state = state
        self.secure = secure
        """Under TLS: the cookie is for nobody else."""
        self._book = PeopleBook(state)
        self._keys = KeyBook(state)
        self._now_s = now_s
        self._people: dict[str, Person] = {}
        self._by_key: dict[bytes, Person] = {}
        self._scoped: dict[bytes, ScopedKey] = {}
        self._sessions: dict[bytes, Session] = {}
        self._seen: dict[bytes, float] = {}
        self._found_over: frozenset[bytes] = frozenset()
        self._attempts = Attempts(time.monotonic)
        self._check = PasswordCheck() if login else None
        self._changing = asyncio.Lock()
        self._trying = Threads(_AT_ONCE, _MOST_WAITING, "too many people sign in at once")
        try:
            make_private_file(audit_file(state))
        except OSError as err:
            raise UnavailableError(
                f"cannot be written: {err.strerror}",
                file=audit_file(state),
                remedy="be the user that the station runs as, or name another --state DIR",
            ) from None
        self._audit = AuditLog(audit_file(state))
        self._read()

    @property
    def cookie(self) -> str:
        """Its name; the prefix has browsers refuse it to every other origin and path."""
        return "__Host-flightd" if self.secure else "flightd-session"

    @property
    def people(self) -> int:
        """Those who can sign in, or have a key."""
        return sum(bool(person.password or person.key) for person in self._people.values())

    async def run(self) -> None:
        """Follow what `flightd ground people` and `keys` change, until cancelled."""
        noted_s = self._now_s()
        try:
            while True:
                await asyncio.sleep(_READ_AGAIN_S)
                try:
                    async with self._changing:
                        await asyncio.to_thread(self._read)
                    if self._now_s() - noted_s > _NOTE_SEEN_S:
                        noted_s = self._now_s()
                        await asyncio.to_thread(self._tidy)
                except FlightdError as err:  # who is known stays known; the disk may come back
                    _LOG.warning("the people of this station cannot be read: %s", err)
        finally:
            with contextlib.suppress(FlightdError):
                self._tidy()

    @property
    def audit_lost(self) -> int:
        """Lines of the audit that its disk did not take."""
        return self._audit.dropped

    def close(self) -> None:
        """Write what waits of the audit."""
        self._audit.close()

    def identify(self, scope: Scope) -> Identity | None:
        """Who sends a request, None for nobody known.  WrongKeyError for a key that is nobody's, whatever
        else the request holds."""
        headers = Headers(scope=scope)
        authorization = headers.get("authorization")
        if authorization is not None:
            return self._by_bearer(authorization)
        if not self.login:
            return LOCAL
        found = self._session(self.session_of(headers))
        return None if found is None else self._signed_in(found)

    def renewed(self, who: Identity) -> Identity | None:
        """Who somebody is by now: perhaps with another role, or nobody any more."""
        if who.by == "local":
            return who
        if who.by == "password":
            found = self._session(who.session)
            return None if found is None else self._signed_in(found)
        person = self._by_key.get(who.session)
        return None if person is None else Identity(person.name, person.role, "key", who.session)

    def session_state(self, who: Identity | None, over: bool = False) -> SessionState:
        """How it stands with somebody's session, for the page."""
        if who is None:
            return SessionState(self.login)
        found = self._sessions.get(who.session)
        ends_in_s = None if found is None else max(found.began_s + ABSOLUTE_S - self._now_s(), 0.0)
        return SessionState(self.login, who.name, who.role.value, ends_in_s, over)

    def outlived(self, who: Identity) -> Person | None:
        """Whose session is over by the clock alone; None where it goes on, or was ended by somebody."""
        found = self._sessions.get(who.session)
        if found is None or not self._is_over(found, self._now_s()):
            return None
        return self._people.get(found.person.casefold())

    def ended(self, scope: Scope) -> Identity | None:
        """Whose session, by the request's cookie, the clock has ended minutes ago at most."""
        found = self._sessions.get(self.session_of(Headers(scope=scope)))
        is_known = found is not None and found.person.casefold() in self._people
        return self._signed_in(found) if found is not None and is_known else None

    def is_known(self, person: Person) -> bool:
        """The person is as before, with the same role and password."""
        return self._people.get(person.name.casefold()) == person

    def token_of(self, headers: Headers) -> str:
        """The session's id in the request's cookie, empty where there is none."""
        return cookie_parser(headers.get("cookie", "")).get(self.cookie, "")

    def session_of(self, headers: Headers) -> bytes:
        """The hash of that id, empty where there is none."""
        token = self.token_of(headers)
        return hashed_secret(token) if token else b""

    async def sign_in(
        self, name: str, password: str, address: str, held: str = ""
    ) -> tuple[str, Identity] | None:
        """The id of a session that begins now, and whose it is; None where name or password is wrong.  It has
        the id `held` where that is of a session of the same person that goes on: his pages stay open.
        TooManyAttemptsError, UnavailableError."""
        check = self._check
        if check is None:
            raise InputError("this station asks nobody who he is")
        self._attempts.begin(name, address)
        person = self._people.get(name.casefold())
        kept = "" if person is None else person.password
        fits = await self._trying.run(check.fits, password, kept)
        if person is None or not fits:
            return None
        going_on = self._session(hashed_secret(held)) if held else None
        is_his = going_on is not None and going_on.person.casefold() == person.name.casefold()
        token, now_s = held if is_his else secrets.token_urlsafe(32), self._now_s()
        session = Session(hashed_secret(token), person.name, now_s, now_s)
        async with self._changing:
            if not await asyncio.to_thread(self._book.begin, session, kept):
                return None  # the password was changed meanwhile
            self._sessions[session.id] = session
        self._attempts.succeeded(name, address)
        return token, Identity(person.name, person.role, "password", session.id)

    async def sign_out(self, session: bytes) -> None:
        """End a session at once, on every page that has it."""
        if self._sessions.pop(session, None) is None:
            return
        async with self._changing:
            await asyncio.to_thread(self._book.end, session)
            self._sessions.pop(session, None)  # it may have been read again meanwhile

    def known_name(self, name: str) -> str:
        """The name as it is written here; `(unknown)` for one that is nobody's: it may be a password."""
        person = self._people.get(name.casefold())
        return "(unknown)" if person is None else person.name

    def write_down(self, who: Identity | None, address: str, act: str, target: str, **outcome: str) -> None:
        """A line of the audit; never waits."""
        person = ("", "", "") if who is None else (who.name, who.role.value, who.by)
        self._audit.write(StationEntry(*person, address, act, target, **outcome))

    def _by_bearer(self, authorization: str) -> Identity:
        kind, _, key = authorization.partition(" ")
        hashed = hashed_secret(key.strip())
        if kind.lower() != "bearer" or not key.strip():
            raise WrongKeyError("this key is nobody's here")
        if (scoped := self._scoped.get(hashed)) is not None:
            return Identity(scoped.name, Role.VIEWER, "key", hashed, frozenset(scoped.scopes))
        person = self._by_key.get(hashed)
        if person is None:
            raise WrongKeyError("this key is nobody's here")
        return Identity(person.name, person.role, "key", hashed)

    def _session(self, hashed: bytes) -> Session | None:
        """A session that goes on, which is used now."""
        found = self._sessions.get(hashed)
        if found is None:
            return None
        now_s = self._now_s()
        seen_s = max(self._seen.get(hashed, 0.0), found.seen_s)
        if self._is_over(found, now_s) or found.person.casefold() not in self._people:
            return None
        self._seen[hashed] = max(seen_s, now_s)
        return found

    def _is_over(self, session: Session, now_s: float) -> bool:
        seen_s = max(self._seen.get(session.id, 0.0), session.seen_s)
        return now_s - seen_s > IDLE_S or not -_CLOCK_S <= now_s - session.began_s <= ABSOLUTE_S

    def _signed_in(self, session: Session) -> Identity:
        person = self._people[session.person.casefold()]
        return Identity(person.name, person.role, "password", session.id)

    def _read(self) -> None:
        """Everybody anew, at one stroke for the loop."""
        people, sessions = self._book.read()
        keys = self._keys.all()
        self._scoped = {key.hash: key for key in keys}
        self._people = {person.name.casefold(): person for person in people}
        self._by_key = {person.key: person for person in people if person.key}
        self._sessions = {session.id: session for session in sessions}

    def _tidy(self) -> None:
        """Note when sessions were used last, and drop those that are over for the second time: open pages
        have seen by then that it was the clock that ended them."""
        over = frozenset(self._over(self._now_s()))
        if gone := over & self._found_over:
            self._book.end(*gone)
        self._found_over = over
        if self._seen:
            self._book.note_seen(self._seen.copy())
        for session in list(self._seen):
            if session not in self._sessions:
                self._seen.pop(session, None)

    def _over(self, now_s: float) -> Iterator[bytes]:
        for session in self._sessions.copy().values():
            if self._is_over(session, now_s):
                yield session.id
