"""The page Stock against the books: uploaded, compared with what is counted, refused."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import LocationState
from tests.web.chromium import NARROW, hindrances, opened, station
from tests.web.stock_rig import SSCC, cell, code, counted_store, look

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

BOOKS = (
    "Lagerplatz;Menge;Artikel\n"
    f"al-01-1-1;1;(00){SSCC}\n"
    "AL-01-2-1;12;04006381333931\n"
    "AL-02-1-1;3;=HYPERLINK(0)\n"
    "AL-02-2-1;1;PAL-1\n"
    "AL-03-2-1;1;pal-7/l1\n"
    "AL-04-2-1;;\n"
    ";1;X\n"
    "AZ-99;1;X\n"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    counted_store(tmp_path / "monday")
    return tmp_path


@pytest.fixture
def url(folder: Path) -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        yield f"{url}/stock"


def upload(page: Page, file: Path) -> None:
    expect(page.get_by_role("button", name="Upload CSV or XLSX")).to_be_visible()
    page.locator("input[type=file]").set_input_files(file)


def outcomes(page: Page) -> Locator:
    return page.get_by_role("list", name="Outcomes").get_by_role("listitem")


def test_the_books_are_uploaded_and_every_difference_is_shown(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    books = tmp_path / "books.csv"
    books.write_text(BOOKS)
    with opened(browser, url) as page:
        page.evaluate("document.addEventListener('click', (e) => (window.lastClicked = e.target.type), true)")
        page.get_by_role("button", name="Upload CSV or XLSX").focus()
        page.keyboard.press("Enter")
        assert page.evaluate("window.lastClicked") == "file", "the key opens what chooses a file"
        upload(page, books)
        expect(outcomes(page)).to_have_text(
            ["3 as expected", "3 unexpected", "1 empty", "2 not countable"]
        )  # fmt: skip
        expect(page.get_by_text("row 8: no place")).to_be_visible()
        expect(page.get_by_text("One place of the file is not in this inventory:")).to_be_visible()
        expect(page.get_by_role("listitem").filter(has_text="AZ-99")).to_be_visible()
        expect(page.get_by_label("Quantities are in")).to_have_value("1")
        table = page.get_by_role("group", name="Differences")
        expect(table.get_by_role("row", name="AL-02-1-1 empty =HYPERLINK(0) quantity 3")).to_be_visible()
        expect(cell(page, "AL-02-1-1")).to_have_accessible_name("AL-02-1-1, empty, not as expected")
        page.get_by_role("group", name="States").get_by_role("button", name="Not as expected 4").click()
        expect(cell(page, "AL-01-1-1")).to_have_class(re.compile("aside"))
        table.get_by_role("button", name="AL-03-2-1").click()
        card = page.get_by_role("region", name="AL-03-2-1")
        expect(card.get_by_role("list", name="Against the expected stock")).to_contain_text(
            "unexpected: PAL-8/L1"
        )
        assert hindrances(page) == []
        with page.expect_download() as download:
            page.get_by_role("button", name="Comparison CSV").click()
        saved = tmp_path / "saved.csv"
        download.value.save_as(saved)
        rows = {row["location"]: row for row in csv.DictReader(io.StringIO(saved.read_text()))}
        assert (rows["AL-02-1-1"]["code"], rows["AL-02-1-1"]["quantity"]) == ("'=HYPERLINK(0)", "3")
        page.get_by_label("Codes are in").select_option("Menge")
        expect(page.get_by_text("places, codes and quantities stand in different columns")).to_be_visible()
        page.get_by_label("Quantities are in").select_option("none")
        expect(outcomes(page).first).not_to_have_text("3 as expected")
        page.reload()
        expect(page.get_by_text("Kept for everybody since")).to_be_visible()
        expect(page.get_by_label("Codes are in")).to_have_value("1")
        states = page.get_by_role("group", name="States")
        states.get_by_role("button", name=re.compile("Not as expected")).click()
        with opened(browser, url, NARROW, "dark") as other:
            expect(other.get_by_text("books.csv: CSV")).to_be_visible()
            expect(other.get_by_text("against the books: empty")).to_be_visible()
            assert hindrances(other) == []
            other.get_by_role("button", name="Remove").click()
            expect(other.get_by_text("kept at this station for everybody")).to_be_visible()
        expect(page.get_by_text("kept at this station for everybody")).to_be_visible()
        expect(page.get_by_role("button", name=re.compile("Not as expected"))).to_have_count(0)


def test_an_upload_is_compared_anew_with_what_is_counted_since(
    browser: Browser, url: str, folder: Path
) -> None:
    books = folder / "books.csv"
    books.write_text("place,code\nBL-01-1-2,PAL-11/L1\n")
    with SqliteStore(folder / "monday") as store, opened(browser, url) as page:
        upload(page, books)
        expect(outcomes(page).filter(has_text="not countable")).to_have_text("1 not countable")
        store.commit(look("BL-01-1-2", LocationState.READ, code("PAL-11/L1"), at_s=60))
        expect(outcomes(page).filter(has_text="as expected")).to_have_text("1 as expected")


def test_a_file_that_is_no_table_is_refused_in_words(browser: Browser, url: str, tmp_path: Path) -> None:
    (tmp_path / "photo.csv").write_bytes(b"\x89PNG\x00\x00")
    with opened(browser, url, NARROW) as page:
        upload(page, tmp_path / "photo.csv")
        expect(page.get_by_text("photo.csv: neither text nor a workbook; save it as CSV")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        assert hindrances(page) == []
