"""The page Missions in a real browser: choose by mouse and keyboard, keep, fly, and fly the rest."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.config.schema import load_config
from tests.unit.mission.shelves import FITTED
from tests.web.chromium import NARROW, hindrances, opened, station
from tests.web.live_flight import LiveFlight
from tests.web.stock_rig import RACKS, counted_store

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

CONFIG = load_config(Path(__file__).parents[2] / "configs" / "sim.toml").with_values(
    mission={"autostart": False, "start_countdown_s": 0.0}, front_camera=FITTED
)
HOLD_MS = 1300.0


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A drone that waits on a site with racks, and a station with an inventory of that site."""
    folder = tmp_path_factory.mktemp("hall")
    counted_store(folder / "monday")
    with LiveFlight(RACKS, CONFIG, speed=4.0) as flight:
        status, command = flight.ports
        with station([f"demo=127.0.0.1:{status}/{command}"], folder=folder) as url:
            yield url


def node(page: Page, name: str) -> None:
    page.get_by_role("button", name=f"Node {name}", exact=True).click()


def figure(page: Page, name: str) -> Locator:
    return page.locator("dl.takes div").filter(has_text=name).locator("dd")


def test_a_flight_is_chosen_estimated_kept_and_flown(browser: Browser, url: str) -> None:
    second = list(RACKS.nodes)[1]
    with opened(browser, f"{url}/missions") as page:
        expect(page.get_by_text("Choose aisles or nodes")).to_be_visible()
        node(page, second)
        expect(page.get_by_text("Time in the air")).to_be_visible()
        every = figure(page, "Places").inner_text()
        page.get_by_role("button", name="1", exact=True).click()  # a shelf level
        expect(figure(page, "Places")).not_to_have_text(every)
        assert 0 < int(figure(page, "Places").inner_text()) < int(every)

        page.get_by_role("button", name=f"Node {second}").focus()  # and on by keyboard alone
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Space")
        chosen = page.get_by_role("group", name="Map of").get_by_role("button", pressed=True)
        expect(chosen).to_have_count(2)
        page.get_by_text("Order of flight").click()
        expect(page.locator(".flown-order li")).to_have_count(2)
        assert hindrances(page) == []

        page.get_by_label("Name").fill("Two nodes")
        page.keyboard.press("Enter")
        expect(page.get_by_role("button", name="Kept", exact=True)).to_be_visible()
        page.get_by_label("Name").fill("Low level")
        page.get_by_role("button", name="Keep changes").click()
        expect(page.get_by_role("button", name="Low level 2 nodes")).to_be_visible()
        page.get_by_role("button", name="Duplicate Low level").click()
        expect(page.get_by_role("button", name="Low level copy 2 nodes")).to_be_visible()
        page.get_by_role("button", name="Delete Low level copy", exact=True).click()
        page.get_by_role("button", name="Delete Low level copy for good").click()
        expect(page.get_by_role("button", name="Low level copy 2 nodes")).to_have_count(0)
        page.reload()
        page.get_by_role("button", name="Low level 2 nodes").click()

        start = page.get_by_role("button", name="Start this mission")
        expect(start).to_have_attribute("aria-disabled", "false")
        start.hover()
        page.mouse.down()
        page.wait_for_timeout(HOLD_MS)
        page.mouse.up()
        expect(page.get_by_text(re.compile("0 of 2 nodes"))).to_be_visible(timeout=20_000)
        page.get_by_role("link", name="Live").click()
        page.get_by_role("button", name="Land here").click()
        expect(page.get_by_role("heading", name="Flight ended early")).to_be_visible(timeout=40_000)
        page.get_by_role("link", name="Missions").click()
        page.get_by_role("button", name="Fly the rest").click()
        expect(page.get_by_text("The rest of Low level: 2 nodes of 2.")).to_be_visible()


def test_places_to_look_at_become_a_mission_with_one_click(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/stock?store=monday", NARROW, "dark") as page:
        page.get_by_role("button", name=re.compile("^Recount . places as a mission")).click()
        expect(page.get_by_text(re.compile("^Counts . places of the inventory again"))).to_be_visible()
        expect(page.get_by_label("Name")).to_have_value(re.compile("^Recount . places"))
        expect(page.get_by_role("button", name="Node A1", exact=True)).to_have_attribute(
            "aria-pressed", "true"
        )
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]
