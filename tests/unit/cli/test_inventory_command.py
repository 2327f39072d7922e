"""`flightd inventory` as its user meets it: count, look, export, compare, count again."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import zxingcpp

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.build import flown_between_m
from flightd.app.flight_orders import configured_order, going_on
from flightd.app.recording import FlightSetting, record_setting
from flightd.cli.main import app
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.inventory import (
    CaseGrid,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    UndecidedCode,
)
from flightd.site.site_file import load_site
from tests.unit.cli.inventory_commands import RUNNER, code, counted_store, error_of, look, run

CONFIGS = Path(__file__).parents[3] / "configs"


def photograph(path: Path, *codes: tuple[str, zxingcpp.BarcodeFormat]) -> None:
    picture = np.full((400, 300 * len(codes) + 100), 235, np.uint8)
    for i, (text, kind) in enumerate(codes):
        drawing = np.asarray(zxingcpp.create_barcode(text, kind).to_image(scale=3), np.uint8)
        height, width = drawing.shape
        picture[60 : 60 + height, 60 + 300 * i : 60 + 300 * i + width] = drawing
    cv2.imwrite(str(path), picture)
    os.utime(path, ns=(1_700_000_000_000_000_000, 1_700_000_000_000_000_000))


QR, EAN = zxingcpp.BarcodeFormat.QRCode, zxingcpp.BarcodeFormat.EAN13


@pytest.fixture
def photographs(tmp_path: Path) -> Path:
    folder = tmp_path / "photographs"
    folder.mkdir()
    photograph(folder / "A-01.png", ("PALLET-1", QR))
    photograph(folder / "A-02.png", ("PALLET-2", QR), ("9780679601050", EAN))
    photograph(folder / "A-03.png")
    return folder


def test_photographs_become_an_inventory_and_again_change_nothing(tmp_path: Path, photographs: Path) -> None:
    store = tmp_path / "store"
    counted = json.loads(run("add", store, photographs, "--json"))
    assert counted == {"A-01": "read", "A-02": "several", "A-03": "unreadable"}
    first = run("show", store, "--json")
    run("add", store, photographs)
    assert run("show", store, "--json") == first
    (look,) = json.loads(run("show", store, "--location", "A-01", "--json"))["observations"]
    assert (look["utc"], look["reads"][0]["text"]) == ("2023-11-14T22:13:20.000Z", "PALLET-1")
    evidence = store / "evidence" / look["evidence"][:2] / f"{look['evidence']}.jpg"
    assert 0 < evidence.stat().st_size <= 50_000
    assert "3 locations: 1 read, 1 several, 1 unreadable" in run("show", store)


def test_a_photograph_is_of_the_planned_place_whatever_its_case_and_location_labels_are_no_stock(
    tmp_path: Path,
) -> None:
    store, folder = tmp_path / "store", tmp_path / "photographs"
    folder.mkdir()
    with SqliteStore(store) as planned:
        planned.plan([PlannedLocation("AL-01", "A1"), PlannedLocation("AL-02", "A1")])
    photograph(folder / "al-01.png", ("PALLET-1", QR), ("AL-01", QR))
    photograph(folder / "AL-02.png", ("AL-01", QR))
    assert json.loads(run("add", store, folder, "--json")) == {"AL-01": "read", "AL-02": "unreadable"}
    assert "2 locations" in run("show", store)


def test_what_is_known_of_the_goods_stands_beside_the_codes(tmp_path: Path) -> None:
    gs1 = code("x", "Data Matrix", a01="09501101530003", a10="L1", a17="261130")
    with SqliteStore(tmp_path) as store:
        store.plan([PlannedLocation("A-01", "A1", 2), PlannedLocation("A-02", "A1")])
        fill = PlaceFill(0.62, 0.04, 0.03, CaseGrid(4, 3))
        store.commit(replace(look("A-01", 1, gs1), fill=fill))
        store.commit(replace(look("A-02", 2, state="empty"), fill=PlaceFill(0.0)))
    lines = run("show", tmp_path).splitlines()
    known = "lot L1  expiry 2026-11-30  fill 62 %, 4 cm over the rack's face, leans by 3 cm  cases 4 x 3"
    known += "  1 of 2 pallets seen"
    assert lines[:2] == [f"A-01             read         x  {known}", "A-02             empty"]


def test_what_stayed_undecided_beside_a_code_is_told_and_is_no_code(tmp_path: Path) -> None:
    undecided = UndecidedCode("ITF", "070429", 1), UndecidedCode("Codabar", "A\x1b1B", 3)
    with SqliteStore(tmp_path) as store:
        store.commit(replace(look("A-01", 1, code("x")), undecided=undecided))
        store.commit(look("A-02", 2, code("y")))
    shown = "undecided 070429 (1 look)  undecided A\\x1b1B (3 looks)"
    assert run("show", tmp_path).splitlines() == [
        f"A-01             read         x  {shown}",
        "A-02             read         y",
        "2 locations: 2 read",
    ]
    first, second = json.loads(run("show", tmp_path, "--json"))["locations"]
    assert (first["texts"], second["observation"]["undecided"]) == (["x"], [])
    assert first["observation"]["undecided"] == [
        {"symbology": "ITF", "text": "070429", "looks": 1},
        {"symbology": "Codabar", "text": "A\x1b1B", "looks": 3},
    ]
    rows = csv.DictReader(io.StringIO(run("export", tmp_path, "--format", "csv")))
    assert [(row["text"], row["undecided"], row["undecided_looks"]) for row in rows] == [
        ("x", "070429 | A\x1b1B", "1 | 3"),
        ("y", "", ""),
    ]
    assert "070429" not in run("export", tmp_path, "--format", "epcis")
    assert run("show", tmp_path, "--location", "A-01").rstrip().endswith(f"read        0.90  x  {shown}")


@pytest.fixture
def counted(tmp_path: Path) -> Path:
    return counted_store(tmp_path / "counted")


def test_what_is_exported_as_expected_stock_matches_itself(counted: Path, tmp_path: Path) -> None:
    stock = tmp_path / "stock.csv"
    rows = csv.DictReader(io.StringIO(run("export", counted, "--format", "csv")))
    with stock.open("w", newline="") as file:
        books = csv.writer(file)
        books.writerow(["location", "code"])
        books.writerows([row["location"], row["text"]] for row in rows if row["text"])
    result = json.loads(run("compare", counted, stock, "--json"))
    assert {name: n for name, n in result["outcomes"].items() if n} == {"match": 5}
    texts = [
        t
        for place in json.loads(run("export", counted, "--format", "json"))["locations"]
        for t in place["texts"]
    ]
    assert "=HYPERLINK(1)" in texts


def test_the_comparison_names_differences_and_makes_a_mission_that_loads(
    counted: Path, tmp_path: Path
) -> None:
    stock = tmp_path / "stock.csv"
    stock.write_text(
        "\ufefflocation,code,article\nA-01,=HYPERLINK(1),\nA-05,PALLET-5,nails\nA-06,PALLET-6,\nA-07,\n"
    )
    shutil.copy(CONFIGS / "site-demo.toml", tmp_path)
    config = tmp_path / "hall.toml"
    config.write_text((CONFIGS / "sim.toml").read_text())
    recount = tmp_path / "recount.toml"
    result = json.loads(run("compare", counted, stock, "--recount", recount, "--config", config, "--json"))
    assert {name: n for name, n in result["outcomes"].items() if n} == {
        "match": 1, "unexpected": 4, "empty_but_expected": 1, "uncounted": 1,
    }  # fmt: skip
    assert "A-01" not in result["recount"]
    assert result["recount"]["A-05"] == "empty_but_expected"
    assert result["recount"]["A-08"] == "not_visited"
    before, after = load_config(config), load_config(recount)
    assert after.mission.nodes == ("A2",)
    assert after.model_copy(update={"mission": before.mission}) == before
    assert "empty_but_expected PALLET-5" in run("compare", counted, stock)


def test_stores_merge(counted: Path, tmp_path: Path, photographs: Path) -> None:
    other = tmp_path / "other"
    run("add", other, photographs)
    assert json.loads(run("merge", counted, other, "--json"))["new_observations"] == 3
    assert json.loads(run("merge", counted, other, "--json"))["new_observations"] == 0


def test_a_merge_of_what_is_no_inventory_changes_nothing(
    counted: Path, tmp_path: Path, photographs: Path
) -> None:
    other, new = tmp_path / "other", tmp_path / "new"
    run("add", other, photographs)
    before = run("show", counted, "--json")
    assert "holds no inventory.db" in error_of("merge", counted, other, tmp_path)
    assert run("show", counted, "--json") == before
    assert "holds no inventory.db" in error_of("merge", new, tmp_path)
    assert not new.exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("place,code\nA,B\n", "no column 'location'"),
        ("location,code\n,B\n", "line 2: no location"),
        ("", "no column"),
    ],
)
def test_bad_stock_files_are_refused(counted: Path, tmp_path: Path, text: str, words: str) -> None:
    stock = tmp_path / "stock.csv"
    stock.write_text(text)
    assert words in error_of("compare", counted, stock)


def test_a_count_with_nothing_left_is_refused_on_the_ground_and_never_in_the_air(tmp_path: Path) -> None:
    site = load_site(CONFIGS / "site-racks.toml")
    config = load_config(CONFIGS / "sim.toml")
    order = configured_order(config)
    with SqliteStore(tmp_path) as store:
        for number, code in enumerate(site.locations):
            store.commit(Observation("monday", code, number, LocationState.EMPTY, 0.9))
    with pytest.raises(InputError, match="every location is counted"):
        going_on(order, "monday", site, tmp_path)
    assert going_on(order, "monday", site, tmp_path, in_air=True) is order


def test_the_heights_flown_between_hold_the_views_of_a_tilted_front_camera() -> None:
    site, config = load_site(CONFIGS / "site-racks.toml"), load_config(CONFIGS / "sim.toml")
    level = config.front_camera.model_copy(update={"url": "folder:front"})
    tilted = level.model_copy(update={"mount_pitch_deg": -30.0})
    lows, highs = zip(
        *(
            flown_between_m(config.model_copy(update={"front_camera": camera}), site)
            for camera in (level, tilted)
        ),
        strict=True,
    )
    assert highs[1] > highs[0] + 0.3, "looking down on the labels, it flies higher"
    assert lows[1] >= lows[0]


def test_bad_arguments_are_refused(counted: Path, tmp_path: Path) -> None:
    stock = tmp_path / "stock.csv"
    stock.write_text("location,code\n")
    assert "holds no inventory" in error_of("show", tmp_path / "nowhere")
    assert "knows no location 'Q'" in error_of("show", counted, "--location", "Q")
    assert "--format pdf" in error_of("export", counted, "--format", "pdf")
    assert "choose one of .csv (csv), .xlsx (xlsx), .json (json), .jsonld (epcis)" in error_of(
        "export", counted, "--out", tmp_path / "stock.pdf"
    )
    assert not (tmp_path / "stock.pdf").exists()
    said = error_of("export", counted, "--out", tmp_path / "stock.json", "--format", "epcis")
    assert "its ending says json, --format says epcis" in said
    assert said.endswith("name the file stock.jsonld")
    assert "no flight.mcap beside" in error_of("compare", counted, stock, "--recount", tmp_path / "r.toml")
    elsewhere = tmp_path / "deep" / "r.toml"
    config = CONFIGS / "sim.toml"
    assert "beside" in error_of("compare", counted, stock, "--recount", elsewhere, "--config", config)


def test_a_sites_locations_are_planned(tmp_path: Path) -> None:
    site = tmp_path / "hall.toml"
    made = RUNNER.invoke(app, ["map", "new", str(site), "--levels-m", "0.4,1.4"])
    assert made.exit_code == 0
    count = json.loads(run("plan", tmp_path / "store", site, "--json"))["locations"]
    assert json.loads(run("show", tmp_path / "store", "--json"))["states"] == {"not_visited": count}
    assert count > 0
    bare = tmp_path / "bare.toml"
    assert RUNNER.invoke(app, ["map", "new", str(bare)]).exit_code == 0
    assert "add a [[rack]]" in error_of("plan", tmp_path / "store", bare)


@pytest.fixture
def flown(tmp_path: Path) -> Path:
    """The folder of a flight over the small racks: its log, and a count with doubts in both aisles."""
    folder = tmp_path / "flown"
    site = load_site(CONFIGS / "site-racks-small.toml")
    config = load_config(CONFIGS / "sim.toml").with_values(
        inventory={"run": "monday"}, mission={"resume": True, "progress": tmp_path / "left.json"}
    )
    order = configured_order(config)
    with SqliteStore(folder) as store:
        store.plan(PlannedLocation(place.code, place.node) for place in site.locations.values())
        for number, place in enumerate(site.locations.values()):
            state = ("unreadable", "occluded", "empty")[number % 3]
            store.commit(Observation("monday", place.code, number + 1, LocationState(state), 0.9))
    with McapRecorder(folder / "flight.mcap") as recorder:
        record_setting(recorder, 1, FlightSetting(config, site, order))
    return folder


def recounted(flown: Path, out: Path, *options: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """The doubtful locations with their reasons, and the nodes of the mission that is written for them."""
    books = flown / "books.csv"
    books.write_text("location,code\n")
    told = json.loads(run("compare", flown, books, "--recount", out, *options, "--json"))
    nodes = load_config(out).mission.nodes
    assert tuple(told["recount_nodes"]) == nodes
    return told["recount"], nodes


def test_a_recount_needs_no_configuration_beside_the_flight_that_knows_it(
    flown: Path, tmp_path: Path
) -> None:
    out = tmp_path / "recount.toml"
    doubtful, nodes = recounted(flown, out)
    site, config = load_site(CONFIGS / "site-racks-small.toml"), load_config(out)
    assert load_site(config.mission.site) == site
    assert {site.locations[code].node for code in doubtful} == set(nodes)
    assert set(doubtful.values()) == {"unreadable", "occluded"}
    assert config.front_camera == load_config(CONFIGS / "sim.toml").front_camera
    assert (config.inventory.run, config.mission.resume) == ("monday recount", False)
    order = configured_order(config)
    assert going_on(order, config.inventory.run, site, flown).nodes == nodes
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(flown, elsewhere)
    (elsewhere / "flight.mcap").unlink()
    books = flown / "books.csv"
    assert "add --log FLIGHT.mcap or --config F" in error_of("compare", elsewhere, books, "--recount", out)
    run("compare", elsewhere, books, "--recount", out, "--log", flown / "flight.mcap")


def test_a_recount_is_limited_to_what_is_named(flown: Path, tmp_path: Path) -> None:
    out, site = tmp_path / "recount.toml", load_site(CONFIGS / "site-racks-small.toml")
    every, _ = recounted(flown, out)
    in_a, nodes = recounted(flown, out, "--aisles", "A")
    assert in_a
    assert in_a.keys() == {code for code in every if site.locations[code].aisle == "A"}
    assert {site.nodes[node].aisle for node in nodes} == {"A"}
    two = sorted({site.locations[code].node for code in every})[:2]
    _, nodes = recounted(flown, out, "--nodes", ",".join(two))
    assert set(nodes) == set(two)
    occluded, _ = recounted(flown, out, "--states", "occluded")
    assert occluded == {code: why for code, why in every.items() if why == "occluded"}
    assert recounted(flown, out, "--reasons", "unreadable")[0].keys() == every.keys() - occluded.keys()
    some = list(every)[3:5]
    assert list(recounted(flown, out, "--locations", ", ".join(some))[0]) == some
    assert len(recounted(flown, out, "--at-most", "4")[0]) == 4


def test_a_recount_of_so_many_begins_with_differences(flown: Path, tmp_path: Path) -> None:
    out, books = tmp_path / "recount.toml", flown / "books.csv"
    (late,) = list(load_site(CONFIGS / "site-racks-small.toml").locations)[-1:]
    books.write_text(f"location,code\n{late},PALLET-9\n")
    told = json.loads(run("compare", flown, books, "--recount", out, "--at-most", "1", "--json"))
    assert told["recount"] == {late: "empty_but_expected"}


def test_a_recount_takes_the_place_of_an_earlier_one_and_of_nothing_else(flown: Path, tmp_path: Path) -> None:
    out, books, log = tmp_path / "recount.toml", flown / "books.csv", flown / "flight.mcap"
    recounted(flown, out, "--at-most", "1")
    assert len(recounted(flown, out)[1]) > 1
    for taken in (books, log):
        before = taken.read_bytes()
        said = error_of("compare", flown, books, "--recount", taken)
        assert said == f"{taken}: is there already, and no re-count; give the name of a new file"
        assert taken.read_bytes() == before
    assert "Is a directory" in error_of("compare", flown, books, "--recount", ".")


def test_a_recount_takes_the_place_of_no_other_site_file(flown: Path, tmp_path: Path) -> None:
    site = tmp_path / "again-site.toml"
    shutil.copy(CONFIGS / "site-large.toml", site)
    before = site.read_bytes()
    books = flown / "books.csv"
    books.write_text("location,code\n")
    told = load_site(CONFIGS / "site-racks-small.toml")
    with McapRecorder(flown / "flight.mcap") as recorder:
        config = load_config(CONFIGS / "sim.toml").with_values(mission={"site": tmp_path / "gone.toml"})
        record_setting(recorder, 1, FlightSetting(config, told, configured_order(config)))
    said = error_of("compare", flown, books, "--recount", tmp_path / "again.toml")
    assert said == f"{site}: is there already, and holds another site"
    assert site.read_bytes() == before
    recounted(flown, tmp_path / "other.toml")
    assert load_site(tmp_path / "other-site.toml") == told


def test_a_location_is_asked_for_whatever_its_case(flown: Path, tmp_path: Path) -> None:
    assert json.loads(run("show", flown, "--location", "al-01-1-1", "--json"))["location"] == "AL-01-1-1"
    assert list(recounted(flown, tmp_path / "r.toml", "--locations", "al-01-1-1")[0]) == ["AL-01-1-1"]


@pytest.mark.parametrize(
    ("option", "name"),
    [
        ("--aisles", "Z"),
        ("--nodes", "Z9"),
        ("--locations", "nowhere"),
        ("--states", "lost"),
        ("--reasons", "whim"),
    ],
)
def test_a_limit_that_names_nothing_is_refused(flown: Path, tmp_path: Path, option: str, name: str) -> None:
    books = flown / "books.csv"
    books.write_text("location,code\n")
    said = error_of("compare", flown, books, "--recount", tmp_path / "r.toml", option, name)
    assert f"{option} {name}: unknown here; there are " in said


def test_a_misspelt_location_of_the_books_is_named_with_its_line(counted: Path, tmp_path: Path) -> None:
    books = tmp_path / "books.csv"
    books.write_text("location,code\nA-01,PALLET-1\nA-O2,PALLET-2\nA-O2,PALLET-3\n")
    told = RUNNER.invoke(app, ["inventory", "compare", str(counted), str(books), "--json"])
    assert told.exit_code == 0
    assert json.loads(told.stdout)["unknown_locations"] == [{"location": "A-O2", "line": 3}]
    assert f"{books}: line 3: A-O2: {counted} knows no such location" in told.stderr
    assert "line 4" not in told.stderr
    assert "A-01" not in told.stderr
