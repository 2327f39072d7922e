"""What labels say of the goods, and what is seen of the place, as sensor reports of an EPCIS 2.0 event."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from flightd.core.inventory import LocationRecord, Observation
from flightd.core.label_values import PlaceValue, ValueKind, told_number
from flightd.inventory.place_values import code_values, place_values

_UNITS: Final = {
    "kg": "KGM", "lb": "LBR", "m": "MTR", "in": "INH", "ft": "FOT", "yd": "YRD", "m2": "MTK", "in2": "INK",
    "ft2": "FTK", "yd2": "YDK", "l": "LTR", "m3": "MTQ",
}  # fmt: skip
"""Codes of UN/CEFACT recommendation 20, which EPCIS has its units in."""
_PERCENT, _PIECES = "P1", "C62"
_IN_URI: Final = {ValueKind.LOT: "/10/", ValueKind.SERIAL: "/21/"}
"""What the URI of the object may say already."""


def value_reports(
    seen: Observation, things: Mapping[str, str], base_uri: str, least_confidence: float
) -> list[dict[str, Any]]:
    """A report for each value that is known; one that is unknown, or that its object's URI says, has none.

    `things` are the URIs of the objects by the texts of their codes: a report names its object."""
    reports: list[dict[str, Any]] = []
    if len(things) < 2:  # what is known of the place is of its one object
        uri = next(iter(things.values()), "")
        reports += [_report(value, uri, base_uri) for value in place_values(seen, least_confidence)]
    else:
        for read in {read.text: read for read in seen.reads if read.text in things}.values():
            values = code_values(read, seen, least_confidence)
            reports += [_report(value, things[read.text], base_uri) for value in values]
    return [report for report in reports if report]


def place_reports(record: LocationRecord, seen: Observation, base_uri: str) -> list[dict[str, Any]]:
    """A report for each figure of the place that is known: how full it is, how far goods stand out and lean,
    the cases in the front, and, where pallets stand behind one another, how many, and how many are seen."""
    fill = seen.fill
    cases = fill.cases if fill else None
    figures: dict[str, tuple[float | None, str]] = {
        "fill": (None if fill is None or fill.share is None else round(100.0 * fill.share, 1), _PERCENT),
        "overhang": (fill.overhang_m if fill else None, _UNITS["m"]),
        "lean": (fill.lean_m if fill else None, _UNITS["m"]),
        "cases": (cases.count if cases else None, _PIECES),
        "case_columns": (cases.columns if cases else None, _PIECES),
        "case_rows": (cases.rows if cases else None, _PIECES),
    }
    if record.pallets_deep > 1:
        figures["pallets_deep"] = record.pallets_deep, _PIECES
        figures["pallets_seen"] = record.pallets_seen, _PIECES
    return [
        {"type": f"{base_uri}{name}", "value": value, "uom": unit}
        for name, (value, unit) in figures.items()
        if value is not None
    ]


def _report(stands: PlaceValue, uri: str, base_uri: str) -> dict[str, Any]:
    told = stands.known
    if told is None or (stands.kind in _IN_URI and _IN_URI[stands.kind] in uri):
        return {}
    report: dict[str, Any] = {"type": f"{base_uri}{stands.kind.value}"}
    number = told_number(told.value)
    if number is None:
        report["stringValue"] = told.text
    else:
        report |= {"value": number} | ({"uom": _UNITS[told.unit]} if told.unit else {})
    return report | ({"uriValue": uri} if uri else {})
