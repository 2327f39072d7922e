"""The page Stock in a real browser: every place with its state, filling live; by mouse and by keys alone."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import LocationState, PlannedLocation
from tests.web.chromium import NARROW, WIDE, hindrances, opened, station
from tests.web.stock_rig import RACKS, RUN, SSCC, cell, code, counted_store, flown_log, look

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    counted_store(tmp_path / "monday")
    return tmp_path


@pytest.fixture
def url(folder: Path) -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        yield f"{url}/stock"


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The same, for all tests that only look."""
    folder = tmp_path_factory.mktemp("hall")
    counted_store(folder / "monday")
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        yield f"{url}/stock"


def test_every_place_stands_on_its_front_with_its_state(browser: Browser, unchanged: str) -> None:
    with opened(browser, unchanged) as page:
        expect(page.get_by_role("heading", name="Stock 6 of 11 places counted")).to_be_visible()
        states = page.get_by_role("group", name="States")
        for words, count in {
            "Read": 4, "Several codes": 1, "Empty": 1, "Unreadable": 1, "Occluded": 1, "Contradicted": 1,
            "Never counted": 2,
        }.items():  # fmt: skip
            expect(states.get_by_role("button", name=re.compile(rf"{words} {count}$"))).to_be_visible()
        front = page.get_by_role("region", name="Rack AL")
        high, low = (cell(page, f"AL-01-{level}-1").bounding_box() for level in (2, 1))
        last = cell(page, "AL-04-1-1").bounding_box()
        assert high
        assert low
        assert last
        assert high["y"] < low["y"], "the highest level is on top"
        assert low["x"] < last["x"]
        expect(front.get_by_role("button", name="AL-04-1-1, contradicted")).to_be_visible()
        expect(page.get_by_role("region", name="Places whose rack is not known")).to_contain_text("0 of 1")
        assert hindrances(page) == []


def test_a_click_shows_picture_outline_code_and_history(browser: Browser, unchanged: str) -> None:
    with opened(browser, unchanged) as page:
        cell(page, "AL-01-1-1").click()
        card = page.get_by_role("region", name="AL-01-1-1")
        expect(card.get_by_role("img", name="What the camera saw at AL-01-1-1")).to_be_visible()
        expect(card.locator("polygon.stock-code")).to_have_count(1)
        points = card.locator("polygon").get_attribute("points") or ""
        lefts = sorted(float(pair.split(",")[0]) for pair in points.split())[:2]
        assert all(0.5 <= left < 0.56 for left in lefts), "it begins in the middle of the picture"
        expect(card.get_by_role("code")).to_have_text(f"00{SSCC}")
        expect(card.get_by_text(f"(00) {SSCC}")).to_be_visible()
        expect(card.get_by_text("98 %")).to_be_visible()
        looks = card.get_by_role("list").get_by_role("listitem")
        expect(looks).to_have_count(2)
        looks.nth(1).get_by_role("button").click()
        expect(card.get_by_text("2026-W46")).to_be_visible()
        expect(card.get_by_role("img")).to_have_count(0)
        assert hindrances(page) == []
        page.reload()
        expect(card.get_by_role("img")).to_be_visible()
        card.get_by_role("button", name="Close").click()
        expect(card).to_be_hidden()


def test_a_place_says_how_full_it_is_or_that_nobody_knows(browser: Browser, unchanged: str) -> None:
    with opened(browser, unchanged) as page:
        for place, told in {
            "AL-01-2-1": ["Filled63 %", "Overhang0.04 m", "Leans by0.03 m", "Cases4 x 3", "Confidence98 %"],
            "AL-02-2-1": ["Filledunknown", "Undecided070429", "Confidence98 %"],
            "AL-01-1-1": ["Confidence98 %"],
        }.items():
            cell(page, place).click()
            facts = page.get_by_role("region", name=place).locator("dl > div")
            expect(facts).to_contain_text([*told, "Looked at"])
            expect(facts).to_have_count(len(told) + 3)


def test_it_is_walked_and_searched_by_keys_alone(browser: Browser, url: str) -> None:
    with opened(browser, url) as page:
        expect(cell(page, "AL-01-2-1")).to_be_visible()
        for _ in range(30):
            page.keyboard.press("Tab")
            if page.evaluate("document.activeElement.dataset.code ?? ''") == "AL-01-2-1":
                break
        page.keyboard.press("Enter")
        expect(page.get_by_role("region", name="AL-01-2-1")).to_be_visible()
        for key, place in {
            "ArrowDown": "AL-01-1-1", "ArrowRight": "AL-02-1-1", "End": "AL-04-1-1", "Home": "AL-01-1-1",
        }.items():  # fmt: skip
            page.keyboard.press(key)
            expect(page.get_by_role("heading", name=place, exact=True)).to_be_visible()
            expect(cell(page, place)).to_be_focused()
        page.keyboard.press("End")
        page.keyboard.press("ArrowRight")
        expect(page.get_by_role("heading", name="BL-01-1-1", exact=True)).to_be_visible()
        page.get_by_role("searchbox", name="Code or place").focus()
        page.keyboard.type(f"(00){SSCC}")
        expect(page.get_by_text("1 place", exact=True)).to_be_visible()
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="AL-01-1-1", exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="Next place")).to_be_disabled()
        page.keyboard.press("Escape")
        expect(page.get_by_role("button", name="STOPPING")).to_be_visible()


def test_states_pick_out_what_next_and_previous_go_through(browser: Browser, unchanged: str) -> None:
    with opened(browser, unchanged) as page:
        states = page.get_by_role("group", name="States")
        for name in ("Unreadable 1", "Occluded 1"):
            states.get_by_role("button", name=re.compile(name)).click()
        expect(cell(page, "AL-01-1-1")).to_have_class(re.compile("aside"))
        cell(page, "AL-02-2-1").click()
        page.get_by_role("button", name="Previous place").click()
        expect(page.get_by_role("heading", name="AL-03-1-1", exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="Previous place")).to_be_disabled()
        states.get_by_role("button", name="Show all").click()
        expect(page.get_by_role("button", name="Previous place")).to_be_enabled()


def test_it_fills_while_a_flight_counts(browser: Browser, url: str, folder: Path) -> None:
    with SqliteStore(folder / "monday") as store, opened(browser, url) as page:
        expect(cell(page, "BL-01-1-2")).to_have_accessible_name("BL-01-1-2, never counted")
        store.commit(look("BL-01-1-2", LocationState.READ, code("PAL-11/L1"), at_s=60), confirmed=False)
        expect(cell(page, "BL-01-1-2")).to_have_accessible_name("BL-01-1-2, read, not booked yet, PAL-11/L1")
        cell(page, "BL-01-1-2").click()
        expect(page.get_by_role("region", name="BL-01-1-2")).to_contain_text("not booked yet")
        store.settle(RUN, ["BL-01-1-2"], confirmed=True)
        expect(cell(page, "BL-01-1-2")).to_have_accessible_name("BL-01-1-2, read, PAL-11/L1")
        expect(page.get_by_role("heading", name="Stock 7 of 11 places counted")).to_be_visible()


def test_what_labels_say_is_text_and_never_a_formula(
    browser: Browser, unchanged: str, tmp_path: Path
) -> None:
    with opened(browser, unchanged) as page:
        cell(page, "AL-04-2-1").click()
        expect(page.get_by_role("region", name="AL-04-2-1").locator("code")).to_have_text("<b>PAL-10</b>")
        saved = {}
        for name in ("CSV", "XLSX", "JSON", "EPCIS"):
            with page.expect_download() as download:
                page.get_by_role("link", name=name, exact=True).click()
            saved[name] = tmp_path / download.value.suggested_filename
            download.value.save_as(saved[name])
    assert [path.name for path in saved.values()] == [
        "inventory.csv", "inventory.xlsx", "inventory.json", "inventory.jsonld"
    ]  # fmt: skip
    rows = {row["location"]: row for row in csv.DictReader(io.StringIO(saved["CSV"].read_text()))}
    assert rows["BL-01-1-1"]["text"] == "'=1+2"
    assert rows["AL-02-1-1"]["state"] == "empty"
    assert zipfile.is_zipfile(saved["XLSX"])
    assert len(json.loads(saved["JSON"].read_text())["locations"]) == 11
    assert json.loads(saved["EPCIS"].read_text())["type"] == "EPCISDocument"


@pytest.mark.parametrize(("size", "scheme"), [(NARROW, "light"), (WIDE, "dark")])
def test_it_is_for_everybody_on_every_screen(
    browser: Browser, unchanged: str, size: tuple[int, int], scheme: str
) -> None:
    with opened(browser, unchanged, size, scheme) as page:
        cell(page, "AL-01-1-1").click()
        expect(page.get_by_role("img", name=re.compile("What the camera saw"))).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        expect(cell(page, "AL-01-1-1")).to_be_in_viewport(ratio=1.0)
        assert hindrances(page) == []


def test_moving_to_the_flight_and_back_keeps_what_was_chosen(browser: Browser, unchanged: str) -> None:
    with opened(browser, unchanged) as page:
        cell(page, "AL-02-1-1").click()
        page.get_by_role("link", name="Live").click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        expect(page.get_by_role("main")).to_be_focused()
        page.go_back()
        expect(page.get_by_role("heading", name="AL-02-1-1", exact=True)).to_be_visible()


def test_places_that_need_a_look_are_a_queue_with_who_looks_and_what_was_decided(
    browser: Browser, url: str, folder: Path
) -> None:
    with opened(browser, url) as page, opened(browser, url, NARROW, "dark") as other:
        queue = page.get_by_role("list", name="4 places to look at")
        expect(queue.get_by_role("button")).to_have_text(
            [
                re.compile("AL-03-1-1.*Occluded"),
                re.compile("AL-04-1-1.*Contradicted"),
                re.compile("AL-02-2-1.*Unreadable"),
                re.compile("AL-03-2-1.*Several codes"),
            ]
        )
        queue.get_by_role("button", name="AL-02-2-1").click()
        form = page.get_by_role("group", name="Decision")
        form.get_by_role("button", name="I look").click()
        expect(form.get_by_text("Say who you are first.")).to_be_visible()
        form.get_by_label("Who").fill("Ann")
        form.get_by_label("Note").fill("<b>torn</b>")
        form.get_by_role("button", name="I look").click()
        expect(form.get_by_role("button", name="I look")).to_have_attribute("aria-pressed", "true")
        expect(other.get_by_text("is looked at, Ann: <b>torn</b>")).to_be_visible()
        form.get_by_role("button", name="Put right").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="3 places to look at")).to_be_visible()
        expect(form.get_by_role("list", name="Decided so far").get_by_role("listitem")).to_have_count(2)
        page.get_by_role("button", name="1 closed place").click()
        assert hindrances(page) == []
        other.get_by_role("button", name=re.compile("AL-03-1-1.*Occluded")).click()
        assert hindrances(other) == []
        assert other.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        with SqliteStore(folder / "monday") as store:
            store.commit(look("AL-02-2-1", LocationState.UNREADABLE, at_s=60))
        expect(page.get_by_role("heading", name="4 places to look at")).to_be_visible()


def test_places_are_selected_to_be_counted_again_by_mouse_keys_search_and_state(
    browser: Browser, url: str, folder: Path
) -> None:
    with opened(browser, url, NARROW) as page:
        again = page.get_by_role("group", name="Count again")
        cell(page, "AL-01-2-1").click(modifiers=["Shift"])  # read, as it should be
        expect(cell(page, "AL-01-2-1")).to_have_accessible_name("AL-01-2-1, read, 4006381333931, selected")
        expect(page.get_by_role("region", name="AL-01-2-1")).to_have_count(0)
        cell(page, "AL-01-2-1").focus()
        page.keyboard.press("Shift+Enter")
        expect(again.get_by_text("To count places again")).to_be_visible()
        page.keyboard.press("Shift+Enter")
        cell(page, "BL-01-1-2").click()  # never counted
        page.get_by_label("Selected to be counted again").check()
        expect(again.get_by_role("button", name="Recount 2 selected places as a mission")).to_be_visible()
        expect(cell(page, "BL-01-1-2")).to_have_accessible_name("BL-01-1-2, never counted, selected")
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        form = page.get_by_role("group", name="Decision")
        form.get_by_label("Who").fill("Ann")
        expect(form.get_by_role("button", name="Put right")).to_have_count(0)
        form.get_by_role("button", name="Count again").click()
        queue = page.get_by_role("list", name="5 places to look at")
        expect(queue.get_by_role("button", name=re.compile("BL-01-1-2.*to be counted again"))).to_be_visible()
        again.get_by_role("button", name="Clear").click()
        page.get_by_role("group", name="States").get_by_role("button", name=re.compile("Read 4")).click()
        expect(again.get_by_role("button", name="Recount what is picked out (4 places)")).to_be_visible()
        page.get_by_role("searchbox", name="Code or place").fill("BL-")
        again.get_by_role("button", name="Recount what is picked out (1 place)").click()
        expect(page).to_have_url(re.compile("/missions$"))


FLIES_IN = """([two, demo]) => import("/static/app/store.js").then(({ update }) =>
  update((s) => {
    for (const [drone, name] of [["two", two], ["demo", demo]]) {
      const welcome = { role: "operator", floor: { name, nodes: [] } };
      s.drones.set(drone, { ...s.drones.get(drone), welcome });
    }
  }))"""


def test_a_recount_goes_to_the_drone_of_the_hall_that_the_inventory_is_of(
    browser: Browser, tmp_path: Path
) -> None:
    counted_store(tmp_path / "monday")
    flown_log(tmp_path / "monday" / "flight.mcap", RACKS)
    drones = ["demo=127.0.0.1:1/1", "two=127.0.0.1:1/2"]
    with station(drones, folder=tmp_path) as url, opened(browser, f"{url}/stock") as page:
        page.get_by_role("searchbox", name="Code or place").fill("AL-01-2-1")
        again = page.get_by_role("button", name="Recount what is picked out (1 place)")
        expect(again).to_be_visible()
        selected = "import('/static/app/store.js').then(({ state }) => state.selected)"
        page.evaluate(FLIES_IN, ["hall 3", "hall 2"])
        again.click()
        refused = f"the inventory is of {RACKS.name}, and demo flies in hall 2: link a drone of {RACKS.name}"
        expect(page.get_by_role("alert").filter(has_text=refused)).to_be_visible()
        assert page.evaluate(selected) == "demo"
        page.evaluate(FLIES_IN, [RACKS.name, "hall 2"])
        again.click()
        expect(page).to_have_url(re.compile("/missions$"))
        assert page.evaluate(selected) == "two"


def test_a_store_that_a_flight_begins_is_shown_instead_of_what_the_drone_tells(
    browser: Browser, tmp_path: Path
) -> None:
    with station(["demo=127.0.0.1:1/1"], folder=tmp_path) as url, opened(browser, f"{url}/stock") as page:
        chosen = page.get_by_role("combobox", name=re.compile("^Inventory"))
        expect(chosen).to_have_value("drone/demo")
        expect(page.get_by_role("alert").filter(has_text="cannot be reached")).to_be_visible()
        counted_store(tmp_path / "tuesday")
        expect(chosen).to_have_value("store/tuesday", timeout=15_000)
        expect(cell(page, "AL-01-1-1")).to_be_visible()
        chosen.select_option("drone/demo")
        expect(page.get_by_role("alert").filter(has_text="cannot be reached")).to_be_visible()
        page.wait_for_timeout(11_000)
        expect(chosen).to_have_value("drone/demo")


def test_a_front_on_the_right_runs_to_the_left_as_who_stands_before_it_sees_it(
    browser: Browser, tmp_path: Path
) -> None:
    with SqliteStore(tmp_path / "racks") as store:
        store.plan(PlannedLocation(place.code, place.node) for place in RACKS.locations.values())
    flown_log(tmp_path / "racks" / "flight.mcap", RACKS)
    with station([], folder=tmp_path) as url, opened(browser, f"{url}/stock") as page:
        expect(page.get_by_role("region", name="Aisle A, right")).to_be_visible()
        cell(page, "BR-04-2-2").click()
        for key, place in {
            "ArrowRight": "BR-04-2-1", "End": "BR-01-2-1", "ArrowDown": "BR-01-1-1", "Home": "BR-04-1-2",
            "ArrowLeft": "BL-02-1-2", "ArrowUp": "BL-02-2-2",
        }.items():  # fmt: skip
            page.keyboard.press(key)
            expect(page.get_by_role("heading", name=place, exact=True)).to_be_visible()
        words = "Aisle B, left · bay 2 · level 2 · position 2"
        expect(page.get_by_role("region", name="BL-02-2-2").get_by_text(words)).to_be_visible()


def test_a_place_of_a_strange_name_and_a_first_answer_that_fails_stop_nothing(
    browser: Browser, unchanged: str
) -> None:
    with opened(browser, unchanged) as page:
        page.route(re.compile("/api/stock$"), lambda route: route.abort())
        page.goto(f"{unchanged}?store=monday&place=constructor")
        expect(page.get_by_text("the ground station does not answer").first).to_be_visible()
        page.unroute(re.compile("/api/stock$"))
        expect(page.get_by_role("heading", name="Stock 6 of 11 places counted")).to_be_visible()


def until_asked(page: Page, asked: list[Route]) -> None:
    """The page's request has come, however busy the machine is."""
    while not asked:
        page.wait_for_timeout(20)


def test_the_address_says_which_inventory_and_who_goes_on_is_not_called_back(
    browser: Browser, url: str, folder: Path
) -> None:
    counted_store(folder / "tuesday")
    with opened(browser, url) as page:
        chosen = page.get_by_role("combobox", name=re.compile("^Inventory"))
        expect(chosen).to_have_value("store/tuesday")
        chosen.select_option("store/monday")
        expect(page).to_have_url(f"{url}?store=monday")
        page.get_by_role("link", name="Guide", exact=True).click()
        expect(page).to_have_url(re.compile("/guide$"))
        page.evaluate(
            f"history.pushState(null, '', '{url}?store=tuesday'); dispatchEvent(new Event('popstate'))"
        )
        expect(chosen).to_have_value("store/tuesday")
        page.goto(f"{url}?store=sunday&place=AL-01-1-1")
        expect(page.get_by_role("alert").filter(has_text="there is no inventory sunday")).to_be_visible()
        expect(page).to_have_url(re.compile("sunday"))  # and no other one's place is taken for it
        page.goto(f"{url}?store=tuesday")
        expect(chosen).to_have_value("store/tuesday")
        field = page.get_by_role("searchbox", name="Code or place")
        asked: list[Route] = []
        page.route("**/api/stock/find*", lambda route: asked.append(route))  # noqa: PLW0108 - it is marked
        field.fill("AL-01-1-1")
        field.press("Enter")
        until_asked(page, asked)
        page.get_by_role("link", name="Guide", exact=True).click()
        asked[-1].continue_()
        page.wait_for_timeout(700)
        expect(page).to_have_url(re.compile("/guide$"))


AS_VIEWER = """import("/static/app/store.js").then(({ update }) =>
  update((s) => { s.session = { login: true, name: "vera", role: "viewer" }; }))"""


def test_a_viewers_comparison_runs_one_at_a_time_and_the_newest_is_asked_for_when_it_ends(
    browser: Browser, url: str, folder: Path
) -> None:
    with opened(browser, url) as page:
        asked: list[Route] = []
        page.evaluate(AS_VIEWER)
        expect(page.get_by_text("kept in this tab only")).to_be_visible()
        expect(page.get_by_role("group", name="Count again")).to_have_count(0)
        page.route("**/api/stock/compare*", lambda route: asked.append(route))  # noqa: PLW0108 - it is marked
        books = {"name": "books.csv", "mimeType": "text/csv", "buffer": b"place;code\nAL-01-1-1;PAL-1\n"}
        page.locator("input[type=file]").set_input_files(books)  # type: ignore[arg-type]
        until_asked(page, asked)
        asked[0].continue_()
        expect(page.get_by_text(re.compile("^books.csv: CSV"))).to_be_visible(timeout=30_000)
        for second in (1, 2, 3):
            with SqliteStore(folder / "monday") as store:
                store.commit(look("BL-01-1-2", LocationState.EMPTY, at_s=second))
            page.wait_for_timeout(1300)
        assert len(asked) == 2, "what changed since waits for its end"
        asked[1].continue_()
        page.wait_for_timeout(500)
        assert len(asked) == 3
        asked[2].continue_()
