"""The front camera's pictures of racks that nobody tuned: wide bays, narrow ones, levels near each other."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera, front_lens
from flightd.sim.racks.rack_layout import faces
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import StockShares, StockSituation, stock
from flightd.site.site import Side, Site
from flightd.site.site_file import load_site, parse_site
from tests.command import Command

CAMERA = FrontCamera(lens=front_lens(320, 200, 250.0))
SHARES = StockShares(several=0.1, too_small=0.1, occluded=0.15, dark=0.15)
RACKS = [
    "bay_width_m = 2.7\nlevels_m = [0.3, 2.0]",
    "bay_width_m = 7.0\nlevels_m = [1.0, 8.0, 16.0]",
    "bay_width_m = 0.2\nlevels_m = [0.3, 1.0]\npositions = 10",
    "bay_width_m = 1.0\nlevels_m = [0.1, 0.15, 0.2]\npositions = 3",
    "bay_width_m = 1.0\nlevels_m = [0.0, 0.01, 0.02]",
    "bay_width_m = 1.35\nlevels_m = [0.3, 1.5]\ndeck_below_label_m = 3.0",
    "bay_width_m = 1.35\nlevels_m = [0.3, 1.5]\ndeck_below_label_m = 0.0",
]


def site_with(rack: str, shelf_distance_m: float = 1.2, shelf_height_m: float = 30.0) -> Site:
    return parse_site(
        '[site]\nname = "any"\nceiling_m = 40.0\n[[pad]]\nid = "home"\nnode = "A1"\n'
        '[[aisle]]\nid = "A"\nx_m = 0.0\ny_m = 0.0\nspacing_m = [3.0, 3.0, 3.0]\n'
        f"shelf_distance_m = {shelf_distance_m}\nshelf_height_m = {shelf_height_m}\n[[rack]]\n{rack}\n",
        "any",
    )


def look_at(site: Site, count: int) -> None:
    """Draw what is seen from before so many of the site's locations, from one end of it to the other."""
    renderer = FrontRenderer(site, CAMERA, RackAppearance(shares=SHARES), 3)
    locations = list(site.locations.values())
    for at in np.linspace(0, len(locations) - 1, count).astype(int):
        location = locations[at]
        node, side = site.nodes[location.node], 1.0 if location.side is Side.RIGHT else -1.0
        height_m = max(location.height_m, 0.4)
        yaw_rad = side * math.pi / 2
        pose = (node.x_m, node.y_m, height_m, 0.0, 0.0, 0.0, 0.0, 0.0, yaw_rad, 0.0, 0.0, 0.0)
        picture = renderer.render(Kinematics(0, *pose), int(at))
        assert picture.std() > 1.5  # noise alone has less


@pytest.mark.parametrize("rack", RACKS)
def test_any_rack_can_be_drawn(rack: str) -> None:
    look_at(site_with(rack), 3)


def test_the_racks_of_a_new_hall_can_be_drawn(flightd: Command, tmp_path: Path) -> None:
    hall = tmp_path / "hall.toml"
    size = ("--aisles", "6", "--nodes", "6", "--spacing-m", "1.4,1.9,1.2,2.1", "--pitch-m", "3.2")
    assert flightd("map", "new", hall, *size, "--levels-m", "0.4,1.3,2.2").returncode == 0
    look_at(load_site(hall), 4)


@pytest.mark.parametrize("distance_m", [0.6, 8.0])
def test_labels_of_any_size_can_be_drawn(distance_m: float) -> None:
    look_at(site_with("bay_width_m = 0.4\nlevels_m = [0.3, 0.5]", distance_m), 3)


@pytest.mark.parametrize("rack", RACKS)
def test_every_place_has_room_for_goods(rack: str) -> None:
    for face in faces(site_with(rack)):
        assert all(level.height_m > 0.0 for level in face.levels)
        assert all(low.top_m < high.deck_m for low, high in itertools.pairwise(face.levels))


def test_goods_without_room_for_a_label_have_none() -> None:
    site = site_with("bay_width_m = 0.2\nlevels_m = [0.3, 1.0]\npositions = 10")
    situations = {place.situation for place in stock(site, SHARES, 250.0, 1).values()}
    assert situations <= {
        StockSituation.EMPTY,
        StockSituation.MISSING,
        StockSituation.OCCLUDED,
        StockSituation.DARK,
    }
