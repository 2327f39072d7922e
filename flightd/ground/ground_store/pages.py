"""Questions to the store, each answered by a bounded page: the next one begins `after` the last row."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from flightd.core.errors import InputError
from flightd.core.inventory import LocationState
from flightd.ground.ground_store.engine import Row, Session
from flightd.ground.ground_store.fill_text import fill_shown

MOST_ROWS = 1000
_STOCK = (
    "SELECT place.code, node, state, texts, place.utc_ns, run.name, confidence, evidence, pallets_deep,"
    " undecided, printed, fill FROM place LEFT JOIN run ON run.id = place.run"
)
_DIFFERENCES = (
    "SELECT code, kind, utc_ns, state, texts, run.name, before_ns, before_state, before_texts"
    " FROM difference JOIN run ON run.id = before_run WHERE run = ? AND code > ? ORDER BY code LIMIT ?"
)
_LOOKS = (
    "SELECT observation.utc_ns, observation.id, place.code, run.name, observation.state,"
    " observation.confidence, standing, observation.node, x_m, y_m, height_m, yaw_rad, observation.evidence,"
    " reads, observation.fill, observation.undecided, observation.printed, again FROM observation"
    " JOIN place ON place.id = observation.place JOIN run ON run.id = observation.run"
)


@dataclass(frozen=True, slots=True)
class Mark:
    """Where a page in the order of time ended; `Mark.read(str(mark))` is the same."""

    utc_ns: int
    id: bytes

    def __str__(self) -> str:
        return f"{self.utc_ns}-{self.id.hex()}"

    @classmethod
    def read(cls, text: str) -> Mark:
        """InputError for what is none."""
        time, _, identity = text.partition("-")
        try:
            mark = cls(int(time), bytes.fromhex(identity))
        except ValueError:
            raise InputError("no mark of a page", key=f"after={text[:80]!r}") from None
        if not 0 <= mark.utc_ns < 1 << 63:
            raise InputError("no mark of a page", key=f"after={text[:80]!r}")
        return mark


_END = Mark((1 << 63) - 1, b"\xff" * 33)
"""Newer than all: where the newest come first, the first page begins there."""


def site_id(session: Session, name: str) -> int:
    """InputError where the store knows no such site."""
    return _only(session.rows("SELECT id FROM site WHERE name = ?", name), f"there is no site {name!r}")


def run_id(session: Session, site: int, name: str) -> int:
    """InputError where the site has no such run."""
    found = session.rows("SELECT id FROM run WHERE site = ? AND name = ?", site, name)
    return _only(found, f"there is no run {name!r}")


def place_id(session: Session, site: int, code: str) -> int:
    """InputError where the site has no such place."""
    found = session.rows("SELECT id FROM place WHERE site = ? AND code = ?", site, code)
    return _only(found, f"there is no place {code!r}")


def sites(session: Session) -> list[dict[str, Any]]:
    """Every site by name."""
    return [{"site": name} for (name,) in session.rows("SELECT name FROM site ORDER BY name")]


def stock(
    session: Session, site: int, after: str, limit: int, state: LocationState | None = None
) -> list[dict[str, Any]]:
    """Places by code, as each stands."""
    where, values = ("", ()) if state is None else (" AND state = ?", (state.value,))
    rows = session.rows(
        f"{_STOCK} WHERE place.site = ?{where} AND place.code > ? ORDER BY place.code LIMIT ?",
        site, *values, after, limit,
    )  # fmt: skip
    names = ("location", "node", "state", "texts", "utc_ns", "run", "confidence", "evidence", "pallets_deep",
             "undecided", "printed")  # fmt: skip
    return [{**_document(names, row[:-1]), "fill": fill_shown(row[-1])} for row in rows]


def differences(session: Session, run: int, after: str, limit: int) -> list[dict[str, Any]]:
    """What a run found otherwise than the counts before it, by place."""
    names = ("location", "change", "utc_ns", "state", "texts", "before_run", "before_utc_ns", "before_state",
             "before_texts")  # fmt: skip
    return [_document(names, row) for row in session.rows(_DIFFERENCES, run, after, limit)]


def history(session: Session, place: int, after: Mark | None, limit: int) -> list[dict[str, Any]]:
    """Every look at a place, newest first, pending and withdrawn ones too."""
    mark = after or _END
    rows = session.rows(
        f"{_LOOKS} WHERE observation.place = ? AND observation.utc_ns <= ?"
        " AND (observation.utc_ns, observation.id) < (?, ?)"
        " ORDER BY observation.utc_ns DESC, observation.id DESC LIMIT ?",
        place, mark.utc_ns, mark.utc_ns, mark.id, limit,
    )  # fmt: skip
    return [_look(row) for row in rows]


def looks_of_run(session: Session, run: int, after: Mark | None, limit: int) -> list[dict[str, Any]]:
    """Every look of a run, oldest first."""
    mark = after or Mark(0, b"")
    rows = session.rows(
        f"{_LOOKS} WHERE observation.run = ?"
        " AND observation.utc_ns BETWEEN ? AND (SELECT ended_ns FROM run WHERE id = ?)"
        " AND (observation.utc_ns, observation.id) > (?, ?)"
        " ORDER BY observation.utc_ns, observation.id LIMIT ?",
        run, mark.utc_ns, run, mark.utc_ns, mark.id, limit,
    )  # fmt: skip
    return [_look(row) for row in rows]


def runs(session: Session, site: int, after: str, limit: int) -> list[dict[str, Any]]:
    """The runs of a site, newest first; `after` is the name of the last one of the page before."""
    began_ns, identity = (1 << 63) - 1, 0
    if after:
        found = session.rows("SELECT began_ns, id FROM run WHERE site = ? AND name = ?", site, after)
        if not found:
            raise InputError(f"there is no run {after!r}")
        began_ns, identity = found[0]
    rows = session.rows(
        "SELECT name, began_ns, ended_ns, looks FROM run WHERE site = ? AND (began_ns, id) < (?, ?)"
        " ORDER BY began_ns DESC, id DESC LIMIT ?",
        site, began_ns, identity, limit,
    )  # fmt: skip
    return [_document(("run", "began_ns", "ended_ns", "looks"), row) for row in rows]


def flights(session: Session, site: int, after: Mark | None, limit: int) -> list[dict[str, Any]]:
    """The flights of a site, newest first."""
    mark = after or _END
    rows = session.rows(
        "SELECT began_ns, id, drone, duration_s, mission, outcome, reason, verdict, nodes_planned,"
        " nodes_visited FROM flight WHERE site = ? AND (began_ns, id) < (?, ?)"
        " ORDER BY began_ns DESC, id DESC LIMIT ?",
        site, mark.utc_ns, mark.id, limit,
    )  # fmt: skip
    names = ("utc_ns", "id", "drone", "duration_s", "mission", "outcome", "reason", "verdict",
             "nodes_planned", "nodes_visited")  # fmt: skip
    return [_document(names, row) for row in rows]


def decisions(session: Session, site: int, code: str, limit: int) -> list[dict[str, Any]]:
    """What people decided about a place, newest first."""
    rows = session.rows(
        "SELECT utc_ns, seen_ns, what, who, note FROM decision WHERE site = ? AND code = ?"
        " ORDER BY utc_ns DESC, id DESC LIMIT ?",
        site, code, limit,
    )  # fmt: skip
    return [_document(("utc_ns", "seen_utc_ns", "what", "who", "note"), row) for row in rows]


def questions(session: Session, site: int, after: Mark | None, limit: int) -> list[dict[str, Any]]:
    """What was asked of places, newest first; `answered_ns` is of the look that answers, None of none."""
    mark = after or _END
    rows = session.rows(
        "SELECT question.utc_ns, question.id, code, who, reason, reference, coalesce(answered_ns,"
        " CASE WHEN place.utc_ns > question.utc_ns THEN place.utc_ns END), nullif(file, '') FROM question"
        " JOIN place ON place.id = question.place WHERE question.site = ?"
        " AND (question.utc_ns, question.id) < (?, ?)"
        " ORDER BY question.utc_ns DESC, question.id DESC LIMIT ?",
        site, mark.utc_ns, mark.id, limit,
    )  # fmt: skip
    names = ("utc_ns", "id", "location", "who", "reason", "reference", "answered_ns", "file")
    return [_document(names, row) for row in rows]


def _only(found: list[Row], otherwise: str) -> int:
    if not found:
        raise InputError(otherwise)
    return int(found[0][0])


def _document(names: tuple[str, ...], row: Row) -> dict[str, Any]:
    document = {}
    for name, value in zip(names, row, strict=True):
        shown = json.loads(value) if name.endswith(("texts", "undecided", "printed")) else value
        document[name] = value.hex() if isinstance(value, bytes) else shown
    return document


def _look(row: Row) -> dict[str, Any]:
    utc_ns, identity, code, run, state, confidence, standing, node, x_m, y_m, height_m, yaw_rad, *rest = row
    evidence, reads, fill, undecided, printed, again = rest
    return {
        "id": identity.hex(),
        "utc_ns": utc_ns,
        "location": code,
        "run": run,
        "state": state,
        "confidence": confidence,
        "standing": ("pending", "confirmed", "withdrawn")[standing],
        "pose": None
        if node is None
        else {"node": node, "x_m": x_m, "y_m": y_m, "height_m": height_m, "yaw_rad": yaw_rad},
        "evidence": None if evidence is None else evidence.hex(),
        "fill": fill_shown(fill),
        "reads": [
            {"symbology": s, "text": text, "checksum": bool(sure), "agreeing": n, "quality": q, "gs1": gs1}
            for s, text, sure, n, q, gs1, *_ in json.loads(reads)
        ],
        "undecided": json.loads(undecided),
        "printed": json.loads(printed),
        "again": bool(again),
    }
