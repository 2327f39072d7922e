"""The page Fleet in a browser: have nodes visited, see who is not flown and why, stop all, see the week."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from flightd.core.inventory import CountPose, LocationState, Observation, PlannedLocation, Standing
from flightd.core.types import Phase
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.schedules.kept import CountAisles, Kept, QuietHours
from flightd.ground.schedules.schedule_book import ScheduleBook
from tests.web.chromium import NARROW, hindrances, opened
from tests.web.paper_station import PaperStation, paper_station
from tests.web.people_rig import PASSWORD, audited, with_people

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

expect.set_options(timeout=20_000.0)
_CLOSINGS = frozenset({"/api/fleet/close", "/api/fleet/open"})


def keep_schedules(folder: Path) -> None:
    """One every day, and one that its quiet hours hold back."""
    book, now_ns = ScheduleBook(folder), int(datetime.now(UTC).timestamp()) * 10**9
    daily = Kept("hall", "Aisle A", "a", CountAisles(("A",)), "23:59", "UTC")
    held = Kept(
        "hall", "Aisle B", "b", CountAisles(("B",)), "23:58", "UTC", quiet=(QuietHours("23:00", "23:59"),)
    )
    book.keep("schedule-1", daily, now_ns)
    book.keep("schedule-2", held, now_ns)


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[PaperStation]:
    keep_schedules(tmp_path)
    with paper_station("abc", tmp_path) as station:
        yield station


def seen(place: str) -> SentLook:
    """An empty place, counted now."""
    now_ns, pose = int(datetime.now(UTC).timestamp()) * 10**9, CountPose("A3", 0.0, 0.0, 0.9, 0.0)
    look = Observation("run", place, now_ns, LocationState.EMPTY, 0.9, (), pose)
    return SentLook(look, Standing.CONFIRMED)


def drone(page: Page, name: str) -> Locator:
    rows = page.get_by_role("region", name="Drones", exact=True).get_by_role("listitem")
    return rows.filter(has=page.get_by_text(name, exact=True))


def press(page: Page, name: str | re.Pattern[str]) -> None:
    """By the key."""
    page.get_by_role("button", name=name).press("Enter")


def test_a_shared_pad_is_free_kept_for_a_drone_and_taken(browser: Browser, tmp_path: Path) -> None:
    with (
        paper_station("ab", tmp_path, docks=["A5"], speed=4.0) as station,
        opened(browser, f"{station.url}/fleet") as page,
    ):
        pads = page.get_by_role("list", name="Pads").get_by_role("listitem")
        shared = pads.filter(has_text="Pad A5:")
        expect(shared).to_have_text("Pad A5: shared, free, charges")
        a = station.links["a"].drone
        a.battery_frac = 0.5
        page.get_by_role("button", name="Node A3").click()
        page.get_by_role("region", name="Work", exact=True).get_by_label("Flown by").select_option("a")
        press(page, "Have 1 node visited")
        a.held = False
        own = station.own
        assert own is not None
        while own.document()["docks"][0]["drone"] != "a":
            page.wait_for_timeout(50.0)
        a.held = True
        expect(shared).to_contain_text("kept for a, charges")
        a.held = False
        expect(shared).to_contain_text("a stands here, charges")
        expect(pads.filter(has_text="Pad A1:")).to_contain_text("home of a, which is away")


def test_a_tour_is_asked_for_a_drone_is_taken_and_given_back_and_all_are_stopped(
    browser: Browser, fleet: PaperStation
) -> None:
    with opened(browser, f"{fleet.url}/fleet") as page:
        expect(drone(page, "a")).to_contain_text(re.compile("Flown by the fleet.s traffic"))
        expect(page.get_by_role("img", name="b: On the ground")).to_be_visible()
        pads = page.get_by_role("list", name="Pads").get_by_role("listitem")
        expect(pads).to_have_text(
            [re.compile("Pad A1: a stands"), re.compile("B1: b stands"), re.compile("B5: c stands")]
        )

        page.get_by_role("button", name="Node A3").click()  # by mouse, and on by keyboard
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Space")
        work = page.get_by_role("region", name="Work", exact=True)
        work.get_by_label("Flown by").select_option("a")
        press(page, "Have 2 nodes visited")
        expect(page.get_by_text("2 nodes were asked for.")).to_be_visible()
        expect(work.get_by_text("a visits")).to_be_visible()
        expect(work.get_by_text("Waits for a drone")).to_be_visible()  # its share, and the rest
        line = page.get_by_role("list", name=re.compile("What . does")).filter(has_text="Visits A3 in")
        expect(line).to_have_count(1)
        expect(line).to_contain_text(re.compile("Lands at A1 in .*, planned"))

        work.get_by_label("Node").select_option("B3")  # and another one from the list
        press(page, "Add")
        work.get_by_label("Flown by").select_option("")
        press(page, "Have 1 node visited")
        expect(work.get_by_text("b visits")).to_be_visible()
        expect(page.get_by_role("img", name=re.compile("^b: Taking off"))).to_be_visible()
        assert hindrances(page) == []

        page.evaluate(
            """() => fetch("/drones/b/acts", {method: "POST", headers: {"Content-Type": "application/json"},
               body: JSON.stringify({id: "by-ann-1", command: "pause"})})"""
        )
        expect(drone(page, "b")).to_contain_text("Not flown by the fleet: a person has it")
        expect(drone(page, "b")).to_contain_text("Closed for others: B1")
        expect(page.get_by_role("button", name="Give it to the fleet: b")).to_be_visible()
        assert fleet.links["a"].flies

        fleet.links["c"].is_reached = False
        press(page, "STOP ALL")
        expect(page.get_by_text("Armed for 5 seconds")).to_be_visible()
        assert all("stop" not in link.drone.commands for link in fleet.links.values())
        press(page, "Press again: STOP all 3 drones")
        outcomes = page.get_by_role("region", name="STOP for all drones").get_by_role("listitem")
        refused = "c STOP not accepted yet: c cannot be reached: no answer"
        expect(outcomes).to_have_text(["a STOP accepted", "b STOP accepted", refused])
        assert fleet.links["a"].drone.phase in {Phase.LAND, Phase.ABORTED}
        fleet.links["c"].is_reached = True
        fleet.links["c"].drone.phase = Phase.FOLLOW  # it is told as soon as it can be
        expect(outcomes.last).to_have_text("c STOP accepted")
        for link in fleet.links.values():
            link.drone.held = False
        expect(drone(page, "a")).to_contain_text("nothing shows that it stands on its pad")
        assert hindrances(page) == []


def test_an_aisle_is_closed_to_the_drones_and_opened_by_a_second_press(
    browser: Browser, fleet: PaperStation, tmp_path: Path
) -> None:
    with opened(browser, f"{fleet.url}/fleet") as page:
        closed = page.get_by_role("region", name="Closed to drones")
        expect(closed).to_contain_text("Nothing is closed.")
        closed.get_by_role("button", name="Close aisle A").press("Enter")
        expect(closed.get_by_role("listitem")).to_contain_text("aisle A is closed")
        expect(closed.get_by_role("listitem")).to_contain_text("No drone is in it.")
        work = page.get_by_role("region", name="Work", exact=True)
        work.get_by_label("Node").select_option("A3")
        press(page, "Add")
        press(page, "Have 1 node visited")
        expect(page.get_by_text("1 node was asked for.")).to_be_visible()
        expect(work.get_by_role("listitem").filter(has_text="A3: aisle A is closed")).to_be_visible()
        assert hindrances(page) == []
        page.route("**/api/fleet", lambda route: route.abort())
        expect(closed.get_by_role("listitem")).to_contain_text("Nobody knows whether a drone is in it.")
        page.unroute("**/api/fleet")
        expect(closed.get_by_role("listitem")).to_contain_text("No drone is in it.")

        for node in ("B3", "A3"):
            page.get_by_role("button", name=f"Node {node}").click()
        closed.get_by_role("button", name="Close what is between the chosen nodes").press("Enter")
        expect(closed.get_by_role("status")).to_have_text("no way leads between these nodes")
        press(page, "Open again: A")
        assert fleet.own is not None
        assert [one["name"] for one in fleet.own.document()["closed"]] == ["A"], "a slip of the hand"
        press(page, "Press again: drones fly there (A)")
        expect(closed).to_contain_text("Nothing is closed.")
        expect(work.get_by_text("visits")).to_be_visible()
    lines = audited(tmp_path / "state")
    acts = [(line["outcome"], line["text"]) for line in lines if line["target"] in _CLOSINGS]
    assert acts == [
        ("accepted", "close A; HTTP 200"),
        ("refused", "close B3 A3; HTTP 400"),
        ("accepted", "open A; HTTP 200"),
    ]


def test_the_most_valuable_nodes_are_asked_for_by_their_number(browser: Browser, tmp_path: Path) -> None:
    kept = GroundStore(SqliteEngine(tmp_path / "store.db"), FolderEvidence(tmp_path / "evidence"))
    places = tuple(PlannedLocation(f"P-{node}", node) for node in ("A3", "B3"))
    with kept as store, paper_station("ab", tmp_path, store=store) as station:
        store.take(Batch("hall", "a", places, (seen("P-A3"),)))
        with opened(browser, f"{station.url}/fleet") as page:
            form = page.get_by_role("region", name="Work by value")
            form.get_by_label("How many").fill("9")
            form.get_by_role("button", name="Have it visited").press("Enter")
            expect(form.get_by_role("status")).to_have_text("9 nodes were asked for.")
            assert hindrances(page) == []
        assert station.own is not None
        told = station.own.document()
        asked = {*told["open"], *told["given"]}
        assert len(asked) == 9
        assert "A3" not in asked, "it alone was counted"


def test_the_week_is_a_calendar_and_all_fits_a_phone_in_german(browser: Browser, fleet: PaperStation) -> None:
    with opened(browser, f"{fleet.url}/fleet", NARROW, "dark", "de-DE") as page:
        week = page.get_by_role("region", name="Zeitplan").locator("ol.week")
        expect(week.get_by_text("23:59 Aisle A")).to_have_count(7)
        expect(week.get_by_text("von den Ruhezeiten aufgehalten")).to_have_count(7)
        page.get_by_role("button", name="Eine Woche früher").press("Enter")
        expect(week.get_by_text("Aisle A")).to_have_count(0)  # it was not kept then
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]


def test_a_viewer_at_a_station_without_a_fleet_sees_its_drones_and_stops_them(
    browser: Browser, tmp_path: Path
) -> None:
    with_people(tmp_path / "state")
    with (
        paper_station("a", tmp_path, fleet=False, login=True) as alone,
        opened(browser, f"{alone.url}/fleet") as page,
    ):
        page.get_by_label("Name").fill("vera")
        page.get_by_label("Password").fill(PASSWORD)
        page.get_by_role("button", name="Sign in").press("Enter")
        expect(page.get_by_text("People fly these drones")).to_be_visible()
        expect(page.get_by_text("--fleet", exact=True)).to_be_visible()
        expect(page.get_by_role("img", name="a: On the ground")).to_be_visible()
        expect(page.get_by_role("button", name="Node A3")).to_have_count(0)
        alone.links["a"].drone.phase = Phase.FOLLOW
        press(page, "STOP ALL")
        press(page, "Press again: STOP 1 drone")
        expect(page.get_by_text("STOP accepted")).to_be_visible()
        assert hindrances(page) == []
