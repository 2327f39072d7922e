"""What would be booked in Odoo, and what would not and why: nothing is changed by making a plan."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import msgspec

from flightd.core.errors import InputError, cannot_write
from flightd.runtime.durable_files import replace_file

_MOST_BYTES = 64_000_000


class Made(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Of what and where a quant is made."""

    location: int
    product: int
    lot: int


class Booking(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One count to be booked: the quants of a label become `counted`; without quants, one is made."""

    place: str
    code: str
    why: str
    utc: datetime
    run: str
    books: float
    counted: float
    quants: tuple[int, ...]
    made: Made | None = None

    def of(self, made: Made) -> Booking:
        """The same, with what is to be made."""
        return msgspec.structs.replace(self, made=made)

    def is_still(self, other: Booking) -> bool:
        """Whether both book the same; a quant that was made meanwhile, and waits, is the one to be made."""
        return self == (other if self.made is None else msgspec.structs.replace(other, quants=self.quants))


class Untouched(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A difference that is not booked, and why: somebody has to look."""

    place: str
    code: str
    why: str


class Plan(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`agreed` labels lie where Odoo has them, `uncounted` ones lie where nobody looked."""

    site: str
    bookings: tuple[Booking, ...]
    untouched: tuple[Untouched, ...]
    agreed: int
    uncounted: int


def write_plan(plan: Plan, path: Path) -> None:
    """For a person to read, and to approve."""
    data = msgspec.json.format(msgspec.json.encode(plan), indent=1) + b"\n"
    try:
        replace_file(path, path.with_name(f".{path.name}.tmp"), data)
    except OSError as err:
        raise cannot_write(path, err) from None


def read_plan(path: Path) -> Plan:
    """InputError for what is none."""
    try:
        with path.open("rb") as stream:
            return msgspec.json.decode(stream.read(_MOST_BYTES), type=Plan)
    except OSError as err:
        raise InputError(f"{err.strerror}", file=path, remedy="make one: python -m tools.odoo plan") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as err:
        raise InputError(
            f"not a plan: {err}", file=path, remedy="make one: python -m tools.odoo plan"
        ) from None
