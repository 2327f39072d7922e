"""Odoo's stock against the count: what may be booked, and why the rest may not.

A count is trusted where it is confirmed, sure and fresh, no person has the place in hand, and Odoo has moved
nothing there since.  The last is what makes bookings safe to repeat: a booking is a move, too, and so no look
is ever booked twice.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from flightd.core.errors import InputError
from flightd.inventory.comparison import ComparisonOutcome, Difference, compare_stock
from flightd.vision.shelf.code_equality import code_key
from tools.odoo.connector_file import ConnectorFile
from tools.odoo.counts import Counted, Station, StationCounts
from tools.odoo.found_labels import made_of
from tools.odoo.odoo import Odoo, Record
from tools.odoo.plan import Booking, Plan, Untouched
from tools.odoo.stock import Location, OdooStock, Quant

MOST_FOUND = 200
"""So many unexpected labels are looked for in Odoo by one plan."""
_CLOCKS = timedelta(minutes=5)
_UNTOUCHED = {
    ComparisonOutcome.MISSING: "not among what was read there: look, or count it in Odoo",
    ComparisonOutcome.WRONG: "something else lies there",
    ComparisonOutcome.EMPTY_BUT_EXPECTED: "the place is empty",
}


def plan_bookings(
    asked: ConnectorFile, odoo: Odoo, station: Station, stock: OdooStock, now: datetime
) -> Plan:
    """Reads Odoo and the station alone.  InputError where the count has none of Odoo's places."""
    planning = _Planning(asked, odoo, station, stock, station.counts(), now)
    lines = compare_stock(planning.counts.records(stock.aliases), stock.expected)
    bookings: list[Booking] = []
    untouched: list[Untouched] = []
    for one in (one for line in lines for one in planning.judged(line)):
        (bookings if isinstance(one, Booking) else untouched).append(one)  # type: ignore[arg-type]
    outcomes = [line.outcome for line in lines]
    return Plan(
        site=asked.counts.site,
        bookings=tuple(bookings),
        untouched=tuple(untouched),
        agreed=outcomes.count(ComparisonOutcome.MATCH),
        uncounted=outcomes.count(ComparisonOutcome.UNCOUNTED),
    )


class _Moved(Record, frozen=True):
    date: str


@dataclass(slots=True)
class _Planning:
    """One plan in the making."""

    asked: ConnectorFile
    odoo: Odoo
    station: Station
    stock: OdooStock
    counts: StationCounts
    now: datetime
    _locations: dict[str, Location] = field(init=False)
    _quants: dict[tuple[str, str], list[Quant]] = field(init=False)
    _doubts: dict[str, str] = field(init=False)
    _found: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        self._locations = {place.casefold(): location for place, location in self.stock.places.items()}
        self._doubts = {}
        self._quants = {}
        for one in self.stock.lying:
            self._quants.setdefault((one.place.casefold(), code_key(one.code)), []).extend(one.quants)
        if not any(code.casefold() in self._locations for code in self.counts.counted):
            first = next(iter(self.counts.counted), "none at all")
            raise InputError(
                f"Odoo has none of the places that were counted, of which the first is {first}",
                key="odoo.place",
                remedy="give them to the locations in Odoo, or choose what of a location a place is",
            )

    def judged(self, line: Difference) -> Iterator[Booking | Untouched]:
        """What becomes of a line of the comparison; nothing of what agrees, or was not counted."""
        match line.outcome:
            case ComparisonOutcome.MATCH | ComparisonOutcome.UNCOUNTED:
                return
            case ComparisonOutcome.MOVED:
                yield Untouched(line.location, line.text, f"lies at {line.found_at}: move it in Odoo")
            case ComparisonOutcome.UNEXPECTED:
                yield self._of_found(line.location, line.text)
            case _:
                yield self._of_absent(line)
                if line.found:
                    yield self._of_found(line.location, line.found)

    def _of_absent(self, line: Difference) -> Booking | Untouched:
        """A label that Odoo has at a place where it was not seen."""
        place, code, why = line.location, line.text, line.outcome.value
        if why not in self.asked.counts.zeroed:
            return Untouched(place, code, _UNTOUCHED[line.outcome])
        quants = self._quants[place.casefold(), code_key(code)]
        reason = self._doubt_about(place) or _in_use(quants, 0.0)
        if reason:
            return Untouched(place, code, f"{_UNTOUCHED[line.outcome]}, but {reason}")
        books = sum(quant.quantity for quant in quants)
        return self._booking(place, code, why, books, 0.0, tuple(quant.id for quant in quants))

    def _of_found(self, place: str, code: str) -> Booking | Untouched:
        """A label at a place where Odoo has it not."""
        location = self._locations.get(place.casefold())
        if location is None:
            return Untouched(place, code, f"Odoo has no location with the {self.asked.odoo.place} {place}")
        if any(place.casefold() == one.casefold() for one in self.stock.untold):
            return Untouched(place, code, "Odoo has something there that no label names: give that a barcode")
        reason = self._doubt_about(place)
        if reason:
            return Untouched(place, code, f"not expected there, but {reason}")
        self._found += 1
        if self._found > MOST_FOUND:
            return Untouched(
                place, code, f"the first {MOST_FOUND} unexpected labels come first: put those right"
            )
        waiting = self._quants.get((place.casefold(), code_key(code)), [])
        made = made_of(self.odoo, code, location)
        reason = made if isinstance(made, str) else _in_use(waiting, 1.0)
        if isinstance(made, str) or reason:
            return Untouched(place, code, reason)
        booking = self._booking(place, code, "unexpected", 0.0, 1.0, tuple(quant.id for quant in waiting))
        return booking.of(made)

    def _booking(
        self, place: str, code: str, why: str, books: float, counted: float, quants: tuple[int, ...]
    ) -> Booking:
        seen = self.counts.counted[place]
        assert seen.utc is not None
        return Booking(place, code, why, seen.utc, seen.run or "", books, counted, quants)

    def _doubt_about(self, place: str) -> str:
        """Why a count of a place is not booked; "" where it may be.  Asked once for each place."""
        if place not in self._doubts:
            seen = self.counts.counted[place]
            self._doubts[place] = self._doubt(seen) or self._in_hand(seen) or self._moved(seen)
        return self._doubts[place]

    def _doubt(self, seen: Counted) -> str:
        asked = self.asked.counts
        if seen.utc is None or not seen.state.is_counted:
            return "the place was not counted"
        sure = seen.confidence or 0.0
        if sure < asked.least_confidence:
            return f"it was counted with confidence {sure:.2f}, less than {asked.least_confidence:g}"
        if seen.utc > self.now + _CLOCKS:
            return "it was counted in the future: set the clocks right"
        if self.now - seen.utc > timedelta(hours=asked.oldest_h):
            return f"it was counted more than {asked.oldest_h:g} h ago: count it again"
        return ""

    def _in_hand(self, seen: Counted) -> str:
        decided = self.station.decided(seen.location)
        if decided is None or decided.what == "open" or (seen.utc and decided.seen_utc < seen.utc):
            return ""
        return f"{decided.who} has decided about it: {decided.what}"

    def _moved(self, seen: Counted) -> str:
        assert seen.utc is not None
        location = self._locations[seen.location.casefold()]
        # the clocks of both differ: what moved a little before the look counts as later
        since = (seen.utc - _CLOCKS).replace(microsecond=0, tzinfo=None).isoformat(sep=" ")
        here = ["|", ["location_id", "=", location.id], ["location_dest_id", "=", location.id]]
        moves = self.odoo.first(
            "stock.move.line", _Moved, [["state", "=", "done"], ["date", ">=", since], *here], 1
        )
        return f"Odoo moved something there since ({moves[0].date} UTC): count it again" if moves else ""


def _in_use(quants: list[Quant], counted: float) -> str:
    """Why these quants are not booked; "" where they may be."""
    if any(quant.reserved_quantity for quant in quants):
        return "a transfer in Odoo has reserved it"
    for quant in quants:
        if quant.inventory_quantity_set and quant.inventory_quantity != counted:
            return f"a count of {quant.inventory_quantity:g} waits in Odoo already"
    return ""
