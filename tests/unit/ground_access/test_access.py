"""Who asks: sessions end when they should, keys are programs', what the file says holds within seconds."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from flightd.core.types import CommandKind
from flightd.ground.access.access import ABSOLUTE_S, IDLE_S, LOCAL, Access, WrongKeyError
from flightd.ground.access.attempts import TooManyAttemptsError
from flightd.ground.access.passwords import hashed_password, hashed_secret, new_key
from flightd.ground.access.people_book import PeopleBook, Person
from flightd.ground.access.roles import QUELLING, Identity, Role, may_order
from flightd.ground.page_person import PagePeople, PagePerson, Standing
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until

WORDS = "correct horse battery"
KEY = new_key()
HASH = hashed_password(WORDS, "ann")


class Clock:
    now_s = 1_700_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def book(tmp_path: Path) -> PeopleBook:
    book = PeopleBook(tmp_path)
    book.add(Person("ann", Role.OPERATOR, HASH))
    book.add(Person("export", Role.VIEWER, key=hashed_secret(KEY)))
    return book


@pytest.fixture
def access(tmp_path: Path, book: PeopleBook, clock: Clock) -> Iterator[Access]:
    access = Access(tmp_path, login=True, secure=True, now_s=clock)
    yield access
    access.close()


def asking(access: Access, token: str = "", **headers: str) -> Identity | None:
    """Who a request with this cookie is from."""
    return access.identify(request(access, token, **headers))


def request(access: Access, token: str = "", **headers: str) -> dict[str, Any]:
    """Its scope."""
    sent = {**headers, **({"cookie": f"a=b; {access.cookie}={token}"} if token else {})}
    return {"type": "http", "headers": [(name.encode(), value.encode()) for name, value in sent.items()]}


async def signed_in(access: Access, address: str = "10.0.0.1") -> str:
    found = await access.sign_in("Ann", WORDS, address)
    assert found is not None
    return found[0]


def test_a_session_goes_on_until_it_is_signed_out(access: Access, book: PeopleBook) -> None:
    @in_real_time
    async def run() -> None:
        token = await signed_in(access)
        who = asking(access, token)
        assert who is not None
        assert (who.name, who.role, who.by) == ("ann", Role.OPERATOR, "password")
        assert token.encode() not in book.file.read_bytes(), "only a hash of the id is kept"
        other = await signed_in(access)
        await access.sign_out(who.session)
        assert asking(access, token) is None
        assert asking(access, other) is not None
        assert access.renewed(who) is None

    run()


def test_a_session_ends_when_it_is_not_used_and_after_a_shift_whatever_it_does(
    access: Access, clock: Clock, tmp_path: Path
) -> None:
    @in_real_time
    async def run() -> None:
        idle, used = await signed_in(access), await signed_in(access)
        end_s = clock.now_s + ABSOLUTE_S
        clock.now_s += IDLE_S - 1
        assert asking(access, used) is not None
        clock.now_s += 2
        assert asking(access, idle) is None
        while clock.now_s + IDLE_S / 2 < end_s:
            clock.now_s += IDLE_S / 2
            assert asking(access, used) is not None
        clock.now_s = end_s + 1
        assert asking(access, used) is None

    run()


def test_signing_in_again_goes_on_with_the_session_of_the_same_person_alone(
    access: Access, book: PeopleBook, clock: Clock
) -> None:
    @in_real_time
    async def run() -> None:
        book.add(Person("ben", Role.OPERATOR, HASH))
        access._read()  # noqa: SLF001 - as it does each second
        token = await signed_in(access)
        who = asking(access, token)
        assert who is not None
        clock.now_s += ABSOLUTE_S - 60
        access._seen[who.session] = clock.now_s  # noqa: SLF001 - an open page
        assert access.session_state(who).ends_in_s == 60
        bens = await access.sign_in("ben", WORDS, "10.0.0.1", token)
        assert bens is not None
        assert bens[0] != token
        assert await access.sign_in("ann", "wrong words here", "10.0.0.1", token) is None
        assert access.session_state(who).ends_in_s == 60
        again = await access.sign_in("ann", WORDS, "10.0.0.1", token)
        assert again == (token, who)
        access._read()  # noqa: SLF001
        assert access.session_state(who).ends_in_s == ABSOLUTE_S
        clock.now_s += ABSOLUTE_S + 1
        over = await access.sign_in("ann", WORDS, "10.0.0.1", token)
        assert over is not None
        assert over[0] != token, "what is over does not begin again"

    run()


class Drone:
    flies = True


def test_a_session_that_the_clock_ends_in_flight_is_left_until_those_drones_have_landed(
    access: Access, book: PeopleBook, clock: Clock
) -> None:
    @in_real_time
    async def run() -> None:
        drones = {"a": Drone(), "b": Drone()}
        drones["b"].flies = False
        tokens = [await signed_in(access) for _ in range(3)]
        identities = [who for who in (asking(access, token) for token in tokens) if who is not None]
        people = [PagePerson(who, access, drones) for who in identities]
        assert {person.standing() for person in people} == {Standing.SIGNED_IN}
        await access.sign_out(identities[2].session)
        assert people[2].standing() is Standing.GONE, "who signs out is gone, whatever flies"
        clock.now_s += ABSOLUTE_S + 1
        assert [person.standing() for person in people[:2]] == [Standing.OVER] * 2
        state = people[0].session_state()
        assert (state.name, state.over, state.ends_in_s) == ("ann", True, 0.0)
        assert asking(access, tokens[0]) is None, "no other request is answered"
        for dropped in (False, True):
            access._tidy()  # noqa: SLF001 - as it does each minute
            access._read()  # noqa: SLF001
            assert (access._sessions == {}) is dropped, "an open page sees once why it is over"  # noqa: SLF001
            assert people[0].standing() is Standing.OVER
        drones["b"].flies, drones["a"].flies = True, False
        assert people[0].standing() is Standing.GONE, "b took off since"
        drones["a"].flies = True
        assert people[1].standing() is Standing.OVER
        book.set_password("ann", hashed_password("another horse battery", "ann"))
        access._read()  # noqa: SLF001
        assert people[1].standing() is Standing.GONE

    run()


def test_whose_page_comes_again_after_the_sessions_end_has_what_is_left_of_it_until_they_have_landed(
    access: Access, clock: Clock
) -> None:
    @in_real_time
    async def run() -> None:
        drone = Drone()
        people = PagePeople(access, {"a": drone})
        token, unseen = await signed_in(access), await signed_in(access)
        who = asking(access, token)
        assert who is not None
        person = people.at(who)
        clock.now_s += ABSOLUTE_S + 1
        assert person.standing() is Standing.OVER
        people.keep(person)
        late = people.returning(request(access, unseen))
        assert late is not None
        assert people.at(late).standing() is Standing.OVER, "its socket broke before the station told it"
        for _ in range(2):
            access._tidy()  # noqa: SLF001 - as it does each minute
        access._read()  # noqa: SLF001
        assert people.returning(request(access, unseen)) is None
        assert people.returning(request(access, "another")) is None
        people.look()
        assert people.returning(request(access, token)) == who
        assert people.at(who) is person
        drone.flies = False
        people.look()
        drone.flies = True
        assert people.returning(request(access, token)) is None, "it took off since"

    run()


def test_a_session_outlives_the_stations_restart(access: Access, clock: Clock, tmp_path: Path) -> None:
    @in_real_time
    async def run() -> None:
        token = await signed_in(access)
        again = Access(tmp_path, login=True, secure=True, now_s=clock)
        assert asking(again, token) is not None
        again.close()

    run()


def test_what_the_file_says_of_people_holds_within_seconds(access: Access, book: PeopleBook) -> None:
    @in_real_time
    async def run() -> None:
        running = asyncio.ensure_future(access.run())
        token = await signed_in(access)
        who = asking(access, token)
        assert who is not None
        book.set_role("ann", Role.VIEWER)
        await until(lambda: (now := access.renewed(who)) is not None and now.role is Role.VIEWER)
        book.set_password("ann", HASH)
        await until(lambda: access.renewed(who) is None)
        assert asking(access, token) is None
        assert asking(access, authorization=f"Bearer {KEY}") is not None
        book.remove("export")
        await until(lambda: refused(access, f"Bearer {KEY}"))
        running.cancel()
        await asyncio.wait([running])

    run()


def refused(access: Access, authorization: str) -> bool:
    try:
        asking(access, authorization=authorization)
    except WrongKeyError:
        return True
    return False


def test_a_program_comes_by_its_key_and_a_wrong_one_is_never_taken_for_anybody(
    access: Access, tmp_path: Path
) -> None:
    who = asking(access, authorization=f"bearer {KEY}")
    assert who is not None
    assert (who.name, who.role, who.by) == ("export", Role.VIEWER, "key")
    for wrong in ("Bearer", "Bearer ", f"Bearer {KEY}x", f"Basic {KEY}", "", f"Bearer {KEY.upper()}"):
        assert refused(access, wrong), wrong
    open_to_all = Access(tmp_path, login=False, secure=False)
    assert asking(open_to_all) == LOCAL
    assert refused(open_to_all, "Bearer none"), "not even where nobody is asked"
    open_to_all.close()


def test_wrong_names_and_passwords_are_told_alike_and_held_up(access: Access) -> None:
    @in_real_time
    async def run() -> None:
        for name in ("ann", "nobody"):
            for _ in range(4):
                assert await access.sign_in(name, "wrong words here", f"10.0.0.{len(name)}") is None
            with pytest.raises(TooManyAttemptsError, match="try again in"):
                await access.sign_in(name, WORDS, "10.0.0.9")
        assert access.known_name("ANN") == "ann"
        assert access.known_name(WORDS) == "(unknown)"

    run()


def test_each_role_may_what_the_one_before_it_may_and_everybody_may_stop() -> None:
    for role in Role:
        assert may_order(role, CommandKind.STOP)
        assert may_order(role, CommandKind.PAUSE)
        assert all(role.covers(lower) for lower in list(Role)[: list(Role).index(role) + 1])
    assert not Role.VIEWER.covers(Role.OPERATOR)
    assert not Role.OPERATOR.covers(Role.ADMIN)
    assert {kind for kind in CommandKind if may_order(Role.VIEWER, kind)} == QUELLING
    assert all(may_order(Role.OPERATOR, kind) for kind in CommandKind)
