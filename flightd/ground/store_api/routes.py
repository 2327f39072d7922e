"""The store's endpoints as routes of the station."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.core.inventory import LocationState
from flightd.core.utc_time import utc_text
from flightd.ground.access.gate import identity_of, note_act
from flightd.ground.bounded import Threads
from flightd.ground.ground_store.batch import MOST_BATCH_BYTES, Batch
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.questions import Question
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.json_http import AnswerTo, as_json, json_body, or_refused, refusal, said
from flightd.ground.store_api.endpoints import (
    ENDPOINTS,
    LIMIT,
    MOST,
    MOST_CHARS,
    MOST_QUESTION_BYTES,
    MOST_QUESTIONS,
    PLAIN_CHARS,
    STATES,
    Endpoint,
    Parameter,
    mark_of,
)
from flightd.ground.store_api.openapi import document
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES

PREFIX = "/api/v1"
_AT_ONCE, _MOST_WAITING = 3, 32
_Names = Annotated[list[Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]], Meta(max_length=1000)]


class Asked(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Of which looks, or pictures, is asked."""

    names: _Names


_Text = Annotated[str, Meta(max_length=MOST_CHARS, pattern=rf"^{PLAIN_CHARS}\Z")]


class AskedOf(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A place, and why somebody wants to know what lies there; the reference is the asker's own."""

    location: _Text
    reason: _Text = ""
    reference: _Text = ""


class NewQuestions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Of places of a site."""

    site: _Text
    questions: Annotated[list[AskedOf], Meta(min_length=1, max_length=MOST_QUESTIONS)]


def store_routes(store: GroundStore | None) -> list[BaseRoute]:
    """None without a store."""
    if store is None:
        return []
    threads = Threads(_AT_ONCE, _MOST_WAITING, "too many questions to the store wait already")
    told = document()

    async def openapi(_: Request) -> Response:
        return as_json(told)

    async def picture(request: Request) -> Response:
        jpeg = await threads.run(store.evidence.picture, request.path_params["name"])
        return Response(
            jpeg, headers={"Cache-Control": "private, immutable, max-age=86400"}, media_type="image/jpeg"
        )

    async def ask(request: Request) -> Response:
        new = await said(request, NewQuestions, "questions", MOST_QUESTION_BYTES)
        questions = [Question(one.location, one.reason, one.reference) for one in new.questions]
        who = identity_of(request).name
        unknown = await threads.run(store.ask, new.site, who, questions)
        asked = sum(one.location not in unknown for one in questions)
        note_act(request, f"asked {asked} of {new.site}")
        return as_json({"asked": asked, "unknown": unknown})

    return [
        Route(f"{PREFIX}/openapi.json", openapi, methods=["GET"]),
        *(Route(PREFIX + one.path, _answer(store, threads, one), methods=["GET"]) for one in ENDPOINTS),
        Route(f"{PREFIX}/pictures/{{name}}", or_refused(picture), methods=["GET"]),
        Route(f"{PREFIX}/questions", or_refused(ask), methods=["POST"]),
        *_delivery_routes(store, threads),
    ]


def _delivery_routes(store: GroundStore, threads: Threads) -> list[BaseRoute]:
    async def standings(request: Request) -> Response:
        asked = await said(request, Asked, "a question about looks", MOST_BATCH_BYTES)
        return as_json(await threads.run(store.standings, asked.names))

    async def printed(request: Request) -> Response:
        asked = await said(request, Asked, "a question about looks", MOST_BATCH_BYTES)
        return as_json(await threads.run(store.printed_texts, asked.names))

    async def missing(request: Request) -> Response:
        asked = await said(request, Asked, "a question about pictures", MOST_BATCH_BYTES)
        return as_json(sorted(await threads.run(store.missing_pictures, asked.names)))

    async def keep(request: Request) -> Response:
        jpeg = await json_body(request, "a picture", MOST_BYTES)
        if not jpeg.startswith(b"\xff\xd8"):
            raise InputError("not a JPEG")
        return as_json({"name": await threads.run(store.keep_picture, jpeg)})

    async def take(request: Request) -> Response:
        batch = await said(request, Batch, "a batch", MOST_BATCH_BYTES)
        return as_json(await threads.run(store.take, batch))

    ways: dict[str, AnswerTo] = {
        "": take, "/standings": standings, "/printed-texts": printed, "/missing-pictures": missing,
        "/pictures": keep,
    }  # fmt: skip
    return [
        Route(f"{PREFIX}/deliveries{way}", or_refused(answer), methods=["POST"])
        for way, answer in ways.items()
    ]


def _answer(store: GroundStore, threads: Threads, endpoint: Endpoint) -> AnswerTo:
    async def page(request: Request) -> Response:
        try:
            asked = read_parameters(endpoint, request.query_params.multi_items())
        except InputError as err:
            return refusal(str(err), 400)
        rows = await threads.run(endpoint.rows, store, asked)
        is_full = endpoint.after and len(rows) == asked.get("limit")
        last = rows[-1] if is_full else None
        after = None if last is None else mark_of(last) if endpoint.after == "mark" else last[endpoint.after]
        return as_json({"rows": [_shown(row) for row in rows], "next": after})

    return or_refused(page)


def read_parameters(endpoint: Endpoint, given: list[tuple[str, str]]) -> dict[str, Any]:
    """Each parameter as its kind says, None where it was not given.  InputError for what is wrong, missing,
    given twice, or none of them."""
    known = {parameter.name: parameter for parameter in endpoint.parameters}
    found: dict[str, Any] = dict.fromkeys(known)
    for name, text in given:
        if name not in known:
            raise InputError(f"there is no parameter {name!r}", remedy=f"known: {', '.join(known) or 'none'}")
        if found[name] is not None:
            raise InputError("given twice", key=name)
        if len(text) > MOST_CHARS or "\0" in text:
            raise InputError(f"expected up to {MOST_CHARS} characters", key=name)
        found[name] = _read(known[name], text)
    if "limit" in known and found["limit"] is None:
        found["limit"] = LIMIT
    for parameter in endpoint.parameters:
        if parameter.needed and not found[parameter.name]:
            raise InputError("is missing", key=parameter.name)
    return found


def _read(parameter: Parameter, text: str) -> Any:
    match parameter.kind:
        case "number":
            if not (text.isascii() and text.isdecimal() and 1 <= int(text[:9]) <= MOST):
                raise InputError(f"expected 1 to {MOST}", key=parameter.name)
            return int(text)
        case "state":
            if text not in STATES:
                raise InputError(f"expected {', '.join(STATES)}", key=parameter.name)
            return LocationState(text)
        case "mark":
            return Mark.read(text)
    return text


def _shown(row: Mapping[str, Any]) -> dict[str, Any]:
    """Times as text."""
    shown = {}
    for name, value in row.items():
        if name == "utc_ns" or name.endswith("_ns"):
            shown[name.removesuffix("_ns")] = None if value is None else utc_text(value)
        else:
            shown[name] = value
    return shown
