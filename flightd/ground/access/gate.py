"""Stands before each route: who asks, may he, and the line of the audit.

What is not allowed is refused here, whatever the page has shown."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping
from typing import TypeAlias

from starlette.requests import HTTPConnection
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from flightd.ground.access.access import Access, WrongKeyError
from flightd.ground.access.roles import Identity
from flightd.ground.access.route_roles import RULES, Line, Rule
from flightd.ground.json_http import as_json
from flightd.ground.messages import SessionState, session_message

SIGN_IN_FIRST = 4401
"""WebSocket: nobody known asks; the page offers to sign in."""
_WHO, _NOTE = "flightd.who", "flightd.note"
_READING = frozenset({"GET", "HEAD"})

Returning: TypeAlias = Callable[[Scope], Identity | None]


def gated(
    routes: Iterable[BaseRoute], access: Access, returning: Returning = lambda _: None
) -> list[BaseRoute]:
    """The routes, each behind the rule for it; `returning` says who opens a page's WebSocket after the end of
    his session, of which that route lets through what is left.  LookupError for a route without a rule."""
    return [_gated(route, access, returning) for route in routes]


def identity_of(connection: HTTPConnection) -> Identity:
    """Who asks, behind a gate that has let him pass."""
    who: Identity = connection.scope[_WHO]
    return who


def person_of(connection: HTTPConnection, typed: str) -> str:
    """Who is written down for an act: who signed in; only where nobody does, the name that was typed."""
    who = identity_of(connection)
    return typed.strip() if who.by == "local" else who.name


def note_act(connection: HTTPConnection, words: str) -> None:
    """What the audit's line is to say of this act, besides method, path and status."""
    connection.scope[_NOTE].append(words)


def address_of(scope: Scope) -> str:
    """Where a request comes from."""
    client = scope.get("client")
    return str(client[0]) if client else ""


def _gated(route: BaseRoute, access: Access, returning: Returning) -> BaseRoute:
    if isinstance(route, Route):
        methods = (route.methods or set()) - {"HEAD"}
        rules = {method: _rule(f"{method} {route.path}") for method in methods}
        if "GET" in rules:
            rules["HEAD"] = rules["GET"]
        if not rules:
            raise LookupError(f"{route.path}: it takes every method; name those that it has")
    elif isinstance(route, WebSocketRoute):
        rules = {"WEBSOCKET": _rule(f"WEBSOCKET {route.path}")}
    elif isinstance(route, Mount):
        rule = _rule(f"MOUNT {route.path}")
        rules = dict.fromkeys(_READING, rule)
    else:
        raise TypeError(f"no role can be set for {route!r}")
    route.app = _Gate(route.app, access, rules, returning)
    return route


def _rule(of: str) -> Rule:
    rule = RULES.get(of)
    if rule is None:
        raise LookupError(f"no role is set for {of}: add it to route_roles.py")
    return rule


class _Gate:
    def __init__(self, app: ASGIApp, access: Access, rules: Mapping[str, Rule], returning: Returning) -> None:
        self._app = app
        self._access = access
        self._rules = rules
        self._returning = returning

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        is_socket = scope["type"] == "websocket"
        rule = self._rules.get("WEBSOCKET" if is_socket else scope["method"])
        if rule is None:
            await _refuse(scope, receive, send, 405, "nothing can be done so here")
            return
        try:
            who = self._access.identify(scope)
        except WrongKeyError as err:
            await _refuse(scope, receive, send, 401, str(err))
            return
        if who is None and is_socket:
            who = self._returning(scope)
        if rule.role is not None:
            if who is None:
                await (_turn_away(receive, send) if is_socket else _ask_who(scope, receive, send))
                return
            if why := _lacks(who, rule):
                if rule.line is not Line.NONE:
                    self._write_down(scope, who, "refused", why)
                await _refuse(scope, receive, send, 403, why)
                return
        scope[_WHO], scope[_NOTE] = who, []
        if rule.line is not Line.ACT:
            await self._app(scope, receive, send)
            return
        status = 500

        async def noting(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, noting)
        finally:
            self._write_down(scope, who, "accepted" if status < 400 else "refused", f"HTTP {status}")

    def _write_down(self, scope: Scope, who: Identity | None, outcome: str, text: str) -> None:
        method = scope.get("method", "WEBSOCKET")
        notes = "; ".join([*scope.get(_NOTE, ()), text])
        self._access.write_down(
            who, address_of(scope), method, scope["path"][:200], outcome=outcome, text=notes[:500]
        )


def _lacks(who: Identity, rule: Rule) -> str:
    """What is missing to somebody, as a line; "" where he may."""
    if who.scopes is not None:
        if rule.scope in who.scopes:
            return ""
        needed = "is not for keys with scopes" if rule.scope is None else f"needs the scope {rule.scope}"
        return f"this {needed}; {who.name} has {', '.join(sorted(who.scopes))}"
    if rule.role is not None and not who.role.covers(rule.role):
        return f"this needs the role {rule.role}; {who.name} has the role {who.role}"
    return ""


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, why: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": why[:120]})  # HTTP 403
        return
    await as_json({"refused": why}, status)(scope, receive, send)


async def _ask_who(scope: Scope, receive: Receive, send: Send) -> None:
    headers = {"WWW-Authenticate": "Bearer"}
    await as_json({"refused": "sign in first"}, 401, headers)(scope, receive, send)


async def _turn_away(receive: Receive, send: Send) -> None:
    """A page's script is told nothing of a handshake that fails: so the socket opens, says why, closes."""
    await receive()
    await send({"type": "websocket.accept"})
    with contextlib.suppress(RuntimeError):  # it has closed by itself meanwhile
        await send({"type": "websocket.send", "text": session_message(SessionState(login=True))})
        await send({"type": "websocket.close", "code": SIGN_IN_FIRST, "reason": "sign in first"})
