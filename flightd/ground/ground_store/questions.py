"""What other programs ask of places.

A question is open until a confirmed look that is newer is in the store, whatever it found; that follows from
the looks, as all that is derived of them does, until the answer is told to whoever asked (`outbox`), once.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.ground.drop import Drop
from flightd.ground.ground_store.engine import Row, Session, listed

IS_LOOKED_AT = "question.file = '' AND place.utc_ns > question.utc_ns"
"""Of a question whose answer is there, and not told yet."""
_IS_OPEN = "question.file = '' AND coalesce(place.utc_ns, 0) <= question.utc_ns"
_ASK = (
    "INSERT INTO question (id, site, place, utc_ns, who, reason, reference)"
    " SELECT ?, site, id, ?, ?, ?, ? FROM place WHERE site = ? AND code = ? AND NOT EXISTS"
    " (SELECT 1 FROM question WHERE question.site = place.site AND question.place = place.id AND who = ?"
    f" AND reference = ? AND {_IS_OPEN})"
)
_LOOKED_AT = (
    "SELECT place, reference FROM question JOIN place ON place.id = question.place"
    f" WHERE question.site = ? AND who = ? AND {IS_LOOKED_AT} ORDER BY question.utc_ns, reference"
)
_TELL = (
    "UPDATE question SET file = ?, answered_ns = ? WHERE site = ? AND place = ? AND who = ? AND file = ''"
    " AND utc_ns < ?"
)
References: TypeAlias = dict[int, tuple[str, ...]]
"""By the id of a place, without those that are empty."""


@dataclass(frozen=True, slots=True)
class Question:
    """What `who` asks is what lies at the place `location` now; its `reason` and `reference` are its own."""

    location: str
    reason: str = ""
    reference: str = ""


def ask(
    session: Session,
    site: int,
    who: str,
    questions: Sequence[Question],
    utc_ns: int,
    drop: Drop | None = None,
) -> list[str]:
    """Of places that the site has; returns the codes of the others.  What `who` asked already by the same
    reference, and what is open, stays as it is.  That it came by a `drop` is noted, until `moved`."""
    source = f"{drop.inbox}\0{drop.sha256}" if drop else secrets.token_hex()
    session.run_many(
        _ASK,
        [
            (
                hashlib.sha256(f"{source}\0{utc_ns}\0{number}".encode()).digest(), utc_ns,
                who, asked.reason, asked.reference, site, asked.location, who, asked.reference,
            )
            for number, asked in enumerate(questions)
        ],
    )  # fmt: skip
    if drop:
        moved(session, drop.inbox)
        session.run("INSERT INTO dropped VALUES (?, ?, ?, ?)", drop.inbox, drop.name, drop.sha256, drop.said)
    codes = list(dict.fromkeys(asked.location for asked in questions))
    known = {
        code
        for marks, part in listed(codes)
        for (code,) in session.rows(f"SELECT code FROM place WHERE site = ? AND code IN {marks}", site, *part)
    }
    return [code for code in codes if code not in known]


def dropped(session: Session, inbox: str) -> Drop | None:
    """What is noted of a file that may lie in the inbox still."""
    found = session.rows("SELECT inbox, name, sha256, said FROM dropped WHERE inbox = ?", inbox)
    return Drop(*found[0]) if found else None


def moved(session: Session, inbox: str) -> None:
    """That file lies there no more: one of the same name and content is another from now on."""
    session.run("DELETE FROM dropped WHERE inbox = ?", inbox)


def open_places(session: Session, site: int) -> frozenset[str]:
    """The codes of the places of which a question is open."""
    return frozenset(
        code
        for (code,) in session.rows(
            "SELECT DISTINCT code FROM question JOIN place ON place.id = question.place"
            f" WHERE question.site = ? AND {_IS_OPEN}",
            site,
        )
    )


def looked_at(session: Session, site: int, who: str) -> References:
    """The places of which `who` is to be told an answer, each with the references of its questions."""
    found: References = {}
    for place, reference in session.rows(_LOOKED_AT, site, who):
        known = found.setdefault(place, ())
        if reference and reference not in known:
            found[place] = (*known, reference)
    return found


def tell(session: Session, site: int, who: str, file: str, places: Collection[Row]) -> None:
    """The file answers what `who` asked of these places, (id, time of the newest look) each."""
    session.run_many(_TELL, [(file, utc_ns, site, place, who, utc_ns) for place, utc_ns in places])
