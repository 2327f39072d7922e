"""A webhook: every event of the store sent to somebody's address, signed, until he has taken it."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import http.client
import json
import logging
import random
import time
import urllib.error
import urllib.request
from typing import Any

from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.core.utc_time import utc_text
from flightd.ground.ground_store.events import Event
from flightd.ground.ground_store.http_address import http_address, way_lost
from flightd.ground.ground_store.station_target import NoRedirect
from flightd.ground.ground_store.store import GroundStore

_LOG = logging.getLogger(__name__)
SECRET = "FLIGHTD_WEBHOOK_SECRET"  # noqa: S105 - the name of a variable
_LEAST_SECRET = 16
_LOOK_S = 2.0
_FIRST_S, _LONGEST_S = 1.0, 300.0
_WAIT_S = 10.0
_AT_ONCE = 50


class Webhook:
    """Tells `url`; `secret` signs."""

    def __init__(self, url: str, secret: str) -> None:
        """InputError for an address at which others would read it, and for a secret that is soon guessed."""
        http_address(
            url, f"--webhook {url}", "https://HOST/PATH", what="not an address", read="others could read it"
        )
        if len(secret) < _LEAST_SECRET:
            raise InputError(
                f"a webhook is signed with a secret of {_LEAST_SECRET} characters or more", key=SECRET
            )
        self.url = url
        self._secret = secret.encode()
        self._opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), NoRedirect())

    async def run(self, store: GroundStore) -> None:
        """Until cancelled.  One that is not taken is sent again, later and later; those after it wait."""
        delay_s, failure = _FIRST_S, ""
        while True:
            try:
                more = await asyncio.to_thread(self.tell, store)
            except Exception as err:  # noqa: BLE001 - its end would be the station's
                told = str(err) if isinstance(err, FlightdError) else f"failed: {err!r}"
                if told != failure:
                    _LOG.warning("webhook %s: %s", self.url, told)
                failure = told
                await asyncio.sleep(delay_s * random.uniform(0.8, 1.2))
                delay_s = min(2.0 * delay_s, _LONGEST_S)
                continue
            delay_s, failure = _FIRST_S, ""
            if not more:
                await asyncio.sleep(_LOOK_S)

    def tell(self, store: GroundStore) -> bool:
        """Send what waits, oldest first; whether there may be more.  UnavailableError at one that is not
        taken."""
        events, dropped = store.waiting_events(self.url, _AT_ONCE)
        for event in events:
            self._send(event, dropped)
            store.event_taken(self.url, event.id)
        return len(events) == _AT_ONCE

    def _send(self, event: Event, dropped: int) -> None:
        told: dict[str, Any] = {"id": event.id, "event": event.kind, "utc": utc_text(event.utc_ns)}
        body = json.dumps({**told, "dropped": dropped, **event.body}).encode()
        stamp = str(int(time.time()))
        request = urllib.request.Request(  # noqa: S310 - http and https alone
            self.url,
            body,
            {
                "Content-Type": "application/json",
                "Flightd-Time": stamp,
                "Flightd-Signature": signature(self._secret, stamp, body),
            },
        )
        try:
            with self._opener.open(request, timeout=_WAIT_S):
                pass
        except urllib.error.HTTPError as err:
            raise UnavailableError(f"answers HTTP {err.code}") from None
        except (OSError, http.client.HTTPException) as err:
            raise UnavailableError(f"cannot be had: {way_lost(err)}") from None


def signature(secret: bytes, stamp: str, body: bytes) -> str:
    """HMAC-SHA256 of time and body: a receiver makes it itself, and takes nothing that is minutes old."""
    return hmac.new(secret, stamp.encode() + b"." + body, hashlib.sha256).hexdigest()
