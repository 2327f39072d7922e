"""The pages of the flights, used by mouse and by keyboard alone, wide and narrow, light and dark."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.replay.synthetic_flight import write_flight
from tests.web.chromium import NARROW, WIDE, hindrances, opened, station

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

DRAWN_TWICE = (
    "() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(() => drawn())))"
)
SIZES = [(WIDE, "light"), (NARROW, "dark")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two flights with a judge, one of them bad, one without a summary, and a broken log; `b` is newest."""
    root = tmp_path_factory.mktemp("flights")
    for seed, name in ((1, "a"), (2, "b")):
        (root / name).mkdir()
        write_flight(root / name, seed=seed)
    verdict(root / "a", '"verdict": "good", "cross_track_rms_m": 0.011', 1_700_000_000)
    verdict(
        root / "b",
        '"verdict": "bad", "cross_track_rms_m": 0.081, "faults": [{"kind": "left_aisle"}]',
        1_760_000_000,
    )
    (root / "c").mkdir()
    shutil.copy(root / "a" / "flight.mcap", root / "c")
    os.utime(root / "c" / "flight.mcap", (1_600_000_000,) * 2)
    whole = (root / "a" / "flight.mcap").read_bytes()
    (root / "broken.mcap").write_bytes(whole[: len(whole) // 2])
    os.utime(root / "broken.mcap", (1_500_000_000,) * 2)
    return root


def verdict(folder: Path, said: str, written_s: int) -> None:
    summary = folder / "summary.json"
    summary.write_text(summary.read_text().rstrip().rstrip("}") + f", {said}}}")
    os.utime(folder / "flight.mcap", (written_s,) * 2)


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        yield url


def rows(page: Page) -> list[str]:
    """The listed flights' missions and years, from top to bottom."""
    return [re.sub(r"\s+", " ", text) for text in page.get_by_role("row").all_inner_texts()[1:]]


def all_read(page: Page) -> None:
    expect(page.get_by_text("4 flights", exact=True)).to_be_visible()


def open_flight(page: Page, year: str = "2023") -> None:
    """From the list."""
    all_read(page)
    page.get_by_role("link", name=re.compile(year)).click()
    expect(page.get_by_role("img", name="Height, m, over time")).to_be_visible()


def slider(page: Page) -> Locator:
    return page.get_by_role("slider", name="Time")


def now_s(page: Page) -> float:
    return float(slider(page).input_value())


@pytest.mark.parametrize(("size", "scheme"), SIZES)
def test_flights_are_listed_newest_first(
    size: tuple[int, int], scheme: str, browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/flights", size, scheme) as page:
        all_read(page)
        years = [year for text in rows(page) for year in re.findall(r"20\d\d", text)[:1]]
        assert years == ["2025", "2023", "2020", "2017"]
        assert "Bad" in rows(page)[0]
        assert "left aisle" in rows(page)[0]
        expect(page.get_by_text("Cut off before its end")).to_be_visible()
        for row in page.get_by_role("row").all()[1:]:
            row.scroll_into_view_if_needed()  # it is fetched only then
            picture = row.get_by_role("img", name="The floor in the middle of the flight")
            assert picture.evaluate("img => img.decode().then(() => img.naturalWidth)") == 160
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        assert hindrances(page) == []


def test_flights_are_sorted_and_filtered_by_keyboard_alone_and_the_address_keeps_it(
    browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/flights") as page:
        all_read(page)
        page.get_by_role("button", name="Cross-track rms").focus()
        page.keyboard.press("Enter")
        column = page.get_by_role("columnheader", name="Cross-track rms")
        expect(column).to_have_attribute("aria-sort", "descending")
        assert [text for text in rows(page) if "8.1" in text] == rows(page)[:1]
        page.keyboard.press("Enter")
        expect(column).to_have_attribute("aria-sort", "ascending")
        assert "1.1" in rows(page)[0]
        assert "8.1" in rows(page)[1], "what is unknown comes last"
        page.keyboard.press("/")
        page.keyboard.type("left aisle")
        expect(page.get_by_text("1 of 4 flights")).to_be_visible()
        page.reload()
        expect(page.get_by_text("1 of 4 flights")).to_be_visible()
        expect(page.get_by_role("searchbox", name="Search flights")).to_have_value("left aisle")
        page.get_by_role("searchbox", name="Search flights").fill("")
        page.get_by_label("Show").select_option("Broken or running logs")
        expect(page.get_by_text("1 of 4 flights")).to_be_visible()
        assert "2017" in rows(page)[0]


def test_one_goes_from_row_to_row_and_opens_a_flight_by_keyboard(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights") as page:
        all_read(page)
        page.get_by_role("link", name=re.compile("2025")).focus()
        page.keyboard.press("ArrowDown")
        expect(page.get_by_role("link", name=re.compile("2023"))).to_be_focused()
        page.keyboard.press("Space")
        expect(page.get_by_role("checkbox", name=re.compile("2023"))).to_be_checked()
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name=re.compile("demo"))).to_be_visible()
        page.go_back()
        all_read(page)


@pytest.mark.parametrize(("size", "scheme"), SIZES)
def test_a_flight_is_played_back(size: tuple[int, int], scheme: str, browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights", size, scheme) as page:
        open_flight(page)
        expect(page.get_by_role("group", name="Map of demo")).to_be_visible()
        expect(page.get_by_role("img", name=re.compile("Down camera: [12] line"))).to_be_visible()
        page.get_by_role("button", name="Play").click()
        expect(page.get_by_role("button", name="Pause")).to_be_visible()
        expect(slider(page)).to_have_value(re.compile(r"^(0\.[5-9]|[1-9])"))
        page.get_by_role("button", name="Pause").click()
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        stood = page.evaluate(DRAWN_TWICE) or slider(page).input_value()
        page.evaluate(DRAWN_TWICE)
        assert slider(page).input_value() == stood
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        assert hindrances(page) == []


def test_time_is_moved_by_keys_wherever_nobody_types(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights") as page:
        open_flight(page)
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowLeft")
        expect(slider(page)).to_have_value("11")
        page.keyboard.press("End")
        expect(slider(page)).to_have_value(re.compile(r"^[6-9]\d"))
        expect(page.get_by_text("12 of 12 nodes visited")).to_be_visible()
        page.keyboard.press("Home")
        expect(slider(page)).to_have_value("0")
        page.keyboard.press(".")
        expect(slider(page)).not_to_have_value("0")
        first = slider(page).input_value()
        page.keyboard.press(".")
        expect(slider(page)).not_to_have_value(first)
        assert now_s(page) > float(first)
        page.keyboard.press(",")
        expect(slider(page)).to_have_value(first)
        page.keyboard.press("+")
        expect(page.get_by_role("combobox", name="Speed")).to_have_value("2")
        page.keyboard.press("Space")
        expect(page.get_by_role("button", name="Pause")).to_be_visible()
        page.keyboard.press("Space")
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        page.get_by_text("Keys", exact=True).click()
        page.get_by_role("checkbox", name="Keys of one character").uncheck()
        slider(page).focus()
        before_s = now_s(page)
        page.keyboard.press(".")
        assert now_s(page) == before_s, "they are switched off"
        page.keyboard.press("ArrowRight")
        expect(slider(page)).not_to_have_value(str(before_s))
        page.get_by_role("combobox", name="Speed").focus()
        before_s = now_s(page)
        page.keyboard.press("Home")
        assert now_s(page) == before_s, "the list of speeds has its own keys"


def test_a_click_on_a_plot_or_an_event_goes_to_its_time_and_plots_show_a_stretch_around_it(
    browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/flights") as page:
        open_flight(page)
        whole_s = float(slider(page).get_attribute("max") or 0)
        plot = page.get_by_role("img", name="Speed, m/s, over time").locator(".u-over")
        plot.evaluate("plot => plot.scrollIntoView({block: 'center'})")
        box = plot.bounding_box()
        assert box is not None
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 30)
        expect(slider(page)).not_to_have_value("0")
        assert now_s(page) == pytest.approx(whole_s / 2, abs=0.02 * whole_s)
        page.get_by_role("region", name="Events").get_by_role(
            "button", name=re.compile("take_off|take off")
        ).first.click()
        expect(page.get_by_role("heading", name="Taking off")).to_be_visible()
        assert now_s(page) == pytest.approx(2.5, abs=0.2)

        slider(page).press("Home")
        expect(slider(page)).to_have_value("0")
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("Shift+ArrowRight")
        with page.expect_response(re.compile("/series")):
            page.get_by_label("Plots show").select_option("10 s")
        expect(page.get_by_role("img", name="Height, m, over time")).to_be_visible()
        spans = [re.search(r"from=([\d.]+)&to=([\d.]+)", one) for one in asked]
        (from_s, to_s), *_ = [(float(one[1]), float(one[2])) for one in spans if one]
        assert to_s - from_s == pytest.approx(10)
        assert from_s <= 20 <= to_s
        output = page.get_by_role("figure").filter(has_text="Height").locator("b").first
        expect(output).to_have_text(re.compile(r"1\.[45]\d"))


@pytest.mark.parametrize(("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")])
def test_two_flights_are_compared(size: tuple[int, int], scheme: str, browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights", size, scheme) as page:
        all_read(page)
        page.get_by_role("checkbox", name=re.compile("2023")).check()
        page.get_by_role("checkbox", name=re.compile("2025")).check()
        page.get_by_role("link", name="Compare both").click()
        table = page.get_by_role("region", name="Figures")
        cross = table.get_by_role("row").filter(has_text="Cross-track rms")
        expect(cross).to_contain_text("1.1")
        expect(cross).to_contain_text("8.1")
        expect(cross).to_contain_text("+7.0 cm")
        expect(cross).to_contain_text("worse")
        expect(page.get_by_role("img", name="Height, m, over time")).to_be_visible()
        page.keyboard.press("Shift+ArrowRight")
        expect(page.get_by_role("img", name="The first flight's drone")).to_have_count(1)
        expect(page.get_by_role("img", name="The second flight's drone")).to_have_count(1)
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        assert hindrances(page) == []


def test_what_cannot_be_shown_says_so_and_is_tried_again(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights/0123456789abcdef") as page:
        expect(page.get_by_text("There is no such flight.")).to_be_visible()
        page.get_by_role("button", name="Try again").click()
        expect(page.get_by_text("There is no such flight.")).to_be_visible()
        page.goto(f"{url}/flights/compare?a=x")
        expect(page.get_by_role("heading", name="The flight cannot be shown")).to_be_visible()
        page.get_by_role("link", name="All flights").click()
        all_read(page)


def test_a_broken_log_is_played_as_far_as_it_goes(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights") as page:
        open_flight(page, "2017")
        expect(page.get_by_text("The log is cut off before its end")).to_be_visible()


def test_a_report_opens_beside_and_reaches_nothing_of_the_station(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights") as page:
        open_flight(page)
        with page.context.expect_page(timeout=60_000) as other:
            page.get_by_role("link", name="Report").click()
        report = other.value
        expect(report.get_by_role("heading", name="Mission completed")).to_be_visible(timeout=60_000)
        assert report.evaluate("window.origin") == "null"
        assert report.evaluate("window.opener") is None
        reached = report.evaluate("fetch('/api/flights').then(() => 'reached', () => 'refused')")
        assert reached == "refused"


def test_a_flight_takes_focus_and_title_keys_scroll_the_slider_obeys_them_once_and_escape_stops(
    browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/flights") as page:
        open_flight(page)
        expect(page.get_by_role("main")).to_be_focused()
        expect(page).to_have_title(re.compile("2023.* · Flights · flightd$"))
        for key in ("PageDown", "PageUp"):
            page.keyboard.press(key)
        assert now_s(page) == 0.0
        page.keyboard.press("End")
        expect(slider(page)).not_to_have_value("0")
        page.keyboard.press("Home")
        expect(slider(page)).to_have_value("0")
        slider(page).focus()
        page.keyboard.press("ArrowRight")
        expect(slider(page)).to_have_value("1")
        said = slider(page).get_attribute("aria-valuetext")
        assert said is not None
        assert said.startswith("0:01.0, On the ground")
        page.keyboard.press("Escape")
        expect(page.get_by_role("button", name="STOPPING")).to_be_visible()


def test_without_a_folder_the_page_says_how_to_give_one(browser: Browser) -> None:
    with station(["demo=127.0.0.1:1/1"]) as url, opened(browser, f"{url}/flights", NARROW) as page:
        expect(page.get_by_role("heading", name="No folder of flights")).to_be_visible()
        assert hindrances(page) == []
