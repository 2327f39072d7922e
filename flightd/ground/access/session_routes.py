"""The way in and out, and the audit: what the pages Sign in and the head ask for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.adapters.ground_link.protocol import DECODE_ERRORS
from flightd.core.errors import FlightdError, InputError
from flightd.ground.access.access import ABSOLUTE_S, Access
from flightd.ground.access.attempts import TooManyAttemptsError
from flightd.ground.access.audit import newest_entries
from flightd.ground.access.gate import address_of
from flightd.ground.access.passwords import MOST_CHARS
from flightd.ground.json_http import as_json, is_json, json_body, status_of
from flightd.ground.shown_text import shown

_SHOWN = 500
_COOKIE_S = int(ABSOLUTE_S) + 3600
"""Beyond the session, whose end is the station's matter: by it is known who stops a flight beyond it."""


class SignIn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the page Sign in sends."""

    name: Annotated[str, Meta(min_length=1, max_length=60)]
    password: Annotated[str, Meta(min_length=1, max_length=MOST_CHARS)]


_decode: Callable[[bytes], SignIn] = msgspec.json.Decoder(SignIn).decode


def session_routes(access: Access) -> list[BaseRoute]:
    """Who am I, sign in, sign out; and the audit's newest lines."""
    return [
        Route("/api/session", partial(_told, access), methods=["GET"]),
        Route("/api/session", partial(_sign_in, access), methods=["POST"]),
        Route("/api/session", partial(_sign_out, access), methods=["DELETE"]),
        Route("/api/audit", partial(_audit, access.state), methods=["GET"]),
    ]


async def _told(access: Access, request: Request) -> Response:
    return as_json(access.session_state(access.identify(request.scope)))


async def _sign_in(access: Access, request: Request) -> Response:
    address, held = address_of(request.scope), access.token_of(request.headers)
    if not access.login:
        return as_json({"refused": "this station asks nobody who he is"}, 409)
    if not is_json(request):
        return as_json({"refused": "who signs in says so as JSON"}, 415)
    try:
        said = _read(await json_body(request, "a sign-in"))
        signed_in = await access.sign_in(said.name, said.password, address, held)
    except TooManyAttemptsError as err:
        return as_json({"refused": str(err)}, 429, {"Retry-After": str(err.wait_s)})
    except FlightdError as err:
        return as_json({"refused": str(err)}, status_of(err, 400))
    name = access.known_name(said.name)
    if signed_in is None:
        access.write_down(None, address, "sign in", name, outcome="refused", text="name or password is wrong")
        return as_json({"refused": "name or password is wrong"}, 401)
    token, who = signed_in
    if token != held:
        await access.sign_out(access.session_of(request.headers))  # the one that this browser had before
    access.write_down(who, address, "sign in", name, outcome="accepted")
    answer = as_json(access.session_state(who))
    _set_cookie(access, answer, token, _COOKIE_S)
    return answer


async def _sign_out(access: Access, request: Request) -> Response:
    who = access.identify(request.scope)
    if who is not None and who.by == "password":
        await access.sign_out(who.session)
        access.write_down(who, address_of(request.scope), "sign out", who.name, outcome="accepted")
    answer = as_json(access.session_state(None))
    answer.headers["Clear-Site-Data"] = '"cache"'  # pictures that the browser has kept
    _set_cookie(access, answer, "", 0)
    return answer


async def _audit(state: Path, _request: Request) -> Response:
    try:
        entries = await asyncio.to_thread(newest_entries, state, _SHOWN)
    except FlightdError as err:
        return as_json({"refused": shown(str(err))}, status_of(err))
    return as_json({"entries": entries})


def _set_cookie(access: Access, answer: Response, token: str, age_s: int) -> None:
    answer.set_cookie(
        access.cookie, token, max_age=age_s, path="/", secure=access.secure, httponly=True, samesite="strict"
    )


def _read(body: bytes) -> SignIn:
    try:
        return _decode(body)
    except DECODE_ERRORS as err:
        raise InputError(f"not a sign-in: {err}") from None
