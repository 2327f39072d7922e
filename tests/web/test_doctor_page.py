"""The page Doctor: a drone that stands is looked at, set right, given other settings and the old ones back,
and started anew, by keyboard and mouse."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.web.chromium import NARROW, WIDE, hindrances, opened, station
from tests.web.standing_drone import StandingDrone

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

SLOW_MS = 60_000
"""Other work may have the machine: the drone is a whole daemon."""


def is_for_everybody(page: Page, size: tuple[int, int], scheme: str) -> None:
    """As it stands, on such a screen."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    assert page.evaluate("document.documentElement.scrollWidth") == size[0], size
    assert hindrances(page) == [], (size, scheme)


def test_a_drone_that_stands_is_looked_after(browser: Browser, tmp_path: Path) -> None:
    drone = StandingDrone(tmp_path)
    drones = [drone.at, "away=127.0.0.1:1/1"]
    (state := tmp_path / "state").mkdir()
    (state / "audit.jsonl").symlink_to("/dev/full")
    with drone.standing(), station(drones, state=state) as url, opened(browser, f"{url}/doctor") as page:
        is_set_right(page)
        is_for_everybody(page, NARROW, "light")
        is_for_everybody(page, WIDE, "dark")
        page.get_by_role("link", name="Settings").click()
        page.get_by_role("link", name="mission", exact=True).click()
        is_given_other_settings(page, drone)
        page.get_by_role("button", name="Start flightd anew").click()
        expect(page.get_by_text("flightd starts anew: a few seconds.")).to_be_visible(timeout=SLOW_MS)
        assert drone.ended() == 0
        page.get_by_role("link", name="Checks").click()
        page.reload()
        lost = re.compile(r"\d lines? of this station.s audit (is|are) lost: its disk is full, or too slow\.")
        expect(page.get_by_text(lost)).to_be_visible()
        page.get_by_role("button", name="away").click()
        expect(page.get_by_role("heading", name="Not looked at")).to_be_visible(timeout=SLOW_MS)
        expect(page.get_by_role("alert").filter(has_text="away cannot be reached")).to_be_visible()
        is_for_everybody(page, NARROW, "dark")


def is_set_right(page: Page) -> None:
    mend = page.get_by_role("button", name="Set right: GUID_TIMEOUT")
    again = page.get_by_role("button", name="Look again")
    expect(again).to_be_enabled(timeout=SLOW_MS)
    for _ in range(30):  # until it has read all of the autopilot's parameters
        if mend.is_visible():
            break
        again.click()
        expect(again).to_be_enabled(timeout=SLOW_MS)
        expect(again).to_be_focused()  # also while it waited
    expect(page.get_by_role("heading", name=re.compile("Not fit to fly"))).to_be_visible()
    expect(page.get_by_text("stop the daemon and run flightd doctor on the drone").first).to_be_visible()
    mend.focus()
    page.keyboard.press("Enter")
    read_back = page.get_by_role("status").filter(has_text="GUID_TIMEOUT was 3, now reads 0.3")
    expect(read_back).to_be_visible(timeout=SLOW_MS)
    expect(mend).to_have_count(0)
    expect(page.get_by_role("table").get_by_role("row", name=re.compile("firmware"))).to_be_visible()
    lines = page.get_by_role("list", name="Log lines, newest first")
    expect(lines.get_by_text(re.compile("maintenance: GUID_TIMEOUT was 3")).first).to_be_visible()


def is_given_other_settings(page: Page, drone: StandingDrone) -> None:
    before = drone.config.read_text()
    height = page.get_by_role("textbox", name="height_m m")
    height.fill("50", timeout=SLOW_MS)
    complaint = page.get_by_role("alert").filter(has_text="mission.height_m: 50 is outside 0.5 to 20 m")
    expect(complaint).to_be_visible(timeout=SLOW_MS)
    send = page.get_by_role("button", name="Send to demo")
    expect(send).to_be_disabled()
    is_for_everybody(page, WIDE, "light")
    is_for_everybody(page, NARROW, "dark")
    height.fill("1.5")
    expect(complaint).to_have_count(0, timeout=SLOW_MS)
    page.get_by_role("textbox", name="dwell_s s").fill("3")
    page.get_by_role("button", name="Undo mission.dwell_s").click()
    page.get_by_role("link", name="Checks").click()
    page.go_back()
    expect(height).to_have_value("1.5", timeout=SLOW_MS)
    page.get_by_role("link", name="Live").click()
    assert not page.evaluate("dispatchEvent(new Event('beforeunload', {cancelable: true}))")
    page.go_back()
    expect(height).to_have_value("1.5", timeout=SLOW_MS)
    send.click()
    expect(page.get_by_text("Say who you are first.")).to_be_visible()
    page.get_by_role("textbox", name="Who").fill("Ann")
    written = page.get_by_text("The drone has written them.")
    send.click()
    expect(written).to_be_visible(timeout=SLOW_MS)
    assert "height_m = 1.5" in drone.config.read_text()
    assert "# by a person" in drone.config.read_text()
    older = page.get_by_text("flightd still runs by older settings")
    expect(older).to_be_visible()
    page.get_by_role("button", name="Back to before this").click()
    page.get_by_role("button", name="Really go back").click()
    expect(page.get_by_text("as they were before that change")).to_be_visible(timeout=SLOW_MS)
    expect(older).to_have_count(0)
    assert drone.config.read_text() == before
    height.fill("1.5")
    send.click()
    expect(older).to_be_visible(timeout=SLOW_MS)
