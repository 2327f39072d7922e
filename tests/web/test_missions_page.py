"""The page Missions in a real browser: choose by mouse and keyboard, keep, fly, and fly the rest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.config.schema import load_config
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.unit.mission.shelves import FITTED
from tests.web.chromium import NARROW, hindrances, opened, station
from tests.web.live_flight import LiveFlight
from tests.web.stock_rig import RACKS, counted_store, flown_log

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page, WebSocketRoute

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

CONFIG = load_config(Path(__file__).parents[2] / "configs" / "sim.toml").with_values(
    mission={**BRISK, "autostart": False, "start_countdown_s": 0.0}, front_camera=FITTED
)
DEMO = Path(__file__).parents[2] / "configs" / "site-demo.toml"
SECOND = list(RACKS.nodes)[1]

expect.set_options(timeout=40_000.0)


@pytest.fixture(scope="module")
def flight() -> Iterator[LiveFlight]:
    """A drone that waits on a site with racks."""
    with LiveFlight(RACKS, CONFIG, speed=1.0) as flight:
        yield flight


@pytest.fixture(scope="module")
def url(flight: LiveFlight, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Its station, with an inventory of that site."""
    folder = tmp_path_factory.mktemp("hall")
    counted_store(folder / "monday")
    counted_store(folder / "elsewhere")
    flown_log(folder / "elsewhere" / "flight.mcap", load_site(DEMO))
    status, command = flight.ports
    with station([f"demo=127.0.0.1:{status}/{command}"], folder=folder) as url:
        yield url


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def press(page: Page, name: str) -> None:
    """By the key, once it may be pressed."""
    expect(button(page, name)).to_be_enabled()
    button(page, name).press("Enter")


def places(page: Page) -> Locator:
    return page.locator("dl.takes div").filter(has_text="Places").locator("dd")


def _held_back(page: Page) -> Callable[[], None]:
    """What the station tells from now on reaches the page only once this is called."""
    held: list[str | bytes] = []
    free: list[Callable[[str | bytes], None]] = []

    def through(socket: WebSocketRoute) -> None:
        socket.connect_to_server().on_message(lambda said: free[0](said) if free else held.append(said))
        sockets.append(socket)

    sockets: list[WebSocketRoute] = []
    page.route_web_socket(re.compile("/live$"), through)

    def hear() -> None:
        for said in held:
            sockets[-1].send(said)
        free.append(sockets[-1].send)

    return hear


def test_a_flight_is_chosen_estimated_kept_flown_and_flown_on_and_places_become_one(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    with opened(browser, f"{url}/missions") as page:
        expect(page.get_by_text("Choose aisles or nodes")).to_be_visible()
        button(page, f"Node {SECOND}").click()
        expect(page.get_by_text("Time in the air")).to_be_visible()
        every = places(page).inner_text()
        button(page, "1").click()  # a shelf level
        expect(places(page)).not_to_have_text(every)
        assert 0 < int(places(page).inner_text()) < int(every)
        page.get_by_role("button", name=f"Node {SECOND}").focus()  # and on by keyboard alone
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Space")
        chosen = page.get_by_role("group", name="Map of").get_by_role("button", pressed=True)
        expect(chosen).to_have_count(2)
        page.locator(".flown-order summary").click()
        expect(page.locator(".flown-order li")).to_have_count(2)
        assert hindrances(page) == []

        page.get_by_label("Name").fill("Two nodes")
        press(page, "Keep")
        expect(button(page, "Kept")).to_be_visible()
        page.get_by_label("Name").fill("Low level")
        press(page, "Keep changes")
        row = page.get_by_role("button", name="Low level 2 nodes")
        expect(row).to_be_visible()
        press(page, "Duplicate Low level")
        copy = page.get_by_role("button", name="Low level copy 2 nodes")
        expect(copy).to_be_visible()
        press(page, "Delete Low level copy")
        press(page, "Delete Low level copy for good")
        expect(copy).to_have_count(0)
        page.reload()
        row.click()

        start = page.get_by_role("button", name="Start this mission")
        expect(start).to_have_attribute("aria-disabled", "false")
        start.hover()
        page.mouse.down()
        expect(page.get_by_text(re.compile("0 of 2 nodes"))).to_be_visible()
        page.mouse.up()
        flight.pace(8.0)
        page.get_by_role("link", name="Live").click()
        button(page, "Land here").click()
        expect(page.get_by_role("heading", name="Flight ended early")).to_be_visible()
        page.get_by_role("link", name="Missions").click()
        button(page, "Fly the rest").click()
        expect(page.get_by_text("The rest of Low level: 2 nodes of 2.")).to_be_visible()

        page.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
        page.emulate_media(color_scheme="dark")
        hear = _held_back(page)
        page.goto(f"{url}/stock?store=monday")
        page.get_by_role("button", name=re.compile("^Recount . places as a mission")).click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        hear()  # what was chosen before any drone was heard stands
        expect(page.get_by_text(re.compile("^Counts . places of the inventory again"))).to_be_visible()
        expect(page.get_by_label("Name")).to_have_value(re.compile("^Recount . places"))
        expect(button(page, "Node A1")).to_have_attribute("aria-pressed", "true")
        expect(page.get_by_text("no flight log beside it says of which hall it is")).to_be_visible()
        page.get_by_role("link", name="Stock").click()
        page.get_by_role("combobox", name=re.compile("^Inventory")).select_option("store/elsewhere")
        page.get_by_role("button", name=re.compile("^AL-01-2-1,")).click()
        page.get_by_label("Selected to be counted again").check()
        page.get_by_role("button", name="Close").click()
        page.get_by_role("button", name="Recount 1 selected place as a mission").click()
        refused = f"the inventory is of {load_site(DEMO).name}, and demo flies in {RACKS.name}"
        expect(page.get_by_role("alert").filter(has_text=refused)).to_be_visible()
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]


def test_a_schedule_of_what_is_worth_most_is_kept_with_how_many_nodes(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/missions") as page:
        card = page.get_by_role("region", name="Schedules")
        card.get_by_role("button", name="New schedule").press("Enter")
        card.get_by_label("Name").fill("Most valuable")
        card.get_by_label("What is counted").select_option(label="Work by value")
        card.get_by_label("How many").fill("12")
        card.get_by_label("Time zone").fill("UTC")
        with page.expect_request(lambda asked: asked.method == "PUT") as kept:
            card.get_by_role("button", name="Keep schedule").press("Enter")
        assert (kept.value.post_data_json or {})["count"] == {"kind": "value", "nodes": 12}
        expect(card.get_by_text("Work by value · every day at 22:00, UTC")).to_be_visible()
        card.get_by_role("button", name="Delete Most valuable").press("Enter")
        card.get_by_role("button", name="Delete Most valuable for good").press("Enter")
        expect(card.get_by_text("None yet.")).to_be_visible()


def test_a_schedule_is_kept_listed_suspended_and_deleted(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/missions", NARROW) as page:
        card = page.get_by_role("region", name="Schedules")
        expect(card.get_by_text("Nothing starts by itself on this site")).to_be_visible()
        card.get_by_role("button", name="New schedule").press("Enter")
        card.get_by_label("Name").fill("Tuesdays")
        card.get_by_role("button", name="Tue").press("Space")
        card.get_by_label("Time zone").fill("Berlin")
        card.get_by_role("button", name="Keep schedule").press("Enter")
        expect(card.get_by_role("alert")).to_have_text(
            re.compile("'Berlin' is no time zone that this machine")
        )
        assert hindrances(page) == []
        card.get_by_label("Time zone").fill("Europe/Berlin")
        card.get_by_role("button", name="Keep schedule").press("Enter")
        expect(card.get_by_text("aisles A · Tue at 22:00, Europe/Berlin")).to_be_visible()
        expect(card.get_by_text(re.compile("^next Tue"))).to_be_visible()
        card.get_by_role("button", name="Suspend Tuesdays").press("Enter")
        expect(card.get_by_text("suspended")).to_be_visible()
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]
        card.get_by_role("button", name="Delete Tuesdays").press("Enter")
        card.get_by_role("button", name="Delete Tuesdays for good").press("Enter")
        expect(card.get_by_text("None yet.")).to_be_visible()
