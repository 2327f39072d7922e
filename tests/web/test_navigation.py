"""From page to page of the station: one document, one way to the drone, STOP in reach everywhere."""

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

NOWHERE = "There is no such page"


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """A station whose drone nobody flies."""
    with station(["demo=127.0.0.1:1/1"]) as url:
        yield url


def lose_the_way(page: Page) -> None:
    """As a bookmark of a page that is gone, or a later version's, does."""
    page.evaluate("history.pushState(null, '', '/gone'); dispatchEvent(new PopStateEvent('popstate'))")
    expect(page.get_by_role("heading", name=NOWHERE)).to_be_visible()


@pytest.mark.parametrize("size", [WIDE, NARROW])
def test_the_link_of_the_page_that_is_shown_is_the_current_one(
    browser: Browser, url: str, size: tuple[int, int]
) -> None:
    with opened(browser, url, size) as page:
        here = page.get_by_role("navigation", name="Pages").get_by_role("link", name="Live")
        expect(here).to_have_attribute("aria-current", "page")
        expect(page).to_have_title("Live · flightd")
        lose_the_way(page)
        expect(here).not_to_have_attribute("aria-current", re.compile(""))
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        expect(here).to_be_in_viewport(ratio=1.0)
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        assert hindrances(page) == []


def test_moving_keeps_the_document_and_its_link_to_the_drones(browser: Browser, url: str) -> None:
    sockets: list[str] = []
    with opened(browser, url) as page:
        page.evaluate("window.sameDocument = true")
        page.on("websocket", lambda socket: sockets.append(socket.url))
        lose_the_way(page)
        page.get_by_role("link", name="Live", exact=True).click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        expect(page).to_have_url(f"{url}/")
        page.go_back()
        expect(page.get_by_role("heading", name=NOWHERE)).to_be_visible()
        page.go_forward()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        assert page.evaluate("window.sameDocument")
    assert sockets == [], "another one would mean that the first was closed: nobody attended meanwhile"


def test_a_page_wears_its_own_styles_wherever_one_comes_from(browser: Browser, url: str) -> None:
    """Those of pages seen before would change what has the same class there."""
    rules = """() => [...document.styleSheets, ...document.adoptedStyleSheets]
        .flatMap((sheet) => [...sheet.cssRules].map((rule) => rule.cssText))"""
    with opened(browser, f"{url}/flights") as page:
        expect(page.get_by_role("main").get_by_role("heading").first).to_be_visible()
        straight = page.evaluate(rules)
        for name in ("Site", "Studio", "Missions", "Doctor", "Stock", "Flights"):
            page.get_by_role("link", name=name, exact=True).click()
            expect(page).to_have_title(re.compile(f"^{name}"))
            expect(page.get_by_text("Loading …")).to_have_count(0)
        assert page.evaluate(rules) == straight


def test_one_moves_by_keyboard_and_goes_on_with_the_new_pages_first_thing(browser: Browser, url: str) -> None:
    with opened(browser, url) as page:
        lose_the_way(page)
        page.get_by_role("link", name="Live", exact=True).focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        expect(page.get_by_role("main")).to_be_focused()
        page.get_by_role("link", name="Studio", exact=True).click()  # this station has no folder
        expect(page.get_by_role("heading", name="No folder to work in")).to_be_visible()


def test_a_link_that_the_browser_is_asked_to_open_elsewhere_is_left_to_it(browser: Browser, url: str) -> None:
    with opened(browser, url) as page:
        lose_the_way(page)
        # what it opens there is the browser's: headless it may leave unloaded what nobody looks at
        with page.context.expect_page():
            page.get_by_role("link", name="Live", exact=True).click(modifiers=["Control"])
        expect(page.get_by_role("heading", name=NOWHERE)).to_be_visible()


@pytest.mark.parametrize("missing", ["**/style/live.css", "**/live/live_page.js", "**/live/facts.js"])
def test_a_page_that_cannot_be_had_says_so_and_is_tried_again(
    browser: Browser, url: str, missing: str
) -> None:
    with opened(browser, url) as page:
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        page.route(missing, lambda route: route.abort())
        page.reload()
        expect(page.get_by_role("heading", name="The page cannot be loaded")).to_be_visible()
        expect(page.get_by_role("button", name="STOP")).to_be_visible()
        page.unroute(missing)
        page.get_by_role("button", name="Try again").click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()


def test_a_page_that_fails_leaves_the_head_and_stop(browser: Browser, url: str) -> None:
    with opened(browser, url) as page:
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        broken = "export default () => { throw new Error('nothing to draw'); };"
        page.route(
            "**/guide_page.js", lambda route: route.fulfill(content_type="text/javascript", body=broken)
        )
        page.get_by_role("link", name="Guide", exact=True).click()
        expect(page.get_by_role("alert").filter(has_text="nothing to draw")).to_be_visible()
        expect(page.get_by_role("button", name="STOP")).to_be_visible()
        page.get_by_role("link", name="Live", exact=True).click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()


def test_beside_the_flight_a_drone_that_does_not_fly_is_no_alarm(browser: Browser, url: str) -> None:
    with opened(browser, url) as page:
        expect(page.get_by_role("alert").filter(has_text="not heard yet")).to_be_visible()
        assert re.search(r"[?!.]\.$", page.get_by_role("alert").first.inner_text().strip()) is None
        page.get_by_role("link", name="Guide", exact=True).click()
        expect(page.get_by_role("status").filter(has_text="not heard yet")).to_be_visible()
        expect(page.get_by_role("alert").filter(has_text="not heard yet")).to_have_count(0)
