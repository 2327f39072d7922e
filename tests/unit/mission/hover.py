"""A scan of one node by hand: what each picture of it shows is given, what the scanner finds is kept."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from flightd.config.scan import ScanConfig
from flightd.core.scanning import BodyPose, Finding, Light, Occupancy
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import Assigner
from flightd.mission.scan.scanner import Scanner
from flightd.mission.scan.views import View, ViewPlanner
from flightd.site.site import Site
from tests.unit.mission.shelves import SIGHT, SITE, picture, pose, read

PARAMS = ScanConfig(max_height_m=4.0)
EXPERT = PARAMS.expert
ASIDE_PER_HEIGHT = 0.4
STEP_NS = 250_000_000


def planner(site: Site, params: ScanConfig = PARAMS) -> ViewPlanner:
    """As a scanner's own."""
    assigner = Assigner(site, SIGHT, params.expert.least_probability)
    return ViewPlanner(site, SIGHT, assigner, params, math.inf, ASIDE_PER_HEIGHT)


class Hover:
    """A scan of A2: answers each picture of the present view until the node is over."""

    def __init__(self, params: ScanConfig = PARAMS) -> None:
        self.scanner = Scanner(SITE, SIGHT, params, aside_per_height=ASIDE_PER_HEIGHT)
        self.assigner = Assigner(SITE, SIGHT, params.expert.least_probability)
        self.planner = planner(SITE, params)
        self.scanner.arrive("A2", 1.0, -math.pi / 2)
        self.now_ns = 10**9
        self.seq = 0
        self.views: list[View] = []
        self.found: dict[str, Finding] = {}

    def at_view(self) -> View:
        view = self.scanner.view
        assert view is not None
        self.scanner.begin(self.now_ns)
        self.views.append(view)
        return view

    def look(
        self,
        show: dict[str, Occupancy],
        reads: dict[str, tuple[str, ...]] | None = None,
        share: float = 1.0,
    ) -> bool:
        """One picture at the view, which shows that share of each place; True when the view is over."""
        view = self.scanner.view
        assert view is not None
        self.now_ns += STEP_NS
        self.seq += 1
        here = pose(self.now_ns, x_m=view.x_m, y_m=view.y_m, height_m=view.height_m, yaw_rad=view.yaw_rad)
        codes = [self.code(here, code, text) for code, texts in (reads or {}).items() for text in texts]
        places = {code: seen for code, seen in show.items() if code in view.locations}
        shown = picture(self.seq, tuple(codes), places, self.now_ns)
        cut = tuple(replace(place, share=share) for place in shown.places)
        self.scanner.take(replace(shown, places=cut), here)
        over = self.scanner.step(self.now_ns)
        self.gather()
        return over

    def lit(self, camera: Callable[[float], tuple[float, Light]], reads: dict[str, tuple[str, ...]]) -> None:
        """To the end: `camera` says what it makes of a wanted exposure and how places come out then; codes
        are read in fair light only."""
        while (view := self.scanner.view) is not None:
            self.at_view()
            over = False
            while not over:
                exposure, light = camera(self.scanner.exposure[0])
                self.now_ns += STEP_NS
                self.seq += 1
                at = {"x_m": view.x_m, "y_m": view.y_m, "height_m": view.height_m, "yaw_rad": view.yaw_rad}
                here = pose(self.now_ns, **at)
                seen = reads if light is Light.FAIR else {}
                codes = [
                    self.code(here, c, t) for c, texts in seen.items() if c in view.locations for t in texts
                ]
                places = dict.fromkeys(view.locations, Occupancy.UNSURE)
                shown = picture(self.seq, tuple(codes), places, self.now_ns, exposure, light)
                self.scanner.take(shown, here)
                over = self.scanner.step(self.now_ns)
                self.gather()

    def code(self, here: BodyPose, code: str, text: str) -> CodeRead:
        (place,) = self.assigner.places(here, [code])
        xs, ys = zip(*place.quad_px, strict=True)
        # a second label of a place beside the first
        aside = 0.2 * (max(xs) - min(xs)) * (1 if text.endswith("2") else 0)
        return read(text, sum(xs) / 4 + aside, sum(ys) / 4)

    def gather(self) -> None:
        found, _ = self.scanner.drain()
        self.found.update({finding.location: finding for finding in found})

    def run(self, show: dict[str, Occupancy], reads: dict[str, tuple[str, ...]]) -> None:
        """Show the same at every view to the end."""
        while self.scanner.view is not None:
            view = self.at_view()
            while not self.look(show, {c: t for c, t in reads.items() if c in view.locations}):
                pass
            self.now_ns += STEP_NS


LOCATIONS = tuple(place.code for place in SITE.locations.values() if place.node == "A2")
GOODS = dict.fromkeys(LOCATIONS, Occupancy.GOODS)
