"""What the code reader costs for pictures without a code, in processor time of one core.

`python -m tools.bench_reader [--pictures N] [--seed N] [FOLDER]`: rendered shelves whose goods have no
labels, with the places that a stop looks at, by cameras of 1, 2, 5 and 12 Mpx, and the pictures of a folder,
if one is given.  The smallest and the folder's also shrunk to 640x480.  A unit is one cvtColor(BGR2HSV) of
the same picture, measured in between: figures of busy hours and other machines can be compared by it.
"""

from __future__ import annotations

import argparse
import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median, quantiles
from time import thread_time

import cv2
import numpy as np

from flightd.config.scan import ScanConfig
from flightd.core.geometry import Lens
from flightd.core.scanning import BodyPose, PictureWorth, Place
from flightd.core.types import Image
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.mission.scan.views import ViewPlanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import StockShares
from flightd.site.site_file import load_site
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.shelf_look import read_shelf

_SITE = Path(__file__).parents[1] / "configs" / "site-racks-small.toml"
_UNLABELLED = StockShares(
    empty=0.1, tilted=0, glossy=0, several=0, torn=0, too_small=0, missing=0.9, occluded=0, dark=0
)
_SMALL = 640, 480
_ENLARGED = 1.4, 2.2, 3.43
"""Cameras of 2, 5 and 12 Mpx, of one of 1 Mpx."""
_SUFFIXES = (".jpg", ".jpeg", ".png")
_TURNS, _UNIT_TURNS = 2, 5
"""Each picture is timed so often, and the least counts: what else the machine does only adds."""
_BEST = PictureWorth(True, True, 1.0)


@dataclass(frozen=True, slots=True)
class Shelf:
    """A picture, (H, W, 3) BGR, of goods without labels, and the places that are looked at in it."""

    picture: Image
    places: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Cost:
    """What pictures cost, milliseconds each, and in units, and how large they are."""

    ms: tuple[float, ...]
    units: tuple[float, ...]
    mpx: float


def shelves(count: int, seed: int, enlarged: float = 1.0) -> Iterator[Shelf]:
    """So many views of shelves by a camera with so many times the pixels each way, the pose known exactly;
    pictures of the places are kept already, as they are for all frames of a stop but the first."""
    site, rng, standard = load_site(_SITE), random.Random(seed), FrontCamera()
    camera = replace(standard, lens=_enlarged(standard.lens, enlarged))
    look = replace(RackAppearance(), shares=_UNLABELLED, location_labels=False, in_part=0.5)
    sight = FrontSight(camera.lens, camera.mount)
    assigner = Assigner(site, sight)
    planner = ViewPlanner(site, sight, assigner, ScanConfig(max_height_m=4.0))
    renderer = FrontRenderer(site, camera, look, seed)
    nodes = rng.sample(sorted(site.nodes), len(site.nodes))
    views = (view for node in nodes for view in planner.views(node, frozenset(site.locations), 1.0, 0.0))
    for number, view in enumerate(itertools.islice(views, count)):
        turned = 0.0, 0.0, view.yaw_rad
        at = view.x_m, view.y_m, view.height_m
        picture = renderer.render(Kinematics(number, *at, 0.0, 0.0, 0.0, *turned, 0.0, 0.0, 0.0), number)
        places = assigner.places(BodyPose(number, *at, *turned, 0.01, 0.01, 0.004, True), view.locations)
        yield Shelf(picture.copy(), tuple(replace(place, kept=_BEST) for place in places))


def _enlarged(lens: Lens, times: float) -> Lens:
    """The same field of view in more pixels."""
    width_px, height_px = round(lens.width_px * times / 4) * 4, round(lens.height_px * times / 4) * 4
    middle = (width_px - 1) / 2, (height_px - 1) / 2
    return Lens(width_px, height_px, lens.fx_px * times, lens.fy_px * times, *middle)


def small(picture: Image) -> Image:
    """The picture shrunk to 640x480."""
    return np.asarray(cv2.resize(picture, _SMALL, interpolation=cv2.INTER_AREA), np.uint8)


def cost(pictures: Sequence[Image], work: Callable[[Image], object] = read_codes) -> Cost:
    """What `work` on each of the pictures costs."""
    ms, units = [], []
    for picture in pictures:
        unit_ms = min(_spent_ms(_converted, picture) for _ in range(_UNIT_TURNS))
        ms.append(min(_spent_ms(work, picture) for _ in range(_TURNS)))
        units.append(ms[-1] / unit_ms)
    return Cost(tuple(ms), tuple(units), median(picture.size / 3e6 for picture in pictures))


def shelf_cost(seen: Sequence[Shelf]) -> Cost:
    """What a reader makes of frames with places in view costs."""
    places = {id(shelf.picture): shelf.places for shelf in seen}
    pictures = [shelf.picture for shelf in seen]
    return cost(pictures, lambda picture: read_shelf(picture, 0, 0, places[id(picture)]))


def _converted(picture: Image) -> object:
    return cv2.cvtColor(picture, cv2.COLOR_BGR2HSV)


def _spent_ms(work: Callable[[Image], object], picture: Image) -> float:
    begun = thread_time()
    work(picture)
    return (thread_time() - begun) * 1e3


def line(name: str, found: Cost) -> str:
    """The figures for people."""
    *_, most = sorted(found.ms)
    nine_tenths = quantiles(found.ms, n=10)[-1] if len(found.ms) > 1 else most
    return (
        f"{name:24} {len(found.ms):4} pictures of {found.mpx:.2f} Mpx: median {median(found.ms):.1f} ms "
        f"({median(found.ms) / found.mpx:.1f} ms per Mpx, {median(found.units):.0f} units), "
        f"90 % {nine_tenths:.1f} ms, most {most:.1f} ms"
    )


def main() -> None:
    """Render or load, read, and print what it cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="pictures without a code")
    parser.add_argument("--pictures", type=int, default=24, help="rendered ones of each size")
    parser.add_argument("--seed", type=int, default=1, help="of what they show")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    seen = list(shelves(asked.pictures, asked.seed))
    whole = [shelf.picture for shelf in seen]
    print(f"{sum(len(shelf.places) for shelf in seen) / len(seen):.1f} places in a picture")
    print(line("reader, places in view", shelf_cost(seen)))
    for times in _ENLARGED:
        larger = list(shelves(asked.pictures, asked.seed, times))
        print(line("reader, places in view", shelf_cost(larger)))
        print(line("codes, goods", cost([shelf.picture for shelf in larger])))
    files: list[Path] = []
    if asked.folder is not None:
        files = sorted(path for path in asked.folder.iterdir() if path.suffix.lower() in _SUFFIXES)
    loaded = [picture for path in files if (picture := cv2.imread(str(path))) is not None]
    for name, pictures in (("goods", whole), ("folder", [np.asarray(one, np.uint8) for one in loaded])):
        if pictures:
            print(line(f"codes, {name}", cost(pictures)))
            print(line(f"codes, {name}, 640x480", cost([small(picture) for picture in pictures])))


if __name__ == "__main__":
    main()
