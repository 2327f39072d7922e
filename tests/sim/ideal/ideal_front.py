"""A perfect code reader: what the front camera would read of known stock, computed instead of rendered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flightd.core.scanning import BodyPose, CodeSet, Occupancy, Place, PlaceLook
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import FrontSight
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site import Side, Site


@dataclass(frozen=True)
class Label:
    """One code on the shelf front, `dx_m` along and `dh_m` above its location's own label."""

    text: str
    dx_m: float = 0.0
    dh_m: float = 0.0
    size_m: float = 0.06
    symbology: str = "QR Code"


@dataclass
class Stock:
    """What lies where: labels by location; places named in `empty`, `torn`, `covered` show no code."""

    labels: Mapping[str, Sequence[Label]] = field(default_factory=dict)
    empty: frozenset[str] = frozenset()
    torn: frozenset[str] = frozenset()
    covered: frozenset[str] = frozenset()

    def occupancy(self, location: str) -> Occupancy:
        if location in self.empty:
            return Occupancy.EMPTY
        return Occupancy.COVERED if location in self.covered else Occupancy.GOODS


class IdealFront:
    """Reads every label that is wholly in the picture, of the shelf that the camera faces."""

    def __init__(self, site: Site, sight: FrontSight, stock: Stock) -> None:
        self._site = site
        self._sight = sight
        self._stock = stock
        self.pictures = 0

    def see(self, k: Kinematics, places: Sequence[Place], stamp_ns: int) -> CodeSet:
        self.pictures += 1
        pose = BodyPose(
            stamp_ns, k.x_m, k.y_m, k.height_m, k.roll_rad, k.pitch_rad, k.yaw_rad, 0.0, 0.0, 0.0, True
        )
        lens = self._sight.lens
        reads = tuple(
            read
            for code, labels in self._stock.labels.items()
            if code not in self._stock.torn
            for label in labels
            if (read := self._read(pose, code, label)) is not None
        )
        looks = tuple(
            PlaceLook(place.location, place.quad_px, place.share, self._stock.occupancy(place.location))
            for place in places
        )
        return CodeSet(self.pictures, stamp_ns, lens.width_px, lens.height_px, reads, looks)

    def _read(self, pose: BodyPose, code: str, label: Label) -> CodeRead | None:
        location, lens, half = self._site.locations[code], self._sight.lens, label.size_m / 2
        x, h = location.x_m + label.dx_m, location.height_m + label.dh_m
        out = half if location.side is Side.LEFT else -half
        corners = [(x - out, h + half), (x + out, h + half), (x + out, h - half), (x - out, h - half)]
        towards = pose.y_m - location.y_m if location.side is Side.LEFT else location.y_m - pose.y_m
        if not 0.0 < towards < 2.0:  # labels face their aisle
            return None
        pixels = self._sight.view(pose).project(np.array([(cx, location.y_m, ch) for cx, ch in corners]))
        limits = (lens.width_px - 1, lens.height_px - 1)
        if not np.isfinite(pixels).all() or (pixels < 0).any() or (pixels > limits).any():
            return None
        centred = pixels - lens.centre_px
        return CodeRead(label.symbology, label.text, tuple(map(tuple, centred.tolist())), True, 1, 1.0)
