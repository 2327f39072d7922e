"""What labels say of goods beside what they are: batch, dates, number, measures; and what of it stands."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from typing import Final, TypeAlias

Told: TypeAlias = str | date | Decimal
"""A lot, serial or licence plate as it is written; a date; a number or measure in its unit."""

LEAST_CONFIDENCE: Final = 0.7
"""A value is known from this confidence on, unless another one is demanded."""
LEAST_TEXT_CONFIDENCE: Final = 0.9
"""And one of printed text from this on, whatever else is demanded: nothing vouches for it."""


class ValueKind(enum.StrEnum):
    """What a value is, in the order in which values are told."""

    LOT = "lot"
    SERIAL = "serial"
    LPN = "lpn"
    PRODUCTION_DATE = "production_date"
    PACKAGING_DATE = "packaging_date"
    BEST_BEFORE = "best_before"
    SELL_BY = "sell_by"
    EXPIRY = "expiry"
    QUANTITY = "quantity"
    """Of the trade items or pieces."""
    NET_WEIGHT = "net_weight"
    GROSS_WEIGHT = "gross_weight"
    NET_LENGTH = "net_length"
    NET_WIDTH = "net_width"
    NET_DEPTH = "net_depth"
    NET_AREA = "net_area"
    NET_VOLUME = "net_volume"


DATES: Final = frozenset(
    {
        ValueKind.PRODUCTION_DATE,
        ValueKind.PACKAGING_DATE,
        ValueKind.BEST_BEFORE,
        ValueKind.SELL_BY,
        ValueKind.EXPIRY,
    }
)
NUMBERS: Final = frozenset(ValueKind) - DATES - {ValueKind.LOT, ValueKind.SERIAL, ValueKind.LPN}


class ValueSource(enum.StrEnum):
    """Where a value comes from."""

    GS1 = "gs1"
    """An element of a code, its checksum or a second read behind it."""
    TEXT = "text"
    """Printed text."""


class UnknownReason(enum.StrEnum):
    """Why a value is unknown although something was read of it."""

    CONTRADICTING = "contradicting"
    """Sources at the place say different things."""
    SEVERAL = "several"
    """Different codes at the place say different things, each of its own goods."""
    UNSURE = "unsure"
    """Nothing of it was read with the confidence that is demanded."""


@dataclass(frozen=True, slots=True)
class LabelValue:
    """One value as one source tells it.  `text` is its `told_text`; `unit` is empty for what has none;
    confidence is 0..1."""

    kind: ValueKind
    text: str
    unit: str
    source: ValueSource
    confidence: float

    @property
    def value(self) -> Told:
        """A date or a number where the kind is one and the text says one, else the text."""
        try:
            if self.kind in DATES:
                return date.fromisoformat(self.text)
            return Decimal(self.text) if self.kind in NUMBERS else self.text
        except (ValueError, ArithmeticError):
            return self.text


@dataclass(frozen=True, slots=True)
class PlaceValue:
    """What stands of one kind: the value, or why it is unknown.  Exactly one of both is there."""

    kind: ValueKind
    known: LabelValue | None
    unknown: UnknownReason | None = None

    def __post_init__(self) -> None:
        if (self.known is None) == (self.unknown is None):
            raise ValueError(f"{self.kind}: a value, or a reason that it is unknown")


def told_text(value: Told) -> str:
    """As people and tables have it: dates as ISO 8601, numbers without an exponent."""
    if isinstance(value, date):
        return value.isoformat()
    return f"{value:f}" if isinstance(value, Decimal) else value


def told_number(value: Told) -> int | float | None:
    """For who wants numbers as numbers; None for what is none."""
    if not isinstance(value, Decimal):
        return None
    return int(value) if value == value.to_integral_value() else float(value)
