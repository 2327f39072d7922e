"""Addresses that a person gives for what is sent over HTTP, and what went wrong on the way there."""

from __future__ import annotations

import http.client
from urllib.parse import SplitResult, urlsplit

from flightd.config.ground import is_loopback
from flightd.core.errors import InputError


def http_address(url: str, key: str, form: str, *, what: str, read: str) -> SplitResult:
    """The parts of an address that `key` names.  InputError that begins with `what` for one that is none,
    with its `form` as the remedy, and `read` for http:// to another machine: what others could do then."""
    try:
        parts = _parts(url)
    except ValueError as err:
        raise InputError(f"{what}: {err}", key=key, remedy=f"give {form}") from None
    if parts.scheme == "http" and not is_loopback(parts.hostname or ""):
        raise InputError(read, key=key, remedy="give https://")
    return parts


def http_host(url: str, key: str, what: str) -> str:
    """Such an address of a host alone, to which a key is sent; without a / at its end."""
    form = "https://HOST:PORT"
    parts = http_address(url, key, form, what=what, read="the key would be read on the way")
    if parts.path not in {"", "/"} or parts.query:
        raise InputError(what, key=key, remedy=f"give {form}")
    return f"{parts.scheme}://{parts.netloc}"


def _parts(url: str) -> SplitResult:
    """ValueError for what `http.client` would stumble over later, and for a password."""
    if not url.isascii() or any(char <= " " or char == "\x7f" for char in url):
        raise ValueError("it has characters that must be written as %XX there")
    parts = urlsplit(url)
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise ValueError("it has no http:// or https:// with a host")
    if parts.username is not None:
        raise ValueError("no name and password belong into it")
    if parts.port == 0:
        raise ValueError("port 0 is nobody's")
    try:
        parts.hostname.encode("idna")
    except UnicodeError:
        raise ValueError("its host is no name") from None
    return parts


def way_lost(err: OSError | http.client.HTTPException) -> str:
    """Why nothing came back, in a line."""
    if isinstance(err, OSError):
        return str(getattr(err, "reason", None) or err)
    return "the answer broke off" if isinstance(err, http.client.IncompleteRead) else "it answers no HTTP"
