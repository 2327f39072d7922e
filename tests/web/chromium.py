"""The system's Chromium for the tests of the page, and a station to look at with it."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import pytest

from tests.web.forked_stations import forked_station
from tools.system_browser import system_browser

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

ROOT = Path(__file__).parents[2]
AXE = Path(__file__).parent / "vendor" / "axe.min.js"
WIDE, NARROW = (1400, 900), (390, 844)
_QUIET = (
    "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
    "--disable-default-apps", "--disable-domain-reliability", "--disable-sync", "--no-first-run",
    "--no-default-browser-check", "--no-pings",
)  # fmt: skip
"""Flags with which it asks nobody anything by itself."""
_SERIOUS = {"serious", "critical"}


def chromium_path() -> str:
    """Where the system's Chromium is; a test without it is skipped, but not where everything has to run."""
    found = system_browser()
    if found is None:
        text = "no Chromium on this machine: apt install chromium"
        if os.environ.get("CI") == "true":
            pytest.fail(text)
        pytest.skip(text)
    return found


@contextlib.contextmanager
def running() -> Iterator[Browser]:
    """Chromium, headless."""
    from playwright.sync_api import sync_playwright

    path = chromium_path()
    with sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=path, args=list(_QUIET))
        try:
            yield browser
        finally:
            browser.close()


@contextlib.contextmanager
def another(browser: Browser, *flags: str) -> Iterator[Browser]:
    """Another Chromium beside one that runs, with further flags."""
    other = browser.browser_type.launch(executable_path=chromium_path(), args=[*_QUIET, *flags])
    try:
        yield other
    finally:
        other.close()


@contextlib.contextmanager
def station(
    drones: Sequence[str],
    listen: str = "127.0.0.1:0",
    folder: Path | None = None,
    state: Path | None = None,
    options: Sequence[str] = (),
) -> Iterator[str]:
    """`flightd ground` as a person starts it; its address."""
    words = [word for drone in drones for word in ("--drone", drone)]
    words += [] if folder is None else ["--folder", str(folder)]
    words += ["--listen", listen, *options]
    with TemporaryDirectory() as elsewhere, started([*words, "--state", str(state or elsewhere)]) as url:
        yield url


@contextlib.contextmanager
def started(words: Sequence[str]) -> Iterator[str]:
    """`flightd ground` with these words; its address."""
    process = forked_station(list(words))
    with process.stderr:
        try:
            said: list[str] = []
            for line in process.stderr:  # a broker may be missed before
                said.append(line)
                if found := re.search(r"the ground station is at (https?://[0-9.]+:\d+)", line):
                    break
            else:
                raise AssertionError("".join(said))
            yield found[1]
        finally:
            process.terminate()
            code, rest = process.wait(20), process.stderr.read()
            assert (code, "Traceback" in rest) == (0, False), rest


@contextlib.contextmanager
def opened(
    browser: Browser, url: str, size: tuple[int, int] = WIDE, scheme: str = "light", locale: str = "en-US"
) -> Iterator[Page]:
    """A page of the station.  No foreign host may be asked, and nothing may go wrong in it, meanwhile."""
    context = new_context(browser, size, scheme, locale)
    asked: list[str] = []
    wrong: list[str] = []
    context.on("request", lambda request: asked.append(request.url))
    context.on("weberror", lambda error: wrong.append(str(error.error)))
    page = context.new_page()
    page.on("websocket", lambda socket: asked.append(socket.url.replace("ws", "http", 1)))
    page.on("console", lambda said: wrong.append(said.text) if "Content Security" in said.text else None)
    try:
        page.goto(url)
        yield page
    finally:
        context.close()
    station_url = "/".join(url.split("/")[:3])
    assert [other for other in asked if not other.startswith((station_url, f"blob:{station_url}"))] == []
    assert asked
    assert wrong == []


def new_context(
    browser: Browser, size: tuple[int, int], scheme: str, locale: str = "en-US"
) -> BrowserContext:
    """A person's browser: `scheme` light or dark."""
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]},
        color_scheme="dark" if scheme == "dark" else "light",
        locale=locale,
        ignore_https_errors=True,  # of a certificate that the test has made for itself
    )
    context.set_default_timeout(30_000)
    context.grant_permissions(["screen-wake-lock"])  # as every browser with a screen has it
    return context


def hindrances(page: Page) -> list[str]:
    """What axe-core finds serious or critical for people with disabilities: rule and element.

    Only a page that is asked reads it: that costs as much as the page."""
    if page.evaluate("typeof axe") == "undefined":
        page.evaluate(f"() => {{ {AXE.read_text()} }}")
    found = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{violation['id']}: {node['html']}"
        for violation in found["violations"]
        if violation["impact"] in _SERIOUS
        for node in violation["nodes"]
    ]
