"""What was counted, out of a ground station's store: asked with a key of scope `stock`, which opens nothing
else of the station."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Generic, TypeVar
from urllib.parse import urlencode

import msgspec

from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.core.inventory import LocationRecord, LocationState, Observation
from flightd.core.types import CodeRead
from flightd.vision.shelf.code_equality import code_key
from tools.odoo.connector_file import CountsSection
from tools.odoo.json_service import JsonService, Refusal, checked_url

_PAGE = 1000
_MOST_PAGES = 1000
_T = TypeVar("_T")


class Counted(msgspec.Struct, frozen=True):
    """A place as it stands by its newest confirmed look."""

    location: str
    node: str
    state: LocationState
    texts: tuple[str, ...]
    utc: datetime | None
    run: str | None
    confidence: float | None


class Decided(msgspec.Struct, frozen=True):
    """What a person said about a look."""

    seen_utc: datetime
    what: str
    who: str


class _Page(msgspec.Struct, Generic[_T], frozen=True):
    rows: tuple[_T, ...]
    next: str | None


@dataclass(frozen=True, slots=True)
class StationCounts:
    """`counted` are all places of the site by code."""

    counted: Mapping[str, Counted]

    def records(self, aliases: Mapping[str, str]) -> list[LocationRecord]:
        """As they are compared; a code whose key has an alias goes by that."""
        return [_record(one, aliases) for one in self.counted.values()]


class Station:
    """UnavailableError where it cannot be had, InputError for what it refuses."""

    def __init__(self, asked: CountsSection, key: str) -> None:
        """InputError for an address that would send the key in the open, and without a key."""
        url = checked_url(asked.station, "counts.station")
        if not key:
            raise InputError("the station asks for a key", key="FLIGHTD_STORE_KEY", remedy=_NEW_KEY)
        headers = {"Authorization": f"Bearer {key}"}

        def refused(told: Refusal) -> FlightdError:
            why = told.said or f"HTTP {told.status}, with nothing that a station says"
            if told.status >= 500:
                return UnavailableError(f"the station answers: {why}", file=url, remedy="try again later")
            if told.status in {401, 403}:
                return InputError(
                    f"the station answers: {why}", file=url, key="FLIGHTD_STORE_KEY", remedy=_NEW_KEY
                )
            remedy = "is that a station with --store, and counts.site one of its sites?"
            return InputError(f"the station answers: {why}", file=url, key="counts.site", remedy=remedy)

        self._service = JsonService("the station", url, headers, asked.timeout_s, "refused", refused)
        self._site = asked.site

    def counts(self) -> StationCounts:
        """All of the site."""
        found: dict[str, Counted] = {}
        after = ""
        for _ in range(_MOST_PAGES):
            asked = {"site": self._site, "limit": _PAGE} | ({"after": after} if after else {})
            page = self._service.ask(f"/api/v1/stock?{urlencode(asked)}", _Page[Counted])
            found.update((one.location, one) for one in page.rows)
            if page.next is None:
                return StationCounts(found)
            after = page.next
        raise UnavailableError("the station's stock has no end", remedy="is that a station of flightd?")

    def decided(self, place: str) -> Decided | None:
        """What a person decided last about a place."""
        asked = urlencode({"site": self._site, "location": place, "limit": 1})
        rows = self._service.ask(f"/api/v1/decisions?{asked}", _Page[Decided]).rows
        return rows[0] if rows else None


_NEW_KEY = "set it to one of: flightd ground keys make NAME --scope stock"


def _record(one: Counted, aliases: Mapping[str, str]) -> LocationRecord:
    if one.utc is None or one.state is LocationState.NOT_VISITED:
        return LocationRecord(one.location, one.node, None)
    texts = dict.fromkeys(aliases.get(code_key(text), text) for text in one.texts)
    reads = tuple(CodeRead("", text, (), True, 1, 1.0) for text in texts)
    state = LocationState.READ if len(texts) == 1 else one.state  # several names may be one thing's
    utc_ns = int((one.utc - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds() * 1e9)
    try:
        seen = Observation(one.run or "", one.location, utc_ns, state, one.confidence or 0.0, reads)
    except ValueError as err:
        raise UnavailableError(f"the station tells of a place what cannot be: {err}") from None
    return LocationRecord(one.location, one.node, seen)
