"""An inventory as a counting flight leaves it: fronts of two aisles, looks in every state, pictures."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import segno
from mcap.writer import Writer

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import (
    CaseGrid,
    CountPose,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    UndecidedCode,
)
from flightd.core.topics import Topic
from flightd.core.types import CodeRead
from flightd.site.site import Site
from flightd.site.site_file import load_site, site_toml
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

SSCC = "340123450002439853"
RUN = "2026-W47"
RACKS = load_site(Path(__file__).parents[2] / "configs" / "site-racks-small.toml")
"""Two aisles with fronts on both sides."""
_NS = 1_700_000_000 * 10**9
POSE = CountPose("A1", 0.1, 0.0, 0.9, -1.57)


def cell(page: Page, place: str) -> Locator:
    """The place on its front."""
    return page.get_by_role("button", name=re.compile(rf"^{re.escape(place)},"))


def picture_of(*texts: str) -> bytes:
    """A JPEG in which the QR codes of the texts are, three at most."""
    picture = np.full((360, 480), 200, np.uint8)
    for text, (top, left) in zip(texts, ((60, 240), (220, 40), (220, 240)), strict=False):
        modules = np.array([list(row) for row in segno.make_qr(text).matrix], np.uint8)
        code = np.kron(1 - modules, np.ones((5, 5), np.uint8)) * 255
        picture[top : top + code.shape[0], left : left + code.shape[1]] = code
    return evidence_jpeg(np.repeat(picture[:, :, None], 3, axis=2))


def code(text: str, *gs1: tuple[str, str]) -> CodeRead:
    return CodeRead("QR Code", text, (), True, 3, 1.0, gs1)


def look(
    location: str,
    state: LocationState,
    *reads: CodeRead,
    run: str = RUN,
    at_s: int = 0,
    evidence: str = "",
    fill: PlaceFill | None = None,
) -> Observation:
    return Observation(run, location, _NS + at_s * 10**9, state, 0.98, reads, POSE, evidence, fill=fill)


def counted_store(folder: Path) -> None:
    """Eight places of aisle A (side L) and two of aisle B, of which the last nobody saw; `A-GATE` stands
    nowhere on a rack."""
    with SqliteStore(folder) as store:
        codes = [f"AL-{bay:02}-{level}-1" for bay in (1, 2, 3, 4) for level in (1, 2)]
        store.plan(PlannedLocation(place, "A1") for place in [*codes, "BL-01-1-1", "BL-01-1-2", "A-GATE"])
        kept = store.keep_evidence(picture_of(f"00{SSCC}"))
        store.commit(look("AL-01-1-1", LocationState.UNREADABLE, run="2026-W46", at_s=-604_800))
        store.commit(look("AL-01-1-1", LocationState.READ, code(f"00{SSCC}", ("00", SSCC)), evidence=kept))
        filled = PlaceFill(0.625, 0.04, 0.03, CaseGrid(4, 3))
        store.commit(look("AL-01-2-1", LocationState.READ, code("4006381333931"), fill=filled))
        store.commit(look("AL-02-1-1", LocationState.EMPTY))
        unread = look("AL-02-2-1", LocationState.UNREADABLE, fill=PlaceFill(None))
        store.commit(replace(unread, undecided=(UndecidedCode("ITF", "070429", 1),)))
        store.commit(look("AL-03-1-1", LocationState.OCCLUDED))
        store.commit(look("AL-03-2-1", LocationState.SEVERAL, code("PAL-7/L1"), code("PAL-8/L1")))
        store.commit(look("AL-04-1-1", LocationState.READ, code("PAL-9/L1")), confirmed=False)
        store.settle(RUN, ["AL-04-1-1"], confirmed=False)
        store.commit(look("AL-04-2-1", LocationState.READ, code("<b>PAL-10</b>")))
        store.commit(look("BL-01-1-1", LocationState.READ, code("=1+2")))


def flown_log(file: Path, site: Site) -> None:
    """A log of which only the map was written yet."""
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("map", "jsonschema", b"{}")
        channel = writer.register_channel(Topic.MAP, "json", schema)
        writer.add_message(channel, 1, json.dumps({"text": site_toml(site)}).encode(), 1)
        writer.finish()


def counted_hall(folder: Path) -> Path:
    """The folder of a station, with an inventory and its log."""
    counted_store(folder / "monday")
    flown_log(folder / "monday" / "flight.mcap", RACKS)
    return folder
