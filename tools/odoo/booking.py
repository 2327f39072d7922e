"""Books in Odoo what a person has approved: each line of a plan alone, and only what is still so."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import RunError, cannot_write
from flightd.core.utc_time import utc_text
from tools.odoo.odoo import Odoo
from tools.odoo.plan import Booking, Plan

_ROUNDED = 1e-6
"""Quantities are decimals that Odoo rounds by the unit's precision."""


@dataclass(frozen=True, slots=True)
class Approval:
    """Of `by`: for the `places` alone, where any are named; `applies`, or leaves that to a person in Odoo."""

    by: str
    applies: bool
    places: Collection[str] = ()

    def covers(self, booking: Booking) -> bool:
        return not self.places or booking.place in self.places


@dataclass(frozen=True, slots=True)
class Booked:
    """What became of a line of the plan; `done` where Odoo has taken it."""

    booking: Booking
    done: bool
    said: str


def book(
    odoo: Odoo, approved: Plan, fresh: Plan, approval: Approval, journal: Path, now_ns: int
) -> Iterator[Booked]:
    """Book what `approval` covers of the approved plan, as far as the `fresh` one says the same still.

    A line that a rule of Odoo's is against is told, and the next one booked; where Odoo cannot be had it
    ends with that error, and what was booked by then stands in the journal."""
    reasons = {(one.place, one.code): one.why for one in fresh.untouched}
    for booking in approved.bookings:
        if not approval.covers(booking):
            continue
        still = next((one for one in fresh.bookings if booking.is_still(one)), None)
        if still is None:
            why = reasons.get(
                (booking.place, booking.code), "Odoo and the count say otherwise than this plan now"
            )
            yield Booked(booking, False, why)
            continue
        try:
            quants = _book(odoo, still, approval)
        except RunError as err:
            yield Booked(booking, False, str(err))
            continue
        _note(journal, still, quants, approval, now_ns)
        yield Booked(
            booking, True, "applied" if approval.applies else "set: apply it in Odoo under Physical Inventory"
        )


def _book(odoo: Odoo, booking: Booking, approval: Approval) -> tuple[int, ...]:
    """The quants that were booked.  RunError where Odoo's stock is not what the plan was made by: that is
    asked after the quantity is set, and from then on Odoo itself looks after it."""
    quants, made = booking.quants, booking.made
    if not quants and made is not None:
        quants = (odoo.new_counted(made.location, made.product, made.lot, booking.counted),)
    else:
        odoo.set_counted(quants, booking.counted)
    wanted = booking.counted - booking.books
    if not math.isclose(odoo.differences(quants), wanted, abs_tol=_ROUNDED):
        odoo.clear_counted(quants)
        raise RunError("Odoo's stock has changed meanwhile, nothing was booked", remedy="make a new plan")
    if approval.applies:
        why = (
            f"flightd: counted {booking.utc:%Y-%m-%d %H:%M} UTC, run {booking.run}, approved by {approval.by}"
        )
        odoo.apply_counted(quants, why)
    return quants


def _note(journal: Path, booking: Booking, quants: tuple[int, ...], approval: Approval, now_ns: int) -> None:
    line = {
        "utc": utc_text(now_ns), "by": approval.by, "applied": approval.applies, "place": booking.place,
        "code": booking.code, "books": booking.books, "counted": booking.counted, "quants": quants,
        "run": booking.run,
    }  # fmt: skip
    try:
        with journal.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(line, ensure_ascii=False) + "\n")
    except OSError as err:
        raise cannot_write(journal, err) from None
