"""The page Studio: a colour learnt by mouse and keys, compared, installed, taken back."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from flightd.ground.studio.profile_shelf import ProfileShelf
from flightd.ground.studio.studio import missing_training
from flightd.vision.lines.colour_profile import load_profile, save_profile
from tests.web.camera_rig import CameraDrone
from tests.web.chromium import NARROW, WIDE, hindrances, opened, station
from tests.web.studio_rig import HEIGHT, WIDTH, flown_folder, marks_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")
from playwright.sync_api import expect

pytestmark = pytest.mark.skipif(missing_training() != "", reason=missing_training())
expect.set_options(timeout=40_000.0)

LOOKS = [(NARROW, "light"), (WIDE, "dark")]
SIGNED_IN = """import("/static/app/store.js").then(({ update }) => update((s) => {
  s.session = { login: true, name: "otto-of-the-first-shift", role: "operator" };
}))"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With a recorded flight, and a profile that Ann installed before."""
    folder = flown_folder(tmp_path)
    shipped = load_profile("yellow")
    save_profile(shipped, folder / "first.npz")
    content = (folder / "first.npz").read_bytes()
    ProfileShelf(folder).install("hall", content, "Ann", "yellow", (shipped.training_hash, "same"))
    return folder


@pytest.fixture
def url(folder: Path) -> Iterator[str]:
    """Of a station with a drone that cannot be reached, and one that stands."""
    with CameraDrone().standing() as eye, station(["demo=127.0.0.1:1/1", eye.at], folder=folder) as url:
        yield url


def drag(page: Page, first: list[float], last: list[float]) -> None:
    """With the mouse over the picture, from pixel to pixel of it."""
    box = page.get_by_label("Picture to mark in").bounding_box()
    assert box is not None
    scale = box["width"] / WIDTH
    places = [
        (box["x"] + min(max(x, 3), WIDTH - 3) * scale, box["y"] + min(max(y, 3), HEIGHT - 3) * scale)
        for x, y in (first, last)
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=3)
    page.mouse.up()


def lines_of(page: Page) -> dict[str, list[dict[str, Any]]]:
    """What the shipped profile sees in the set's pictures: where to draw."""
    seen: dict[str, list[dict[str, Any]]] = page.evaluate(
        """async () => {
            const at = `/api/studio/sets/${location.pathname.split("/")[2]}`, seen = {};
            for (const { file } of (await (await fetch(at)).json()).pictures) {
                const data = await (await fetch(`${at}/pictures/${file}/mask?by=yellow`)).arrayBuffer();
                const length = new DataView(data).getUint32(0);
                seen[file] = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))).lines;
            }
            return seen;
        }"""
    )
    return seen


def mark(page: Page, lines: list[dict[str, Any]]) -> None:
    """Paint along the line by a stroke, floor beside it by a box."""
    paint, floor = marks_of(lines)["regions"]
    page.get_by_role("button", name="Paint").click()
    page.get_by_role("button", name="Stroke").click()
    drag(page, paint["stroke"][0], paint["stroke"][1])
    page.get_by_role("button", name="Floor").click()
    page.get_by_role("button", name="Box").click()
    (x0, y0), (x1, y1) = floor["stroke"]
    drag(page, [min(x0, x1) - 8, min(y0, y1) - 8], [max(x0, x1) + 8, max(y0, y1) + 8])


def mistake_the_buttons(page: Page, seen: dict[str, list[dict[str, Any]]]) -> None:
    """Paint for floor and floor for paint in these pictures, sent as the page sends them."""
    marks = {
        file: [one | {"paint": not one["paint"]} for one in marks_of(lines)["regions"]]
        for file, lines in seen.items()
    }
    page.evaluate(
        """async (marks) => {
            const at = `/api/studio/sets/${location.pathname.split("/")[2]}`;
            for (const [file, regions] of Object.entries(marks)) {
                const headers = { "Content-Type": "application/json" }, body = JSON.stringify({ regions });
                await fetch(`${at}/pictures/${file}`, { method: "PUT", headers, body });
            }
        }""",
        marks,
    )
    page.reload()


def score_on(page: Page) -> None:
    """The one flight of the site, and none."""
    expect(page.get_by_text("Also scored on 1 flight log of one site.")).to_be_visible()
    page.get_by_text("Flights to score on").click()
    assert page.get_by_label("Site").input_value()
    flown = page.get_by_role("checkbox", name=re.compile("flight.mcap"))
    flown.uncheck()
    expect(page.get_by_text("Scored on no flight log: none is chosen.")).to_be_visible()
    flown.check()
    expect(page.get_by_text("Also scored on 1 flight log of one site.")).to_be_visible()


def fit_a_flight(page: Page) -> None:
    """What the made-up flight is refused, then what a flight that tells enough is shown as."""
    lens = page.get_by_role("region", name="Lens")
    look = lens.get_by_role("button", name="Look what it found")
    look.click()
    expect(page.get_by_role("alert").filter(has_text="mission: is missing")).to_be_visible()
    delay = {
        "name": "camera delay",
        "unit": "s",
        "key": "camera.latency_s",
        "configured": 0.06,
        "change": True,
    }
    delay |= {"fitted": 0.05269, "sigma": 0.00411, "online": 0.05323, "online_sigma": 0.004, "note": ""}
    leak = {"name": "attitude leak", "unit": "1/s", "key": "", "configured": 0.0, "change": False}
    leak |= {"fitted": None, "sigma": None, "online": None, "online_sigma": None}
    leak["note"] = "not told by this flight"
    study = {"frames": 584, "sensors": [delay, leak], "config": "[camera]\nlatency_s = 0.0527"}
    page.route("**/api/studio/flights/*/sensors", lambda route: route.fulfill(json=study))
    look.click()
    row = lens.get_by_role("row", name=re.compile("Camera delay, s camera.latency_s"))
    expect(row.get_by_role("cell")).to_have_text(["0.06", "0.05323 ± 0.004", "0.05269 ± 0.0041"])
    expect(lens.get_by_role("row", name=re.compile("Not told by this flight"))).to_be_visible()
    expect(lens.get_by_text("latency_s = 0.0527")).to_be_visible()
    lens.get_by_role("button", name="Front camera").click()
    expect(lens.get_by_text("A flight tells of the down camera alone")).to_be_visible()
    lens.get_by_role("button", name="Down camera").click()
    look.click()
    expect(row).to_be_visible()


def serves_everybody(page: Page) -> None:
    """Wide and narrow, light and dark: nothing hinders, nothing overflows."""
    for size, scheme in LOOKS:
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        assert hindrances(page) == [], (size, scheme)


def test_a_colour_is_learnt_compared_installed_and_taken_back(
    browser: Browser, url: str, folder: Path
) -> None:
    flies = folder / "profiles" / "hall.npz"
    first = load_profile(flies).training_hash
    with opened(browser, f"{url}/studio/nothing") as page:
        expect(page.get_by_text("there is no set nothing")).to_be_visible()
        page.get_by_role("link", name="All sets").click()
        page.get_by_label("Name of a new set").fill("hall")
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="hall", exact=False, level=2)).to_be_visible()

        page.get_by_role("button", name="Files").click()
        page.get_by_label("JPEG or PNG").set_input_files(
            {"name": "a.jpg", "mimeType": "image/jpeg", "buffer": b"no picture"}
        )
        expect(page.get_by_role("alert").filter(has_text="this is no picture")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("button", name="STOPPING")).to_be_visible()

        page.get_by_role("button", name="From a flight").click()
        page.get_by_role("button", name=re.compile("Take 8 from all")).click()
        thumbs = page.get_by_role("region", name="Pictures").get_by_role("listitem")
        expect(thumbs).to_have_count(8)
        page.get_by_role("button", name="From a flight").click()

        seen = lines_of(page)
        page.get_by_role("button", name=re.compile(r"^1\. ")).click()
        mark(page, seen.pop(next(iter(seen))))
        expect(page.get_by_role("button", name="1. 2 marks")).to_be_visible()
        page.get_by_label("Picture to mark in").focus()  # a line by its ends, by keys alone
        for key in ("3", "Space", "Shift+ArrowUp", "Shift+ArrowUp", "Space"):
            page.keyboard.press(key)
        expect(page.get_by_role("button", name="1. 2 marks, 1 line")).to_be_visible()
        page.keyboard.press("Backspace")
        expect(page.get_by_role("button", name="1. 2 marks", exact=True)).to_be_visible()
        taught = re.compile(r"\d+ % of the picture is taken for paint, \d line")
        expect(page.get_by_text(taught)).to_be_visible()
        expect(page.get_by_text("Saving …")).to_have_count(0)

        score_on(page)
        mistake_the_buttons(page, seen)
        page.get_by_role("button", name="Learn from the marks").click()
        expect(page.get_by_text("Worse than what flies now", exact=True)).to_be_visible(timeout=300_000)
        scores = page.get_by_role("group", name="Scores")
        for name in ("new", "shipped yellow", "installed 1"):
            expect(scores.get_by_role("columnheader", name=name)).to_be_visible()
        page.get_by_role("button", name="Install", exact=True).click()
        expect(page.get_by_text("Say who you are first.")).to_be_visible()
        page.get_by_label("Who").fill("Bo")
        page.get_by_role("button", name="Install", exact=True).click()
        asks = page.get_by_role("alert").filter(has_text="It is worse than what flies now")
        asks.get_by_role("button", name="No").click()
        assert load_profile(flies).training_hash == first
        page.get_by_role("button", name="Install", exact=True).click()
        asks.get_by_role("button", name="Yes, install the worse one").click()
        versions = page.get_by_role("region", name="Profile hall").get_by_role("listitem")
        expect(versions.filter(has_text="Version 2")).to_contain_text("installed")
        assert load_profile(flies).training_hash != first
        versions.get_by_role("button", name="Take back to 1").click()
        expect(versions.filter(has_text="Version 1")).to_contain_text("installed")
        assert load_profile(flies).training_hash == first

        page.get_by_role("button", name="eye", exact=True).click()
        card = page.get_by_role("region", name="Profile hall")
        card.get_by_role("button", name="To the drone eye").click()
        expect(card.get_by_text("eye is set to the shipped profile of its floor's paint.")).to_be_visible()
        card.get_by_role("button", name="Send version 1 to eye").click()
        expect(card.get_by_text("eye is set to version 1.")).to_be_visible()
        expect(card.get_by_text(re.compile("The drone has it"))).to_be_visible()
        expect(card.get_by_role("button", name="Send version")).to_have_count(0)
        card.get_by_role("button", name="Start flightd anew").click()
        expect(card.get_by_text("flightd starts anew")).to_be_visible()

        page.get_by_role("button", name="Look for the board").click()
        expect(page.get_by_text("The board is seen in 0 of 8 pictures")).to_be_visible()
        fit_a_flight(page)
        serves_everybody(page)
        page.get_by_role("link", name="Studio", exact=True).first.click()
        expect(page.get_by_role("link", name="hall")).to_be_visible()
        page.get_by_label("Paint").select_option("another …")
        expect(page.get_by_label("Tone")).to_be_visible()
        serves_everybody(page)


def test_a_cameras_exposure_is_seen_set_and_read_back(browser: Browser, url: str) -> None:
    with opened(browser, f"{url}/studio") as page:
        card = page.get_by_role("region", name="Camera exposure")
        expect(card.get_by_role("alert").filter(has_text="demo cannot be reached")).to_be_visible()
        page.get_by_role("button", name="eye").click()
        expect(card.get_by_role("row", name="Exposure left to the camera 20 ms")).to_be_visible()
        expect(card.get_by_role("row", name="Automatic left to the camera on")).to_be_visible()
        expect(card.get_by_text(re.compile("the floor smears by 5.3 px"))).to_be_visible()
        spread = re.compile(r"Brightness .*: Median 90 of 255, 6\.\d % burnt out, 0\.0 % black")
        expect(card.get_by_role("img", name=spread)).to_be_visible()
        says = card.get_by_role("list", name="What the doctor says")
        for words in (
            "it grows in the dark",
            "set camera.exposure_s",
            "too bright",
            "then a shorter exposure",
        ):
            expect(says.get_by_text(words)).to_be_visible()

        exposure = card.get_by_label("exposure_s s")
        exposure.focus()  # all of it by keys
        page.keyboard.type("0.5")
        complaint = card.get_by_role("alert").filter(has_text="camera.exposure_s: 0.5 is outside 0 to 0.1 s")
        expect(complaint).to_be_visible()
        expect(card.get_by_role("button", name="Send to eye")).to_be_disabled()
        page.keyboard.press("Control+a")
        page.keyboard.type("0.004")
        card.get_by_label("gain 1").focus()
        page.keyboard.type("200")
        expect(complaint).to_have_count(0)
        serves_everybody(page)
        card.get_by_label("Who").fill("Bo")
        card.get_by_role("button", name="Send to eye").press("Enter")
        card.get_by_role("button", name="Start flightd anew").press("Enter")
        expect(card.get_by_text("flightd starts anew")).to_be_visible()
        card.get_by_role("button", name="Look again").press("Enter")
        expect(card.get_by_role("row", name="Exposure 4 ms 4 ms")).to_be_visible()
        expect(card.get_by_role("row", name="Gain 200 100")).to_be_visible()
        expect(says.get_by_text("gain was set to 200, the camera tells 100")).to_be_visible()
        expect(card.get_by_text(re.compile("the floor smears by 1.1 px"))).to_be_visible()
        serves_everybody(page)
        page.get_by_role("button", name="DE, Deutsch").click()
        for width in (360, 390, 561, 700, 1140, 1400):
            page.set_viewport_size({"width": width, "height": 800})
            page.evaluate(SIGNED_IN)
            expect(page.locator("summary", has_text="otto-of-the-first-shift")).to_be_visible()
            expect(page.get_by_role("button", name="STOP eye")).to_be_in_viewport(ratio=1.0)
            assert page.evaluate("document.documentElement.scrollWidth") == width
