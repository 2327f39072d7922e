"""A service that answers JSON over HTTP: each question ends with an answer of the form that was asked for, or
with an error that says in one line what was the matter and what to do."""

from __future__ import annotations

import http.client
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec

from flightd.core.errors import FlightdError, UnavailableError
from flightd.ground.ground_store.http_address import http_host
from flightd.ground.ground_store.station_target import NoRedirect

MOST_ANSWER_BYTES = 32 << 20
_MOST_REFUSAL_BYTES = 1 << 20
_PART_BYTES = 65_536
_MOST_SHOWN = 300
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Refusal:
    """An answer that is none: its HTTP status, what it says in a line ("" where that is no JSON, but a page
    for people), and what was asked."""

    status: int
    said: str
    way: str


@dataclass(frozen=True, slots=True)
class JsonService:
    """`name` is what people call it; `headers` go with each question, and with nothing else; `refused` makes
    an error of a refusal."""

    name: str
    url: str
    headers: Mapping[str, str]
    timeout_s: float
    message_key: str
    refused: Callable[[Refusal], FlightdError]

    def ask(self, way: str, kind: type[_T], body: object = None, *, changes: bool = False) -> _T:
        """The answer to a GET, or to a POST of the `body`.  `changes`: that could change something there.

        UnavailableError where none came, or half of one; what `refused` says of a refusal."""
        data = None if body is None else msgspec.json.encode(body)
        sent = dict(self.headers) | (
            {} if data is None else {"Content-Type": "application/json; charset=utf-8"}
        )
        request = urllib.request.Request(f"{self.url}{way}", data, sent)  # noqa: S310 - http and https alone
        opener = urllib.request.build_opener(NoRedirect())
        before_s = time.monotonic() + self.timeout_s
        try:
            with opener.open(request, timeout=self.timeout_s) as answer:
                whole = _whole(answer, before_s, MOST_ANSWER_BYTES)
        except urllib.error.HTTPError as err:
            with err:
                raise self.refused(Refusal(err.code, self._said(err, before_s), way)) from None
        except (OSError, http.client.HTTPException) as err:
            raise self._lost(err, changes=changes) from None
        return self._decoded(way, whole, kind)

    def _decoded(self, way: str, whole: bytes, kind: type[_T]) -> _T:
        try:
            return msgspec.json.decode(whole, type=kind)
        except msgspec.ValidationError as err:
            raise UnavailableError(
                f"{self.name} answers {way} otherwise than it is documented: {err}",
                file=self.url,
                remedy="is its version one that the guide names?",
            ) from None
        except msgspec.DecodeError:
            is_page = whole.lstrip()[:1] == b"<"
            raise UnavailableError(
                f"{self.name} answers {way} with {'a web page' if is_page else 'something'} that is no JSON",
                file=self.url,
                remedy="is that its own address, with no sign-in or proxy before it?",
            ) from None

    def _lost(self, err: Exception, *, changes: bool) -> FlightdError:
        reason = getattr(err, "reason", None) or err
        if isinstance(reason, TimeoutError):
            what = f"{self.name} did not answer within {self.timeout_s:g} s"
        elif isinstance(err, http.client.HTTPException):
            what = f"the answer of {self.name} broke off"
        else:
            what = f"{self.name} cannot be had: {getattr(reason, 'strerror', None) or reason}"
        again = "it may have been done there: run the command again, which books nothing twice"
        return UnavailableError(what, file=self.url, remedy=again if changes else "try again later")

    def _said(self, err: urllib.error.HTTPError, before_s: float) -> str:
        try:
            told = msgspec.json.decode(_whole(err, before_s, _MOST_REFUSAL_BYTES), type=dict[str, Any])
        except (OSError, http.client.HTTPException, msgspec.DecodeError):
            return ""
        return " ".join(str(told.get(self.message_key, "")).split())[:_MOST_SHOWN]


def checked_url(url: str, key: str) -> str:
    """InputError for what is no address of a service, or would send a key in the open."""
    return http_host(url, key, f"{url} is no address of a service")


def _whole(answer: Any, before_s: float, most: int) -> bytes:
    """All of a body.  HTTPException where it breaks off or has no end, TimeoutError where it drips."""
    parts: list[bytes] = []
    size = 0
    while part := answer.read1(_PART_BYTES):
        parts.append(part)
        size += len(part)
        if size > most:
            raise http.client.HTTPException(f"more than {most} bytes")
        if time.monotonic() > before_s:
            raise TimeoutError
    if getattr(answer, "length", None):
        raise http.client.IncompleteRead(b"", answer.length)
    return b"".join(parts)
