"""The page Site in a real browser: sites from nothing, drawn, checked, saved, taken back; mouse and keys."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.request import Request, urlopen

import pytest

from flightd.site.site_file import load_site
from tests.web.chromium import NARROW, WIDE, hindrances, opened, station

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

RACKS = Path(__file__).parents[2] / "configs" / "site-racks-small.toml"
SOUND = "Sound: a drone can fly by it."


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sites")


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    with station(["demo=127.0.0.1:1/1"], folder=folder) as url:
        _begin_working(url)
        yield f"{url}/site"


def _begin_working(url: str) -> None:
    """The first question starts the process that works on maps, which takes a while on a busy machine."""
    new = {"name": "n", "aisles": 1, "nodes": 2, "spacing_m": [1.5], "pitch_m": 3}
    asked = Request(
        f"{url}/api/site/new", json.dumps(new).encode(), {"Origin": url, "Content-Type": "application/json"}
    )
    with urlopen(asked, timeout=60) as answer:
        assert answer.status == 200


@pytest.fixture
def file(folder: Path) -> Path:
    return Path(shutil.copy(RACKS, folder / "hall.toml"))


def entry(page: Page, name: str) -> Locator:
    return page.get_by_role("region", name="Elements").get_by_role("button", name=name)


def form(page: Page) -> Locator:
    return page.locator("section.element")


def type_into(page: Page, label: str, text: str) -> None:
    page.get_by_label(label).fill(text)
    page.keyboard.press("Enter")


def tables(file: Path) -> dict[str, list[dict[str, object]]]:
    return tomllib.loads(file.read_text())


def test_a_site_from_nothing_is_drawn_checked_saved_and_read_by_the_daemon(
    browser: Browser, url: str, folder: Path
) -> None:
    with opened(browser, url) as page:
        page.get_by_role("link", name="New site").click()
        page.get_by_label("Nodes of each aisle").fill("4")
        page.get_by_label("Aisles", exact=True).fill("3")
        type_into(page, "From aisle to aisle", "2,4 m")
        expect(page.get_by_text("A number, as in 1.5")).to_be_visible()
        type_into(page, "From aisle to aisle", "2,4")
        expect(page.get_by_text("ceiling_m = 4.5 is assumed")).to_be_visible()
        page.get_by_role("button", name="Understood").click()
        expect(page.get_by_text(SOUND)).to_be_visible()
        page.get_by_label("File").fill("north hall")
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_text("Saved as north hall.toml.")).to_be_visible()
        site = load_site(folder / "north hall.toml")
        assert [aisle.y_m for aisle in site.aisles] == [0.0, 2.4, 4.8]
        page.reload()
        expect(page.get_by_role("heading", name="my hall north hall.toml")).to_be_visible()


def test_a_rack_is_changed_checked_and_saved_with_every_comment_and_taken_back(
    browser: Browser, url: str, file: Path
) -> None:
    before = file.read_text()
    with opened(browser, f"{url}/edit?name=hall.toml") as page:
        entry(page, "Rack 1").click()
        expect(form(page).get_by_text("12 bays, 48 places: AL-01-1-1 to BR-04-2-2")).to_be_visible()
        type_into(page, "Places in a bay", "3")
        type_into(page, "Pattern of location codes", "{aisle}{side}{bay:02}.{level}.{position}")
        expect(form(page).get_by_text("12 bays, 72 places: AL01.1.1 to BR04.2.3")).to_be_visible()
        type_into(page, "Heights of the labels", "0.9 2.4")
        finding = page.get_by_role("list", name="Findings").get_by_role(
            "button", name=re.compile("2.4 m is above")
        )
        entry(page, "Pad home").click()
        finding.click()
        expect(page.get_by_label("Heights of the labels")).to_be_focused()
        assert hindrances(page) == []
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_role("alert").filter(has_text="not saved: rack[0].levels_m")).to_be_visible()
        assert file.read_text() == before
        page.get_by_role("heading", name="Rack 1").click()
        page.keyboard.press("Control+z")
        expect(page.get_by_text(SOUND)).to_be_visible()
        page.keyboard.press("Control+s")
        expect(page.get_by_text("Saved as hall.toml.")).to_be_visible()
        assert file.read_text() == before.replace(
            "positions = 2\n", 'positions = 3\npattern = "{aisle}{side}{bay:02}.{level}.{position}"\n'
        )
        file.write_text(file.read_text().replace("racks-small", "changed elsewhere"))
        type_into(page, "Places in a bay", "1")
        page.keyboard.press("Control+s")
        expect(page.get_by_role("alert").filter(has_text="was changed by somebody else")).to_be_visible()
        page.get_by_role("button", name="Open anew").click()
        page.get_by_role("button", name="Keep it").click()
        expect(page.get_by_label("Places in a bay")).to_have_value("1")
        page.get_by_role("link", name="Live").click()
        expect(page.get_by_role("heading", name="No drone yet")).to_be_visible()
        assert asks_before_it_goes(page)
        page.go_back()
        page.get_by_role("button", name="Open anew").click()
        page.get_by_role("button", name="Lose what is not saved").click()
        expect(page.get_by_role("heading", name="changed elsewhere hall.toml")).to_be_visible()
        assert not asks_before_it_goes(page)
        page.get_by_label("Old versions").select_option(index=1)
        expect(page.get_by_text("Save puts it back")).to_be_visible()
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_text("Saved as hall.toml.")).to_be_visible()
        assert file.read_text() == before


def asks_before_it_goes(page: Page) -> bool:
    return not page.evaluate("dispatchEvent(new Event('beforeunload', {cancelable: true}))")


def middle(page: Page, selector: str) -> tuple[float, float]:
    box = page.locator(selector).first.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def take_up(page: Page, element: str) -> None:
    """To draw such an element; what is said of it then moves the drawing."""
    tool = page.get_by_role("button", name=f"Draw a new {element}")
    tool.click()
    expect(tool).to_have_attribute("aria-pressed", "true")


def drag(page: Page, a: tuple[float, float], b: tuple[float, float]) -> None:
    page.mouse.move(*a)
    page.mouse.down()
    page.mouse.move((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
    page.mouse.move(*b)
    page.mouse.up()


def test_the_mouse_moves_and_draws_and_each_stroke_is_one_step_back(
    browser: Browser, url: str, file: Path
) -> None:
    with opened(browser, f"{url}/edit?name=hall.toml") as page:
        expect(page.get_by_text(SOUND)).to_be_visible()
        a1, a2, b3 = (middle(page, f"[data-id={node}] .mark") for node in ("A1", "A2", "B3"))
        metre = (a2[0] - a1[0]) / 1.3
        drag(page, a2, (a2[0] + 0.31 * metre, a2[1] + 40))
        expect(page.get_by_label("A2, x")).to_have_value("1.6")
        expect(page.get_by_label("Distances from node to node")).to_have_value("1.6 1 1.3")
        between = (b3[0] + 0.5 * metre, b3[1])
        drag(page, between, (between[0], between[1] + 0.5 * metre))
        expect(page.get_by_role("heading", name="Aisle B")).to_be_visible()
        expect(page.get_by_label("Pitch from the aisle before")).to_have_value("3.9")
        expect(page.get_by_text(SOUND)).to_be_visible()
        take_up(page, "keep-out")
        a4 = middle(page, "[data-id=A4] .mark")
        drag(page, (a4[0] + 0.55 * metre, a4[1] + 0.6 * metre), (a4[0] + 0.9 * metre, a4[1] + 1.4 * metre))
        expect(page.get_by_role("heading", name="Keep-out 1")).to_be_visible()
        take_up(page, "pad")
        page.mouse.click(*middle(page, "[data-id=B1] .mark"))
        expect(page.get_by_label("On node")).to_have_value("B1")
        take_up(page, "blocked line")
        page.mouse.click(*middle(page, "[data-id=A2] .mark"))
        page.mouse.click(*middle(page, "[data-id=A3] .mark"))
        expect(entry(page, "Blocked A2 to A3")).to_have_attribute("aria-pressed", "true")
        expect(page.get_by_role("definition").last).to_be_visible()
        for _ in range(5):
            page.get_by_role("button", name="Undo").click()
        expect(page.get_by_role("button", name="Undo")).to_be_disabled()
        expect(page.get_by_role("button", name="Save", exact=True)).to_be_disabled()
        for _ in range(5):
            page.get_by_role("button", name="Redo").click()
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_text("Saved as hall.toml.")).to_be_visible()
        page.get_by_role("button", name="Fly it in simulation").click()
        drones = page.get_by_role("navigation", name="Drones")
        expect(drones.get_by_role("button", name="simulation")).to_be_visible()
        page.get_by_role("button", name="End the flight").click()
        expect(page.get_by_text("was not good")).to_be_visible()
        expect(page.get_by_role("button", name="Fly again in simulation")).to_be_enabled()
        expect(drones).to_have_count(0)
        assert hindrances(page) == []
    saved = tables(file)
    assert saved["aisle"][0]["spacing_m"] == [1.6, 1.0, 1.3]
    assert saved["aisle"][1]["y_m"] == 3.9
    assert [pad["node"] for pad in saved["pad"]] == ["A1", "B1"]
    assert saved["blocked"] == [{"nodes": ["A2", "A3"]}]
    assert "# one bay before each node" in file.read_text()


def test_a_finger_draws_what_it_goes_over_and_what_the_browser_takes_away_draws_nothing(
    browser: Browser, url: str, file: Path
) -> None:
    context = browser.new_context(
        viewport={"width": NARROW[0], "height": NARROW[1]}, has_touch=True, locale="en-US"
    )
    page = context.new_page()
    page.goto(f"{url}/edit?name=hall.toml")
    expect(page.get_by_text(SOUND)).to_be_visible()
    take_up(page, "keep-out")
    page.locator(".site-plan").scroll_into_view_if_needed()
    finger = context.new_cdp_session(page)
    a1, a2 = (middle(page, f"[data-id={node}] .mark") for node in ("A1", "A2"))
    metre = (a2[0] - a1[0]) / 1.3

    def touch(kind: str, *at: tuple[float, float]) -> None:
        points = [{"x": x, "y": y} for x, y in at]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def swipe(ending: str) -> None:
        touch("touchStart", (a1[0] + 0.3 * metre, a1[1] + 0.7 * metre))
        for part in (0.25, 0.5, 0.75, 1.0):
            touch("touchMove", (a1[0] + (0.3 + part) * metre, a1[1] + (0.7 + 1.5 * part) * metre))
        touch(ending)

    swipe("touchCancel")
    expect(page.locator(".sketch")).to_have_count(0)
    expect(entry(page, "Keep-out 1")).to_have_count(0)
    swipe("touchEnd")
    expect(page.get_by_role("heading", name="Keep-out 1")).to_be_visible()
    expect(page.get_by_role("button", name="Redo")).to_be_disabled()
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("Saved as hall.toml.")).to_be_visible()
    context.close()
    drawn = tables(file)["keep_out"][-1]
    assert [drawn[key] for key in ("x0_m", "y0_m", "x1_m", "y1_m")] == pytest.approx(
        [0.3, 0.7, 1.3, 2.2], abs=0.06
    )


def test_all_of_it_goes_by_keys_alone_and_nodes_keep_what_lies_on_them(
    browser: Browser, url: str, file: Path
) -> None:
    with opened(browser, f"{url}/edit?name=hall.toml", NARROW, "dark") as page:
        add = page.get_by_role("button", name="Add aisle")
        add.focus()
        page.keyboard.press("Enter")
        expect(page.get_by_label("Pitch from the aisle before")).to_have_value("3.4")
        expect(
            page.get_by_role("list", name="Findings").get_by_text("aisle C cannot be reached")
        ).to_be_visible()
        page.get_by_role("button", name="Add cross").focus()
        page.keyboard.press("Enter")
        expect(entry(page, "Cross B1 to C1")).to_be_visible()
        expect(page.get_by_text(SOUND)).to_be_visible()
        entry(page, "Aisle B").press("Enter")
        type_into(page, "Letters", "Q")
        expect(entry(page, "Cross Q1 to C1")).to_be_visible()
        page.locator("summary").filter(has_text="4 nodes").press("Enter")
        page.get_by_role("button", name="Add a node after Q1").press("Enter")
        expect(entry(page, "Cross A4 to Q5")).to_be_visible()
        page.get_by_role("group", name="Drawing.").focus()
        page.keyboard.press("ArrowRight")
        expect(page.get_by_label("Q2, x")).to_have_value("0.75")
        page.keyboard.press("Delete")
        expect(entry(page, "Cross A4 to Q4")).to_be_visible()
        page.keyboard.press("ArrowDown")
        expect(page.get_by_label("Line, y")).to_have_value("3.5")
        assert hindrances(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") == NARROW[0]
        expect(page.get_by_role("button", name="STOP")).to_be_in_viewport(ratio=1.0)
        page.get_by_role("link", name="Live").click()
        page.go_back()
        expect(page.get_by_label("Line, y")).to_have_value("3.5")
        page.get_by_role("link", name="All sites").click()
        expect(page.get_by_text("has changes that are not saved")).to_be_visible()
        assert hindrances(page) == []


ASKED = """async ({draft, calls}) => {
  const module = await import("/static/app/site/draft.js");
  for (const [name, ...given] of calls) draft = module[name](draft, ...given);
  return draft;
}"""


def test_what_names_nodes_and_aisles_follows_them(browser: Browser, url: str) -> None:
    def rows(*values: dict[str, object]) -> list[dict[str, object]]:
        return [{"values": one, "at": i} for i, one in enumerate(values)]

    aisles = [{"id": one, "x_m": 0, "y_m": y, "spacing_m": [1, 2, 3]} for one, y in (("A", 0), ("AB", 3))]
    draft = {
        "site": {"name": "x"},
        "text": "as it was",
        "lists": {
            "aisle": rows(*aisles),
            "cross": rows({"nodes": ["A1", "AB1"]}, {"nodes": ["A3", "AB3"]}),
            "blocked": rows({"nodes": ["A2", "A3"]}),
            "rack": rows({"aisles": ["A", "AB"]}, {"sides": ["left"]}),
            "pad": rows({"id": "home", "node": "A1"}, {"id": "far", "node": "AB3"}),
        },
    }
    with opened(browser, url) as page:

        def after(*calls: list[object]) -> dict[str, list[dict[str, object]]]:
            told = page.evaluate(ASKED, {"draft": draft, "calls": calls})
            assert told["text"] == "as it was"
            return {name: [row["values"] for row in rows] for name, rows in told["lists"].items()}

        more = after(["withNodeAfter", 0, 1])
        assert more["aisle"][0]["spacing_m"] == [1, 1, 1, 3]
        assert [one["nodes"] for one in more["cross"]] == [["A1", "AB1"], ["A4", "AB3"]]
        assert more["blocked"] == [{"nodes": ["A2", "A4"]}]
        assert after(["withNodeAfter", 0, 1], ["withoutNode", 0, 2]) == after()
        less = after(["withoutNode", 1, 2])
        assert less["aisle"][1]["spacing_m"] == [1, 5]
        assert len(less["cross"]) == len(less["pad"]) == 1
        first = after(["withoutNode", 0, 0])
        assert (first["aisle"][0]["x_m"], first["aisle"][0]["spacing_m"]) == (1, [2, 3])
        assert [pad["node"] for pad in first["pad"]] == ["AB3"]
        assert first["blocked"] == [{"nodes": ["A1", "A2"]}]
        named = after(["withAisleNamed", 0, "Q"])
        assert named["rack"] == [{"aisles": ["Q", "AB"]}, {"sides": ["left"]}]
        assert [one["nodes"] for one in named["cross"]] == [["Q1", "AB1"], ["Q3", "AB3"]]
        gone = after(["without", {"table": "aisle", "index": 0}])
        assert gone["cross"] == gone["blocked"] == []
        assert gone["rack"][0] == {"aisles": ["AB"]}
        kept = after(["withNodeAt", 0, 1, 9.0])
        assert kept["aisle"][0]["spacing_m"] == [2.95, 0.05, 3], "a node never passes its neighbour"


def test_coverage_is_checked_beside_the_drawing_and_leads_to_its_aisle(
    browser: Browser, url: str, file: Path
) -> None:
    with opened(browser, f"{url}/edit?name=hall.toml", WIDE, "dark") as page:
        card = page.get_by_role("region", name="Scan coverage")
        expect(card.get_by_text("100 % of 48 places are read")).to_be_visible()
        card.get_by_text("Camera and labels").click()
        type_into(page, "Field of view across", "25")
        expect(card.get_by_text("0 % of 48 places are read")).to_be_visible()
        gap = page.get_by_role("button", name=re.compile("aisle B, right side: .* is in no picture"))
        gap.first.click()
        expect(page.get_by_role("heading", name="Aisle B")).to_be_focused()
        assert page.locator("circle.lost").count() > 0
        assert hindrances(page) == []


def test_other_programs_maps_come_in_and_go_out(
    browser: Browser, url: str, file: Path, tmp_path: Path
) -> None:
    saved = {}
    with opened(browser, f"{url}/edit?name=hall.toml") as page:
        for words in ("VDMA LIF", "Nodes (CSV)", "Location codes (CSV)", "Site file (TOML)"):
            with page.expect_download() as download:
                page.get_by_label("Export").select_option(words)
            saved[words] = tmp_path / download.value.suggested_filename
            download.value.save_as(saved[words])
        assert [path.name for path in saved.values()] == [
            "hall.lif.json", "hall-nodes.csv", "hall-locations.csv", "hall.toml"
        ]  # fmt: skip
        assert saved["Site file (TOML)"].read_text() == RACKS.read_text()
        assert json.loads(saved["VDMA LIF"].read_text())["metaInformation"]["lifVersion"] == "1.0.0"
        page.get_by_role("link", name="All sites").click()
        page.locator("input[type=file]").set_input_files(saved["Location codes (CSV)"])
        expect(page.get_by_role("alert").filter(has_text="row 3: node 'A1' comes twice")).to_be_visible()
        page.locator("input[type=file]").set_input_files(saved["VDMA LIF"])
        expect(page.get_by_text(SOUND)).to_be_visible()
        expect(page.get_by_text("no LIF tells how high shelves are")).to_be_visible()
        expect(entry(page, "Cross A4 to B4")).to_be_visible()
