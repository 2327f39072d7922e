"""Which location a code belongs to, by geometry: the ray through the code meets the shelf front in a cell.

A read that may as well be a neighbour's is given to nobody.  Labels whose text is a location code are no
stock: they tell where the drone really is, and so contradict a wrong place on the map.  Nor is what has the
form of a location code but is not on the map.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from flightd.core.camera_view import CameraView, ForwardMount, Viewpoint
from flightd.core.geometry import Lens, Matrix
from flightd.core.scanning import BodyPose, CodeSet, Place, PlaceOpening, Quad
from flightd.core.types import CodeRead
from flightd.site.racks import code_form
from flightd.site.shelf_cells import Cell, cells_of
from flightd.site.site import Side, Site

_DEPTH_SIGMA_M = 0.05
"""How far in front of or behind the shelf front labels hang."""
_TILT_SIGMA_RAD = math.radians(0.5)
_HEIGHT_SIGMA_M = 0.03
_LEAST_SHARE = 0.02
_OPENING_SHARE = 0.85
"""A place's opening is looked at where so much of it is in the picture."""
_BAY_SHARE = 0.75
"""Part of a bay's width by which a location label must be off its place to contradict the map."""


@dataclass(frozen=True, slots=True)
class FrontSight:
    """The front camera on the drone."""

    lens: Lens
    mount: ForwardMount

    def view(self, pose: BodyPose) -> CameraView:
        p = pose
        return CameraView(
            self.lens,
            Viewpoint.at(p.x_m, p.y_m, p.height_m, p.roll_rad, p.pitch_rad, p.yaw_rad, self.mount),
        )


@dataclass(frozen=True, slots=True)
class PlacedRead:
    """A code on the shelf front.  `location` is empty where no cell is surely its own; `likeliest` is the
    best cell and `probability` that of it.  `size_m` is the larger side of the code."""

    read: CodeRead
    location: str
    likeliest: str
    x_m: float
    height_m: float
    size_m: float
    probability: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """A location label: what it says and where the map has it, against where it was seen from.

    `dx_m`, `dy_m` are from the drone to the label, in map axes (the way to the shelf is the map's own);
    `off_m` is how far along the aisle the label is from where its location should be (+ x)."""

    location: str
    stamp_ns: int
    dx_m: float
    dy_m: float
    off_m: float
    contradicts: bool


@dataclass(frozen=True, slots=True)
class ShelfLook:
    """What was read in one picture taken at `pose`, sorted by location; `unmapped` are location codes that
    the map lacks."""

    codes: CodeSet
    pose: BodyPose
    reads: tuple[PlacedRead, ...]
    sightings: tuple[Sighting, ...]
    unmapped: tuple[str, ...] = ()


class Assigner:
    """Sorts what the front camera saw by the locations of a site."""

    def __init__(self, site: Site, sight: FrontSight, least_probability: float = 0.99) -> None:
        self._sight = sight
        self._least = least_probability
        self._locations = site.locations
        self._form = code_form(site.racks)
        self._bay_m = {
            (aisle, side): rack.bay_width_m
            for rack in site.racks
            for aisle in rack.aisles
            for side in rack.sides
        }
        self.cells: Mapping[str, Cell] = cells_of(site)
        self._fronts: dict[tuple[str, Side], list[Cell]] = {}
        for cell in self.cells.values():
            self._fronts.setdefault((cell.aisle, cell.side), []).append(cell)

    def places(self, pose: BodyPose, locations: Iterable[str]) -> tuple[Place, ...]:
        """Where the picture taken at `pose` shows the cells, those out of the picture left out."""
        view, lens = self._sight.view(pose), self._sight.lens
        found = []
        for code in locations:
            cell = self.cells[code]
            corners_m = *cell.corners_m, *cell.core_m, *cell.lit_m, *cell.deck_corners_m
            pixels = view.project(np.array(corners_m))
            if not np.isfinite(pixels[:12]).all():
                continue
            share = _inside_share(pixels[:4], lens)
            if share >= _LEAST_SHARE:
                quad, core, lit = (_quad(pixels[i : i + 4], lens) for i in (0, 4, 8))
                deck = _quad(pixels[12:], lens) if np.isfinite(pixels[12:]).all() else ()
                level, opening = self._locations[code].level, _opening(cell, view)
                place = Place(code, quad, round(share, 3), core, deck, opening, level=level, lit_px=lit)
                found.append(place)
        return tuple(found)

    def look(self, codes: CodeSet, pose: BodyPose, front: tuple[str, Side]) -> ShelfLook:
        """Everything of one picture taken at `pose` while facing the shelf `front` (aisle, side)."""
        stock: list[PlacedRead] = []
        sightings: list[Sighting] = []
        unmapped: list[str] = []
        for read in codes.reads:
            where = self._on_front(read, pose, front)
            if where is None:
                continue
            if read.text in self._locations:
                if read.believed:
                    sightings.append(self._sighting(read, pose, where, front))
            elif self._form.fullmatch(read.text):
                unmapped += [read.text] * read.believed
            else:
                stock.append(self._placed(read, pose, where, front))
        return ShelfLook(codes, pose, tuple(stock), tuple(sightings), tuple(unmapped))

    def _on_front(
        self, read: CodeRead, pose: BodyPose, front: tuple[str, Side]
    ) -> tuple[float, float, float] | None:
        """(x, height, size) of a code on the shelf front; None where its ray misses the front."""
        cells = self._fronts.get(front)
        if not cells:
            return None
        view, lens = self._sight.view(pose), self._sight.lens
        try:
            points = view.onto_shelf(np.array(read.corners_px) + lens.centre_px, cells[0].y_m)
        except ValueError:
            return None
        if not np.isfinite(points).all():
            return None
        x_m, height_m = points.mean(axis=0)
        return float(x_m), float(height_m), float(np.ptp(points, axis=0).max())

    def _placed(
        self, read: CodeRead, pose: BodyPose, where: tuple[float, float, float], front: tuple[str, Side]
    ) -> PlacedRead:
        x_m, height_m, size_m = where
        cells = self._fronts[front]
        distance_m = abs(cells[0].y_m - pose.y_m)
        sigma_x, sigma_h = _sigmas(pose, x_m, height_m, distance_m)
        scored = ((cell.inside_probability(x_m, height_m, sigma_x, sigma_h), cell) for cell in cells)
        best, cell = max(scored, key=lambda pair: pair[0])
        sure = best >= self._least and pose.certain
        location = cell.location if sure else ""
        return PlacedRead(read, location, cell.location, x_m, height_m, size_m, best)

    def _sighting(
        self,
        read: CodeRead,
        pose: BodyPose,
        where: tuple[float, float, float],
        front: tuple[str, Side],
    ) -> Sighting:
        home = self._locations[read.text]
        off_m = where[0] - home.x_m
        elsewhere = (home.aisle, home.side) != front
        far = abs(off_m) >= _BAY_SHARE * self._bay_m[home.aisle, home.side]
        dx_m, dy_m = where[0] - pose.x_m, self._fronts[front][0].y_m - pose.y_m
        return Sighting(read.text, pose.stamp_ns, dx_m, dy_m, off_m, elsewhere or far)


def _sigmas(pose: BodyPose, x_m: float, height_m: float, distance_m: float) -> tuple[float, float]:
    """Standard deviations (along, upwards) of a point measured on the front, metres."""
    across = (x_m - pose.x_m) / max(distance_m, 0.1)
    upward = (height_m - pose.height_m) / max(distance_m, 0.1)
    depth = math.hypot(_DEPTH_SIGMA_M, pose.sigma_y_m)
    turn = distance_m * (1.0 + across**2)
    sigma_x = math.hypot(pose.sigma_x_m, turn * pose.sigma_yaw_rad, across * depth)
    rise = distance_m * (1.0 + upward**2)
    return sigma_x, math.hypot(_HEIGHT_SIGMA_M, rise * _TILT_SIGMA_RAD, upward * depth)


def _quad(pixels: Matrix, lens: Lens) -> Quad:
    centre_x, centre_y = lens.centre_px
    return tuple((round(float(x) - centre_x, 1), round(float(y) - centre_y, 1)) for x, y in pixels)


def _opening(cell: Cell, view: CameraView) -> PlaceOpening | None:
    """The room of a cell in the picture, None where too little of it is."""
    corners = np.array(cell.opening_m)
    width_m, height_m = cell.x1_m - cell.x0_m, cell.top_m - cell.deck_m
    pixels = view.project(corners)
    if height_m <= 0.0 or not np.isfinite(pixels).all():
        return None
    if _inside_share(pixels, view.lens) < _OPENING_SHARE:
        return None
    at = view.viewpoint
    rightwards = 1.0 if cell.side is Side.LEFT else -1.0
    right_m = rightwards * (at.x_m - (cell.x0_m + cell.x1_m) / 2)
    eye_m = right_m, at.height_m - cell.deck_m, abs(at.y_m - cell.y_m)
    posts = cell.posts if rightwards > 0.0 else cell.posts[::-1]
    return PlaceOpening(_quad(pixels, view.lens), width_m, height_m, eye_m, posts)


def _inside_share(pixels: Matrix, lens: Lens) -> float:
    """Share of a quad's bounding box that lies in the picture; one that is higher than the picture counts
    as the picture's height."""
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    limits = np.array((lens.width_px - 1.0, lens.height_px - 1.0))
    size = np.maximum(np.minimum(high - low, (np.inf, limits[1])), 1e-6)
    seen = np.minimum(high, limits) - np.maximum(low, 0.0)
    return float(np.prod(np.clip(seen / size, 0.0, 1.0)))
