"""The values that GS1 elements carry: batch, serial number, dates, quantity, measures.

Source: GS1 General Specifications, sections 3.4 to 3.6 (the application identifiers) and 7.12 (of which
century a year of two digits is).
"""

from __future__ import annotations

import calendar
from collections.abc import Iterator
from datetime import date
from decimal import Decimal
from typing import Final, TypeAlias

from flightd.core.label_values import LabelValue, Told, ValueKind, ValueSource, told_text
from flightd.vision.shelf.gs1 import Elements

_Told: TypeAlias = tuple[ValueKind, Told, str]

_TEXTS: Final = {"10": ValueKind.LOT, "21": ValueKind.SERIAL}
_DATES: Final = {
    "11": ValueKind.PRODUCTION_DATE,
    "13": ValueKind.PACKAGING_DATE,
    "15": ValueKind.BEST_BEFORE,
    "16": ValueKind.SELL_BY,
    "17": ValueKind.EXPIRY,
}
_COUNTS: Final = ("30", "37")
_MEASURES: Final = {
    "310": (ValueKind.NET_WEIGHT, "kg"),
    "311": (ValueKind.NET_LENGTH, "m"),
    "312": (ValueKind.NET_WIDTH, "m"),
    "313": (ValueKind.NET_DEPTH, "m"),
    "314": (ValueKind.NET_AREA, "m2"),
    "315": (ValueKind.NET_VOLUME, "l"),
    "316": (ValueKind.NET_VOLUME, "m3"),
    "330": (ValueKind.GROSS_WEIGHT, "kg"),
    "320": (ValueKind.NET_WEIGHT, "lb"),
    "321": (ValueKind.NET_LENGTH, "in"),
    "322": (ValueKind.NET_LENGTH, "ft"),
    "323": (ValueKind.NET_LENGTH, "yd"),
    "324": (ValueKind.NET_WIDTH, "in"),
    "325": (ValueKind.NET_WIDTH, "ft"),
    "326": (ValueKind.NET_WIDTH, "yd"),
    "327": (ValueKind.NET_DEPTH, "in"),
    "328": (ValueKind.NET_DEPTH, "ft"),
    "329": (ValueKind.NET_DEPTH, "yd"),
    "340": (ValueKind.GROSS_WEIGHT, "lb"),
    "350": (ValueKind.NET_AREA, "in2"),
    "351": (ValueKind.NET_AREA, "ft2"),
    "352": (ValueKind.NET_AREA, "yd2"),
}
"""By the first three digits; the fourth says how many decimals.  The first of a kind on a label is told: one
measure in two units is no contradiction."""


def gs1_values(elements: Elements, confidence: float, seen_on: date) -> tuple[LabelValue, ...]:
    """What the elements of one code, seen on a day, say of the goods; each with the confidence of the read.

    A date that the calendar lacks is told as it is written, with no confidence."""
    texts = ((_TEXTS[ai], value, "") for ai, value in elements if ai in _TEXTS)
    counts = ((ValueKind.QUANTITY, Decimal(value), "") for ai, value in elements if ai in _COUNTS)
    told: tuple[_Told, ...] = (*texts, *counts, *_measures(elements))
    sure = (
        LabelValue(kind, told_text(value), unit, ValueSource.GS1, confidence) for kind, value, unit in told
    )
    return (*sure, *_dates(elements, confidence, seen_on.year))


def full_date(yymmdd: str, year: int) -> date | None:
    """The day of an element seen in `year`; None for one that the calendar lacks.

    The year is within 49 before and 50 after; the day 00 is the last of its month."""
    two, month, day = int(yymmdd[:2]), int(yymmdd[2:4]), int(yymmdd[4:])
    century, ahead = year - year % 100, two - year % 100
    if ahead >= 51:
        century -= 100
    elif ahead <= -50:
        century += 100
    try:
        last = calendar.monthrange(century + two, month)[1]
        return date(century + two, month, day or last)
    except ValueError:  # calendar.IllegalMonthError is one
        return None


def _dates(elements: Elements, confidence: float, year: int) -> Iterator[LabelValue]:
    for ai, value in elements:
        if ai in _DATES:
            day = full_date(value, year)
            sure = confidence if day else 0.0
            yield LabelValue(_DATES[ai], told_text(day or value), "", ValueSource.GS1, sure)


def _measures(elements: Elements) -> list[_Told]:
    found: dict[ValueKind, _Told] = {}
    for family, (kind, unit) in _MEASURES.items():
        for ai, value in elements:
            if len(ai) == 4 and ai[:3] == family:
                found.setdefault(kind, (kind, Decimal(value).scaleb(-int(ai[3])), unit))
    return list(found.values())
