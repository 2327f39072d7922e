"""Folders and files as nobody would make them: told in one line, and the other inventories are shown."""

from __future__ import annotations

import io
import json
import os
import shutil
import sqlite3
from pathlib import Path

import pytest
from PIL import Image
from starlette.requests import Request
from starlette.responses import Response

from flightd.core.errors import InputError, RunError
from flightd.ground.evidence_outlines import outlines
from flightd.ground.stock_routes import answered
from flightd.ground.stores import Stores
from flightd.site.site_file import load_site
from flightd.vision.jpeg import jpeg_size
from flightd.vision.shelf.evidence_jpeg import picture_name
from tests.rigs.event_loops import in_real_time
from tests.rigs.odd_jpegs import resized
from tests.web.served import served
from tests.web.stock_rig import RACKS, counted_store, flown_log, picture_of
from tests.web.test_stock_routes import NOBODY, got

PLAIN = load_site(Path(__file__).parents[2] / "configs" / "site-demo.toml")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    counted_store(tmp_path / "hall" / "monday")
    return tmp_path / "hall"


@in_real_time
async def test_a_folder_whose_name_is_no_text_is_listed_and_shown(folder: Path) -> None:
    odd = folder / os.fsdecode(b"caf\xe9")
    try:
        shutil.copytree(folder / "monday", odd)
    except OSError:
        pytest.skip("this file system takes no such names")
    (odd / "broken").mkdir()
    (odd / "broken" / "inventory.db").write_bytes(b"nothing of ours" * 300)
    async with served(NOBODY, folder=odd.parent) as station:
        code, told = await got(station, "")
        names = {store["name"] for store in told["stores"]}
        assert (code, names) == (200, {"monday", r"caf\udce9", r"caf\udce9/broken"})
        assert (await got(station, r"/places?store=caf%5Cudce9"))[0] == 200
        code, told = await got(station, r"/places?store=caf%5Cudce9/broken")
        assert (code, "no inventory, or a damaged one" in told["refused"]) == (404, True)
    async with served(NOBODY, folder=odd) as station:
        assert (await got(station, ""))[1]["folder"] == r"caf\udce9"


@pytest.mark.parametrize(
    "spoilt",
    [
        "UPDATE code_read SET gs1 = 'no JSON'",
        "UPDATE code_read SET gs1 = '[1]'",
        "UPDATE code_read SET gs1 = '[[[\"00\"], 1]]'",
        """UPDATE code_read SET gs1 = '[["00", "\\ud800"]]'""",
        "UPDATE code_read SET text = CAST(x'ff41' AS TEXT)",
        "UPDATE observation SET standing = 7",
        "UPDATE observation SET x_m = NULL",
        "PRAGMA ignore_check_constraints = ON; UPDATE observation SET state = 'stolen'",
        "PRAGMA ignore_check_constraints = ON; UPDATE observation SET confidence = 2.0",
    ],
)
@in_real_time
async def test_a_store_with_rows_that_are_none_of_ours_is_told_in_one_line(folder: Path, spoilt: str) -> None:
    shutil.copytree(folder / "monday", folder / "odd")
    book = sqlite3.connect(folder / "odd" / "inventory.db")
    book.executescript(spoilt)
    book.close()
    async with served(NOBODY, folder=folder) as station:
        for way in ("/places?store=odd", "/place?store=odd&code=AL-01-1-1", "/export?store=odd&format=json"):
            code, told = await got(station, way)
            assert code in {404, 409, 503}, way
            assert told["refused"]
            assert "\n" not in told["refused"]
        assert (await got(station, "/places?store=monday"))[0] == 200


@in_real_time
async def test_a_decision_that_nobody_knows_is_told_in_one_line(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        assert (await got(station, "/decisions?store=monday"))[1] == {"decisions": []}
        from flightd.ground.decision_book import Decided, Decision, DecisionBook

        DecisionBook(folder).add("monday", Decision("12345678", "AL-01-1-1", 1, 1, Decided.FINE, "Ann"))
        book = sqlite3.connect(folder / "ground.db")
        with book:
            book.execute("UPDATE decision SET what = 'burn'")
        book.close()
        code, told = await got(station, "/decisions?store=monday")
        assert (code, "'burn' is not a valid Decided" in told["refused"]) == (404, True)


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (PermissionError(13, "Permission denied", "/x"), 503, "cannot be read: Permission denied"),
        (ValueError("of a row\nthat is none"), 409, "this inventory cannot be shown: ValueError"),
        (RunError(os.fsdecode(b"caf\xe9")), 409, r"caf\udce9"),
    ],
)
@in_real_time
async def test_what_nobody_thought_of_is_an_answer_in_one_line(
    error: Exception, status: int, said: str
) -> None:
    async def fails(_: Request) -> Response:
        raise error

    request = Request({"type": "http", "method": "GET", "path": "/", "headers": [], "server": ("x", 1)})
    answer = await answered(fails)(request)
    assert (answer.status_code, json.loads(bytes(answer.body))) == (status, {"refused": said})


def test_neither_links_nor_pipes_are_opened(folder: Path) -> None:
    outside = folder.parent / "outside"
    counted_store(outside)
    (folder / "linked").mkdir()
    (folder / "linked" / "inventory.db").symlink_to(outside / "inventory.db")
    (folder / "pipe").mkdir()
    os.mkfifo(folder / "pipe" / "inventory.db")
    os.mkfifo(folder / "monday" / "flight.mcap")
    stores = Stores(folder)
    assert [name for name, _ in stores.names()] == ["monday"]
    assert stores.view("monday").places
    os.mkfifo(folder / "monday" / "inventory.db-wal")
    with pytest.raises(InputError, match="no plain file"):
        stores.view("monday")


@pytest.mark.parametrize("what", ["file", "folder", "all", "pipe"])
def test_a_picture_that_lies_elsewhere_is_not_shown(folder: Path, what: str) -> None:
    stores, jpeg = Stores(folder), picture_of("00340123450002439853")
    name = picture_name(jpeg)
    evidence = folder / "monday" / "evidence"
    file = evidence / name[:2] / f"{name}.jpg"
    assert stores.picture("monday", name) == jpeg
    moved = {"file": file, "folder": file.parent, "all": evidence, "pipe": file}[what]
    moved.rename(folder.parent / "moved")
    if what == "pipe":
        os.mkfifo(file)
    else:
        moved.symlink_to(folder.parent / "moved")
    with pytest.raises(InputError, match="was not kept"):
        stores.picture("monday", name)


def test_a_picture_of_absurd_size_is_refused_before_it_is_decoded(folder: Path) -> None:
    huge = resized(picture_of("A"), 65_000, 65_000)
    assert jpeg_size(huge) == (65_000, 65_000)
    name = picture_name(huge)
    file = folder / "monday" / "evidence" / name[:2] / f"{name}.jpg"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(huge)
    with pytest.raises(InputError, match="larger than any camera's"):
        Stores(folder).picture("monday", name)
    assert outlines(huge) == ()
    out = io.BytesIO()
    Image.new("1", (8000, 8000)).save(out, "PNG")
    assert outlines(out.getvalue()) == (), "no JPEG"
    assert [text for text, _ in outlines(picture_of("ABC"))] == ["ABC"]


def test_a_flight_that_is_written_anew_under_the_same_name_shows_its_own_map(folder: Path) -> None:
    stores, log = Stores(folder), folder / "monday" / "flight.mcap"
    flown_log(log, PLAIN)
    os.utime(log, ns=(1, 1))
    assert "A" not in {front.aisle for front in stores.view("monday").fronts}
    flown_log(log, RACKS)
    database = folder / "monday" / "inventory.db"
    os.utime(database, ns=(1, 1))
    assert "A" in {front.aisle for front in stores.view("monday").fronts}
