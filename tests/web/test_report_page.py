"""The report in a real browser: read by everybody, reached by key, filtered and taken along off-line."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.cli.main import app
from flightd.core.csv_text import exact
from flightd.core.inventory import LocationState
from flightd.studies.counted_stock import counted_beside
from tests.replay.synthetic_count import site_with_racks, write_count, write_stock
from tests.replay.synthetic_flight import SITE_TOML, write_flight
from tests.web.chromium import NARROW, WIDE, hindrances, opened

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect
from typer.testing import CliRunner


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a flight with its count, its books and its report."""
    folder = tmp_path_factory.mktemp("report")
    site = site_with_racks(SITE_TOML)
    log = write_flight(folder)
    write_count(folder, site)
    write_stock(folder / "stock.csv", site)
    made = CliRunner().invoke(app, ["report", str(log), "--expected", str(folder / "stock.csv")])
    assert made.exit_code == 0, made.output
    return folder


@pytest.fixture
def url(folder: Path) -> str:
    return (folder / "report.html").as_uri()


def codes(folder: Path, state: LocationState) -> list[str]:
    count = counted_beside(folder / "flight.mcap")
    assert count is not None
    return [record.code for record in count.records if record.state is state]


def downloaded(page: Page, name: str, to: Path) -> str:
    with page.expect_download() as coming:
        page.get_by_role("button", name=f"Download {name}").click()
    coming.value.save_as(to)
    assert coming.value.suggested_filename == f"inventory.{name.lower()}"
    return to.read_text()


def plain(row: dict[str, str]) -> dict[str, str | float]:
    """A row of an export, its numbers as numbers, for 1 is written 1.0 elsewhere."""
    numbers = {"confidence", "x_m", "y_m", "height_m"}
    return {
        name: float(cell) if name in numbers and cell else cell
        for name, cell in row.items()
        if name != "outcome"
    }


@pytest.mark.parametrize(("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")])
def test_everybody_can_read_it_in_any_light_and_width(
    browser: Browser, url: str, size: tuple[int, int], scheme: str
) -> None:
    with opened(browser, url, size, scheme) as page:
        page.evaluate("for (const folded of document.querySelectorAll('details')) folded.open = true")
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        page.locator("table.exceptions").get_by_role("button").first.click()
        assert hindrances(page) == []


def test_an_exception_is_opened_and_closed_by_key_and_the_focus_comes_back(
    browser: Browser, url: str
) -> None:
    with opened(browser, url) as page:
        first = page.locator("table.exceptions").get_by_role("button").first
        code = first.text_content() or ""
        page.get_by_role("button", name="Download JSON").focus()
        for _ in range(2000):
            page.keyboard.press("Tab")
            if first.evaluate("node => node === document.activeElement"):
                break
        expect(first).to_be_focused()
        dialog = page.get_by_role("dialog", name=code)
        page.keyboard.press("Enter")
        expect(dialog).to_be_visible()
        page.keyboard.press("Escape")
        expect(dialog).to_be_hidden()
        expect(first).to_be_focused()
        page.keyboard.press("Enter")
        dialog.get_by_role("button", name="Close").press("Enter")
        expect(dialog).to_be_hidden()
        expect(first).to_be_focused()
        page.locator("table.exceptions tbody tr").first.locator("td").last.click()
        expect(dialog).to_be_visible()
        dialog.get_by_role("button", name="Close").click()
        expect(first).to_be_focused()


def test_the_filter_shows_the_places_that_are_wanted(browser: Browser, url: str, folder: Path) -> None:
    wanted = codes(folder, LocationState.UNREADABLE)
    with opened(browser, url) as page:
        rows = page.locator("table.exceptions tbody tr:visible")
        every = rows.count()
        assert every > len(wanted) > 0
        page.get_by_label("State").select_option("unreadable")
        expect(rows).to_have_count(len(wanted))
        expect(page.get_by_role("search").get_by_role("status")).to_have_text(
            re.compile(rf"^{len(wanted)} of \d+ locations$")
        )
        assert page.locator(".racks button.cell:not(.out)").count() == len(wanted)
        page.get_by_label("Location or code").fill(wanted[0].lower())
        expect(rows).to_have_count(1)
        expect(rows.get_by_role("button")).to_have_text(wanted[0])
        page.get_by_label("Location or code").fill("")
        page.get_by_label("State").select_option("")
        expect(rows).to_have_count(every)


def test_the_table_is_taken_along_as_csv_and_json(
    browser: Browser, url: str, folder: Path, tmp_path: Path
) -> None:
    exported = CliRunner().invoke(app, ["inventory", "export", str(folder)]).stdout
    wanted = list(csv.DictReader(exported.splitlines()))
    with opened(browser, url) as page:
        rows = list(csv.DictReader(downloaded(page, "CSV", tmp_path / "all.csv").splitlines()))
        assert [plain(row) for row in rows] == [plain(row) for row in wanted]
        assert {row["outcome"] for row in rows} >= {"", "empty but expected"}
        page.get_by_label("State").select_option("several")
        told = json.loads(downloaded(page, "JSON", tmp_path / "some.json"))
    several = [row for row in wanted if row["state"] == "several"]
    assert [(row["location"], row["text"]) for row in told] == [
        (row["location"], exact(row["text"])) for row in several
    ]
    assert several


def test_a_label_that_is_a_formula_is_none_in_the_download(browser: Browser, tmp_path: Path) -> None:
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.core.inventory import Observation
    from flightd.core.types import CodeRead

    texts = ("=HYPERLINK(1)", "'+1", 'say "x", y', "A;=1\t-2")
    log = write_flight(tmp_path, truth=False, summary=False)
    with SqliteStore(tmp_path) as store:
        for number, text in enumerate(texts):
            read = CodeRead("QR Code", text, (), True, 1, 1.0)
            store.commit(Observation("r", f"A-{number}", number, LocationState.READ, 0.9, (read,)))
    assert CliRunner().invoke(app, ["report", str(log)]).exit_code == 0
    with opened(browser, (tmp_path / "report.html").as_uri()) as page:
        text = downloaded(page, "CSV", tmp_path / "stock.csv")
    cells = [row["text"] for row in csv.DictReader(text.splitlines())]
    assert cells == ["'=HYPERLINK(1)", "''+1", 'say "x", y', "A;'=1\t'-2"]
    assert [exact(cell) for cell in cells] == list(texts)
