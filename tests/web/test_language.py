"""The pages in German: switched to, kept, without English left, for everybody."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.config.schema import load_config
from flightd.site.site_file import site_toml
from tests.replay.synthetic_flight import write_flight
from tests.unit.mission.shelves import FITTED
from tests.web.chromium import NARROW, hindrances, opened, station
from tests.web.live_flight import LiveFlight
from tests.web.refused_texts import STAYS_ENGLISH, refused_texts, value_mistakes
from tests.web.stock_rig import RACKS, counted_store

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

CONFIG = load_config(Path(__file__).parents[2] / "configs" / "sim.toml").with_values(
    mission={"autostart": False}, front_camera=FITTED
)
expect.set_options(timeout=40_000.0)

PAGES = (
    ("/", "Flugbereit"),
    ("/stock?store=monday&place=AL-01-1-1", "ein Code, verbürgt"),
    ("/fleet", "Menschen fliegen diese Drohnen"),
    ("/missions", "Knoten auf der Karte wählen"),
    ("/flights", "1 Flug"),
    ("/studio", "Bildsätze"),
    ("/site/edit?name=hall.toml", "Stimmig: Eine Drohne kann danach fliegen."),
    ("/site/new", "Neue Halle"),
    ("/doctor", "Diagnose"),
    ("/guide", "flightd flies a camera drone"),
)
"""Where a page is, and what it says once it is there."""
FOR_EVERYBODY = ("/", "/studio", "/guide")
"""What only German holds is no hindrance here; every page has a test of its own of the others."""
ENGLISH_LEFT = """async () => {
  const { TEXTS } = await import("/static/app/german/catalogue.js");
  const escaped = (text) => text.replace(/[.*+?^$()|[\\]\\\\]/g, "\\\\$&").replace(/\\{\\w+\\}/g, ".+");
  const german = new Set(Object.values(TEXTS));
  const other = Object.keys(TEXTS).filter((text) => text !== TEXTS[text]);
  const forms = other.flatMap((text) => text.split("|"));
  const english = forms
    .filter((text) => !german.has(text))
    .map((text) => new RegExp(`^${escaped(text)}$`, "s"));
  const shown = [];
  const nodes = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (nodes.nextNode()) {
    const { data, parentElement } = nodes.currentNode;
    if (!parentElement.closest("body [lang=en], code, pre, noscript")) shown.push(data);
  }
  for (const name of ["aria-label", "title", "placeholder", "alt"]) {
    for (const element of document.querySelectorAll(`[${name}]`)) {
      if (!element.closest("body [lang=en]")) shown.push(element.getAttribute(name));
    }
  }
  return shown.map((text) => text.trim()).filter((text) => text && english.some((one) => one.test(text)));
}"""


UNKNOWN = (
    "it was never said by anybody at all",
    "this is not to be had, or no more",
    "the pad is blue and no node has it",
    "3 of 4 or more are on their way already",
    "there is nothing in it: look at page 7; and then go on (as before)",
)
"""What nobody says: no text's German may be taken for its own."""
EVENTS = {
    "arming -> take_off: armed": "Scharfstellen → Abheben: scharf",
    "aisle A, level 1: 0.80 m/s at 0.90 m, 1.20 m from the shelf, 3.6 whole views at 4 frames a second,"
    " 2.50 px per module, a blur of 0.53 in 2 ms; no faster because of mission.speed_mps": (
        "Gang A, Ebene 1: 0,80 m/s auf 0,90 m, 1,20 m vom Regal, 3,6 Mal ganz im Bild bei 4 Bildern in der"
        " Sekunde, 2,50 px je Modul, Unschärfe 0,53 in 2 ms; nicht schneller wegen: mission.speed_mps"
    ),
    "camera udp://127.0.0.1:5600: a frame came out of order (13 refused so far)": (
        "Kamera udp://127.0.0.1:5600: ein Bild kam in falscher Reihenfolge (bisher 13 verworfen)"
    ),
    "camera device:/dev/video0: a frame was exposed 1.2 s ago (1 refused so far)": (
        "Kamera device:/dev/video0: ein Bild wurde vor 1,2 s belichtet (bisher 1 verworfen)"
    ),
    "a simulation on site hall-3": "eine Simulation in der Halle hall-3",
    "face light": "Licht am Regal",
    "ground link": "Bodenverbindung",
    "swept": "vorbeigeflogen",
}
"""What a drone tells on a flight, by what is read of it."""
READ = """async ({ examples, unknown, events }) => {
  const { TEXTS, REPORTED, readerOf } = await import("/static/app/german/catalogue.js");
  const read = readerOf(TEXTS, REPORTED, (value, digits) => value.toFixed(digits).replace(".", ","));
  const told = (text) => read(text).map((part) => part.text).join("");
  const names = (text) => [...text.matchAll(/\\{(\\w+)\\}/g)].map(([, name]) => name);
  const own = ([english, german]) => {
    const values = Object.fromEntries(names(english).map((name, i) => [name, `X${i}`]));
    const fill = (text) => text.replace(/\\{(\\w+)\\}/g, (whole, name) => values[name]);
    return told(fill(english)) === fill(german);
  };
  return {
    english: examples.filter((text) => read(text).some((part) => part.foreign)),
    others: Object.entries(REPORTED).filter((entry) => !own(entry)).map(([english]) => english),
    taken: unknown.filter((text) => !read(text).some((part) => part.foreign)),
    events: Object.fromEntries(events.map((text) => [text, told(text)])),
  };
}"""


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A station whose drone waits, with an inventory, a flight and a map in its folder."""
    folder = tmp_path_factory.mktemp("hall")
    counted_store(folder / "monday")
    (folder / "hall.toml").write_text(site_toml(RACKS))
    (folder / "flown").mkdir()
    write_flight(folder / "flown")
    with LiveFlight(RACKS, CONFIG, speed=1.0) as flight:
        status, command = flight.ports
        with station([f"demo=127.0.0.1:{status}/{command}"], folder=folder) as url:
            yield url


def is_german_and_fits(page: Page, size: tuple[int, int]) -> None:
    assert page.evaluate(ENGLISH_LEFT) == [], page.url
    assert page.evaluate("document.documentElement.scrollWidth") == size[0], page.url


def test_every_page_is_german_once_it_is_asked_for_and_stays_so(browser: Browser, url: str) -> None:
    with opened(browser, url, NARROW) as page:
        expect(page.get_by_text("Ready to fly")).to_be_visible()
        assert page.evaluate(ENGLISH_LEFT) != []
        page.get_by_role("button", name="DE, Deutsch").click()
        expect(page.get_by_text("Flugbereit")).to_be_visible()
        expect(page).to_have_title("Live · flightd")
        expect(page.locator("html")).to_have_attribute("lang", "de")
        for path, said in PAGES:
            page.goto(f"{url}{path}")
            expect(page.get_by_text(said).first).to_be_visible()
            is_german_and_fits(page, NARROW)
            assert path not in FOR_EVERYBODY or hindrances(page) == [], path
        expect(page.get_by_role("link", name="Handbuch")).to_be_visible()
        expect(page.locator("article[lang=en]")).to_be_visible()
        page.get_by_role("button", name="EN, English").click()
        expect(page).to_have_title(re.compile("Guide · flightd$"))


def test_what_is_refused_has_its_german_and_no_text_another_ones(browser: Browser, url: str) -> None:
    examples = [one.example for one in refused_texts() if one.text not in STAYS_ENGLISH]
    assert len(examples) > 600
    examples += value_mistakes()
    with opened(browser, f"{url}/guide", NARROW) as page:
        asked = {"examples": examples, "unknown": UNKNOWN, "events": list(EVENTS)}
        found = page.evaluate(READ, asked)
    assert found == {"english": [], "others": [], "taken": [], "events": EVENTS}


def test_whose_browser_is_german_reads_german_numbers_and_dates(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/flights", locale="de-DE") as page:
        expect(page.locator("html")).to_have_attribute("lang", "de")
        expect(page.get_by_role("columnheader", name="Quer rms")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]  # type: ignore[index]
