"""What the store keeps ready besides the looks: how each place stands, and what each run found otherwise.

Both follow from the confirmed looks alone, whatever the order in which they were delivered: a place stands as
its newest look says; a run differs at a place where its newest look there is not what the newest earlier look
of another run that counted the place says.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

from flightd.core.inventory import LocationState, Standing
from flightd.ground.ground_store.engine import Row, Session, listed
from flightd.ground.ground_store.events import EventKind, Noted
from flightd.ground.ground_store.reads_text import texts_of
from flightd.inventory.count_change import change_between

_COLUMNS = "utc_ns, id, run, state, reads, confidence, evidence, fill, undecided, printed"
_CONFIRMED = f"standing = {Standing.CONFIRMED:d}"
_COUNTED = f"state IN ({', '.join(repr(state.value) for state in LocationState if state.is_counted)})"
_NEWEST_FIRST = "ORDER BY utc_ns DESC, id DESC LIMIT 1"
_SINCE = (
    f"SELECT {_COLUMNS} FROM observation WHERE place = ? AND {_CONFIRMED} AND utc_ns >= ? ORDER BY utc_ns, id"
)
_OF_RUN = (  # "+": by place, which has fewer looks than a run
    f"SELECT {_COLUMNS} FROM observation WHERE place = ? AND +run = ? AND {_CONFIRMED} {_NEWEST_FIRST}"
)
_BEFORE = (
    f"SELECT {_COLUMNS} FROM observation WHERE place = ? AND utc_ns <= ? AND (utc_ns, id) < (?, ?)"
    f" AND run <> ? AND {_CONFIRMED} AND {_COUNTED} {_NEWEST_FIRST}"
)
_NO_RUN = 0
"""Ids begin with 1."""
_NEWEST = f"SELECT {_COLUMNS} FROM observation WHERE place = ? AND {_CONFIRMED} {_NEWEST_FIRST}"
_STANDS = (
    "UPDATE place SET utc_ns = ?, look = ?, run = ?, state = ?, texts = ?, confidence = ?, evidence = ?,"
    " fill = ?, undecided = ?, printed = ? WHERE id = ?"
)
_DIFFERS = f"INSERT INTO difference VALUES ({', '.join('?' * 11)})"


@dataclass(frozen=True, slots=True)
class Moment:
    """A confirmed look as far as it matters here."""

    utc_ns: int
    id: bytes
    run: int
    state: str
    reads: str
    confidence: float
    evidence: bytes | None
    fill: str | None
    undecided: str
    printed: str

    @property
    def order(self) -> tuple[int, bytes]:
        return self.utc_ns, self.id

    @property
    def is_counted(self) -> bool:
        return LocationState(self.state).is_counted


@dataclass(slots=True)
class Touched:
    """A place of whose looks some count that did not before (`looks`), or no longer (of `runs`, too)."""

    place: int
    code: str
    looks: list[Moment] = field(default_factory=list)
    runs: set[int] = field(default_factory=set)
    first_ns: int = (1 << 63) - 1
    only_new: bool = True

    def add(self, look: Moment, *, counts: bool) -> None:
        self.runs.add(look.run)
        self.first_ns = min(self.first_ns, look.utc_ns)
        if counts:
            self.looks.append(look)
        else:
            self.only_new = False


@dataclass(slots=True)
class _Written:
    """What is to be written in the end, all at once."""

    stands: list[Row] = field(default_factory=list)
    gone: list[Row] = field(default_factory=list)
    differs: list[Row] = field(default_factory=list)

    def stand(self, place: int, look: Moment | None) -> None:
        if look is None:
            self.stands.append(
                (None, None, None, LocationState.NOT_VISITED.value, "[]", None, None, None, "[]", "[]", place)
            )
            return
        self.stands.append(
            (
                look.utc_ns, look.id, look.run, look.state, json.dumps(texts_of(look.reads)),
                look.confidence, look.evidence, look.fill, look.undecided, look.printed, place,
            )
        )  # fmt: skip

    def differ(self, code: str, run: int, now: Moment | None, before: Moment | None) -> None:
        self.gone.append((run, code))
        if now is None or before is None:
            return
        was, texts = texts_of(before.reads), texts_of(now.reads)
        change = change_between(was, LocationState(now.state), texts)
        if change is not None:
            self.differs.append(
                (
                    run, code, change.value, now.utc_ns, now.id, now.state, json.dumps(texts), before.run,
                    before.utc_ns, before.state, json.dumps(was),
                )
            )  # fmt: skip


def renew(session: Session, touched: Sequence[Touched], noted: Noted) -> None:
    """Bring up to date what follows from looks that were just written."""
    newest = _newest(session, [place.place for place in touched])
    written = _Written()
    for place in touched:
        if not _follows_on(place, newest[place.place], written):
            _renew_place(session, place, written)
    if noted.wanted:
        _note_changes(session, written, noted)
    session.run_many(_STANDS, written.stands)
    session.run_many("DELETE FROM difference WHERE run = ? AND code = ?", written.gone)
    session.run_many(_DIFFERS, written.differs)


def _note_changes(session: Session, written: _Written, noted: Noted) -> None:
    """What differs now and did not so before, and the other way round."""
    names: dict[int, str] = {}
    before: dict[tuple[int, str], tuple[str, bytes]] = {}
    for run in {run for run, _ in written.gone}:
        names[run] = session.rows("SELECT name FROM run WHERE id = ?", run)[0][0]
        for marks, part in listed([code for of, code in written.gone if of == run]):
            question = f"SELECT code, kind, look FROM difference WHERE run = ? AND code IN {marks}"
            before |= {(run, code): (kind, look) for code, kind, look in session.rows(question, run, *part)}
    now = {(row[0], row[1]): (row[2], row[4]) for row in written.differs}
    for (run, code), (kind, look) in now.items():
        if before.get((run, code)) != (kind, look):
            told = {"run": names[run], "location": code, "change": kind, "look": look.hex()}
            noted.note(EventKind.DIFFERENCE_FOUND, told)
    for run, code in sorted(before.keys() - now.keys()):
        noted.note(EventKind.DIFFERENCE_GONE, {"run": names[run], "location": code})


def _newest(session: Session, places: Sequence[int]) -> dict[int, tuple[int, bytes, int, str] | None]:
    """By what each place stood so far."""
    found: dict[int, tuple[int, bytes, int, str] | None] = {}
    for marks, part in listed(places):
        rows = session.rows(
            f"SELECT id, utc_ns, look, run, state, texts FROM place WHERE id IN {marks}", *part
        )
        found |= {row[0]: None if row[1] is None else row[1:] for row in rows}
    return found


def _follows_on(place: Touched, newest: Row | None, written: _Written) -> bool:
    """The usual case, without another question: looks of one run alone, later than all that was known, which
    is nothing or a count of another run."""
    if not place.only_new or len(place.runs) > 1:
        return False
    now = max(place.looks, key=lambda look: look.order)
    before = None
    if newest is not None:
        utc_ns, identity, run, state, texts = newest
        if place.first_ns <= utc_ns or run == now.run or not LocationState(state).is_counted:
            return False
        reads = json.dumps([["", text] for text in json.loads(texts)])
        before = Moment(utc_ns, identity, run, state, reads, 0.0, None, None, "[]", "[]")
    written.stand(place.place, now)
    written.differ(place.code, now.run, now, before)
    return True


def _renew_place(session: Session, place: Touched, written: _Written) -> None:
    """From the looks themselves: every run that has one since the first that has changed."""
    since = [Moment(*row) for row in session.rows(_SINCE, place.place, place.first_ns)]
    latest = {look.run: look for look in since}  # the last of each run stays
    befores = _befores(session, place, since) if since else {}
    for run in sorted(place.runs | set(latest)):
        now, before = latest.get(run), None
        if now is not None:
            before = befores[now.id]
        elif now := _one(session, _OF_RUN, place.place, run):
            before = _one(session, _BEFORE, place.place, now.utc_ns, *now.order, run)
        written.differ(place.code, run, now, before)
    written.stand(place.place, since[-1] if since else _one(session, _NEWEST, place.place))


def _befores(session: Session, place: Touched, since: Sequence[Moment]) -> dict[bytes, Moment | None]:
    """What counted before each of the looks, of another run: by memory, since they may be many."""
    begin = place.place, place.first_ns, place.first_ns, b""
    last = _one(session, _BEFORE, *begin, _NO_RUN)
    other = None if last is None else _one(session, _BEFORE, *begin, last.run)
    befores: dict[bytes, Moment | None] = {}
    for look in since:
        befores[look.id] = other if last is not None and last.run == look.run else last
        if look.is_counted:
            if last is not None and last.run != look.run:
                other = last
            last = look
    return befores


def _one(session: Session, question: str, *values: object) -> Moment | None:
    found = session.rows(question, *values)
    return Moment(*found[0]) if found else None
