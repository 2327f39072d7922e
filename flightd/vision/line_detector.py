"""One detector for all methods: frame in, lines and junctions out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.markers import MarkerSet
from flightd.core.types import UNCHECKED, FloorFeature, Image, LineSet, MarkerSight, PadSight
from flightd.vision.floor import pad_detection as pads
from flightd.vision.floor.feature_tracking import FeatureTracker
from flightd.vision.floor.floor_markers import MarkerFinder
from flightd.vision.floor.frame_check import check_picture
from flightd.vision.lines import band_evidence as evidence
from flightd.vision.lines import centroid, junctions, naive, skeleton
from flightd.vision.lines import fusion as combine
from flightd.vision.lines.band import Band
from flightd.vision.lines.band_ends import lengthen
from flightd.vision.lines.band_refinement import refine
from flightd.vision.lines.colour_profile import ColourProfile, classify, grow, load_profile
from flightd.vision.lines.sampling import Grid, coarsened, grid_for, sample
from flightd.vision.lines.undistortion import Plane, shortest_length

METHODS = ("centroid", "skeleton", "combined", "naive")

_MIN_SIDE_PX = 16
_REACH_PX = 10
"""How far the guessed edge may be off: a sample and a half, or what blur hides."""
_KEPT_BYTES = 1 << 24
"""More than any small picture, less than the 32 MB from which the C library always goes to the system."""
_SPECKS = np.ones((5, 5), np.uint8)
_HOLES = np.ones((9, 9), np.uint8)
_ALONG = np.ones((1, 9), np.uint8)
_WORN = 1.02
"""Closing that adds more than this to the paint shows worn paint, whose holes would break the ridge."""


@dataclass(frozen=True, slots=True)
class Look:
    """What one picture shows by itself: its lines, without their stamp and what was followed; and `small`, in
    which that is done.  `marks` are the stages and the times at which they ended."""

    lines: LineSet
    small: Image
    grid: Grid
    plane: Plane
    marks: tuple[tuple[str, int], ...]


class Detector:
    """Finds the painted lines of one colour in frame after frame.

    `method` is one of METHODS; `profile` a colour profile or the name of one.  With a `lens` the lines
    are those of a distortion-free camera.  Floor markers are looked for when `markers` says
    which.  When `in_flight`, charge pads are looked for, too, features of the floor are followed from frame
    to frame, and the picture's fingerprint and exposure are taken.  `now_ns`, when given, times the stages.
    Not thread-safe: one detector for each worker.
    """

    def __init__(
        self,
        method: str = "combined",
        profile: ColourProfile | str = "yellow",
        lens: Lens | None = None,
        *,
        zhang_suen: bool = False,
        markers: MarkerSet | None = None,
        in_flight: bool = False,
        now_ns: Callable[[], int] | None = None,
    ) -> None:
        if method not in METHODS:
            raise InputError(f"method {method}: unknown; choose one of {', '.join(METHODS)}")
        self.method = method
        self.profile = load_profile(profile) if isinstance(profile, str) else profile
        self._lens = lens
        self._zhang_suen = zhang_suen
        self._markers = MarkerFinder(markers) if markers is not None else None
        self._features = FeatureTracker() if in_flight else None
        self._now_ns = now_ns or _no_clock
        _keep_freed_memory()

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        """Lines and junctions of a (H, W, 3) uint8 BGR picture.

        Raises InputError for any other shape or type, and for pictures too small to hold a line.
        """
        return self.told(self.look(bgr), seq, stamp_ns)

    def look(self, bgr: Image) -> Look:
        """What the picture shows, whatever was before it.  InputError as for `detect`."""
        _check(bgr)
        marks = [("start", self._now_ns())]

        def mark(stage: str) -> None:
            marks.append((stage, self._now_ns()))

        height, width = bgr.shape[:2]
        plane = self._plane(width, height)
        grid = grid_for(width, height)
        small = sample(bgr, grid)
        levels = classify(small, self.profile)
        mask = _closed(grow(levels), _SPECKS)
        mark("colour")
        strips = self._find(bgr, mask, grid, plane, mark)
        if self.method != "naive":
            strips = evidence.without_faint(strips, levels, grid, plane)
        lines = tuple(strip.to_line() for strip in strips)
        found = junctions.find(lines, mask, grid, plane)
        mark("junctions")
        mats: tuple[PadSight, ...] = ()
        picture = UNCHECKED
        if self._features is not None:
            coarse, coarse_grid = coarsened(small, grid)
            mats, picture = pads.find(coarse, lines, coarse_grid, plane), check_picture(coarse)
            mark("pads")
        signs: tuple[MarkerSight, ...] = ()
        if self._markers is not None:
            signs = self._markers.find(small, grid, plane)
            mark("markers")
        seen = LineSet(0, 0, width, height, lines, found, self.method, {}, mats, picture, signs)
        return Look(seen, small, grid, plane, tuple(marks))

    def told(self, look: Look, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        """The lines and junctions of a picture, of which `look` tells, and the features followed to it."""
        timings = {name: (end - begin) / 1e6 for (_, begin), (name, end) in pairwise(look.marks)}
        followed: tuple[FloorFeature, ...] = ()
        if self._features is not None:
            began_ns = self._now_ns()
            followed = self._features.find(look.small, look.grid, seq, stamp_ns, look.plane)
            timings["features"] = (self._now_ns() - began_ns) / 1e6
        return replace(look.lines, frame_seq=seq, stamp_ns=stamp_ns, timings_ms=timings, features=followed)

    def _plane(self, width: int, height: int) -> Plane:
        lens = self._lens
        if lens is not None and (lens.width_px, lens.height_px) != (width, height):
            lens = lens.scaled(width, height)
        return Plane(width, height, lens)

    def _find(
        self, bgr: Image, mask: Image, grid: Grid, plane: Plane, mark: Callable[[str], None]
    ) -> list[Band]:
        if not cv2.countNonZero(mask):
            return []
        if self.method == "naive":
            return naive.find(mask, grid, plane)
        bands = centroid.find(mask, grid, plane) if self.method != "skeleton" else []
        # Where centroids account for all the paint, the ridge could only say the same once more.
        thinned = self.method == "skeleton" or (
            self.method == "combined" and evidence.is_paint_left(mask, bands, grid, plane)
        )
        if thinned:
            bands += self._ridges(mask, grid, plane, bands)
        guesses = _weighed(bands, mask, grid, plane)
        mark("guess")
        shortest = shortest_length(plane)
        if self.method != "combined":
            return evidence.select(guesses, shortest, [])
        frame = np.ascontiguousarray(bgr)
        found: list[Band] = []
        while strips := evidence.select(guesses, shortest, found):
            refined = refine(frame, strips, plane, self.profile.colour, reach_px=_REACH_PX)
            found += [strip for strip in refined if strip is not None]
            if None not in refined:
                break
            # What hid behind a guess that turned out to be no line gets its own chance.
            tried = {id(strip) for strip in strips}
            guesses = [g for g in guesses if id(g.strip) not in tried]
            if not thinned:
                thinned = True
                guesses += _weighed(bands + self._ridges(mask, grid, plane, bands), mask, grid, plane)
        found = lengthen(frame, combine.without_repeats(found), plane)
        mark("refine")
        return found

    def _ridges(self, mask: Image, grid: Grid, plane: Plane, bands: list[Band]) -> list[Band]:
        """What the skeleton shows, along the `bands` that are known and elsewhere."""
        solid = _closed(mask, _HOLES)
        worn = cv2.countNonZero(solid) > _WORN * cv2.countNonZero(mask)
        return skeleton.find(solid if worn else mask, grid, plane, bands, zhang_suen=self._zhang_suen)


def _weighed(bands: list[Band], mask: Image, grid: Grid, plane: Plane) -> list[evidence.Evidence]:
    """Everything that may be a band, with its evidence."""
    return evidence.weigh(combine.fuse(bands, tolerance_px=1.5 * grid.step), mask, grid, plane)


def _closed(mask: Image, kernel: Image) -> Image:
    """The mask with its small gaps filled.  What lies outside the picture is unknown: the floor between a
    band and the border it runs along is no gap, and does not make of the band one that the border cuts; along
    the border, where it cuts one, a gap is none either, and does not make of it one that ends before."""
    closed = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel), np.uint8)
    rows, columns = (max(side - 1, 1) for side in mask.shape)
    across, along = np.ascontiguousarray(mask[::rows]), np.ascontiguousarray(mask[:, ::columns])
    closed[::rows] &= np.asarray(cv2.morphologyEx(across, cv2.MORPH_CLOSE, _ALONG), np.uint8)
    closed[:, ::columns] &= np.asarray(cv2.morphologyEx(along, cv2.MORPH_CLOSE, _ALONG.T), np.uint8)
    return closed


def _check(bgr: Image) -> None:
    shape, dtype = np.shape(bgr), getattr(bgr, "dtype", None)
    if len(shape) != 3 or shape[2] != 3 or dtype != np.uint8:
        raise InputError(f"picture is {shape} {dtype}, not (height, width, 3) uint8 BGR; convert it first")
    if min(shape[:2]) < _MIN_SIDE_PX:
        raise InputError(
            f"picture of {shape[1]}x{shape[0]} px is too small; at least {_MIN_SIDE_PX} px a side"
        )


def _keep_freed_memory() -> None:
    """Let this process keep what a frame's small pictures leave for those of the next one.

    The GNU C library gives freed blocks of more than 128 KB back to the system until it has seen a larger one
    freed; new pages, fifty to three hundred for each frame, cost as much time as reading the frame.  Other
    libraries take no notice.
    """
    np.empty(_KEPT_BYTES, np.uint8)  # freed at once, and never touched


def _no_clock() -> int:
    return 0
