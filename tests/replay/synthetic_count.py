"""A made-up but plausible count over the racks of a site, in a real store: what the report is tested with."""

from __future__ import annotations

import random
import zlib
from pathlib import Path

import cv2
import numpy as np

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import CountPose, LocationState, Observation, PlannedLocation
from flightd.core.types import CodeRead
from flightd.site.site import Location, Site
from flightd.site.site_file import parse_site

RACKS_TOML = """
[[rack]]
aisles = ["A", "B"]
bay_width_m = 1.1
positions = 3
levels_m = [0.3, 1.0, 1.7, 2.4]
"""
UTC_NS = 1_795_000_000_000_000_000
RUN = "2026-11-18 hall 3"


def site_with_racks(site_toml: str, racks_toml: str = RACKS_TOML) -> Site:
    return parse_site(site_toml + racks_toml, "site.toml")


def text_at(location: Location) -> str:
    """What the label of a place says."""
    return f"{zlib.crc32(location.code.encode()):013d}"


def picture_of(location: Location, state: LocationState) -> bytes:
    """A box with a label, or none, before a dark shelf."""
    picture = np.full((270, 480, 3), (70, 62, 55), np.uint8)
    if state is not LocationState.EMPTY:
        cv2.rectangle(picture, (90, 50), (390, 250), (120, 165, 200), -1)
        cv2.rectangle(picture, (190, 120), (300, 190), (245, 245, 245), -1)
        for x in range(198, 292, 5):
            cv2.line(picture, (x, 130), (x, 165), (20, 20, 20), 1 + x % 3)
    cv2.putText(picture, location.code, (96, 240), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (30, 30, 30), 1)
    return bytes(cv2.imencode(".jpg", picture)[1])


def state_of(number: int) -> LocationState:
    """Mostly read, some of everything else."""
    roll = random.Random(number).random()
    for state, share in (
        (LocationState.UNREADABLE, 0.03),
        (LocationState.OCCLUDED, 0.02),
        (LocationState.SEVERAL, 0.03),
        (LocationState.NOT_VISITED, 0.03),
        (LocationState.EMPTY, 0.12),
    ):
        roll -= share
        if roll < 0:
            return state
    return LocationState.READ


def write_count(folder: Path, site: Site) -> None:
    """Plan and count every location of the site's racks into the inventory at `folder`."""
    with SqliteStore(folder) as store:
        store.plan(PlannedLocation(place.code, place.node) for place in site.locations.values())
        for number, place in enumerate(site.locations.values()):
            state = state_of(number)
            if state is LocationState.NOT_VISITED:
                continue
            texts = {
                LocationState.READ: [text_at(place)],
                LocationState.SEVERAL: [text_at(place), f"BOX <{number}> & co"],
            }.get(state, [])
            reads = tuple(CodeRead("EAN-13", text, (), True, 3, 0.9) for text in texts)
            pose = CountPose(place.node, place.x_m, place.y_m, place.height_m, 0.0)
            confidence = 0.8 + 0.19 * random.Random(-number).random() if state.is_counted else 0.2
            evidence = store.keep_evidence(picture_of(place, state))
            utc_ns = UTC_NS + number * 2_500_000_000
            store.commit(Observation(RUN, place.code, utc_ns, state, confidence, reads, pose, evidence))


def write_stock(path: Path, site: Site) -> None:
    """The books: as counted, but one place expected elsewhere, one empty expected full, one unknown code."""
    lines = ["location,code"]
    for number, place in enumerate(site.locations.values()):
        code = text_at(place) if state_of(number) is not LocationState.EMPTY or number % 3 == 0 else ""
        lines.append(f"{place.code},{'4006381333931' if number % 41 == 7 and code else code}")
    path.write_text("\n".join(lines) + "\n")
