"""What stands before every request: which page it may come from, and what a browser may do with the answer.
Who asks is the gate's matter (`access`).

A page of another origin can neither read nor command.  The name in `Host` must be this machine's own, so
that no foreign name can be pointed here (DNS rebinding); a WebSocket and an act need an `Origin` that is
ours, or a program's key, which no page of another origin can send; and what costs work (`/api/`) is answered
to no link or picture in another site's page, which sends no `Origin` and could keep the station busy.  The
answers forbid everything that is not our own: no inline script or style, no foreign host, no frame.
"""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Iterable, MutableMapping
from dataclasses import dataclass
from typing import Any

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
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), serial=(), usb=()",
    "Cache-Control": "private, no-cache",
}
"""On every answer that does not say otherwise itself."""
STRICT_TRANSPORT = "max-age=31536000"
"""Under TLS: from now on no browser comes without.  Other stations of the domain answer for themselves."""
_HOST = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:(?P<port>\d{1,5}))?")


@dataclass(frozen=True, slots=True)
class Hosts:
    """How a browser may name the station in `Host`: by `names`, lower case, `*.` for one label of any kind;
    with `by_address` by any address, too, for to an address no foreign name leads."""

    names: frozenset[str]
    port: int
    secure: bool = False
    by_address: bool = False

    @property
    def scheme(self) -> str:
        return "https" if self.secure else "http"

    def take(self, host: str) -> bool:
        found = _HOST.fullmatch(host.lower())
        if found is None or int(found["port"] or (443 if self.secure else 80)) != self.port:
            return False
        name = found["name"]
        if name in self.names or f"*.{name.partition('.')[2]}" in self.names:
            return True
        return self.by_address and _is_address(name)


def own_hosts(
    listen_host: str, port: int, secure: bool = False, names: Iterable[str] = (), beyond: bool = False
) -> Hosts:
    """The names of a station that listens there; `names` are those in its certificate, `beyond`: others
    reach it."""
    listens = f"[{listen_host}]" if ":" in listen_host else listen_host.lower()
    found = {"127.0.0.1", "localhost", "[::1]", listens, *names}
    if beyond:
        machine = socket.gethostname().lower()
        found |= {machine, f"{machine.partition('.')[0]}.local"}
    return Hosts(frozenset(found), port, secure, beyond)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True


class Guard:
    """ASGI middleware: refuses what does not come from our own page, and puts `HEADERS` on the answers."""

    def __init__(self, app: ASGIApp, hosts: Hosts) -> None:
        self._app = app
        self._hosts = hosts

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
                _add_headers(message, self._hosts.secure)
            await send(message)

        app: ASGIApp = PlainTextResponse(f"refused: {refusal}\n", 403) if refusal else self._app
        await app(scope, receive, guarded)

    def _refusal(self, scope: Scope) -> str:
        """Why a request is not answered; empty where nothing is against it."""
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if not self._hosts.take(host):
            return "this station is not called that"
        site = headers.get("sec-fetch-site", "same-origin")
        if scope["path"].startswith("/api/") and site not in _OURS:
            return "another site"
        reads = scope["type"] == "http" and scope["method"] in {"GET", "HEAD"}
        origin = headers.get("origin")
        if origin is None:
            bears_key = headers.get("authorization", "").lower().startswith("bearer ")
            return "" if reads or bears_key else "an act needs the Origin of the station's own page"
        if origin != f"{self._hosts.scheme}://{host}":
            return "another origin"
        return "" if site in _OURS else "another site"


def _add_headers(message: MutableMapping[str, Any], secure: bool) -> None:
    headers = MutableHeaders(scope=message)
    if secure:
        headers["Strict-Transport-Security"] = STRICT_TRANSPORT
    for name, value in HEADERS.items():
        headers.setdefault(name, value)
