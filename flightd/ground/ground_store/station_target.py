"""The store of a ground station, from elsewhere: drones deliver over HTTPS, by keys of scope `deliver`."""

from __future__ import annotations

import http.client
import urllib.error
import urllib.request
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.batch import Batch, Receipt
from flightd.ground.ground_store.http_address import http_host, way_lost

_WAIT_S = 30.0
_MOST_ANSWER_BYTES = 1 << 20
_T = TypeVar("_T")


class StationTarget:
    """A `Target` at `https://HOST:PORT`; certificates are checked as the system has it.

    UnavailableError where the station, or with this key its store, cannot be had, InputError for what it
    refuses of what is sent."""

    def __init__(self, url: str, key: str) -> None:
        """InputError for an address that would send the key in the open, and without a key."""
        self.shown = http_host(url, f"--store {url}", "not a station")
        if not key:
            raise InputError(
                "a station asks for a key",
                key="FLIGHTD_STORE_KEY",
                remedy="set it to one of: flightd ground keys make NAME --scope deliver",
            )
        self._key = key
        self._opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), NoRedirect())

    def standings(self, looks: Sequence[str]) -> dict[str, int]:
        return self._ask("/standings", msgspec.json.encode({"names": looks}), dict[str, int])

    def printed_texts(self, looks: Sequence[str]) -> dict[str, str]:
        return self._ask("/printed-texts", msgspec.json.encode({"names": looks}), dict[str, str])

    def missing_pictures(self, names: Sequence[str]) -> set[str]:
        return self._ask("/missing-pictures", msgspec.json.encode({"names": names}), set[str])

    def keep_picture(self, jpeg: bytes) -> str:
        return self._ask("/pictures", jpeg, dict[str, str], "image/jpeg").get("name", "")

    def take(self, batch: Batch) -> Receipt:
        return self._ask("", msgspec.json.encode(batch), Receipt)

    def _ask(self, way: str, body: bytes, kind: type[_T], content: str = "application/json") -> _T:
        request = urllib.request.Request(  # noqa: S310 - http and https alone
            f"{self.shown}/api/v1/deliveries{way}",
            body,
            {"Authorization": f"Bearer {self._key}", "Content-Type": content},
        )
        try:
            with self._opener.open(request, timeout=_WAIT_S) as answer:
                return msgspec.json.decode(answer.read(_MOST_ANSWER_BYTES), type=kind)
        except urllib.error.HTTPError as err:
            why = _refusal(err)
            refused = UnavailableError if err.code in {401, 403} or err.code >= 500 else InputError
            raise refused(f"the station answers: {why}", file=self.shown) from None
        except (OSError, http.client.HTTPException) as err:
            raise UnavailableError(f"the station cannot be had: {way_lost(err)}", file=self.shown) from None
        except msgspec.DecodeError as err:
            raise UnavailableError(f"the station cannot be had: {err}", file=self.shown) from None


class NoRedirect(urllib.request.HTTPRedirectHandler):
    """What is sent goes to whom was named and to nobody else."""

    def redirect_request(self, *_: Any) -> None:
        return None


def _refusal(err: urllib.error.HTTPError) -> str:
    try:
        return str(msgspec.json.decode(err.read(_MOST_ANSWER_BYTES), type=dict[str, Any])["refused"])
    except (OSError, http.client.HTTPException, KeyError, msgspec.DecodeError):
        return f"HTTP {err.code}"
