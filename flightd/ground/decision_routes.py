"""Decisions of people about places that need a look, for the page Stock."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.adapters.ground_link.protocol import DECODE_ERRORS
from flightd.core.errors import InputError, RunError
from flightd.ground.access.gate import note_act, person_of
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.json_http import as_json, is_json, json_body
from flightd.ground.stock_routes import StockAnswers, answered, told_seconds


class Said(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision as the page sends it; sent again with the same `id` it is noted once.  `seen_s` is the time
    of the look that the page shows, as it was told (UTC; None: there was none)."""

    id: Annotated[str, Meta(min_length=8, max_length=64)]
    place: Annotated[str, Meta(min_length=1, max_length=200)]
    what: Decided
    who: Annotated[str, Meta(min_length=1, max_length=60)]
    seen_s: float | None
    note: Annotated[str, Meta(max_length=500)] = ""


_decode: Callable[[bytes], Said] = msgspec.json.Decoder(Said).decode


def decision_routes(asked: StockAnswers, folder: Path | None) -> list[BaseRoute]:
    """GET them all, POST one; none without a folder to keep them in."""
    if folder is None:
        return []
    book = DecisionBook(folder)

    async def told(request: Request) -> Response:
        decisions = await asked.off_loop(book.decisions, request.query_params.get("store", ""))
        return as_json({"decisions": [_document(decision) for decision in decisions]})

    async def note(request: Request) -> Response:
        if not is_json(request):
            return as_json({"refused": "a decision is JSON"}, 415)
        said = _read(await json_body(request, "a decision"))
        view = await asked.store_view(request)
        place = next((place for place in view.places if place.code == said.place), None)
        if place is None:
            raise InputError(f"there is no place {said.place!r}")
        if (told_seconds(place.utc_ns) or 0.0) > (said.seen_s or 0.0):
            raise RunError(
                "the place was looked at again meanwhile", remedy="decide about what is shown of it now"
            )
        who = person_of(request, said.who)
        note_act(request, f"{said.what} at {said.place}")
        decision = Decision(
            said.id, said.place, time.time_ns(), place.utc_ns, said.what, who, said.note.strip()
        )
        await asked.off_loop(book.add, request.query_params.get("store", ""), decision)
        return as_json(_document(decision))

    return [
        Route("/api/stock/decisions", answered(told), methods=["GET"]),
        Route("/api/stock/decisions", answered(note), methods=["POST"]),
    ]


def _read(body: bytes) -> Said:
    try:
        said = _decode(body)
    except DECODE_ERRORS as err:
        raise InputError(f"not a decision: {err}") from None
    if not said.who.strip():
        raise InputError("not a decision: nobody made it")
    return said


def _document(decision: Decision) -> dict[str, object]:
    return {
        "place": decision.place,
        "at_s": decision.utc_ns / 1e9,
        "seen_s": told_seconds(decision.seen_ns),
        "what": decision.what.value,
        "who": decision.who,
        "note": decision.note,
    }
