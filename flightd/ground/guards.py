"""What stands before every request: who it may come from, and what a browser may do with the answer.

A page of another origin can neither read nor command.  The name in `Host` must be this machine's own, so
that no foreign name can be pointed here (DNS rebinding); a WebSocket and an act need an `Origin` that is
ours; and what costs work (`/api/`) is answered to no link or picture in another site's page, which sends no
`Origin` and could keep the station busy.  The answers forbid everything that is not our own: no inline
script or style, no foreign host, no frame.
"""

from __future__ import annotations

from collections.abc import Iterable, MutableMapping
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_OURS = frozenset({"same-origin", "none"})
"""Of `Sec-Fetch-Site`: our own page, or a person (a bookmark, the address line)."""
HEADERS = {
    "Content-Security-Policy": _POLICY,
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-cache",
}
"""On every answer that does not say otherwise itself."""


def own_hosts(listen_host: str, port: int) -> frozenset[str]:
    """How a browser on this machine may name the station in `Host`."""
    names = {"127.0.0.1", "localhost", "[::1]", f"[{listen_host}]" if ":" in listen_host else listen_host}
    return frozenset({f"{name}:{port}" for name in names} | (names if port == 80 else set()))


class Guard:
    """ASGI middleware: refuses what does not come from our own page, and puts `HEADERS` on the answers."""

    def __init__(self, app: ASGIApp, hosts: Iterable[str]) -> None:
        self._app = app
        self._hosts = frozenset(hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if scope["type"] == "websocket":
            if refusal:
                await receive()
                await send({"type": "websocket.close", "code": 1008, "reason": refusal})  # HTTP 403
            else:
                await self._app(scope, receive, send)
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                _add_headers(message)
            await send(message)

        app: ASGIApp = PlainTextResponse(f"refused: {refusal}\n", 403) if refusal else self._app
        await app(scope, receive, guarded)

    def _refusal(self, scope: Scope) -> str:
        """Why a request is not answered; empty where nothing is against it."""
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if host not in self._hosts:
            return "this station is not called that"
        site = headers.get("sec-fetch-site", "same-origin")
        if scope["path"].startswith("/api/") and site not in _OURS:
            return "another site"
        reads = scope["type"] == "http" and scope["method"] in {"GET", "HEAD"}
        origin = headers.get("origin")
        if origin is None:
            return "" if reads else "an act needs the Origin of the station's own page"
        if origin == "null" or urlsplit(origin).netloc != host or not origin.startswith("http://"):
            return "another origin"
        return "" if site in _OURS else "another site"


def _add_headers(message: MutableMapping[str, Any]) -> None:
    headers = MutableHeaders(scope=message)
    for name, value in HEADERS.items():
        headers.setdefault(name, value)
