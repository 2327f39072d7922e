"""The page Studio: a colour learnt by mouse and keys, compared, installed, taken back."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from flightd.config.schema import load_config
from flightd.site.site_file import load_site
from flightd.vision.lines.colour_profile import load_profile
from tests.web.chromium import NARROW, WIDE, hindrances, opened, station
from tests.web.live_flight import LiveFlight
from tests.web.studio_rig import HEIGHT, WIDTH, flown_folder, marks_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
pytest.importorskip("sklearn", reason="training needs scikit-learn: pip install -e '.[train]'")
from playwright.sync_api import expect

SIZES = [(WIDE, "light"), (WIDE, "dark"), (NARROW, "light"), (NARROW, "dark")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_folder(tmp_path_factory.mktemp("studio-page"))


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        yield url


def drag(page: Page, first: list[float], last: list[float]) -> None:
    """With the mouse over the picture, from pixel to pixel of it."""
    box = page.get_by_label("Picture to mark in").bounding_box()
    assert box is not None
    scale = box["width"] / WIDTH
    places = [
        (box["x"] + min(max(x, 3), WIDTH - 3) * scale, box["y"] + min(max(y, 3), HEIGHT - 3) * scale)
        for x, y in (first, last)
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=5)
    page.mouse.up()


def lines_in(page: Page) -> list[dict[str, Any]]:
    """What the shipped profile sees in the picture in hand: where to draw."""
    asked: list[dict[str, Any]] = page.evaluate(
        """async () => {
            const picked = document.querySelector(".thumb[aria-pressed=true] img").src;
            const data = await (await fetch(`${picked}/mask?by=yellow`)).arrayBuffer();
            const length = new DataView(data).getUint32(0);
            return JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))).lines;
        }"""
    )
    return asked


def mark(page: Page) -> None:
    """Paint along the line by a stroke, floor beside it by a box."""
    paint, floor = marks_of(lines_in(page))["regions"]
    page.get_by_role("button", name="Paint").click()
    page.get_by_role("button", name="Stroke").click()
    drag(page, paint["stroke"][0], paint["stroke"][1])
    page.get_by_role("button", name="Floor").click()
    page.get_by_role("button", name="Box").click()
    (x0, y0), (x1, y1) = floor["stroke"]
    drag(page, [min(x0, x1) - 8, min(y0, y1) - 8], [max(x0, x1) + 8, max(y0, y1) + 8])


def learn(page: Page, verdict: str | re.Pattern[str]) -> None:
    page.get_by_role("button", name="Learn from the marks").click()
    expect(page.get_by_text(verdict)).to_be_visible(timeout=300_000)


def turn_marks_round(page: Page) -> None:
    """Paint for floor and floor for paint, in every picture, as somebody does who mistook the buttons."""
    page.evaluate(
        """async () => {
            const at = `/api/studio/sets/${location.pathname.split("/")[2]}`;
            for (const one of (await (await fetch(at)).json()).pictures) {
                const regions = one.regions.map((region) => ({ ...region, paint: !region.paint }));
                const said = JSON.stringify({ regions, lines: [] });
                const headers = { "Content-Type": "application/json" };
                await fetch(`${at}/pictures/${one.file}`, { method: "PUT", headers, body: said });
            }
        }"""
    )
    page.reload()


def test_a_colour_is_learnt_compared_installed_and_taken_back(
    browser: Browser, url: str, folder: Path
) -> None:
    with opened(browser, f"{url}/studio") as page:
        page.get_by_label("Name of a new set").fill("hall")
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="hall")).to_be_visible()
        page.get_by_role("button", name="From a flight").click()
        page.get_by_role("button", name=re.compile("Take 8 from all")).click()
        thumbs = page.get_by_role("region", name="Pictures").get_by_role("listitem")
        expect(thumbs).to_have_count(8, timeout=60_000)
        page.get_by_role("button", name="From a flight").click()
        for number in range(1, 9):
            page.get_by_role("button", name=re.compile(rf"^{number}\. ")).click()
            mark(page)
            expect(page.get_by_role("button", name=f"{number}. 2 marks")).to_be_visible()
        taught = re.compile(r"\d+ % of the picture is taken for paint, \d line")
        expect(page.get_by_text(taught)).to_be_visible(timeout=60_000)

        # a line by two ends, by keys alone
        page.get_by_label("Picture to mark in").focus()
        for key in ("3", "Space", "Shift+ArrowUp", "Shift+ArrowUp", "Space"):
            page.keyboard.press(key)
        expect(page.get_by_role("button", name="8. 2 marks, 1 line")).to_be_visible()
        page.keyboard.press("Backspace")
        expect(page.get_by_role("button", name="8. 2 marks", exact=True)).to_be_visible()

        learn(page, re.compile("No different from|Better than"))
        scores = page.get_by_role("group", name="Scores")
        expect(scores.get_by_role("columnheader", name="shipped yellow")).to_be_visible()
        page.get_by_label("Who").fill("Ann")
        page.get_by_role("button", name="Install", exact=True).click()
        profile = page.get_by_role("region", name="Profile hall")
        expect(profile.get_by_role("listitem").filter(has_text="Version 1")).to_contain_text("installed")
        first = load_profile(folder / "profiles" / "hall.npz").training_hash

        turn_marks_round(page)
        learn(page, "Worse than what flies now")
        page.get_by_role("button", name="Install", exact=True).click()
        asks = page.get_by_role("alert").filter(has_text="It is worse than what flies now")
        asks.get_by_role("button", name="No").click()
        assert load_profile(folder / "profiles" / "hall.npz").training_hash == first
        page.get_by_role("button", name="Install", exact=True).click()
        asks.get_by_role("button", name="Yes, install the worse one").click()
        expect(profile.get_by_role("listitem").filter(has_text="Version 2")).to_contain_text("installed")
        assert load_profile(folder / "profiles" / "hall.npz").training_hash != first
        profile.get_by_role("button", name="Take back to 1").click()
        expect(profile.get_by_role("listitem").filter(has_text="Version 1")).to_contain_text("installed")
        assert load_profile(folder / "profiles" / "hall.npz").training_hash == first

    for size, scheme in SIZES:
        for path in ("/studio", "/studio/hall"):
            with opened(browser, f"{url}{path}", size, scheme) as page:
                expect(page.get_by_role("region", name="Profile hall")).to_be_visible()
                assert page.evaluate("document.documentElement.scrollWidth") == size[0]
                assert hindrances(page) == []


def test_what_is_refused_says_why_and_stop_is_in_reach(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/studio/nothing") as page:
        expect(page.get_by_text("there is no set nothing")).to_be_visible()
        page.get_by_role("link", name="All sets").click()
        page.get_by_label("Name of a new set").fill("files")
        page.get_by_role("combobox", name="Paint").select_option("another …")
        page.get_by_role("button", name="Make the set").click()
        expect(page.get_by_text("#7a3fa0 paint")).to_be_visible()
        page.get_by_role("button", name="Files").click()
        page.get_by_label("JPEG or PNG").set_input_files(
            {"name": "a.jpg", "mimeType": "image/jpeg", "buffer": b"no picture"}
        )
        expect(page.get_by_role("alert").filter(has_text="this is no picture")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("button", name="STOPPING")).to_be_visible()


def test_a_live_picture_of_a_drone_is_taken(browser: Browser, tmp_path: Path) -> None:
    configs = Path(__file__).parents[2] / "configs"
    waits = load_config(configs / "sim.toml").with_values(mission={"autostart": False})
    with LiveFlight(load_site(configs / "site-demo.toml"), waits) as flight:
        status, command = flight.ports
        with (
            station([f"demo=127.0.0.1:{status}/{command}"], folder=tmp_path) as url,
            opened(browser, f"{url}/studio") as page,
        ):
            page.get_by_label("Name of a new set").fill("live")
            page.keyboard.press("Enter")
            page.get_by_role("button", name="Live").click()
            page.get_by_role("button", name="Take this picture").click(timeout=60_000)
            expect(page.get_by_role("button", name="1. nothing marked")).to_be_visible(timeout=60_000)
            expect(page.get_by_label("Picture to mark in")).to_be_visible()


def test_without_a_folder_the_page_says_how_to_give_one(browser: Browser) -> None:
    with station(["demo=127.0.0.1:1/1"]) as url, opened(browser, f"{url}/studio", NARROW) as page:
        expect(page.get_by_role("heading", name="No folder to work in")).to_be_visible()
