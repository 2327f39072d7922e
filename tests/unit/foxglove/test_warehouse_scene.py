"""The warehouse as a Foxglove scene: every part of the floor, in metres, z up and y to the left."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.foxglove.frames import IN_LOG
from flightd.adapters.foxglove.schemas import PRIMITIVES
from flightd.adapters.foxglove.warehouse import (
    BAY_DEPTH_M,
    BAY_GAP_M,
    ENDLESS_M,
    FRONT_DEPTH_M,
    warehouse_scene,
)
from flightd.adapters.ground_link.floor_status import floor_status
from flightd.site.site import LineColour, Pad, PadSign, Side, Site
from flightd.site.site_file import load_site
from flightd.site.ways import KeepOut

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-racks.toml")
STAMP_NS = 12_000_000_034


def scene_of(site: Site) -> dict[str, dict[str, Any]]:
    """The entities by name."""
    scene = warehouse_scene(floor_status(site), STAMP_NS, IN_LOG)
    assert scene["deletions"] == []
    return {entity["id"]: entity for entity in scene["entities"]}


def position(solid: dict[str, Any]) -> tuple[float, float, float]:
    at = solid["pose"]["position"]
    return at["x"], at["y"], at["z"]


def size(solid: dict[str, Any]) -> tuple[float, float, float]:
    return solid["size"]["x"], solid["size"]["y"], solid["size"]["z"]


def test_everything_of_the_floor_is_in_it_and_stays_until_it_is_told_anew() -> None:
    scene = scene_of(SITE)
    bays = {(place.aisle, place.side, place.bay) for place in SITE.locations.values()}
    counts = {name: len(entity["cubes"]) for name, entity in scene.items()}
    assert counts == {
        "lines": len(SITE.lines),
        "nodes": 0,
        "racks": len(SITE.shelves),
        "bays": len(bays),
        "keep_outs": len(SITE.keep_outs),
        "pads": len(SITE.pads),
    }
    assert [text["text"] for text in scene["nodes"]["texts"]] == list(SITE.nodes)
    assert len(scene["nodes"]["cylinders"]) == len(SITE.nodes)
    assert {text["text"] for text in scene["pads"]["texts"]} == {pad.id for pad in SITE.pads}
    for entity in scene.values():
        assert entity["lifetime"] == {"sec": 0, "nsec": 0}
        assert entity["timestamp"] == {"sec": 12, "nsec": 34}
        assert entity["frame_id"] == "map"
        assert entity["metadata"] == [{"key": "site", "value": SITE.name}]
        assert set(PRIMITIVES) <= set(entity)


def test_a_painted_line_has_its_length_width_and_colour() -> None:
    cubes = scene_of(SITE)["lines"]["cubes"]
    for line, cube in zip(SITE.lines, cubes, strict=True):
        assert size(cube)[:2] == pytest.approx(
            (math.hypot(line.x1_m - line.x0_m, line.y1_m - line.y0_m), line.width_m), abs=1e-4
        )
        middle = (line.x0_m + line.x1_m) / 2, -(line.y0_m + line.y1_m) / 2
        assert position(cube)[:2] == pytest.approx(middle, abs=1e-4)
        turn = cube["pose"]["orientation"]
        yaw_rad = 2 * math.atan2(turn["z"], turn["w"])
        along = abs(math.cos(yaw_rad)), abs(math.sin(yaw_rad))
        assert along == pytest.approx((1.0, 0.0) if line.y0_m == line.y1_m else (0.0, 1.0), abs=1e-6)
    blue = scene_of(replace(SITE, line_colour=LineColour.BLUE))["lines"]["cubes"][0]["color"]
    assert blue["b"] > 2 * max(blue["r"], blue["g"])
    white = scene_of(replace(SITE, line_colour=LineColour.WHITE))["lines"]["cubes"][0]["color"]
    assert min(white["r"], white["g"], white["b"]) > 0.9


def test_a_rack_stands_behind_its_front_with_each_bay_where_its_places_are() -> None:
    scene = scene_of(SITE)
    for shelf, cube in zip(SITE.shelves, scene["racks"]["cubes"], strict=True):
        assert size(cube) == pytest.approx((shelf.x1_m - shelf.x0_m, FRONT_DEPTH_M, shelf.height_m), abs=1e-4)
        away = 1.0 if shelf.side is Side.LEFT else -1.0  # towards the viewer's +y
        x, y, z = position(cube)
        assert (x, z) == pytest.approx(((shelf.x0_m + shelf.x1_m) / 2, shelf.height_m / 2), abs=1e-4)
        assert y == pytest.approx(-shelf.y_m + away * FRONT_DEPTH_M / 2, abs=1e-4)
    width_m = SITE.racks[0].bay_width_m
    centres = {(round(position(bay)[0], 2), position(bay)[1] > 0) for bay in scene["bays"]["cubes"]}
    assert len(centres) > 4
    for bay in scene["bays"]["cubes"]:
        assert size(bay)[:2] == pytest.approx((width_m - BAY_GAP_M, BAY_DEPTH_M), abs=1e-4)
    for place in SITE.locations.values():
        assert any(
            abs(position(bay)[0] - place.x_m) < width_m / 2 and abs(position(bay)[1] + place.y_m) < 0.2
            for bay in scene["bays"]["cubes"]
        ), place.code


def test_keep_outs_and_pads_have_their_measures() -> None:
    areas = (KeepOut(1.0, 2.0, 3.0, 5.0, 1.5, 2.5), KeepOut(0.0, -2.0, 1.0, -1.0, 2.0, math.inf))
    home = next(iter(SITE.nodes))
    pad = Pad("dock", home, 0.6, charge=False, offset_m=(0.5, 0.25), sign=PadSign.MAT)
    scene = scene_of(replace(SITE, keep_outs=areas, pads=(*SITE.pads, pad)))
    first, endless = scene["keep_outs"]["cubes"]
    assert (position(first), size(first)) == ((2.0, -3.5, 2.0), (2.0, 3.0, 1.0))
    assert size(endless)[2] == ENDLESS_M
    assert position(endless)[2] == 2.0 + ENDLESS_M / 2
    dock = scene["pads"]["cubes"][-1]
    node = SITE.nodes[home]
    assert position(dock)[:2] == pytest.approx((node.x_m + 0.5, -node.y_m - 0.25), abs=1e-4)
    assert size(dock)[:2] == (0.6, 0.6)
    assert dock["color"] != scene["pads"]["cubes"][0]["color"]
