"""`flightd inventory export`: CSV, XLSX and EPCIS of the same inventory."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.inventory.export.csv_table import as_csv
from flightd.inventory.export.epcis import as_epcis
from flightd.inventory.export.xlsx import as_xlsx
from tests.unit.cli.inventory_commands import code, counted_store, error_of, look, run


@pytest.fixture
def counted(tmp_path: Path) -> Path:
    return counted_store(tmp_path / "counted")


def test_csv_has_a_row_for_each_code_and_each_location_without(counted: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(run("export", counted))))
    assert [(row["location"], row["state"], row["text"]) for row in rows] == [
        ("A-01", "read", "'=HYPERLINK(1)"),
        ("A-02", "read", "0109501101530003"),
        ("A-03", "read", "x"),
        ("A-04", "several", "y"),
        ("A-04", "several", "036602301467"),
        ("A-05", "empty", ""),
        ("A-06", "occluded", ""),
        ("A-07", "not_visited", ""),
        ("A-08", "not_visited", ""),
    ]
    assert (rows[1]["gs1"], rows[1]["utc"]) == ("(01)09501101530003(10)B/1", "2001-09-09T01:46:40.000Z")


def test_xlsx_holds_the_same_as_text_never_as_a_formula(counted: Path, tmp_path: Path) -> None:
    out = tmp_path / "stock.xlsx"
    assert run("export", counted, "--out", out).strip() == str(out)
    with zipfile.ZipFile(out) as book:
        sheet = book.read("xl/worksheets/sheet1.xml").decode()
        strings = book.read("xl/sharedStrings.xml").decode()
        styles = book.read("xl/styles.xml").decode()
    assert "<t>=HYPERLINK(1)</t>" in strings
    assert 'quotePrefix="1"' in styles
    assert "<f>" not in sheet
    assert sheet.count("<row ") == 10


def epcis(store: Path, out: Path, *options: str) -> dict[str, dict[str, Any]]:
    """The events by the location, as its record and not the event calls it."""
    run("export", store, "--out", out, *options)
    document = json.loads(out.read_text())
    assert (document["type"], document["schemaVersion"]) == ("EPCISDocument", "2.0")
    events = document["epcisBody"]["eventList"]
    assert len({event["eventID"] for event in events}) == len(events)
    for event in events:
        assert (event["type"], event["action"], event["bizStep"]) == (
            "ObjectEvent", "OBSERVE", "cycle_counting",
        )  # fmt: skip
        assert event["readPoint"] == event["bizLocation"]
        # as the standard's schema has it: objects, or a sensor's word of the read point
        assert event.keys() & {"epcList", "quantityList", "sensorElementList"}
        assert all(event.get(key) != [] for key in ("epcList", "quantityList", "sensorElementList"))
    with SqliteStore(store) as opened:
        looked = [record.code for record in opened.locations() if record.observation]
    return dict(zip(looked, events, strict=True))


def named(event: dict[str, Any]) -> tuple[list[str], list[str]]:
    """The things and the classes that an event names."""
    return event.get("epcList", []), [element["epcClass"] for element in event.get("quantityList", [])]


def test_epcis_counts_with_gs1_uris(counted: Path, tmp_path: Path) -> None:
    events = epcis(counted, tmp_path / "stock.jsonld")
    assert [event["readPoint"]["id"] for event in events.values()] == [
        f"urn:x-flightd:location:A-0{n}" for n in range(1, 7)
    ]
    assert [named(events[f"A-0{n}"]) for n in range(1, 5)] == [
        (["urn:x-flightd:code:%3DHYPERLINK%281%29"], []),
        ([], ["https://id.gs1.org/01/09501101530003/10/B%2F1"]),
        (["https://id.gs1.org/01/09501101530003/21/S%201"], []),
        (["https://id.gs1.org/00/395011010013000129"], ["https://id.gs1.org/01/00036602301467"]),
    ]


def test_epcis_tells_of_places_without_a_code_too_and_of_none_that_was_not_seen(
    counted: Path, tmp_path: Path
) -> None:
    events = epcis(counted, tmp_path / "stock.jsonld")
    assert [events[code].get("sensorElementList") for code in ("A-01", "A-05", "A-06")] == [
        None,
        [{"sensorReport": [{"type": "urn:x-flightd:location_state", "stringValue": "empty"}]}],
        [{"sensorReport": [{"type": "urn:x-flightd:location_state", "stringValue": "occluded"}]}],
    ]
    assert "A-07" not in events


@pytest.fixture
def labelled(tmp_path: Path) -> Path:
    """A place with one label that says much, and one with two codes of which each says its own."""
    folder = tmp_path / "labelled"
    with SqliteStore(folder) as store:
        article = code("a", a01="09501101530003", a10="B1", a17="020600", a3103="001750", a37="12")
        pallets = code("b", a00="395011010013000129", a15="011231"), code("c", a10="B2", a15="020131")
        store.commit(look("A-01", 1, article))
        store.commit(look("A-02", 2, *pallets))
    return folder


def test_lot_dates_and_measures_are_columns_of_their_own(labelled: Path, tmp_path: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(run("export", labelled))))
    names = ("lot", "best_before", "expiry", "quantity", "net_weight")
    assert [[row[name] for name in names] for row in rows] == [
        ["B1", "", "2002-06-30", "12", "1.75"],
        ["", "2001-12-31", "", "", ""],
        ["B2", "2002-01-31", "", "", ""],
    ]
    assert rows[0]["net_weight_unit"] == "kg"
    surer = csv.DictReader(io.StringIO(run("export", labelled, "--least-confidence", "0.95")))
    assert [row["lot"] for row in surer] == ["unknown", "", "unknown"]
    out = tmp_path / "stock.xlsx"
    run("export", labelled, "--out", out)
    with zipfile.ZipFile(out) as book:
        assert "<t>best_before</t>" in book.read("xl/sharedStrings.xml").decode()


def test_values_of_codes_that_differ_are_unknown_at_their_place(labelled: Path) -> None:
    first, second = json.loads(run("show", labelled, "--json"))["locations"]
    assert {value["kind"]: value["value"] for value in first["values"]} == {
        "lot": "B1", "expiry": "2002-06-30", "quantity": 12, "net_weight": 1.75,
    }  # fmt: skip
    assert first["values"][0] == {
        "kind": "lot", "value": "B1", "unit": "", "source": "gs1", "confidence": 0.9,
    }  # fmt: skip
    assert second["values"] == [
        {"kind": "lot", "value": "B2", "unit": "", "source": "gs1", "confidence": 0.9},
        {"kind": "best_before", "value": None, "unknown": "several"},
    ]
    reads = second["observation"]["reads"]
    assert [value["value"] for read in reads for value in read["values"]] == [
        "2001-12-31",
        "B2",
        "2002-01-31",
    ]


def test_epcis_tells_values_of_each_object_as_sensor_reports_and_never_as_master_data(
    labelled: Path, tmp_path: Path
) -> None:
    events = epcis(labelled, tmp_path / "stock.jsonld")
    assert all("ilmd" not in event for event in events.values()), "the standard has it in ADD events alone"
    (element,) = events["A-01"]["sensorElementList"]
    of = {"uriValue": "https://id.gs1.org/01/09501101530003/10/B1"}  # which says the lot
    assert element["sensorReport"] == [
        {"type": "urn:x-flightd:expiry", "stringValue": "2002-06-30", **of},
        {"type": "urn:x-flightd:quantity", "value": 12, **of},
        {"type": "urn:x-flightd:net_weight", "value": 1.75, "uom": "KGM", **of},
    ]
    (element,) = events["A-02"]["sensorElementList"]
    assert [(report["stringValue"], report["uriValue"]) for report in element["sensorReport"]] == [
        ("2001-12-31", "https://id.gs1.org/00/395011010013000129"),
        ("B2", "urn:x-flightd:code:c"),
        ("2002-01-31", "urn:x-flightd:code:c"),
    ]


GLN = "9501101530003"


def test_epcis_names_locations_by_their_gln(tmp_path: Path) -> None:
    store = tmp_path / "store"
    with SqliteStore(store) as opened:
        opened.commit(look("A-01", 1, code("PALLET")))
        opened.commit(
            look("A-02", 2, code("PALLET 2"), code(f"414{GLN}254B", "Data Matrix", a414=GLN, a254="B"))
        )
        opened.commit(look(f"(414){GLN}(254)A/3", 3, state="empty"))
        opened.commit(look(f"https://example.com/414/{GLN}", 4, state="empty"))
    at = {code: event["readPoint"]["id"] for code, event in epcis(store, tmp_path / "a.jsonld").items()}
    assert at == {
        "A-01": "urn:x-flightd:location:A-01",
        "A-02": f"https://id.gs1.org/414/{GLN}/254/B",
        f"(414){GLN}(254)A/3": f"https://id.gs1.org/414/{GLN}/254/A%2F3",
        f"https://example.com/414/{GLN}": f"https://id.gs1.org/414/{GLN}",
    }
    events = epcis(store, tmp_path / "b.jsonld", "--gln", GLN)
    assert events["A-01"]["readPoint"]["id"] == f"https://id.gs1.org/414/{GLN}/254/A-01"
    assert named(events["A-02"]) == (["urn:x-flightd:code:PALLET%202"], [])


def test_epcis_takes_the_key_out_of_a_digital_link(tmp_path: Path) -> None:
    store, gtin = tmp_path / "store", "09501101530003"
    links = {
        "A": f"https://shop.example/x/01/{gtin}/10/B1/21/S1",
        "B": f"https://shop.example/01/{gtin}",
        "C": f"https://shop.example/8003/{gtin}",
        "D": f"https://shop.example/8003/{gtin}9",
        "E": "https://shop.example/01/09501101530004",
    }
    with SqliteStore(store) as opened:
        for number, (place, text) in enumerate(links.items()):
            opened.commit(look(place, number, code(text)))
    events = epcis(store, tmp_path / "stock.jsonld")
    assert [named(event) for event in events.values()] == [
        ([f"https://id.gs1.org/01/{gtin}/21/S1"], []),
        ([], [f"https://id.gs1.org/01/{gtin}"]),
        ([], [f"https://id.gs1.org/8003/{gtin}"]),
        ([f"https://id.gs1.org/8003/{gtin}9"], []),
        (["urn:x-flightd:code:https%3A%2F%2Fshop.example%2F01%2F09501101530004"], []),
    ]


def test_a_gln_that_is_none_is_refused(counted: Path, tmp_path: Path) -> None:
    out = tmp_path / "stock.jsonld"
    assert "the check digit of 9501101530004 does not hold" in error_of(
        "export", counted, "--out", out, "--gln", "9501101530004"
    )
    assert "only EPCIS has it" in error_of("export", counted, "--out", tmp_path / "s.csv", "--gln", GLN)
    with SqliteStore(counted) as store:
        store.commit(look("a location with a long name", 1, state="empty"))
    assert "location a location with a long name cannot be a place" in error_of(
        "export", counted, "--out", out, "--gln", GLN
    )


def test_the_same_inventory_gives_the_same_files(counted: Path) -> None:
    with SqliteStore(counted) as store:
        records = store.locations()
    assert as_csv(records) == as_csv(records)
    assert as_epcis(records) == as_epcis(records)
    assert as_xlsx([]).startswith(b"PK")
