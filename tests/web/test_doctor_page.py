"""The page Doctor: a drone that stands is looked at, set right, given other settings, and given the old ones
back, by keyboard and mouse."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.web.chromium import NARROW, WIDE, hindrances, opened, station
from tests.web.standing_drone import StandingDrone

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

SLOW_MS = 60_000
"""Other work may have the machine: the drone is a whole daemon."""


@pytest.fixture(scope="module")
def drone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StandingDrone]:
    with StandingDrone(tmp_path_factory.mktemp("drone")).standing() as drone:
        yield drone


@pytest.fixture(scope="module")
def url(drone: StandingDrone) -> Iterator[str]:
    with station([drone.at]) as url:
        yield url


def test_a_drone_is_looked_at_and_set_right(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/doctor") as page:
        mend = page.get_by_role("button", name="Set right: GUID_TIMEOUT")
        again = page.get_by_role("button", name="Look again")
        expect(again).to_be_enabled(timeout=SLOW_MS)
        for _ in range(30):  # it reads the autopilot's parameters anew every ten seconds
            if mend.is_visible():
                break
            again.click()
            expect(again).to_be_enabled(timeout=SLOW_MS)
        expect(page.get_by_role("heading", name=re.compile("Not fit to fly"))).to_be_visible()
        expect(page.get_by_text("stop the daemon and run flightd doctor on the drone").first).to_be_visible()
        mend.focus()
        page.keyboard.press("Enter")
        read_back = page.get_by_role("status").filter(has_text="GUID_TIMEOUT was 3, now reads 0.3")
        expect(read_back).to_be_visible(timeout=SLOW_MS)
        expect(mend).to_have_count(0)
        versions = page.get_by_role("table")
        expect(versions.get_by_role("row", name=re.compile("firmware"))).to_be_visible()
        lines = page.get_by_role("list", name="Log lines, newest first")
        expect(lines.get_by_text(re.compile("maintenance: GUID_TIMEOUT was 3")).first).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") == WIDE[0]
        assert hindrances(page) == []


def test_settings_are_judged_as_one_types_sent_and_taken_back(
    browser: Browser, url: str, drone: StandingDrone
) -> None:
    before = drone.config.read_text()
    with opened(browser, f"{url}/doctor/settings/mission", NARROW, "dark") as page:
        height = page.get_by_role("textbox", name="height_m m")
        expect(height).to_be_visible(timeout=SLOW_MS)
        height.fill("50")
        complaint = page.get_by_role("alert").filter(has_text="mission.height_m: 50 is outside 0.5 to 20 m")
        expect(complaint).to_be_visible()
        expect(page.get_by_role("button", name="Send to demo")).to_be_disabled()
        height.fill("1.5")
        expect(complaint).to_have_count(0)
        nodes = page.get_by_role("textbox", name="nodes", exact=True)
        nodes.fill("Z9")  # the station has no map: the drone itself says no
        page.get_by_role("textbox", name="Who").fill("Ann")
        send = page.get_by_role("button", name="Send to demo")
        send.click()
        expect(page.get_by_role("status").filter(has_text="Z9")).to_be_visible(timeout=SLOW_MS)
        assert drone.config.read_text() == before
        page.get_by_role("button", name="Undo mission.nodes").click()
        send.click()
        expect(page.get_by_text("The drone has written them.")).to_be_visible(timeout=SLOW_MS)
        assert "height_m = 1.5" in drone.config.read_text()
        assert "# by a person" in drone.config.read_text()
        assert page.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        assert hindrances(page) == []
        expect(page.get_by_text("flightd still runs by older settings")).to_be_visible()
        page.get_by_role("button", name="Start flightd anew").click()
        expect(page.get_by_text("flightd still runs by older settings")).to_have_count(0, timeout=SLOW_MS)
        page.get_by_role("button", name="Back to before this").click()
        page.get_by_role("button", name="Really go back").click()
        expect(page.get_by_text("as they were before that change")).to_be_visible(timeout=SLOW_MS)
        assert drone.config.read_text() == before


@pytest.mark.parametrize(("size", "scheme"), [(NARROW, "light"), (WIDE, "dark")])
@pytest.mark.parametrize("path", ["/doctor", "/doctor/settings/ground"])
def test_the_page_is_for_everybody(
    browser: Browser, url: str, path: str, size: tuple[int, int], scheme: str
) -> None:
    with opened(browser, f"{url}{path}", size, scheme) as page:
        ready = "No error found|Not fit|No error;" if path == "/doctor" else "^ground$"
        expect(page.get_by_role("heading", name=re.compile(ready))).to_be_visible(timeout=SLOW_MS)
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        assert hindrances(page) == []


def test_what_cannot_be_reached_says_so(browser: Browser, tmp_path: Path) -> None:
    with station(["demo=127.0.0.1:1/1"], folder=tmp_path) as url, opened(browser, f"{url}/doctor") as page:
        expect(page.get_by_role("heading", name="Not looked at")).to_be_visible(timeout=SLOW_MS)
        expect(page.get_by_role("alert").filter(has_text="demo cannot be reached")).to_be_visible()
        assert hindrances(page) == []
