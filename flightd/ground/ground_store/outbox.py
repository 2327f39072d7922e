"""Counts for another program's folder, file by file: each holds what changed since the one before it.

What a file says is settled in one transaction with the note of what its places were told as, and kept until
the file lies where it belongs: however often the writing is cut, the same name has the same content.  What
was asked of a place is answered there, too, whether it stands otherwise or not.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.ground.ground_store import questions
from flightd.ground.ground_store.engine import Row, Session
from flightd.ground.ground_store.questions import References
from flightd.vision.shelf.code_equality import code_key

MOST_PLACES = 20_000
"""Of one file."""
_CHANGED = (
    "SELECT place.id, place.code, node, place.state, place.texts, place.utc_ns, coalesce(place.look, ?),"
    " run.name, confidence, evidence, told.state, told.texts FROM place LEFT JOIN run ON run.id = place.run"
    " LEFT JOIN outbox_place AS told ON told.outbox = ? AND told.place = place.id WHERE place.site = ?"
    " AND (CASE WHEN told.place IS NULL THEN place.look IS NOT NULL"
    " ELSE place.state <> told.state OR place.texts <> told.texts OR ? = 1 AND"
    " coalesce(place.look, ?) <> told.look END OR EXISTS (SELECT 1 FROM question WHERE"
    " question.site = place.site AND question.place = place.id AND who = ?"
    f" AND {questions.IS_LOOKED_AT})) ORDER BY place.code LIMIT ?"
)
_TOLD = (
    "INSERT INTO outbox_place VALUES (?, ?, ?, ?, ?) ON CONFLICT (outbox, place)"
    " DO UPDATE SET state = excluded.state, texts = excluded.texts, look = excluded.look"
)


@dataclass(frozen=True, slots=True)
class PlaceCount:
    """How a place stands; `utc_ns` and `run` are of the look by which it does, 0 and "" where none counts
    any more.  `evidence` names its picture; `references` are of the questions that this answers."""

    code: str
    node: str
    state: str
    texts: tuple[str, ...]
    utc_ns: int
    run: str
    confidence: float | None
    evidence: str
    references: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OutgoingFile:
    """A file that is under way."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Outbox:
    """Who is told what: `name` is whose notes these are, `who` it is that asks questions.  With `recounts` a
    place that was found as before is told, too.  `file_name` makes a file's name of its number, `content`
    what it says."""

    name: str
    who: str
    recounts: bool
    file_name: Callable[[int], str]
    content: Callable[[Sequence[PlaceCount]], bytes]


def next_file(session: Session, site: int, outbox: Outbox) -> OutgoingFile | None:
    """What is under way already, else what changed since; None where nothing did."""
    session.run("INSERT INTO outbox VALUES (?, 0, '', ?) ON CONFLICT DO NOTHING", outbox.name, b"")
    number, file, content = session.rows(
        "SELECT number, file, content FROM outbox WHERE name = ?", outbox.name
    )[0]
    if file:
        return OutgoingFile(file, bytes(content))
    answers = questions.looked_at(session, site, outbox.who)
    asked = (b"", outbox.name, site, int(outbox.recounts), b"", outbox.who, MOST_PLACES)
    while rows := session.rows(_CHANGED, *asked):
        session.run_many(_TOLD, [(outbox.name, row[0], row[3], row[4], row[6]) for row in rows])
        told = [row for row in rows if outbox.recounts or row[0] in answers or not _is_same(row)]
        if told:
            counts = [_count(row, answers) for row in told]
            begun = OutgoingFile(outbox.file_name(number + 1), outbox.content(counts))
            answered = [(row[0], row[5]) for row in told if row[0] in answers]
            questions.tell(session, site, outbox.who, begun.name, answered)
            session.run(
                "UPDATE outbox SET number = ?, file = ?, content = ? WHERE name = ?",
                number + 1, begun.name, begun.content, outbox.name,
            )  # fmt: skip
            return begun
    return None


def file_lies_there(session: Session, name: str, file: str) -> None:
    """The file is not under way any more."""
    session.run("UPDATE outbox SET file = '', content = ? WHERE name = ? AND file = ?", b"", name, file)


def _is_same(row: Row) -> bool:
    """The codes that were told, in another order or notation."""
    state, texts, state_told, texts_told = row[3], row[4], row[10], row[11]
    return state == state_told and _keys(texts) == _keys(texts_told)


def _keys(texts: str) -> set[str]:
    return {code_key(text) for text in json.loads(texts)}


def _count(row: Row, answers: References) -> PlaceCount:
    place, code, node, state, texts, utc_ns, _, run, confidence, evidence, *_ = row
    return PlaceCount(
        code, node, state, tuple(json.loads(texts)), utc_ns or 0, run or "", confidence,
        "" if evidence is None else bytes(evidence).hex(), answers.get(place, ()),
    )  # fmt: skip
