"""JSON over HTTP: what a page sends, what it is answered, and the status that an error is."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TypeAlias, TypeVar

import msgspec
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from flightd.adapters.ground_link.protocol import DECODE_ERRORS
from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError
from flightd.ground.decode_words import decode_words
from flightd.ground.messages import MAX_PAGE_MESSAGE_BYTES
from flightd.ground.shown_text import shown

JSON = "application/json"
AnswerTo: TypeAlias = Callable[[Request], Awaitable[Response]]
_T = TypeVar("_T")


def as_json(value: object, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    return Response(msgspec.json.encode(value), status, headers, JSON)


def status_of(err: FlightdError, mistaken: int = 404) -> int:
    """What went wrong, as HTTP has it; `mistaken`: what was asked for or sent is wrong itself."""
    if isinstance(err, InputError):
        return mistaken
    return 503 if isinstance(err, UnavailableError | TransientError) else 409


def refusal(why: str, status: int) -> Response:
    """One line for a person."""
    return as_json({"refused": shown(why)}, status)


def or_refused(answer: AnswerTo) -> AnswerTo:
    """What goes wrong as a status and one line for a person."""

    async def guarded(request: Request) -> Response:
        try:
            return await answer(request)
        except FlightdError as err:
            mistaken = 404 if request.method in {"GET", "DELETE"} else 400
            return refusal(str(err).removeprefix("refused: "), status_of(err, mistaken))

    return guarded


def is_json(request: Request) -> bool:
    """Whether its body says that it is JSON: another site's form cannot."""
    return request.headers.get("content-type", "").partition(";")[0].strip() == JSON


async def json_body(request: Request, what: str, most: int = MAX_PAGE_MESSAGE_BYTES) -> bytes:
    """The request's body.  InputError for one that is longer than `most` bytes, which `what` names, or breaks
    off."""
    body = b""
    try:
        async for part in request.stream():
            body += part
            if len(body) > most:
                raise InputError(f"too long for {what}")
    except ClientDisconnect:
        raise InputError("it breaks off") from None
    return body


def decoded(body: bytes, kind: type[_T], what: str) -> _T:
    """The JSON `body`.  InputError for one that is not `what`."""
    try:
        return msgspec.json.decode(body, type=kind)
    except DECODE_ERRORS as err:
        raise InputError(f"not {what}: {decode_words(err)}") from None


async def said(request: Request, kind: type[_T], what: str, most: int = MAX_PAGE_MESSAGE_BYTES) -> _T:
    """What the request says in its body.  InputError for one that is not JSON, not `what`, longer than `most`
    bytes, or breaks off."""
    if not is_json(request):
        raise InputError(f"{what} is JSON", remedy="send it as Content-Type: application/json")
    return decoded(await json_body(request, what, most), kind, what)
