"""A person's whole day at the ground station, in the system's Chromium, by mouse and keyboard alone: draw a
site, check it, fly it in the simulator by the clock (watch, pause, go to, STOP, start again), see the stock
fill, compare it with the books, work the exceptions, download, count again what wants a look; learn a colour,
install it, play the flight again.

It takes about eight minutes, most of them in the air, so it is no part of the gate.  Each page is kept as
a picture, wide and narrow, light and dark, and looked at by axe-core; `sheets/` has one file a page with all
four, as flightd/guide/pictures shows them (ground-station-NAME.jpg).

python -m tests.web.whole_day FOLDER
"""

from __future__ import annotations

import contextlib
import csv
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from flightd.runtime.free_ports import free_ports
from tests.web.chromium import NARROW, ROOT, WIDE, hindrances, opened, running, station

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

SITE = "north hall"
PHASE_MS, FLIGHT_MS, TRAINING_MS = 60_000, 400_000, 300_000
_HOLD_MS = 1300.0
_LOOKS = [(WIDE, "light"), (WIDE, "dark"), (NARROW, "light"), (NARROW, "dark")]
_SETTLE_MS = 700
_ROW_PX, _QUALITY = 560, 82
_BETWEEN_BGR = (150, 150, 150)


def main() -> None:
    if len(sys.argv) != 2:
        raise SystemExit("python -m tests.web.whole_day FOLDER: one folder, for the flights and the pictures")
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise SystemExit(f"{folder}: not empty; give a new folder")
    status, command = ports = free_ports(2, socket.SOCK_STREAM)
    with (
        station([f"north=127.0.0.1:{status}/{command}"], folder=folder) as url,
        running() as browser,
        opened(browser, f"{url}/site") as page,
    ):
        day = Day(page, url, folder, ports)
        for step in (draw, fly_and_stop, fly_and_count, work_the_stock, recount, learn, play):
            began_s = time.monotonic()
            step(day)
            print(f"{step.__name__.replace('_', ' '):20} {time.monotonic() - began_s:6.1f} s", flush=True)
    sheets(folder)
    print("\n".join(day.findings) or "axe-core: nothing serious on any page")
    if day.findings:
        raise SystemExit(1)


@dataclass
class Day:
    """The page, where its station is, the folder of both, and the ports of the drone's link."""

    page: Page
    url: str
    folder: Path
    ports: list[int]
    findings: list[str] = field(default_factory=list)

    def button(self, name: str | re.Pattern[str], exact: bool = False) -> Locator:
        return self.page.get_by_role("button", name=name, exact=exact).first

    def seen(self, text: str | re.Pattern[str], within_ms: float = PHASE_MS) -> None:
        """Wait until the page says so."""
        self.page.get_by_text(text).first.wait_for(timeout=within_ms)

    def phase(self, words: str, within_ms: float = PHASE_MS) -> None:
        """Wait until the head of Live says so."""
        self.page.get_by_role("heading", level=2, name=re.compile(words)).wait_for(timeout=within_ms)

    def go(self, page: str) -> None:
        """By the link in the frame."""
        self.page.get_by_role("link", name=page, exact=True).first.click()

    def hold(self, name: str) -> None:
        """A button that is held, as soon as it may be."""
        held = self.page.locator(f"button[aria-disabled=false]:has-text('{name}')").first
        held.wait_for(timeout=FLIGHT_MS)
        held.hover()
        self.page.mouse.down()
        self.page.wait_for_timeout(_HOLD_MS)
        self.page.mouse.up()

    def shoot(self, name: str) -> None:
        """Keep the page as it looks, in all four looks."""
        pictures = self.folder / "pictures"
        pictures.mkdir(exist_ok=True)
        for (width, height), scheme in _LOOKS:
            self.page.set_viewport_size({"width": width, "height": height})
            self.page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
            self.page.wait_for_timeout(_SETTLE_MS)
            self.page.screenshot(path=pictures / f"{name}-{width}-{scheme}.png")
            self.findings += [f"{name}, {width} px, {scheme}: {found}" for found in hindrances(self.page)]
            over_px = self.page.evaluate("document.documentElement.scrollWidth") - width
            if over_px > 0:
                self.findings.append(f"{name}, {width} px, {scheme}: {over_px} px wider than the screen")
        self.page.set_viewport_size({"width": WIDE[0], "height": WIDE[1]})
        self.page.emulate_media(color_scheme="light")

    @contextlib.contextmanager
    def drone(self, out: str) -> Iterator[subprocess.Popen[Any]]:
        """The daemon with its simulated drone on the site that was drawn; it waits for a start."""
        status, command = self.ports
        settings = (
            "ground.listen=127.0.0.1", f"ground.status_port={status}", f"ground.command_port={command}",
            "ground.picture_fps=5", "mission.autostart=false",
        )  # fmt: skip
        words = ["sim", "--speed", "1", "--warehouse", str(self.folder / f"{SITE}.toml")]
        words += ["--out", str(self.folder / out)]
        words += [word for setting in settings for word in ("--set", setting)]
        with (self.folder / f"{out}.log").open("w") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "flightd", *words], cwd=ROOT, stdout=log, stderr=subprocess.STDOUT
            )
            try:
                yield process
            finally:
                if process.poll() is None:
                    process.terminate()
                process.wait(60)


def sheets(folder: Path) -> None:
    """One picture of each page: wide at the left, narrow at the right, light above dark."""
    made = folder / "sheets"
    made.mkdir(exist_ok=True)
    for first in sorted((folder / "pictures").glob(f"*-{WIDE[0]}-light.png")):
        name = first.name.removesuffix(f"-{WIDE[0]}-light.png")
        rows = []
        for scheme in ("light", "dark"):
            looks = []
            for width in (WIDE[0], NARROW[0]):
                shot = cv2.imread(str(first.with_name(f"{name}-{width}-{scheme}.png")))
                assert shot is not None
                size = (round(shot.shape[1] * _ROW_PX / shot.shape[0]), _ROW_PX)
                framed = cv2.resize(shot, size, interpolation=cv2.INTER_AREA)
                looks.append(cv2.copyMakeBorder(framed, 4, 4, 4, 4, cv2.BORDER_CONSTANT, value=_BETWEEN_BGR))
            rows.append(np.hstack(looks))
        cv2.imwrite(str(made / f"{name}.jpg"), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])


def draw(day: Day) -> None:
    """A small hall, checked and saved."""
    page = day.page
    page.get_by_role("link", name="New site").click()
    page.get_by_label("Name", exact=True).fill(SITE)
    page.get_by_label("Nodes of each aisle").fill("3")
    page.get_by_label("Lowest thing under the roof").fill("6")
    page.keyboard.press("Enter")
    day.seen("Sound: a drone can fly by it.")
    page.get_by_role("region", name="Scan coverage").get_by_text(
        re.compile("% of .* places are read")
    ).wait_for()
    page.get_by_label("File").fill(SITE)
    day.button("Save", exact=True).click()
    day.seen(f"Saved as {SITE}.toml.")
    day.shoot("site")


def fly_and_stop(day: Day) -> None:
    """The first flight: watched, paused, sent elsewhere, stopped."""
    page = day.page
    day.go("Live")
    with day.drone("first") as process:
        day.seen("Ready to fly", within_ms=FLIGHT_MS)
        day.hold("Start")
        day.phase("Flying to|Over|Scanning")
        day.shoot("live")
        page.keyboard.press("p")
        day.phase("Holding its place")
        day.button("Resume").click()
        day.phase("Flying to|Over|Scanning")
        day.button(re.compile("^Node B2")).click()
        day.button("Go to B2").click()
        day.phase("Flying to B2")
        page.keyboard.press("Escape")
        day.phase("Landing|Flight ended early")
        process.wait(120)


def fly_and_count(day: Day) -> None:
    """Started again, flown to its end, the stock filling meanwhile."""
    page = day.page
    with day.drone("second") as process:
        day.phase("On the ground", within_ms=FLIGHT_MS)
        day.seen("Ready to fly", within_ms=FLIGHT_MS)
        day.hold("Start")
        day.phase("Flying to|Over|Scanning")
        day.go("Stock")
        counted = page.get_by_role("heading", name=re.compile(r"^Stock [1-9]\d* of \d+ places counted"))
        counted.wait_for(timeout=FLIGHT_MS)
        day.go("Fleet")
        page.get_by_role("img", name=re.compile("^north: ")).wait_for(timeout=PHASE_MS)
        day.shoot("fleet")
        day.go("Live")
        process.wait(FLIGHT_MS // 1000)
    assert process.returncode == 0, (day.folder / "second.log").read_text()


def work_the_stock(day: Day) -> None:
    """Books are compared, a place is decided about, everything is downloaded."""
    page = day.page
    day.go("Stock")
    page.get_by_role("combobox", name=re.compile("^Inventory")).select_option("store/second")
    page.get_by_role("heading", name=re.compile(r"^Stock [1-9]\d* of \d+ places counted")).wait_for()
    found = _download(page, "CSV", day.folder / "counted.csv")
    rows = [row for row in csv.DictReader(found.read_text().splitlines()) if row["state"] == "read"]
    assert rows, found.read_text()
    places = [f"{row['location']};{row['text']}" for row in rows]
    places[0] = f"{rows[0]['location']};ANOTHER"
    books = day.folder / "books.csv"
    books.write_text("\n".join(["Lagerplatz;Artikel", *places]) + "\n")
    page.locator("input[type=file]").set_input_files(books)
    outcomes = page.get_by_role("list", name="Outcomes").get_by_role("listitem")
    outcomes.filter(has_text=f"{len(rows) - 1} as expected").wait_for()
    page.get_by_role("group", name="Differences").get_by_role("button", name=rows[0]["location"]).click()
    day.shoot("stock")
    for name in ("XLSX", "JSON", "EPCIS"):
        _download(page, name, day.folder / f"counted.{name.lower()}")
    form = page.get_by_role("group", name="Decision")
    form.get_by_label("Who").fill("Ann")
    form.get_by_label("Note").fill("the books are wrong")
    form.get_by_role("button", name="I look").click()
    form.get_by_role("list", name="Decided so far").get_by_role("listitem").first.wait_for()


def _download(page: Page, name: str, path: Path) -> Path:
    with page.expect_download() as download:
        page.get_by_role("link", name=name, exact=True).click()
    download.value.save_as(path)
    assert path.stat().st_size > 0
    return path


def recount(day: Day) -> None:
    """The places that want a look, as a mission of their own, flown to its end."""
    page = day.page
    with day.drone("third") as process:
        page.get_by_role("button", name=re.compile(r"^Recount \d+ places? as a mission")).click()
        day.seen(re.compile(r"^Counts \d+ places? of the inventory again"), within_ms=FLIGHT_MS)
        day.seen("Time in the air", within_ms=FLIGHT_MS)
        day.button("Keep", exact=True).click()
        day.shoot("missions")
        day.go("Doctor")
        page.get_by_role("heading", name=re.compile("Not fit to fly|No error")).first.wait_for()
        day.shoot("doctor")
        day.go("Missions")
        day.hold("Start this mission")
        day.seen(re.compile("0 of [12] nodes?"))
        process.wait(FLIGHT_MS // 1000)
    assert process.returncode == 0, (day.folder / "third.log").read_text()
    day.go("Stock")
    page.get_by_role("combobox", name=re.compile("^Inventory")).select_option("store/third")
    page.get_by_role("heading", name=re.compile(r"^Stock \d+ of \d+ places counted")).wait_for()


def learn(day: Day) -> None:
    """A colour from two flights' pictures, installed."""
    page = day.page
    day.go("Studio")
    page.get_by_label("Name of a new set").fill("hall")
    page.keyboard.press("Enter")
    day.button("From a flight").click()
    thumbs = page.get_by_role("region", name="Pictures").get_by_role("listitem")
    flight = page.get_by_role("group", name="Add pictures").get_by_role("combobox")
    for count, name in ((8, "third"), (16, "second")):
        listed = flight.get_by_role("option").filter(has_text=name)
        flight.select_option(listed.text_content())
        day.button(re.compile("Take 8 from all")).click()
        thumbs.nth(count - 1).wait_for()
    day.button("From a flight").click()
    marked = 0
    for number in range(1, 17):
        marked += _mark(day, number)
    assert marked >= 8, "too few pictures show a line"
    day.button("Learn from the marks").click()
    page.get_by_role("group", name="Scores").wait_for(timeout=TRAINING_MS)
    day.shoot("studio")
    page.get_by_label("Who").fill("Ann")
    day.button("Install", exact=True).click()
    again = day.button("Yes, install the worse one")
    versions = page.get_by_role("region", name="Profile hall").get_by_role("listitem")
    with contextlib.suppress(Exception):
        again.click(timeout=2000)
    versions.filter(has_text="installed").first.wait_for()


def _mark(day: Day, number: int) -> bool:
    """Along the first line that the shipped profile sees in the picture of this number, and on the floor
    beside it; False where it sees none."""
    from tests.web.studio_rig import HEIGHT, WIDTH, marks_of
    from tests.web.test_studio_page import drag

    page = day.page
    day.button(re.compile(rf"^{number}\. ")).click()
    lines = page.evaluate(
        """async (number) => {
            const at = `/api/studio/sets/${location.pathname.split("/")[2]}`;
            const { file } = (await (await fetch(at)).json()).pictures[number - 1];
            const data = await (await fetch(`${at}/pictures/${file}/mask?by=yellow`)).arrayBuffer();
            const length = new DataView(data).getUint32(0);
            return JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))).lines;
        }""",
        number,
    )
    if not lines:
        return False
    assert (WIDTH, HEIGHT) == (640, 360)
    paint, floor = marks_of(lines)["regions"]
    day.button(re.compile("^Paint")).click()
    day.button("Stroke", exact=True).click()
    drag(page, *paint["stroke"])
    day.button(re.compile("^Floor")).click()
    drag(page, *floor["stroke"])
    page.get_by_text("Saving …").wait_for(state="detached")
    return True


def play(day: Day) -> None:
    """The second flight, on map, pictures and plots at once."""
    page = day.page
    day.go("Flights")
    rows = page.get_by_role("row")
    rows.nth(3).wait_for(timeout=FLIGHT_MS)
    day.shoot("flights")
    page.get_by_role("link", name=re.compile(r"\d\d:\d\d")).nth(1).click()
    page.get_by_role("img", name="Height, m, over time").wait_for(timeout=FLIGHT_MS)
    slider = page.get_by_role("slider", name="Time")
    slider.focus()
    before = float(slider.input_value())
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    assert float(slider.input_value()) > before
    day.shoot("replay")
    day.go("Guide")
    page.get_by_role("heading", level=2).first.wait_for()
    day.shoot("guide")


if __name__ == "__main__":
    main()
