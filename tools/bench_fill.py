"""How well it is told how full places are: rendered places against the truth of the simulator.

`python -m tools.bench_fill --sites 6` prints the share of places within 10 points, of those unknown, and the
worst.  `--aside 0.3` takes the pictures of each view from places so far apart along the aisle, as in passing.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2

from flightd.config.scan import ScanConfig
from flightd.core.inventory import LocationState, PlaceFill
from flightd.core.scanning import BodyPose
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.mission.scan.location_votes import LocationVotes
from flightd.mission.scan.views import View, ViewPlanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import StockPlace, StockSituation, stock
from flightd.site.site import Site
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf

_SITE = Path(__file__).parents[1] / "configs" / "site-racks.toml"
_PICTURES = 3
_WITHIN = 0.10
_EMPTY_SHARE = 0.02
_EXPOSURES = (0.7, 0.85, 1.0)


@dataclass(frozen=True, slots=True)
class Told:
    """One place: what was told of it, its true share and overhang."""

    code: str
    seed: int
    state: LocationState
    fill: PlaceFill | None
    place: StockPlace

    @property
    def is_plain(self) -> bool:
        """Whether its goods are neither dark nor covered."""
        goods = self.place.goods
        return goods is None or not (goods.dark or goods.covered)

    @property
    def share(self) -> float | None:
        return None if self.fill is None else self.fill.share

    @property
    def overhang_m(self) -> float:
        goods = self.place.goods
        return max((-stack.recess_m for stack in goods.stacks), default=0.0) if goods is not None else 0.0


def told_places(site: Site, seed: int, nodes: int, aside_m: float) -> Iterator[Told]:
    """What is told of all places of some nodes of a site, its goods drawn by the seed."""
    camera, rng = FrontCamera(), random.Random(seed)
    look = replace(
        RackAppearance(), in_part=0.75, exposure=rng.choice(_EXPOSURES), noise=rng.choice((2.0, 3.0))
    )
    places = stock(site, look.shares, camera.lens.fx_px, seed, look.in_part)
    sight = FrontSight(camera.lens, camera.mount)
    assigner = Assigner(site, sight)
    planner = ViewPlanner(site, sight, assigner, ScanConfig(max_height_m=4.0))
    renderer = FrontRenderer(site, camera, look, seed)
    for node in rng.sample(sorted(site.nodes), nodes):
        for view in planner.views(node, frozenset(site.locations), 1.0, 0.0):
            votes = {code: LocationVotes(code, node, _PICTURES) for code in view.locations}
            for number in range(_PICTURES):
                hover, pose = _poses(rng, view, number + 1, (number - _PICTURES // 2) * aside_m)
                picture = renderer.render(hover, number)
                codes, _ = read_shelf(picture, number, number, assigner.places(pose, view.locations))
                seen = assigner.look(codes, pose, (view.aisle, view.side))
                looks = {place.location: place for place in codes.places}
                for code, vote in votes.items():
                    reads = [placed for placed in seen.reads if placed.location == code]
                    vote.add(number, pose, looks.get(code), reads)
            for code, vote in votes.items():
                finding = vote.finding(final=True)
                if finding is not None:
                    yield Told(code, seed, finding.state, finding.fill, places[code])


def _poses(rng: random.Random, view: View, stamp_ns: int, aside_m: float) -> tuple[Kinematics, BodyPose]:
    """Where the drone hovers, and where it takes itself to be, both as far off as in flight."""

    def near(value: float, sigma: float) -> float:
        return value + rng.gauss(0.0, sigma)

    at = near(view.x_m + aside_m, 0.03), near(view.y_m, 0.03), near(view.height_m, 0.03)
    turned = near(0.0, 0.01), near(0.0, 0.01), near(view.yaw_rad, 0.01)
    hover = Kinematics(stamp_ns, *at, 0.0, 0.0, 0.0, *turned, 0.0, 0.0, 0.0)
    believed = near(at[0], 0.01), near(at[1], 0.01), near(at[2], 0.015)
    taken = near(turned[0], 0.004), near(turned[1], 0.004), near(turned[2], 0.004)
    return hover, BodyPose(stamp_ns, *believed, *taken, 0.01, 0.01, 0.004, True)


def table(told: Sequence[Told]) -> list[str]:
    """The figures, a line each."""
    plain = [one for one in told if one.is_plain]
    known = [(one, one.share) for one in told if one.share is not None]
    off = sorted(((abs(share - one.place.fill), one) for one, share in known), key=lambda pair: -pair[0])
    right = sum(error <= _WITHIN for error, _ in off)
    unknown = sum(one.share is None for one in plain)
    filled = [one for one, share in known if share > _EMPTY_SHARE and one.state is LocationState.EMPTY]
    emptied = [one for one, share in known if share <= _EMPTY_SHARE and one.state is not LocationState.EMPTY]
    out = [one for one in told if one.fill is not None and one.fill.overhang_m is not None]
    outs = sorted(abs((one.fill.overhang_m or 0.0) - one.overhang_m) for one in out if one.fill is not None)
    standing = [one for one in plain if one.overhang_m > 0.0]
    lines = [
        f"places {len(told)}, of these {len(plain)} with goods in the light, or empty",
        f"share told {len(known)}, within 10 points {right} ({100 * right / max(len(known), 1):.1f} %)",
        f"unknown, of those in the light: {unknown} ({100 * unknown / max(len(plain), 1):.1f} %)",
        f"filled though the state is empty {len(filled)}, empty though it is not {len(emptied)}",
        f"overhang told {len(out)} of {len(standing)}, off by {_cm(outs[len(outs) // 2 :])} in the middle, "
        f"by {_cm(outs[-1:])} at most",
    ]
    for error, one in off[:5]:
        lines.append(f"off by {error:.2f}: {one.code}, seed {one.seed}, {_words(one)}")
    return lines


def _cm(sizes_m: Sequence[float]) -> str:
    return f"{100 * sizes_m[0]:.1f} cm" if sizes_m else "nothing"


def _words(one: Told) -> str:
    situation: StockSituation = one.place.situation
    return f"told {one.share}, true {one.place.fill:.2f}, {situation.value}, counted as {one.state.value}"


def main() -> None:
    """Render, tell, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sites", type=int, default=6, help="so many times the goods are drawn anew")
    parser.add_argument("--nodes", type=int, default=2, help="nodes of each")
    parser.add_argument("--seed", type=int, default=100, help="of the first")
    parser.add_argument("--aside", type=float, default=0.0, help="metres between the pictures of a view")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    site, begun = load_site(_SITE), time.process_time()
    told: list[Told] = []
    for seed in range(asked.seed, asked.seed + asked.sites):
        told += told_places(site, seed, asked.nodes, asked.aside)
        print(f"seed {seed}: {len(told)} places, {time.process_time() - begun:.0f} s", flush=True)
    print("\n".join(table(told)))


if __name__ == "__main__":
    main()
