"""How many labels are read in passing, at the speed that the plan chooses: rendered flights past a shelf.

A flight goes past sixteen boxes at the speed of the plan for that camera and those labels, with the frames,
the blur and the readers' time that it reckons with; pixels for each module, exposure time, light, gain, speed
of the mission, symbologies, gloss and tilt (in the label's plane up to 30 degrees, out of it up to 30, or
both) are drawn.  The pictures go the product's own way, and a label counts as read where the flight decides
so in passing, from two views at least.

python -m tools.bench_passes [--flights N] [--seed N] [--json] [--list]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from flightd.app.build import scanner_of
from flightd.config.schema import Config, load_config
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
from flightd.site.site import Location, Side, Site
from flightd.site.site_file import load_site
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
"""What a box may be wide before a place."""
_EXPOSURES_S = (0.001, 0.005)
_LEAST_EXPOSURES = (0.5, 1.0)
_CRUISES_MPS = (0.8, 1.5)
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
_TILTS = ("in its plane", "out of it", "both")


@dataclass(frozen=True, slots=True)
class Flight:
    """What was drawn for one flight past a shelf."""

    number: int
    px: float
    config: Config
    light: float
    noise: float
    boxes: dict[str, HungBox]
    tilts: dict[str, str]


@dataclass(frozen=True, slots=True)
class Pass:
    """One label: how it was seen, and what became of it."""

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


def site_of(folder: Path) -> Site:
    """An aisle with shelves of four levels."""
    path = folder / "passes.toml"
    path.write_text(aisle(_NODES), encoding="utf-8")
    return load_site(path)


def flight_of(site: Site, seed: int, number: int) -> Flight:
    """Draw one flight."""
    rng = np.random.default_rng([seed, number, 0x70617373])
    camera = FrontCamera()
    places = [p for p in site.locations.values() if p.level == _LEVEL and p.side is Side.LEFT]
    distance_m = abs(places[0].y_m - site.nodes[places[0].node].y_m)
    px = float(rng.uniform(*_PX))
    module_m = px * distance_m / camera.lens.fx_px
    config = load_config(CONFIG).with_values(
        mission={"speed_mps": float(rng.choice(_CRUISES_MPS))},
        front_camera={"url": "udp://127.0.0.1:0", "exposure_s": float(rng.uniform(*_EXPOSURES_S))},
        scan={
            "mode": "sweep",
            "sweep": {
                "module_m": module_m, "label_m": _ROOM_M, "least_exposure": float(rng.uniform(*_LEAST_EXPOSURES))
            },
        },
    )  # fmt: skip
    serials = Numbers(seed * 1000 + number)
    tilts = {place.code: _TILTS[int(rng.integers(len(_TILTS)))] for place in places}
    boxes = {
        place.code: _box(place, serials.of(index)[0], module_m, tilts[place.code], rng)
        for index, place in enumerate(places)
    }
    return Flight(
        number, px, config, float(rng.uniform(*_LIGHTS)), float(rng.uniform(*_NOISES)), boxes, tilts
    )


def _box(place: Location, serial: int, module_m: float, tilt: str, rng: np.random.Generator) -> HungBox:
    """A box whose label fits its place."""
    turn_rad = float(rng.uniform(-_MOST_TILT_RAD, _MOST_TILT_RAD)) if tilt != "out of it" else 0.0
    lean_rad = float(rng.uniform(0.0, _MOST_TILT_RAD)) if tilt != "in its plane" else 0.0
    leant = Tilt(turn_rad, lean_rad, float(rng.uniform(0.0, math.tau)))
    glossy, looks = bool(rng.random() < _GLOSSY), int(rng.integers(2**31))
    height_m = place.height_m + float(rng.uniform(-0.03, 0.03))
    while True:
        symbology, make = _KINDS[int(rng.integers(len(_KINDS)))]
        box = HungBox(Symbol(symbology, make(serial)), glossy, module_m, 0.0, height_m, leant, looks)
        room_m = _ROOM_M - box.size_m[0]
        if room_m >= 0.0:
            right_m = float(rng.uniform(-0.5, 0.5)) * room_m
            return HungBox(box.symbol, glossy, module_m, right_m, height_m, leant, looks)


def passes(site: Site, flight: Flight, seed: int) -> Iterator[Pass]:
    """Fly past, read, and tell what became of each label."""
    config, front = flight.config, flight.config.front_camera
    camera = FrontCamera(front.lens(), front.mount(), front.fps, front.exposure_s)
    look = RackAppearance(
        StockShares(*[0.0] * len(StockShares.names())), exposure=flight.light, noise=flight.noise
    )
    racks = partial(HungRacks, boxes=flight.boxes)
    renderer = FrontRenderer(site, camera, look, seed + flight.number, racks)
    scanner = scanner_of(config, site)
    assert isinstance(scanner, Scanner)
    scanner.choose([_LEVEL])
    nodes = list(site.nodes)
    leg = next(
        leg for leg in scanner.legs(nodes, nodes[0], math.pi / 2, 1.4) if leg.locations[0] in flight.boxes
    )
    found = {
        finding.location: finding
        for finding in fly_past(site, leg, scanner, renderer, camera, seed + flight.number)
    }
    (told, *_) = (sweep for sweep in scanner.told_sweeps(nodes, [_LEVEL]))
    for code, box in flight.boxes.items():
        finding = found.get(code)
        yield Pass(
            flight.number,
            code,
            flight.px,
            leg.speed_mps,
            told.blur_modules,
            box.symbol.symbology.value,
            box.glossy,
            flight.tilts[code],
            math.degrees(box.tilt.most_rad),
            box.symbol.text,
            tuple(read.text for read in finding.reads) if finding is not None else (),
            finding.state.value if finding is not None else "left for a stop",
        )


def fly_past(
    site: Site, leg: SweepLeg, scanner: Scanner, renderer: FrontRenderer, camera: FrontCamera, seed: int
) -> tuple[Finding, ...]:
    """What one leg finds, flown at its speed from well before its places until well behind them."""
    rng = np.random.default_rng([seed, 0x666C79])
    xs = [site.locations[code].x_m for code in leg.locations]
    y_m = site.nodes[leg.nodes[0]].y_m
    start_m, end_m = min(xs) - 1.2, max(xs) + 1.2
    period_ns = round(1e9 / camera.fps)
    scanner.begin_sweep([leg])
    scanner.begin_leg(0)
    now_ns = round(float(rng.uniform(0.0, 1.0)) * period_ns) + 1
    seq = 0
    while (x_m := start_m + leg.speed_mps * now_ns * 1e-9) < end_m:
        true, pose = _poses(rng, now_ns, (x_m, y_m, leg.height_m), leg)
        places = scanner.places(pose)
        if places:
            picture = renderer.render(true, seq, exposure=leg.exposure)
            codes, _ = read_shelf(picture, seq, now_ns, places, leg.exposure)
            scanner.take(codes, pose)
        scanner.step_sweep(now_ns)
        seq, now_ns = seq + 1, now_ns + period_ns
    scanner.end_leg(leg)
    scanner.end_sweep(now_ns)
    return scanner.drain()[0]


def _poses(
    rng: np.random.Generator, stamp_ns: int, at_m: tuple[float, float, float], leg: SweepLeg
) -> tuple[Kinematics, BodyPose]:
    """Where the drone is on its way and how it moves, and where it takes itself to be, as far off as in flight."""

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


def _share(found: Sequence[Pass]) -> str:
    read = sum(one.read for one in found)
    return f"{read} of {len(found)} ({100 * read / max(len(found), 1):.1f} %) | {sum(one.wrong for one in found)}"


def table(found: Sequence[Pass]) -> list[str]:
    """The figures, a line each."""
    lines = ["| passes | read | wrong |", "|---|---|---|"]
    for low, high in zip(_PX_BANDS, _PX_BANDS[1:], strict=False):
        lines.append(
            f"| {low:g} to {high:g} px a module | {_share([p for p in found if low <= p.px < high])} |"
        )
    for symbology in Symbology:
        lines.append(f"| {symbology.value} | {_share([p for p in found if p.symbology == symbology])} |")
    for low, high in zip(_TILT_BANDS_DEG, _TILT_BANDS_DEG[1:], strict=False):
        inside = [p for p in found if low <= p.tilt_deg < high]
        lines.append(f"| tilted {low} to {high}° | {_share(inside)} |")
    for tilt in _TILTS:
        lines.append(f"| tilted {tilt} | {_share([p for p in found if p.tilt == tilt])} |")
    lines.append(f"| glossy | {_share([p for p in found if p.glossy])} |")
    lines.append(f"| all | {_share(found)} |")
    return lines


def main() -> None:
    """Fly, read, tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flights", type=int, default=60, help="of 16 labels each")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="name the labels that were not read")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        site = site_of(Path(folder))
    begun, found = time.process_time(), []
    for number in range(asked.first, asked.first + asked.flights):
        new = list(passes(site, flight_of(site, asked.seed, number), asked.seed))
        found += new
        if asked.list:
            for one in new:
                if not one.read:
                    print(
                        f"{one.flight} {one.place}: {one.px:.2f} px, {one.symbology}, {one.tilt} {one.tilt_deg:.0f}°,"
                        f" glossy {one.glossy}, {one.speed_mps:.2f} m/s, blur {one.blur_modules:.2f}: {one.state}"
                        f" {one.told} {one.text}",
                        flush=True,
                    )
    print("\n".join(table(found)))
    print(f"{time.process_time() - begun:.0f} s of one core")


if __name__ == "__main__":
    main()
