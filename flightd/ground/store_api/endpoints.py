"""What a program can read of the store: each endpoint once, for the routes and the document about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from flightd.core.inventory import LocationState
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.store import GroundStore

LIMIT, MOST = 100, 1000
"""Rows of a page."""
MOST_CHARS, MOST_QUESTIONS = 200, 1000
"""Of a text that is asked with; of one request."""
MOST_QUESTION_BYTES = 4 << 20
PLAIN_CHARS = r"[^\x00-\x1f]*"
"""No control characters."""
Rows: TypeAlias = list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Parameter:
    """Of a question; `kind` is `text`, `number`, `state` or `mark` (where the page before it ended)."""

    name: str
    kind: str
    meaning: str
    needed: bool = False


@dataclass(frozen=True, slots=True)
class Endpoint:
    """`rows` answers with a page from parameters that were read.  `after` names the field of the last row by
    which the next page is asked for: "" where all fits on one, `mark` where it is time and id."""

    path: str
    summary: str
    parameters: tuple[Parameter, ...]
    rows: Callable[[GroundStore, Mapping[str, Any]], Rows]
    fields: Mapping[str, str]
    after: str = ""


_SITE = Parameter("site", "text", "Name of the site.", needed=True)
_LOCATION = Parameter("location", "text", "Code of the place.", needed=True)
_RUN = Parameter("run", "text", "Name of the run.", needed=True)
_LIMIT = Parameter("limit", "number", f"Rows of a page, 1 to {MOST}; {LIMIT} unless given.")
_AFTER = Parameter("after", "text", "`next` of the page before.")
_AFTER_MARK = Parameter("after", "mark", "`next` of the page before.")
_LOOK_FIELDS = {
    "id": "string", "utc": "time", "location": "string", "run": "string", "state": "state",
    "confidence": "number", "standing": "string", "pose": "object?", "evidence": "string?", "fill": "fill?",
    "reads": "array", "undecided": "array", "printed": "array", "again": "boolean",
}  # fmt: skip

ENDPOINTS: Sequence[Endpoint] = (
    Endpoint("/sites", "Every site.", (), lambda store, _: store.sites(), {"site": "string"}),
    Endpoint(
        "/stock",
        "Places of a site by code, each as its newest confirmed look says.",
        (_SITE, Parameter("state", "state", "Only places in this state."), _AFTER, _LIMIT),
        lambda store, p: store.stock(p["site"], p["after"] or "", p["limit"], p["state"]),
        {
            "location": "string", "node": "string", "state": "state", "texts": "texts", "utc": "time?",
            "run": "string?", "confidence": "number?", "evidence": "string?", "pallets_deep": "number",
            "fill": "fill?", "undecided": "array", "printed": "array",
        },
        "location",
    ),
    Endpoint(
        "/history",
        "Every look at a place, newest first; pending and withdrawn ones, too.",
        (_SITE, _LOCATION, _AFTER_MARK, _LIMIT),
        lambda store, p: store.history(p["site"], p["location"], p["after"], p["limit"]),
        _LOOK_FIELDS,
        "mark",
    ),
    Endpoint(
        "/runs",
        "The runs of a site, newest first.",
        (_SITE, _AFTER, _LIMIT),
        lambda store, p: store.runs(p["site"], p["after"] or "", p["limit"]),
        {"run": "string", "began": "time", "ended": "time", "looks": "integer"},
        "run",
    ),
    Endpoint(
        "/differences",
        "What a run found otherwise than the newest earlier run that counted the place.",
        (_SITE, _RUN, _AFTER, _LIMIT),
        lambda store, p: store.differences(p["site"], p["run"], p["after"] or "", p["limit"]),
        {
            "location": "string", "change": "change", "utc": "time", "state": "state", "texts": "texts",
            "before_run": "string", "before_utc": "time", "before_state": "state", "before_texts": "texts",
        },
        "location",
    ),
    Endpoint(
        "/observations",
        "Every look of a run, oldest first.",
        (_SITE, _RUN, _AFTER_MARK, _LIMIT),
        lambda store, p: store.looks(p["site"], p["run"], p["after"], p["limit"]),
        _LOOK_FIELDS,
        "mark",
    ),
    Endpoint(
        "/flights",
        "The flights of a site, newest first.",
        (_SITE, _AFTER_MARK, _LIMIT),
        lambda store, p: store.flights(p["site"], p["after"], p["limit"]),
        {
            "id": "string", "utc": "time", "drone": "string", "duration_s": "number?", "mission": "string",
            "outcome": "string", "reason": "string", "verdict": "string", "nodes_planned": "integer?",
            "nodes_visited": "integer?",
        },
        "mark",
    ),
    Endpoint(
        "/decisions",
        "What people decided about a place, newest first.",
        (_SITE, _LOCATION, _LIMIT),
        lambda store, p: store.decisions(p["site"], p["location"], p["limit"]),
        {"utc": "time", "seen_utc": "time", "what": "string", "who": "string", "note": "string"},
    ),
    Endpoint(
        "/questions",
        "What other programs ask of places, newest first.",
        (_SITE, _AFTER_MARK, _LIMIT),
        lambda store, p: store.questions(p["site"], p["after"], p["limit"]),
        {
            "id": "string", "utc": "time", "location": "string", "who": "string", "reason": "string",
            "reference": "string", "answered": "time?", "file": "string?",
        },
        "mark",
    ),
)  # fmt: skip

STATES = tuple(state.value for state in LocationState)


def mark_of(row: Mapping[str, Any]) -> str:
    """Where a page ends that has this row last."""
    return str(Mark(row["utc_ns"], bytes.fromhex(row["id"])))
