"""How many labels are read in passing, at the speed that the plan chooses: rendered flights past a shelf.

A flight goes past boxes at the plan's speed for that camera and those labels, with the frames, the blur and
the readers' time that the plan reckons with.  Drawn are pixels for each module (2.75 to 4), exposure time,
light, gain, the mission's speed, symbologies, gloss, and tilt: up to 30 degrees in the label's plane, out of
it about any axis, or both.  Pictures go the product's own way; a label is read where the flight decides so in
passing, from two views at least.

python -m tools.bench_passes [--flights N] [--first N] [--seed N] [--list] [--json]
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from statistics import median

import cv2
import numpy as np

from flightd.app.build import scanner_of
from flightd.config.schema import Config, load_config
from flightd.core.count_choice import CountChoice
from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, Finding
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.scanner import Scanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.code_symbols import Symbol, Symbology
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.label_texts import (
    Numbers,
    gtin_13,
    gtin_with_serial,
    lot,
    own_number,
    pallet_name,
    sscc,
)
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import StockShares
from flightd.sim.sensors.optics import Taking
from flightd.site.site import Location, Side, Site
from flightd.site.site_file import load_site
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.shelf_look import read_shelf
from tools.bench_sweep import CONFIG, aisle
from tools.pass_drawing import HungBox, HungRacks, Tilt

_NODES = 8
_LEVEL = 2
_PX = (2.75, 4.0)
_PX_BANDS = (2.75, 3.0, 3.25, 3.5, 4.0)
_TILT_BANDS_DEG = (0, 10, 20, 30)
_MOST_TILT_RAD = math.radians(30.0)
_ROOM_M = 0.6
"""How wide a box before a place may be."""
_EXPOSURES_S, _LEAST_EXPOSURES, _CRUISES_MPS = (0.001, 0.005), (0.5, 1.0), (0.8, 1.5)
_LIGHTS, _NOISES = (0.45, 1.15), (2.0, 6.0)
"""How bright the picture is against a well-lit one, and the noise that the gain leaves, in grey levels."""
_GLOSSY = 0.3
_KINDS: tuple[tuple[Symbology, Callable[[int], str]], ...] = (
    (Symbology.QR, pallet_name),
    (Symbology.QR, gtin_with_serial),
    (Symbology.DATA_MATRIX, sscc),
    (Symbology.CODE_128, own_number),
    (Symbology.CODE_128, lot),
    (Symbology.CODE_128, sscc),
    (Symbology.EAN_13, gtin_13),
)
_TURNED, _LEANT, _BOTH = "in its plane", "out of it", "both"
_TILTS = (_TURNED, _LEANT, _BOTH)
_BEFORE_M = 1.2
"""A flight begins so far before its first place, and ends so far behind its last."""


@dataclass(frozen=True, slots=True)
class Flight:
    """What was drawn for one flight past a shelf: the boxes and their way of being tilted by place."""

    number: int
    px: float
    config: Config
    look: RackAppearance
    boxes: dict[str, HungBox]
    tilts: dict[str, str]

    @property
    def camera(self) -> FrontCamera:
        front = self.config.front_camera
        return FrontCamera(front.lens(), front.mount(), front.fps, front.exposure_s)


@dataclass(frozen=True, slots=True)
class Passed:
    """One label: how it was seen, and what was told of its place."""

    flight: int
    place: str
    px: float
    speed_mps: float
    blur_modules: float
    symbology: str
    glossy: bool
    tilt: str
    tilt_deg: float
    text: str
    told: tuple[str, ...]
    state: str

    @property
    def read(self) -> bool:
        return self.state == LocationState.READ and self.told == (self.text,)

    @property
    def wrong(self) -> bool:
        """Whether something was told that is not there."""
        return bool(set(self.told) - {self.text}) or self.state == LocationState.EMPTY


def shelf(nodes: int = _NODES) -> Site:
    """An aisle with shelves of four levels, two places before each node."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "passes.toml"
        path.write_text(aisle(nodes), encoding="utf-8")
        return load_site(path)


def flight_of(site: Site, seed: int, number: int) -> Flight:
    """Draw one flight."""
    rng = np.random.default_rng([seed, number, 0x70617373])
    places = [p for p in site.locations.values() if p.level == _LEVEL and p.side is Side.LEFT]
    distance_m = abs(places[0].y_m - site.nodes[places[0].node].y_m)
    config, px = load_config(CONFIG), float(rng.uniform(*_PX))
    module_m = px * distance_m / config.front_camera.fx_px
    sweep = {
        "module_m": module_m,
        "label_m": _ROOM_M,
        "least_exposure": float(rng.uniform(*_LEAST_EXPOSURES)),
    }
    config = config.with_values(
        mission={"speed_mps": float(rng.choice(_CRUISES_MPS))},
        front_camera={"url": "udp://127.0.0.1:0", "exposure_s": float(rng.uniform(*_EXPOSURES_S))},
        scan={"mode": "sweep", "sweep": sweep},
    )
    serials = Numbers(seed * 1000 + number)
    tilts = {place.code: _TILTS[int(rng.integers(len(_TILTS)))] for place in places}
    boxes = {
        place.code: _box(place, serials.of(index)[0], module_m, tilts[place.code], rng)
        for index, place in enumerate(places)
    }
    full = StockShares(**dict.fromkeys(StockShares.names(), 0.0))
    light, noise = float(rng.uniform(*_LIGHTS)), float(rng.uniform(*_NOISES))
    return Flight(number, px, config, RackAppearance(full, exposure=light, noise=noise), boxes, tilts)


def _box(place: Location, serial: int, module_m: float, tilt: str, rng: np.random.Generator) -> HungBox:
    """A box whose label fits its place."""
    turn_rad = float(rng.uniform(-_MOST_TILT_RAD, _MOST_TILT_RAD)) if tilt != _LEANT else 0.0
    lean_rad = float(rng.uniform(0.0, _MOST_TILT_RAD)) if tilt != _TURNED else 0.0
    tilted = Tilt(turn_rad, lean_rad, float(rng.uniform(0.0, math.tau)))
    glossy, looks = bool(rng.random() < _GLOSSY), int(rng.integers(2**31))
    height_m = place.height_m + float(rng.uniform(-0.03, 0.03))
    while True:
        symbology, make = _KINDS[int(rng.integers(len(_KINDS)))]
        box = HungBox(Symbol(symbology, make(serial)), glossy, module_m, 0.0, height_m, tilted, looks)
        room_m = _ROOM_M - box.size_m[0]
        if room_m >= 0.0:
            return replace(box, right_m=float(rng.uniform(-0.5, 0.5)) * room_m)


def passes(site: Site, flight: Flight, seed: int) -> Iterator[Passed]:
    """Fly past, read, and tell what became of each label."""
    scanner = scanner_of(flight.config, site)
    assert isinstance(scanner, Scanner)
    choice = CountChoice((_LEVEL,))
    scanner.choose(choice)
    nodes = list(site.nodes)
    legs = scanner.legs(nodes, nodes[0], math.pi / 2, 1.4)
    leg = next(leg for leg in legs if leg.locations[0] in flight.boxes)
    told = scanner.told_sweeps([nodes], choice)[0]
    found = {finding.location: finding for finding in _fly_past(site, leg, scanner, flight, seed)}
    for code, box in flight.boxes.items():
        finding = found.get(code)
        yield Passed(
            flight=flight.number,
            place=code,
            px=flight.px,
            speed_mps=leg.speed_mps,
            blur_modules=told.blur_modules,
            symbology=box.symbol.symbology.value,
            glossy=box.glossy,
            tilt=flight.tilts[code],
            tilt_deg=math.degrees(box.tilt.most_rad),
            text=box.symbol.text,
            told=tuple(read.text for read in finding.reads) if finding is not None else (),
            state=finding.state.value if finding is not None else "left for a stop",
        )


def _fly_past(site: Site, leg: SweepLeg, scanner: Scanner, flight: Flight, seed: int) -> tuple[Finding, ...]:
    """What one leg finds, flown at its speed from well before its places until well behind them."""
    rng, camera = np.random.default_rng([seed, flight.number, 0x666C79]), flight.camera
    renderer = FrontRenderer(site, camera, flight.look, seed, partial(HungRacks, boxes=flight.boxes))
    xs = [site.locations[code].x_m for code in leg.locations]
    y_m, start_m, end_m = site.nodes[leg.nodes[0]].y_m, min(xs) - _BEFORE_M, max(xs) + _BEFORE_M
    period_ns = round(1e9 / camera.fps)
    now_ns, seq = 1 + round(float(rng.uniform(0.0, 1.0)) * period_ns), 0
    scanner.begin_sweep([leg])
    scanner.begin_leg(0)
    scanner.step_sweep(0, leg, leg.speed_mps)
    x_m, how = start_m + leg.speed_mps * now_ns * 1e-9, scanner.exposure
    while x_m < end_m:
        true, pose = _poses(rng, now_ns, (x_m, y_m, leg.height_m), leg)
        places = scanner.places(pose)
        if places:
            picture = renderer.render(true, seq, None, Taking(*how))
            scanner.take(read_shelf(picture, seq, now_ns, places, *how)[0], pose)
        speed_mps = min(leg.speed_mps, scanner.passing_mps)
        scanner.step_sweep(now_ns, leg, speed_mps)
        how = scanner.exposure
        x_m, seq, now_ns = x_m + speed_mps * period_ns * 1e-9, seq + 1, now_ns + period_ns
    scanner.end_leg(leg)
    scanner.end_sweep(now_ns)
    return scanner.drain()[0]


def _poses(
    rng: np.random.Generator, stamp_ns: int, at_m: tuple[float, float, float], leg: SweepLeg
) -> tuple[Kinematics, BodyPose]:
    """Where the drone is on its way and how it moves, and where it takes itself to be: off as in flight."""

    def near(value: float, sigma: float) -> float:
        return float(rng.normal(value, sigma))

    x_m, y_m, height_m = at_m[0], near(at_m[1], 0.02), near(at_m[2], 0.02)
    turned = near(0.0, 0.015), near(0.0, 0.015), near(leg.yaw_rad, 0.01)
    moves = near(leg.speed_mps, 0.03 * leg.speed_mps), near(0.0, 0.03), near(0.0, 0.03)
    rates = near(0.0, 0.03), near(0.0, 0.03), near(0.0, 0.02)
    true = Kinematics(stamp_ns, x_m, y_m, height_m, *moves, *turned, *rates)
    believed = near(x_m, 0.01), near(y_m, 0.01), near(height_m, 0.015)
    taken = near(turned[0], 0.004), near(turned[1], 0.004), near(turned[2], 0.004)
    return true, BodyPose(stamp_ns, *believed, *taken, 0.01, 0.01, 0.004, True)


def bare_ms_per_mpx(site: Site, seed: int, frames: int = 15) -> float:
    """What the reader takes for a frame of goods without a code, in the middle: ms of one core to the Mpx."""
    flight = flight_of(site, seed, 0)
    look = replace(flight.look, location_labels=False)
    renderer = FrontRenderer(site, flight.camera, look, seed, partial(HungRacks, boxes={}))
    first = site.nodes[next(iter(site.nodes))]
    took = []
    for seq in range(frames):
        x_m = first.x_m + 0.6 * seq
        at_rest = 0.0, 0.0, 0.0
        true = Kinematics(seq, x_m, first.y_m, 1.4, *at_rest, 0.0, 0.0, math.pi / 2, *at_rest)
        picture = renderer.render(true, seq)
        begun_ns = time.process_time_ns()
        read_codes(picture)
        took.append((time.process_time_ns() - begun_ns) / picture[..., 0].size)
    return median(took)


def _share(found: Sequence[Passed]) -> str:
    read, wrong = sum(one.read for one in found), sum(one.wrong for one in found)
    return f"{len(found)} | {100 * read / max(len(found), 1):.1f} % | {wrong}"


def table(found: Sequence[Passed]) -> list[str]:
    """The figures, a line each."""
    groups = {
        f"{low:g} to {high:g} pixels a module": [one for one in found if low <= one.px < high]
        for low, high in pairwise(_PX_BANDS)
    }
    groups |= {kind.value: [one for one in found if one.symbology == kind.value] for kind in Symbology}
    groups |= {
        f"tilted by {low} to {high}°": [one for one in found if low <= one.tilt_deg < high]
        for low, high in pairwise(_TILT_BANDS_DEG)
    }
    groups |= {f"tilted {tilt}": [one for one in found if one.tilt == tilt] for tilt in _TILTS}
    groups |= {"glossy, a lamp in it": [one for one in found if one.glossy], "all": list(found)}
    heading = ["| labels | passes | read | wrong |", "|---|---|---|---|"]
    return heading + [f"| {name} | {_share(group)} |" for name, group in groups.items()]


def _line(one: Passed) -> str:
    shine = ", glossy" if one.glossy else ""
    return (
        f"flight {one.flight}, {one.place}: {one.symbology} of {one.px:.2f} px, tilted {one.tilt} by"
        f" {one.tilt_deg:.0f}°{shine}, at {one.speed_mps:.2f} m/s, blur {one.blur_modules:.2f} modules: "
        f"{one.state} {' '.join(one.told)}"
    )


def main() -> None:
    """Fly, read, tell."""
    shown = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=shown)
    parser.add_argument("--flights", type=int, default=60, help="of 16 labels each")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="tell each label that was not read")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    site, begun, found = shelf(), time.process_time(), []
    for number in range(asked.first, asked.first + asked.flights):
        new = list(passes(site, flight_of(site, asked.seed, number), asked.seed))
        found += new
        if asked.list:
            print("".join(f"{_line(one)}\n" for one in new if not one.read), end="", flush=True)
    cpu_s, bare_ms = time.process_time() - begun, bare_ms_per_mpx(site, asked.seed)
    if asked.json:
        print(json.dumps({"bare_ms_per_mpx": round(bare_ms, 2), "passes": [asdict(one) for one in found]}))
        return
    print("\n".join(table(found)))
    print(f"a frame without a code: {bare_ms:.1f} ms of one core to the Mpx; all: {cpu_s:.0f} s of one core")


if __name__ == "__main__":
    main()
