"""What labels say of the goods, as sensor reports of an EPCIS 2.0 event."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from flightd.core.inventory import Observation
from flightd.core.label_values import PlaceValue, ValueKind, told_number
from flightd.inventory.place_values import code_values, place_values

_UNITS: Final = {
    "kg": "KGM", "lb": "LBR", "m": "MTR", "in": "INH", "ft": "FOT", "yd": "YRD", "m2": "MTK", "in2": "INK",
    "ft2": "FTK", "yd2": "YDK", "l": "LTR", "m3": "MTQ",
}  # fmt: skip
"""Codes of UN/CEFACT recommendation 20, which EPCIS has its units in."""
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
