"""The people of a station: kept for their owner alone, and every session ends with its password."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.access.passwords import PasswordCheck, hashed_password, hashed_secret, new_key
from flightd.ground.access.people_book import MOST_SESSIONS, PeopleBook, Person, Session
from flightd.ground.access.roles import Role

WORDS = "correct horse battery"


def test_a_person_is_kept_without_password_or_key_and_found_whatever_the_case(tmp_path: Path) -> None:
    book, key = PeopleBook(tmp_path / "state"), new_key()
    assert book.people() == []
    assert not book.file.exists(), "asking makes nothing"
    book.add(Person("Ann", Role.ADMIN, hashed_password(WORDS, "Ann"), hashed_secret(key)))
    assert book.file.stat().st_mode & 0o777 == 0o600
    assert book.file.parent.stat().st_mode & 0o777 == 0o700
    kept = book.file.read_bytes()
    assert WORDS.encode() not in kept
    assert key.encode() not in kept
    assert b"$argon2id$" in kept
    with pytest.raises(InputError, match="there is a ANN already"):
        book.add(Person("ANN", Role.VIEWER))
    book.set_role("aNN", Role.OPERATOR)
    (person,) = PeopleBook(tmp_path / "state").people()
    assert (person.name, person.role) == ("Ann", Role.OPERATOR)


@pytest.mark.parametrize("change", ["password", "remove"])
def test_a_new_password_or_a_removal_ends_all_sessions_of_that_person_alone(
    tmp_path: Path, change: str
) -> None:
    book = PeopleBook(tmp_path)
    for name in ("ann", "bob"):
        book.add(Person(name, Role.VIEWER, f"hash of {name}"))
        for number in range(2):
            session = Session(f"{name} {number}".encode(), name, 1.0, 1.0)
            assert book.begin(session, f"hash of {name}")
    if change == "password":
        book.set_password("ann", "another hash")
    else:
        book.remove("ann")
    assert {session.person for session in book.read()[1]} == {"bob"}
    late = Session(b"late", "ann", 2.0, 2.0)
    assert not book.begin(late, "hash of ann"), "looked at before the change, not after it"


def test_sessions_are_bounded_and_the_longest_unused_go_first(tmp_path: Path) -> None:
    book = PeopleBook(tmp_path)
    book.add(Person("ann", Role.VIEWER, "hash"))
    with sqlite3.connect(book.file) as rows:
        rows.executemany(
            "INSERT INTO session VALUES (?, 'ann', 0, ?)", [(b"%d" % at, at) for at in range(MOST_SESSIONS)]
        )
    rows.close()
    assert book.begin(Session(b"new", "ann", 9.0, 1e9), "hash")
    kept = {session.id for session in book.read()[1]}
    assert len(kept) == MOST_SESSIONS
    assert b"new" in kept
    assert b"0" not in kept


@pytest.mark.parametrize("name", ["", " ann", "ann b", "-ann", "a" * 61, "ann\n", "änn"])
def test_what_is_no_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="is no name here"):
        PeopleBook(tmp_path).add(Person(name, Role.VIEWER))


def test_nobody_is_changed_who_is_not_there(tmp_path: Path) -> None:
    book = PeopleBook(tmp_path)
    changes: tuple[Callable[[], None], ...] = (
        lambda: book.set_role("ann", Role.ADMIN),
        lambda: book.set_password("ann", "x"),
        lambda: book.set_key("ann", b"x"),
        lambda: book.remove("ann"),
    )
    for change in changes:
        with pytest.raises(InputError, match="there is no 'ann' here; see flightd ground people list"):
            change()


def test_another_programs_file_and_a_folder_that_refuses_are_named(tmp_path: Path) -> None:
    book = PeopleBook(tmp_path)
    book.file.write_bytes(b"not a database at all" * 100)
    with pytest.raises(InputError, match=r"people\.db: not the people of a ground station"):
        book.people()
    book.file.unlink()
    with sqlite3.connect(book.file) as other:
        other.execute("CREATE TABLE person (name TEXT)")
    other.close()
    with pytest.raises(InputError, match="or of another version"):
        book.people()
    (tmp_path / "file").touch()
    with pytest.raises(UnavailableError, match="name another --state DIR"):
        PeopleBook(tmp_path / "file").add(Person("ann", Role.VIEWER))


def test_a_password_fits_only_its_own_hash_however_a_keyboard_composes_it() -> None:
    check = PasswordCheck()
    kept = hashed_password("Übergröße nord", "ann")
    assert check.fits("U\u0308bergro\u0308ße nord", kept)
    assert not check.fits("Ubergroße nord", kept)
    assert not check.fits("Übergröße nord", "")
    assert not check.fits("Übergröße nord", "no hash")


@pytest.mark.parametrize("password", ["short", "x" * 201, "aaaaaaaaaaaa", "abababababab", "hermannhermann"])
def test_a_password_that_is_soon_guessed_is_refused(password: str) -> None:
    with pytest.raises(InputError, match="password"):
        hashed_password(password, "Hermann")


def test_keys_are_long_and_never_the_same() -> None:
    keys = {new_key() for _ in range(100)}
    assert len(keys) == 100
    assert min(map(len, keys)) >= 50
