"""The guide in the ground station: read, searched and walked through, by mouse and by keyboard alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.web.chromium import NARROW, WIDE, hindrances, opened, station

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

TABLE = re.compile("Hazards.*The table")
SIZES = [(WIDE, "light"), (NARROW, "dark")]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"]) as url:
        yield url


def heading(page: Page, name: str) -> None:
    expect(page.get_by_role("heading", name=name, exact=True)).to_be_visible()


@pytest.mark.parametrize(("size", "scheme"), SIZES)
@pytest.mark.parametrize(("topic", "title"), [("ground-station", "Ground station"), ("hazards", "Hazards")])
def test_a_page_is_read(
    topic: str, title: str, size: tuple[int, int], scheme: str, browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/guide/{topic}", size, scheme) as page:
        heading(page, title)
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        pages = page.get_by_role("navigation", name="Pages", exact=True)
        for name in ("Live", "Stock", "Flights", "Guide"):
            expect(pages.get_by_role("link", name=name)).to_be_in_viewport(ratio=1.0)
        assert hindrances(page) == []


def test_pictures_of_the_guide_are_shown(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/guide/architecture") as page:
        pictures = page.get_by_role("article").get_by_role("img")
        pictures.first.scroll_into_view_if_needed()
        expect(pictures.first).to_have_js_property("complete", True)
        assert int(pictures.first.evaluate("picture => picture.naturalWidth")) > 0


def test_links_lead_to_pages_and_to_their_headings_without_leaving_the_document(
    browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/guide") as page:
        page.evaluate("window.sameDocument = true")
        page.get_by_role("article").get_by_role("link", name="Ground station", exact=True).click()
        heading(page, "Ground station")
        page.get_by_role("article").get_by_role("link", name="ground link", exact=True).first.click()
        heading(page, "Ground link")
        page.go_back()
        heading(page, "Ground station")
        page.get_by_role("navigation", name="On this page").get_by_role("link", name="Orders").click()
        expect(page.get_by_role("heading", name="Orders")).to_be_in_viewport()
        page.get_by_role("navigation", name="Guide").get_by_role("link", name="Hazards").click()
        heading(page, "Hazards")
        page.get_by_role("navigation", name="Pages before and after").get_by_role(
            "link", name=re.compile("After")
        ).click()
        heading(page, "Safety case")
        assert page.evaluate("window.sameDocument")


def test_a_link_to_a_heading_of_another_page_arrives_there(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/guide/ground-station") as page:
        link = page.get_by_role("article").locator("a[href*='#']").first
        target = link.get_attribute("href")
        assert target is not None
        link.click()
        expect(page).to_have_url(f"{url}{target}")
        expect(page.locator(f"[id='{target.partition('#')[2]}']")).to_be_in_viewport()


@pytest.mark.parametrize(("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")])
def test_the_guide_is_searched_by_keyboard_alone(
    size: tuple[int, int], scheme: str, browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/guide/vision", size, scheme) as page:
        heading(page, "Vision")
        page.keyboard.press("/")
        page.keyboard.type("telemetry_stale")
        hits = page.get_by_role("list").filter(has=page.locator("mark"))
        expect(hits.get_by_role("link", name=TABLE)).to_be_visible()
        expect(hits.locator("mark").first).to_have_text("telemetry_stale")
        assert hindrances(page) == []
        page.reload()
        expect(hits.get_by_role("link", name=TABLE)).to_be_visible()
        hits.get_by_role("link", name=TABLE).focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="The table")).to_be_in_viewport()
        page.go_back()
        expect(page.get_by_role("searchbox", name="Search the guide")).to_have_value("telemetry_stale")
        page.go_back()
        heading(page, "Vision")


def test_what_is_found_nowhere_and_what_is_no_page_say_so(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/guide/search?q=nosuchword") as page:
        expect(page.get_by_text("Nothing in the guide holds “nosuchword”")).to_be_visible()
        page.goto(f"{url}/guide/nothing")
        heading(page, "The page cannot be shown")
        page.get_by_role("link", name="All pages").first.click()
        title = page.get_by_role("article").get_by_role("heading", name="flightd", exact=True)
        expect(title).to_be_visible()


def test_a_narrow_page_is_chosen_from_a_list(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/guide", NARROW) as page:
        page.get_by_role("combobox", name="Page", exact=True).select_option("Cameras")
        heading(page, "Cameras")
        expect(page).to_have_url(f"{url}/guide/cameras")


def test_a_topic_takes_focus_and_title_and_is_chosen_by_key_only_when_it_is_meant(
    browser: Browser, url: str
) -> None:
    with opened(browser, f"{url}/guide", NARROW) as page:
        choice = page.get_by_role("combobox", name="Page")
        expect(choice).to_have_value("index")
        choice.focus()
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowDown")
        page.wait_for_timeout(1200)
        expect(page).to_have_url(f"{url}/guide")
        picked = choice.input_value()
        assert picked != "index"
        page.keyboard.press("Enter")
        expect(page).to_have_url(f"{url}/guide/{picked}")
        expect(page.get_by_role("main")).to_be_focused()
        expect(page).to_have_title(re.compile(". · Guide · flightd$"))
