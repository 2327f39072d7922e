"""The page in a real browser: what a person sees of a flight, and does with it by mouse and keyboard."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.web.chromium import NARROW, WIDE, another, hindrances, opened, station
from tests.web.holding_relay import holding
from tests.web.live_flight import LiveFlight

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={"autostart": False, "start_countdown_s": 0.0}, ground={"lost_action": "land"}
)
WITHIN_MS = 40_000.0
HOLD_MS = 1300.0
MOST_CONNECTIONS = 6
DEAF = "WebSocket.prototype.send = () => {}"
"""What the page says over its socket reaches nobody from now on."""
SEEN_WHERE_PAINTED = """() => {
  const ends = (line) => ["x1", "y1", "x2", "y2"].map((end) => Number(line.getAttribute(end)));
  const painted = [...document.querySelectorAll(".paint line")].map(ends);
  const lies = ([x0, y0, x1, y1]) => painted.some(([a0, b0, a1, b1]) =>
    y0 === y1 ? b0 === b1 && Math.abs(y0 - b0) < 15 : a0 === a1 && Math.abs(x0 - a0) < 15);
  const seen = [...document.querySelectorAll(".seen line")].map(ends);
  return seen.length > 0 && seen.every(lies);
}"""
"""Each line that the drone sees is drawn within 15 cm of one that is painted on the floor, and some is."""

expect.set_options(timeout=WITHIN_MS)


@pytest.fixture
def flight() -> Iterator[LiveFlight]:
    """One that waits for its start."""
    with LiveFlight(SITE, CONFIG) as flight:
        yield flight


@pytest.fixture
def url(flight: LiveFlight) -> Iterator[str]:
    status, command = flight.ports
    with station([f"demo=127.0.0.1:{status}/{command}"]) as url:
        yield url


def start(page: Page) -> None:
    """Hold the button, as a person does."""
    button = page.get_by_role("button", name="Start")
    expect(button).to_have_attribute("aria-disabled", "false")
    button.hover()
    page.mouse.down()
    page.wait_for_timeout(HOLD_MS)
    page.mouse.up()


def phase(page: Page, words: str) -> None:
    """Wait until the head line says so."""
    expect(page.get_by_role("heading", level=2, name=re.compile(words))).to_be_visible()


def until_phase(flight: LiveFlight, wanted: set[Phase]) -> None:
    end_s = time.monotonic() + WITHIN_MS * 1e-3
    while flight.phase not in wanted:
        assert time.monotonic() < end_s, flight.phase
        flight.wait_s(0.05)


def test_a_flight_is_started_watched_paused_sent_elsewhere_and_stopped_by_key(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    with opened(browser, url) as page:
        phase(page, "On the ground")
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        expect(page.get_by_role("button", name="Fly home")).to_be_disabled()
        assert hindrances(page) == []
        page.get_by_role("button", name="Start").click()
        expect(page.get_by_text("keep holding")).to_be_visible()
        assert flight.phase is Phase.PREFLIGHT, "a touch starts nothing"
        start(page)
        expect(page.get_by_text("Start: accepted")).to_be_visible()
        phase(page, "Flying to A2")
        expect(page.get_by_role("img", name=re.compile(r"^Down camera: \d lines?$"))).to_be_visible()
        expect(page.get_by_role("img", name="The drone")).to_be_visible()
        expect(page.get_by_role("list", name="Legend").get_by_text("lines seen")).to_be_visible()
        page.wait_for_function(SEEN_WHERE_PAINTED)
        page.wait_for_function(
            "async () => (await import('/static/app/store.js')).state.screen === 'kept on'"
        )
        expect(page.get_by_text("cannot keep the screen on")).to_have_count(0)
        assert hindrances(page) == []
        whole = page.get_by_role("group", name="Map of demo").get_attribute("viewBox")
        page.get_by_role("button", name="Follow the drone").click()
        expect(page.get_by_role("button", name="Follow the drone")).to_have_attribute("aria-pressed", "true")
        expect(page.get_by_role("group", name="Map of demo")).not_to_have_attribute("viewBox", whole or "")
        page.keyboard.press("p")
        phase(page, "Holding its place")
        page.get_by_role("link", name="Guide", exact=True).click()
        expect(page.get_by_role("link", name="Guide", exact=True)).to_have_attribute("aria-current", "page")
        page.keyboard.press("r")
        page.wait_for_timeout(500)
        page.get_by_role("link", name="Live", exact=True).click()
        expect(page.get_by_text("Pause: accepted")).to_be_visible()
        until_phase(flight, {Phase.HOLD})  # a key on another page has resumed nothing
        keys = page.get_by_role("checkbox", name="Keys of one character")
        keys.uncheck()
        page.keyboard.press("r")  # and none that is switched off does
        page.wait_for_timeout(300)
        until_phase(flight, {Phase.HOLD})
        keys.check()
        page.get_by_role("button", name="Resume").click()
        expect(page.get_by_text("Resume: accepted")).to_be_visible()
        phase(page, "Flying to|Over")
        page.get_by_role("button", name=re.compile("^Node B1")).click()
        page.get_by_role("button", name="Go to B1").click()
        expect(page.get_by_text("Go to B1: accepted")).to_be_visible()
        phase(page, "Flying to B1")
        page.get_by_label("Node", exact=True).focus()
        page.keyboard.press("Escape")
        expect(page.get_by_text("STOP: accepted")).to_be_visible()
        phase(page, "Landing|Flight ended early")
        expect(page.get_by_role("list", name="Events").get_by_text("stop ordered").first).to_be_visible()
    until_phase(flight, {Phase.ABORTED})


def test_it_is_flown_by_keyboard_alone(browser: Browser, url: str, flight: LiveFlight) -> None:
    with opened(browser, url) as page:
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        for _ in range(30):  # every page has a link before it
            page.keyboard.press("Tab")
            if page.evaluate("document.activeElement.textContent").startswith("Start"):
                break
        page.keyboard.down("Space")
        page.wait_for_timeout(HOLD_MS)
        page.keyboard.up("Space")
        expect(page.get_by_text("Start: accepted")).to_be_visible()
        phase(page, "Flying to A2")
        page.get_by_role("button", name="Node A1").focus()
        for key in ("ArrowRight", "ArrowRight", "Enter"):
            page.keyboard.press(key)
        expect(page.get_by_role("button", name="Go to A3")).to_be_enabled()
        page.get_by_role("button", name="Land here").focus()
        page.keyboard.press("Enter")
        phase(page, "Landing|Flight ended early")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_page_has_everything_and_keeps_stop_in_reach(
    browser: Browser, url: str, scheme: str
) -> None:
    with opened(browser, url, NARROW, scheme) as page:
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        assert hindrances(page) == []
        page.get_by_role("heading", name="Events").scroll_into_view_if_needed()
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)


def test_what_keeps_it_on_the_ground_is_listed_and_the_start_is_held_back(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    flight.faults.battery = 0.2
    flight.faults.rangeless = True
    with opened(browser, url, WIDE, "dark") as page:
        expect(page.get_by_text("It stays on the ground:")).to_be_visible()
        obstacles = page.get_by_role("listitem")
        expect(obstacles.filter(has_text="No height from the vehicle's range finder")).to_be_visible()
        expect(obstacles.filter(has_text=re.compile("20 ?%"))).to_be_visible()
        expect(page.get_by_role("button", name="Start")).to_have_attribute("aria-disabled", "true")
        assert hindrances(page) == []
        flight.faults.battery, flight.faults.rangeless = None, False
        expect(page.get_by_text("Ready to fly")).to_be_visible()


def test_a_hazard_is_shown_with_what_is_done_and_since_when(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    with opened(browser, url) as page:
        start(page)
        phase(page, "Flying to A2")
        flight.faults.bare = True
        alarm = page.get_by_role("region", name="Hazards")
        expect(alarm.get_by_text("Lines lost")).to_be_visible()
        expect(alarm.get_by_text(re.compile("holds, for"))).to_be_visible()
        phase(page, "Holding its place")
        assert hindrances(page) == []


def test_a_pictures_age_has_its_way_to_the_page_in_it(browser: Browser, url: str) -> None:
    """Taken at 2 s by the drone's clock, 100 s behind the page's; 0.1 s old as it left the station."""
    seen = {"head": {"stamp_ns": 2_000_000_000, "age_ms": 100.0}, "at": 102_900.0}
    with opened(browser, url) as page:
        for clock_ms, now_ms, age_ms in (
            (100_000.0, 102_900.0, 900.0),
            (100_000.0, 103_400.0, 1400.0),
            (None, 102_900.0, 100.0),
            (101_500.0, 102_900.0, 100.0),
        ):
            words = f"{json.dumps(seen)}, {json.dumps(clock_ms)}, {now_ms}"
            module = "import('/static/app/live/camera.js')"
            assert page.evaluate(f"async () => (await {module}).pictureAgeMs({words})") == age_ms
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        store = "(await import('/static/app/store.js')).shown()"
        since_ms = (
            f"async () => {{ const s = {store}; return s.heardAt - s.status.stamp_ns / 1e6 - s.clockMs; }}"
        )
        assert 0 <= page.evaluate(since_ms) < WITHIN_MS


def test_a_page_that_is_loaded_again_or_opened_twice_has_it_all(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    with opened(browser, url) as page:
        start(page)
        expect(page.get_by_role("button", name="Node A1, visited")).to_be_visible()
        phase(page, "Flying to A2")
        page.add_init_script("Object.defineProperty(Navigator.prototype, 'wakeLock', {value: undefined})")
        page.reload()
        expect(page.get_by_text("This browser cannot keep the screen on")).to_be_visible()
        expect(page.get_by_role("button", name="Node A1, visited")).to_be_visible()
        expect(page.get_by_role("list", name="Events").get_by_text("start", exact=True)).to_be_visible()
        track = page.locator("polyline.track")
        expect(track).to_have_attribute("points", re.compile(r"\d+,-?\d+.* .*\d+,"))
        with opened(browser, url, NARROW) as other:
            phase(other, "Flying to|Over")
            expect(other.get_by_text("2 pages open")).to_be_visible()


def test_closing_the_last_page_is_losing_the_ground(browser: Browser, url: str, flight: LiveFlight) -> None:
    assert flight.quiet_s == 0.0, "no page was open yet: nobody attends"
    with opened(browser, url) as page:
        start(page)
        expect(page.get_by_text("this station")).to_be_visible()
        phase(page, "Flying to A2")
        with opened(browser, url):
            pass
        page.wait_for_timeout(1500)
        assert flight.quiet_s < 3.0, "one page is open still"
    until_phase(flight, {Phase.LAND, Phase.ABORTED})


def test_a_drone_that_falls_silent_is_said_to_be(browser: Browser) -> None:
    with LiveFlight(SITE, CONFIG) as flight:
        status, command = flight.ports
        with station([f"demo=127.0.0.1:{status}/{command}"]) as url, opened(browser, url) as page:
            expect(page.get_by_text("Ready to fly")).to_be_visible()
            flight.fall_silent()
            expect(page.get_by_role("alert").get_by_text("what you see is old")).to_be_visible()
            assert hindrances(page) == []


def test_a_station_that_ends_is_said_to_be_gone_and_found_again(browser: Browser, flight: LiveFlight) -> None:
    status, command = flight.ports
    drones = [f"demo=127.0.0.1:{status}/{command}"]
    with station(drones) as url:
        context = browser.new_context()
        page = context.new_page()
        page.goto(url)
        expect(page.get_by_text("Ready to fly")).to_be_visible()
    expect(page.get_by_text("The ground station does not answer")).to_be_visible()
    with station(drones, url.removeprefix("http://")):
        expect(page.get_by_text("The ground station does not answer")).to_be_hidden()
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        context.close()


def test_stop_waits_behind_no_slow_request_of_any_page(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    """A browser opens six connections to a host, for all its pages together."""
    port = url.rpartition(":")[2]
    with (
        holding(int(port)) as relay,
        another(browser, f"--host-resolver-rules=MAP localhost:{port} 127.0.0.1:{relay.port}") as mapped,
        opened(mapped, f"http://localhost:{port}") as page,
    ):
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        page.evaluate("() => { for (let i = 0; i < 8; i += 1) fetch(`/api/flights?${i}`).catch(() => {}); }")
        end_s = time.monotonic() + 20.0
        while relay.held < MOST_CONNECTIONS:
            assert time.monotonic() < end_s, relay.held
            page.wait_for_timeout(50)
        page.keyboard.press("Escape")
        expect(page.get_by_text("STOP: accepted")).to_be_visible(timeout=3000)
        assert relay.held == MOST_CONNECTIONS, "none of them was given up for it"


def test_stop_goes_by_post_where_the_socket_says_nothing(
    browser: Browser, url: str, flight: LiveFlight
) -> None:
    with opened(browser, url) as page:
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        page.evaluate(DEAF)
        with page.expect_request("**/drones/demo/acts") as posted:
            page.keyboard.press("Escape")
        expect(page.get_by_text("STOP: accepted")).to_be_visible()
        answer = posted.value.response()
        assert answer is not None
        assert answer.status == 200
