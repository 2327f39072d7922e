"""Signing in with a real browser, by keyboard alone; what a viewer is offered; another origin's page."""

from __future__ import annotations

import contextlib
import http.server
import re
import sqlite3
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.ground.messages import SessionState, session_message
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.rigs.certificates import make_certificate
from tests.web.chromium import NARROW, WIDE, hindrances, new_context, opened, station
from tests.web.live_flight import LiveFlight
from tests.web.people_rig import PASSWORD, audited, with_people

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, WebSocketRoute

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={**BRISK, "autostart": False, "start_countdown_s": 0.0}, ground={"lost_action": "land"}
)

expect.set_options(timeout=40_000.0)


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    state = tmp_path_factory.mktemp("state")
    with_people(state)
    return state


@pytest.fixture(scope="module")
def flight() -> Iterator[LiveFlight]:
    """One that waits for its start."""
    with LiveFlight(SITE, CONFIG) as flight:
        yield flight


@pytest.fixture(scope="module")
def url(flight: LiveFlight, state: Path) -> Iterator[str]:
    """A station under TLS at which everybody signs in."""
    cert, key = make_certificate(state)
    words = ["--login", "--tls-cert", str(cert), "--tls-key", str(key)]
    status, command = flight.ports
    with station([f"demo=127.0.0.1:{status}/{command}"], folder=state, state=state, options=words) as url:
        yield url


def sign_in(page: Page, name: str, password: str = PASSWORD) -> None:
    """By keyboard alone: the name has the focus."""
    expect(page.get_by_role("textbox", name="Name")).to_be_focused()
    page.keyboard.type(name)
    page.keyboard.press("Tab")
    page.keyboard.type(password)
    page.keyboard.press("Enter")


@pytest.mark.parametrize(("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")])
def test_a_person_signs_in_by_keyboard_sees_who_he_is_and_signs_out(
    browser: Browser, url: str, size: tuple[int, int], scheme: str
) -> None:
    with opened(browser, f"{url}/guide", size, scheme) as page:
        expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
        expect(page).to_have_title("Sign in · flightd")
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        sign_in(page, "otto")
        expect(page.get_by_role("link", name="Guide", exact=True)).to_have_attribute("aria-current", "page")
        expect(page.get_by_role("heading", name="flightd guide").or_(page.locator("article"))).to_be_visible()
        head = page.locator("summary")
        expect(head).to_contain_text("otto")
        head.focus()
        page.keyboard.press("Enter")
        expect(page.get_by_text("Signed in as otto, operator")).to_be_visible()
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        (cookie,) = page.context.cookies()
        assert (cookie["name"], cookie["httpOnly"], cookie["secure"]) == ("__Host-flightd", True, True)
        assert cookie["sameSite"] == "Strict"
        assert page.evaluate("document.cookie") == ""
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="Sign in")).to_be_visible()


def test_a_viewer_is_offered_what_he_may_and_stops_the_drone(
    browser: Browser, url: str, flight: LiveFlight, state: Path
) -> None:
    with opened(browser, url) as page:
        sign_in(page, "vera", "wrong password")
        expect(page.get_by_role("alert")).to_have_text("Name or password is wrong.")
        expect(page.get_by_label("Password")).to_be_focused()
        page.keyboard.type(PASSWORD)
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="Only looking on")).to_be_visible()
        for name in ("Start", "Fly home", "Land here", "Resume"):
            expect(page.get_by_role("button", name=name)).to_have_count(0)
        expect(page.get_by_role("button", name="Pause")).to_be_visible()
        assert hindrances(page) == []
        refused = page.evaluate(
            """async () => (await fetch("/drones/demo/acts", {method: "POST",
               headers: {"Content-Type": "application/json"},
               body: JSON.stringify({id: "12345678", command: "start"})})).status"""
        )
        assert refused == 403, "whatever the page shows"
        assert flight.phase is Phase.PREFLIGHT
        page.get_by_role("link", name="Missions").click()
        expect(page.get_by_text("vera is a viewer; what is kept and flown needs an operator")).to_be_visible()
        expect(page.get_by_label("Name")).to_have_count(0)
        page.get_by_role("link", name="Live").click()
        with page.expect_response(lambda answer: answer.url.endswith("/api/session")):
            other = page.context.new_page()
            other.goto(f"{url}/stock")
            expect(other.locator("summary")).to_contain_text("vera")
            other.locator("summary").click()
            page.locator("summary").click()
            page.get_by_role("button", name="Sign out").click()
        expect(other.get_by_role("heading", name="Sign in")).to_be_visible()
    assert ("start", "refused") in [(line["act"], line["outcome"]) for line in audited(state)]


def test_what_a_socket_says_late_of_the_session_before_signs_nobody_out(browser: Browser, url: str) -> None:
    """The station tells a session's end up to a second later: the next person may have signed in by then."""
    sockets: list[WebSocketRoute] = []
    given_up: list[bool] = []

    def hold(socket: WebSocketRoute) -> None:
        sockets.append(socket)
        station = socket.connect_to_server()
        if len(sockets) == 1:
            station.on_message(lambda _said: None)
            station.on_close(lambda _code, _reason: None)
            socket.on_close(lambda _code, _reason: given_up.append(True))

    with opened(browser, f"{url}/guide") as page:
        expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
        page.route_web_socket("**/live", hold)
        sign_in(page, "otto")
        page.locator("summary").click()
        page.get_by_role("button", name="Sign out").click()
        sign_in(page, "vera")
        expect(page.locator("summary")).to_contain_text("vera")
        sockets[0].send(session_message(SessionState(login=True)))
        for _ in range(100):  # time to take what was said, for a page that still listens
            if not given_up:
                page.wait_for_timeout(20)
        expect(page.locator("summary")).to_contain_text("vera", timeout=1000.0)


def test_an_operator_takes_a_live_picture_and_a_viewer_looks_at_it(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/studio") as page:
        sign_in(page, "otto")
        page.get_by_label("Name of a new set").fill("live")
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Live", exact=True).click()
        page.get_by_role("button", name="Take this picture").click()
        expect(page.get_by_label("Picture to mark in")).to_be_visible()
        page.locator("summary").first.click()
        page.get_by_role("button", name="Sign out").click()
        sign_in(page, "vera")
        expect(page.get_by_text("Only looking on: an operator adds and marks pictures.")).to_be_visible()
        expect(page.get_by_role("img", name="Picture", exact=True)).to_be_visible()
        for name in ("Paint", "Undo", "Take the picture out", "From a flight", "Learn from the marks"):
            expect(page.get_by_role("button", name=name)).to_have_count(0)
        assert hindrances(page) == []


ATTACK = """async (target) => {
  const acts = `${target}/drones/demo/acts`, along = {credentials: "include"}, found = {};
  const tried = async (name, make) => {
    try { found[name] = await make(); } catch (error) { found[name] = "refused"; }
  };
  const act = JSON.stringify({id: "evil-stop-1", command: "stop"});
  await tried("read", async () => (await fetch(`${target}/api/stock`, along)).status);
  await tried("session", async () => (await fetch(`${target}/api/session`, along)).text());
  await tried("json", async () => (await fetch(acts, {method: "POST", ...along,
    headers: {"Content-Type": "application/json"}, body: act})).status);
  await tried("bearer", async () =>
    (await fetch(`${target}/api/stock`, {headers: {Authorization: "Bearer x"}})).status);
  const plain = {method: "POST", mode: "no-cors", ...along, body: act};
  await tried("plain", async () => (await fetch(acts, plain)).type);
  await tried("beacon", async () => (navigator.sendBeacon(acts, act), "sent"));
  await tried("socket", () => new Promise((resolve, reject) => {
    const socket = new WebSocket(target.replace("http", "ws") + "/live");
    socket.onmessage = ({data}) => resolve(data);
    const said = {say: "act", number: 1, drone: "demo", act: JSON.parse(act)};
    socket.onopen = () => socket.send(JSON.stringify(said));
    socket.onclose = reject;
  }));
  const element = (tag, attributes) => () => new Promise((resolve, reject) => {
    const heard = {onload: () => resolve("loaded"), onerror: reject};
    document.body.append(Object.assign(document.createElement(tag), attributes, heard));
  });
  await tried("picture", element("img", {src: `${target}/static/icon.svg`}));
  await tried("script", element("script", {src: `${target}/api/session`}));
  await tried("style", element("link", {rel: "stylesheet", href: `${target}/static/style/base.css`}));
  await tried("frame", () => new Promise((resolve) => {
    const frame = Object.assign(document.createElement("iframe"), {src: target, name: "frame"});
    frame.onload = () => {
      try { resolve(frame.contentDocument ? "read" : "refused"); } catch { resolve("refused"); }
    };
    document.body.append(frame);
  }));
  await tried("window", async () => {
    const other = window.open(target);
    await new Promise((resolve) => setTimeout(resolve, 1000));
    try { return other.document.body.innerText; } catch { return "refused"; }
  });
  const form = Object.assign(document.createElement("form"),
    {method: "post", action: acts, enctype: "text/plain", target: "frame"});
  const field = {name: act.slice(0, -1) + ',"x":"', value: '"}'};
  form.append(Object.assign(document.createElement("input"), field));
  document.body.append(form);
  form.submit();
  await new Promise((resolve) => setTimeout(resolve, 500));
  return found;
}"""


class _Blank(http.server.BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>evil</title><body></body>")

    def log_message(self, *_: object) -> None: ...


@pytest.fixture
def evil() -> Iterator[str]:
    """Another origin of the same site: the strictest cookie goes along with its requests."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Blank) as server:
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        serving.join()


@pytest.mark.parametrize("asks", [True, False], ids=["signed-in", "on-this-machine"])
def test_another_origins_page_can_neither_read_nor_command(
    browser: Browser, evil: str, flight: LiveFlight, state: Path, tmp_path: Path, asks: bool
) -> None:
    status, command = flight.ports
    with_people(tmp_path)
    options = ["--login"] if asks else []
    with station([f"demo=127.0.0.1:{status}/{command}"], state=tmp_path, options=options) as url:
        context = new_context(browser, WIDE, "light")
        page = context.new_page()
        page.goto(url)
        if asks:
            sign_in(page, "ada")
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        before = len(audited(tmp_path))
        page.goto(evil)
        found = page.evaluate(ATTACK, url)
        assert found == {name: "sent" if name == "beacon" else "refused" for name in found}
        assert len(found) == 12
        assert len(audited(tmp_path)) == before, "no act has come so far that it is one"
        page.goto(url)
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        context.close()
    assert flight.phase is Phase.PREFLIGHT


def began_before(state: Path, hours: float) -> None:
    """Whoever is signed in has been so for as long."""
    with contextlib.closing(sqlite3.connect(state / "people.db", timeout=10)) as book, book:
        book.execute("UPDATE session SET began_s = ?", (time.time() - hours * 3600,))


def until(flight: LiveFlight, wanted: set[Phase]) -> None:
    end_s = time.monotonic() + 40.0
    while flight.phase not in wanted:
        assert time.monotonic() < end_s, flight.phase
        flight.wait_s(0.05)


def test_whose_session_ends_in_flight_keeps_stop_and_the_ground_until_it_has_landed(
    browser: Browser, url: str, flight: LiveFlight, state: Path
) -> None:
    with opened(browser, url) as page:
        sign_in(page, "otto")
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        begin = page.get_by_role("button", name="Start")
        begin.focus()
        page.keyboard.down("Space")
        page.wait_for_timeout(1300)
        page.keyboard.up("Space")
        expect(page.get_by_role("heading", name="Flying to A2")).to_be_visible()

        began_before(state, hours=11.8)
        soon = page.get_by_role("region", name="End of the session")
        expect(soon.get_by_role("status")).to_have_text(re.compile(r"^Your session ends in 1[12] minutes\.$"))
        assert hindrances(page) == []
        soon.get_by_role("button", name="Sign in again").click()
        page.keyboard.type("wrong password")
        page.keyboard.press("Enter")
        expect(soon.get_by_role("alert")).to_have_text("Name or password is wrong.")
        soon.get_by_label("Password of otto").fill(PASSWORD)
        page.keyboard.press("Enter")
        expect(soon).to_have_count(0)

        began_before(state, hours=12.1)
        expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
        expect(soon.get_by_role("status")).to_have_text(re.compile("STOP and Pause stay yours"))
        expect(page.get_by_role("link", name="Stock")).to_have_count(0)
        assert hindrances(page) == []
        assert page.evaluate("async () => (await fetch('/api/stock')).status") == 401
        page.reload()  # as after a break of the network: the station still knows who comes
        expect(soon.get_by_role("status")).to_have_text(re.compile("STOP and Pause stay yours"))
        refused = """async () => (await import("/static/app/connection.js")).sendAct("demo",
            {id: "12345678", command: "home"})"""
        assert page.evaluate(refused)["status"] == 401
        soon.get_by_role("button", name="Pause").click()
        until(flight, {Phase.HOLD})
        flight.wait_s(CONFIG.ground.lost_s + 1.0)
        assert flight.phase is Phase.HOLD, "the ground is not lost"
        assert flight.quiet_s < CONFIG.ground.lost_s

        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        page.get_by_label("Name").fill("ot")
        page.keyboard.press("Escape")
        until(flight, {Phase.ABORTED})
        expect(page.get_by_role("button", name="STOP")).to_have_count(0)
        expect(soon).to_have_count(0)
        expect(page.get_by_label("Name")).to_have_value("ot")
    told = [(line["act"], line["outcome"], line["text"]) for line in audited(state)]
    late = "after the end of the session"
    assert [line for line in told if line[0] in {"home", "pause", "stop"}] == [
        ("home", "refused", "sign in first"),
        ("pause", "accepted", late),
        ("stop", "accepted", late),
    ]
