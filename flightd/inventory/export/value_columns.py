"""What is known of the goods beside their codes, as cells of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flightd.core.label_values import PlaceValue, ValueKind, told_number

UNKNOWN: Final = "unknown"
"""Something was read of it, and it is not sure what."""
_PLAIN: Final = (
    ValueKind.LOT, ValueKind.SERIAL, ValueKind.LPN, ValueKind.PRODUCTION_DATE, ValueKind.PACKAGING_DATE,
    ValueKind.BEST_BEFORE, ValueKind.SELL_BY, ValueKind.EXPIRY, ValueKind.QUANTITY,
)  # fmt: skip
_WEIGHTS: Final = (ValueKind.NET_WEIGHT, ValueKind.GROSS_WEIGHT)
_MEASURES: Final = tuple(kind for kind in ValueKind if kind not in {*_PLAIN, *_WEIGHTS})

VALUE_COLUMNS: Final = (
    *(kind.value for kind in _PLAIN),
    *(name for kind in _WEIGHTS for name in (kind.value, f"{kind.value}_unit")),
    "measures",
)


def value_cells(values: Sequence[PlaceValue]) -> list[str | float]:
    """A cell for each of `VALUE_COLUMNS`: empty for what nothing was read of."""
    by_kind = {stands.kind: stands for stands in values}
    cells: list[str | float] = [_cell(by_kind.get(kind)) for kind in _PLAIN]
    for kind in _WEIGHTS:
        stands = by_kind.get(kind)
        cells += [_cell(stands), stands.known.unit if stands and stands.known else ""]
    measures = (by_kind[kind] for kind in _MEASURES if kind in by_kind)
    return [*cells, ", ".join(map(value_text, measures))]


def value_text(stands: PlaceValue) -> str:
    """One value for people: `net_length 1.25 m`."""
    told = stands.known
    return f"{stands.kind} {f'{told.text} {told.unit}'.strip() if told else UNKNOWN}"


def _cell(stands: PlaceValue | None) -> str | float:
    if stands is None:
        return ""
    if stands.known is None:
        return UNKNOWN
    number = told_number(stands.known.value)
    return stands.known.text if number is None else number
