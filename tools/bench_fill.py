"""How well it is told how full places are: rendered places against the truth of the simulator.

`python -m tools.bench_fill --sites 6` prints the share of places within 10 points, of those unknown, and the
worst, how far it is off how goods stand out and lean, and how many empty places were told as such.
`--uneven` lights each level of a rack front otherwise, the camera set for the one that it looks at.
`--aside 0.3` takes the pictures of each view from places so far apart along the aisle, and decides as in
passing; `--pictures 8` so many, at most, of each.  With `--cartons 0.8` so large a part of the places that
are filled wholly holds cartons of one kind (`--in-part 0.2` fills so many others in part), and it is said of
how many plain stacks the cases were counted, how many rightly.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2

from flightd.config.scan import ScanConfig
from flightd.core.inventory import CaseGrid, LocationState, PlaceFill
from flightd.core.scanning import BodyPose, Finding, PlaceLook
from flightd.mission.scan.code_assignment import Assigner, FrontSight, PlacedRead
from flightd.mission.scan.location_votes import LocationVotes
from flightd.mission.scan.sweep_votes import SweepVotes, Undecided
from flightd.mission.scan.views import View, ViewPlanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.face_light import drawn_light
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import StockPlace, StockShares, StockSituation, stock
from flightd.sim.racks.stock_truth import boxes_of
from flightd.sim.sensors.optics import Taking
from flightd.sim.unknowns import SPREADS, WorldKind
from flightd.site.site import Site
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf

_SITE = Path(__file__).parents[1] / "configs" / "site-racks.toml"
_WITHIN = 0.10
_EMPTY_SHARE = 0.02
_EXPOSURES = (0.7, 0.85, 1.0)
_LIGHT = SPREADS[WorldKind.ROUGH].darkest_face, SPREADS[WorldKind.ROUGH].lightest_face


@dataclass(frozen=True, slots=True)
class Told:
    """One place: what was told of it, its true share, overhang and lean; `state` is None where it is
    looked at again."""

    code: str
    seed: int
    state: LocationState | None
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
    def lean_m(self) -> float | None:
        return None if self.fill is None else self.fill.lean_m

    @property
    def true_lean_m(self) -> float:
        goods = self.place.goods
        return max((abs(stack.lean_m) for stack in goods.stacks), default=0.0) if goods is not None else 0.0

    @property
    def cases(self) -> CaseGrid | None:
        return None if self.fill is None else self.fill.cases

    @property
    def is_plain_stack(self) -> bool:
        """Whether its boxes stand in rows and columns, two at least of each."""
        boxes = boxes_of(self.place)
        return len(boxes) > 1 and boxes[0] > 1 and len(set(boxes)) == 1

    @property
    def overhang_m(self) -> float:
        goods = self.place.goods
        return max((-stack.recess_m for stack in goods.stacks), default=0.0) if goods is not None else 0.0


class StopVotes:
    """The pictures of one place as a stop takes them: no more once it is decided."""

    def __init__(self, code: str, node: str, params: ScanConfig) -> None:
        self._votes = LocationVotes(code, node, params.pictures)
        self._found: Finding | None = None

    def add(self, number: int, pose: BodyPose, place: PlaceLook | None, reads: Sequence[PlacedRead]) -> None:
        if self._found is None:
            self._votes.add(number, pose, place, reads)
            self._found = self._votes.finding(final=False)

    def verdict(self) -> Finding | Undecided:
        return self._found or self._votes.finding(final=True) or Undecided.UNSEEN


class PassingVotes:
    """The pictures of one place as they are taken in passing."""

    def __init__(self, code: str, node: str, params: ScanConfig, at_m: tuple[float, float]) -> None:
        self._votes = SweepVotes(code, node, params, 1.0)
        self._x_m, self._y_m = at_m

    def add(self, number: int, pose: BodyPose, place: PlaceLook | None, reads: Sequence[PlacedRead]) -> None:
        bearing_rad = math.atan2(self._x_m - pose.x_m, abs(self._y_m - pose.y_m))
        self._votes.add(number, pose, place, reads, bearing_rad=bearing_rad)

    def verdict(self) -> Finding | Undecided:
        return self._votes.verdict()


@dataclass(frozen=True, slots=True)
class Looks:
    """How places are looked at: at `nodes` of a site, by so many `pictures` of a view, `aside_m` apart; so
    large a part of the places is `empty`; `uneven`: the light differs by level, as in the rough world."""

    nodes: int = 2
    pictures: int = 3
    aside_m: float = 0.0
    empty: float = StockShares().empty
    in_part: float = 0.75
    cartons: float = 0.0
    uneven: bool = False
    params: ScanConfig = field(default_factory=lambda: ScanConfig(max_height_m=4.0))

    def votes(self, site: Site, code: str, node: str) -> StopVotes | PassingVotes:
        if not self.aside_m:
            return StopVotes(code, node, self.params)
        location = site.locations[code]
        return PassingVotes(code, node, self.params, (location.x_m, location.y_m))


def told_places(site: Site, seed: int, looks: Looks) -> Iterator[Told]:
    """What is told of all places of some nodes of a site, its goods drawn by the seed."""
    camera, rng = FrontCamera(), random.Random(seed)
    look = replace(
        RackAppearance(),
        shares=StockShares(empty=looks.empty),
        in_part=looks.in_part,
        cartons=looks.cartons,
        exposure=rng.choice(_EXPOSURES),
        noise=rng.choice((2.0, 3.0)),
        light=drawn_light(site, _LIGHT, seed) if looks.uneven else {},
    )
    places = stock(site, look.shares, camera.lens.fx_px, seed, look.in_part, look.cartons)
    sight = FrontSight(camera.lens, camera.mount)
    assigner = Assigner(site, sight)
    planner = ViewPlanner(site, sight, assigner, looks.params)
    renderer = FrontRenderer(site, camera, look, seed)
    for node in rng.sample(sorted(site.nodes), looks.nodes):
        for view in planner.views(node, frozenset(site.locations), 1.0, 0.0):
            votes = {code: looks.votes(site, code, node) for code in view.locations}
            for number in range(looks.pictures):
                aside_m = (number - looks.pictures // 2) * looks.aside_m
                hover, pose = _poses(rng, view, number + 1, aside_m)
                picture = renderer.render(hover, number, how=Taking(exposure=_exposure(site, look, view)))
                codes, _ = read_shelf(picture, number, number, assigner.places(pose, view.locations))
                seen = assigner.look(codes, pose, (view.aisle, view.side))
                shown = {place.location: place for place in codes.places}
                for code, vote in votes.items():
                    reads = [placed for placed in seen.reads if placed.location == code]
                    vote.add(number, pose, shown.get(code), reads)
            for code, vote in votes.items():
                found = vote.verdict()
                if isinstance(found, Finding):
                    yield Told(code, seed, found.state, found.fill, places[code])
                else:
                    yield Told(code, seed, None, None, places[code])


def _exposure(site: Site, look: RackAppearance, view: View) -> float:
    """What a camera is set to that has learnt how the levels that it looks at are lit."""
    fronts = {f"{view.aisle} {view.side.value} {site.locations[code].level}" for code in view.locations}
    return 1.0 / statistics.geometric_mean(look.light.get(front, 1.0) for front in fronts)


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
    filled_plain = [one for one in plain if one.place.goods is not None]
    leans = [(abs(one.lean_m - one.true_lean_m), one) for one in told if one.lean_m is not None]
    leans.sort(key=lambda pair: -pair[0])
    leaning = [one for one in filled_plain if one.true_lean_m > 0.0]
    as_leaning = sum(one.lean_m is not None for one in leaning)
    offs = sorted(error for error, _ in leans)
    empty = [one for one in told if one.place.goods is None]
    as_such = sum(one.state is LocationState.EMPTY for one in empty)
    again = sum(one.state is None for one in empty)
    wrong = sum(one.state is LocationState.EMPTY for one in told) - as_such
    lines = [
        f"empty {len(empty)}, told as such {as_such} ({100 * as_such / max(len(empty), 1):.1f} %), looked at "
        f"again {again}; told as empty though goods stand there {wrong}",
        f"places {len(told)}, of these {len(plain)} with goods in the light, or empty",
        f"share told {len(known)}, within 10 points {right} ({100 * right / max(len(known), 1):.1f} %)",
        f"unknown, of those in the light: {unknown} ({100 * unknown / max(len(plain), 1):.1f} %)",
        f"filled though the state is empty {len(filled)}, empty though it is not {len(emptied)}",
        f"overhang told {len(out)} of {len(standing)}, off by {_cm(outs[len(outs) // 2 :])} in the middle, "
        f"by {_cm(outs[-1:])} at most",
        f"lean told {len(leans)} of {len(filled_plain)}, of those that lean {as_leaning} of {len(leaning)}, "
        f"off by {_cm(offs[len(offs) // 2 :])} in the middle, {_cm(offs[19 * len(offs) // 20 :])} in 95 %, "
        f"{_cm(offs[-1:])} at most",
    ]
    counted = [(one, grid) for one in told if (grid := one.cases) is not None]
    amiss = [(one, grid) for one, grid in counted if boxes_of(one.place) != (grid.columns,) * grid.rows]
    stacks = sum(one.is_plain_stack for one in told)
    lines.append(
        f"cases told {len(counted)}, wrong {len(amiss)}, of {stacks} plain stacks and "
        f"{len(told) - stacks} others"
    )
    for one, grid in amiss:
        lines.append(
            f"cases wrong: {one.code}, seed {one.seed}, told {grid.columns} x {grid.rows}, "
            f"true {boxes_of(one.place)}"
        )
    for error, one in leans[:3]:
        lines.append(
            f"lean off by {_cm([error])}: {one.code}, seed {one.seed}, true {_cm([one.true_lean_m])}"
        )
    for error, one in off[:5]:
        lines.append(f"off by {error:.2f}: {one.code}, seed {one.seed}, {_words(one)}")
    return lines


def _cm(sizes_m: Sequence[float]) -> str:
    return f"{100 * sizes_m[0]:.1f} cm" if sizes_m else "nothing"


def _words(one: Told) -> str:
    situation: StockSituation = one.place.situation
    counted = one.state.value if one.state else "undecided"
    return f"told {one.share}, true {one.place.fill:.2f}, {situation.value}, counted as {counted}"


def main() -> None:
    """Render, tell, and print the figures."""
    parser, usual = argparse.ArgumentParser(description=__doc__), Looks()
    parser.add_argument("--sites", type=int, default=6, help="so many times the goods are drawn anew")
    parser.add_argument("--nodes", type=int, default=usual.nodes, help="nodes of each")
    parser.add_argument("--seed", type=int, default=100, help="of the first")
    parser.add_argument("--aside", type=float, default=0.0, help="metres between the pictures of a view")
    parser.add_argument("--pictures", type=int, default=usual.pictures, help="of each view, at most")
    parser.add_argument("--uneven", action="store_true", help="each level is lit otherwise")
    parser.add_argument("--empty", type=float, default=usual.empty, help="part of the places that is empty")
    parser.add_argument("--in-part", type=float, default=usual.in_part, help="of the others, in stacks")
    parser.add_argument(
        "--cartons", type=float, default=usual.cartons, help="of the rest, cartons of one kind"
    )
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    site, begun = load_site(_SITE), time.process_time()
    looks = Looks(
        asked.nodes,
        asked.pictures,
        asked.aside,
        asked.empty,
        asked.in_part,
        asked.cartons,
        uneven=asked.uneven,
    )
    told: list[Told] = []
    for seed in range(asked.seed, asked.seed + asked.sites):
        told += told_places(site, seed, looks)
        print(f"seed {seed}: {len(told)} places, {time.process_time() - begun:.0f} s", flush=True)
    print("\n".join(table(told)))


if __name__ == "__main__":
    main()
