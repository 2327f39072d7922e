"""The EPCIS document against what the 2.0 standard lets stand in it.

GS1's own JSON schema comes without a licence to pass it on, so that its rules for such events are stated here
once more: which names may stand where, and of what kind their values are.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any, Final

import pytest

from flightd.core.inventory import CaseGrid, LocationRecord, PlaceFill
from flightd.inventory.export.epcis import as_epcis
from tests.unit.cli.inventory_commands import code, look

_URI: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:[^\s<>\"{}|\\^`]+")
Rule = Callable[[Any], bool]
Report = Mapping[str, Any]


def is_uri(value: object) -> bool:
    return (
        isinstance(value, str)
        and re.fullmatch(r"[A-Za-z][A-Za-z0-9+.-]*:[^\s<>\"{}|\\^`]+", value) is not None
    )


def is_time(value: object) -> bool:
    return isinstance(value, str) and datetime.fromisoformat(value).tzinfo is not None


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value)


def is_unit(value: object) -> bool:
    """A code of UN/CEFACT recommendation 20."""
    return isinstance(value, str) and re.fullmatch(r"[A-Z0-9]{2,3}", value) is not None


def one(*words: str) -> Rule:
    return lambda value: value in words


def list_of(rule: Rule) -> Rule:
    return lambda value: isinstance(value, list) and bool(value) and all(map(rule, value))


def fields(known: Mapping[str, Rule], *needed: str) -> Rule:
    """An object of these fields alone, in which those that are needed stand."""

    def holds(value: object) -> bool:
        assert isinstance(value, dict)
        assert set(needed) <= value.keys() <= known.keys(), value
        return all(known[name](told) for name, told in value.items())

    return holds


REPORT: Final = fields(
    {"type": is_uri, "value": is_number, "uom": is_unit, "stringValue": is_text, "uriValue": is_uri}, "type"
)
CLASS: Final = fields({"epcClass": is_uri, "quantity": is_number, "uom": is_unit}, "epcClass")
PLACE: Final = fields({"id": is_uri}, "id")
EVENT: Final = fields(
    {
        "type": one("ObjectEvent"),
        "eventID": is_uri,
        "eventTime": is_time,
        "eventTimeZoneOffset": lambda value: re.fullmatch(r"[+-]\d\d:\d\d", value) is not None,
        "action": one("OBSERVE"),
        "bizStep": one("cycle_counting"),
        "readPoint": PLACE,
        "bizLocation": PLACE,
        "epcList": list_of(is_uri),
        "quantityList": list_of(CLASS),
        "sensorElementList": list_of(fields({"sensorReport": list_of(REPORT)}, "sensorReport")),
    },
    "type", "eventTime", "eventTimeZoneOffset", "action", "readPoint",
)  # fmt: skip
DOCUMENT: Final = fields(
    {
        "@context": list_of(is_uri),
        "type": one("EPCISDocument"),
        "schemaVersion": one("2.0"),
        "creationDate": is_time,
        "epcisBody": fields({"eventList": list_of(EVENT)}, "eventList"),
    },
    "@context", "type", "schemaVersion", "creationDate", "epcisBody",
)  # fmt: skip

FILL: Final = PlaceFill(0.625, 0.04, 0.03, CaseGrid(4, 3))
GOODS: Final = code("x", "Code 128", a01="09501101530003", a10="B/1", a17="261130", a3102="001250")
RECORDS: Final = (
    LocationRecord("A-01", "A1", replace(look("A-01", 1, GOODS), fill=FILL), 3),
    LocationRecord("A-02", "A1", replace(look("A-02", 2, state="empty"), fill=PlaceFill(0.0))),
    LocationRecord("A-03", "A1", replace(look("A-03", 3, state="occluded"), fill=PlaceFill(None))),
    LocationRecord("A-04", "A1", look("A-04", 4, code("y", a00="395011010013000129"), code("free text"))),
    LocationRecord("A-05", "A1", None, 2),
)


@pytest.mark.parametrize("gln", ["", "9501101530003"])
def test_the_document_holds_what_the_standard_lets_stand_in_it_and_nothing_else(gln: str) -> None:
    document = json.loads(as_epcis(RECORDS, gln))
    assert DOCUMENT(document)
    for event in document["epcisBody"]["eventList"]:
        # objects, or a sensor's word of the read point
        assert event.keys() & {"epcList", "quantityList"} or event["sensorElementList"]


def reports(event: Mapping[str, Any]) -> dict[str, Report]:
    told = [report for element in event.get("sensorElementList", []) for report in element["sensorReport"]]
    return {report["type"].removeprefix("urn:x-flightd:"): report for report in told}


def test_what_is_seen_of_a_place_is_told_as_sensor_reports() -> None:
    full, empty, covered, several = json.loads(as_epcis(RECORDS))["epcisBody"]["eventList"]
    figures = {
        "fill": (62.5, "P1"),
        "overhang": (0.04, "MTR"),
        "lean": (0.03, "MTR"),
        "cases": (12, "C62"),
        "case_columns": (4, "C62"),
        "case_rows": (3, "C62"),
        "pallets_deep": (3, "C62"),
        "pallets_seen": (1, "C62"),
    }
    told = reports(full)
    assert {name: (told[name]["value"], told[name]["uom"]) for name in figures} == figures
    assert reports(empty)["fill"]["value"] == 0.0
    assert set(reports(covered)) == {"location_state"}, "what is unknown is left out"
    assert not reports(several)


def test_a_field_that_the_standard_does_not_know_would_be_found() -> None:
    document = json.loads(as_epcis(RECORDS))
    document["epcisBody"]["eventList"][0]["sensorElementList"][0]["sensorReport"][0]["unit"] = "KGM"
    with pytest.raises(AssertionError):
        DOCUMENT(document)
