"""What a down camera sees of a floor's paint, as labels: where each line runs in its picture.

A stretch that a gap, a pallet or a drain takes away has no label; one of which they leave a part of the width
is `minor`.  A line that no map has is labelled like any other: it is paint, and tells no eye that it is not
meant.  An old one that has faded is `minor`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import msgspec
import numpy as np
from numpy.typing import NDArray

from flightd.core.camera_view import CameraView
from flightd.core.distortion import distorted
from flightd.core.geometry import Matrix
from flightd.sim.dataset.scenes import FAR, Scene, SceneBand, truth_lines, truth_nodes
from flightd.sim.floor.paint_damage import Stripe
from flightd.sim.floor.texture import Box
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, floor_viewpoint, moved
from flightd.vision.training.labelled_frames import LabelledLine, LabelledNode

_SIGHT = 2.5
"""How far aside paint is looked for, in heights: beyond what a tilted picture reaches."""
_SAMPLES = 161
_SEEN = 5
"""So many samples of an edge in the picture tell it; of fewer those around it do, too."""
_AROUND = 0.25
"""Share of the picture's size around it in which an edge still tells its direction."""
_SAME_PX = 1.0
_ROLLS = 12
"""Rounds in which a row and the time at which it is exposed are brought together; vibration needs more than
a steady motion."""


class FloorSight:
    """Where the picture of one exposure shows points of the floor."""

    def __init__(self, camera: SimCamera, kinematics: Kinematics) -> None:
        self.width, self.height = camera.lens.width_px, camera.lens.height_px
        view = floor_viewpoint(kinematics, camera.mount)
        self.foot_m, self.reach_m = (view.x_m, view.y_m), _SIGHT * view.height_m
        half_s = camera.readout_s / 2
        self._first, self._last = (
            CameraView(camera.lens, floor_viewpoint(moved(kinematics, sign * half_s), camera.mount))
            for sign in (-1.0, 1.0)
        )
        self._lens, self._readout_s = camera.lens, camera.readout_s
        self._turned_rad = partial(camera.turned_rad, kinematics.stamp_ns, over_s=camera.exposure_s)

    def pixels(self, points_m: Matrix) -> Matrix:
        """(N, 2) pixels of (N, 2) floor points, each seen when its row is exposed; NaN behind the camera."""
        lens, floor = self._lens, np.column_stack([points_m, np.zeros(len(points_m))])
        centre, focal = np.array(lens.centre_px), np.array((lens.fx_px, lens.fy_px))
        first, last = ((view.project_ideal(floor) - centre) / focal for view in (self._first, self._last))
        seen: Matrix = centre + (first + last) / 2 * focal
        for _ in range(_ROLLS):
            late = np.clip((seen[:, 1:] + 0.5) / self.height, 0.0, 1.0)
            turned_rad = self._turned_rad((late[:, 0] - 0.5) * self._readout_s)
            right, down = _turned_back(first + late * (last - first), turned_rad)
            seen = centre + distorted(np.stack([right, down]), lens).T * focal
        return seen

    def is_around(self, pixels: Matrix, near: float = _AROUND) -> NDArray[np.bool_]:
        """(N,) whether pixels lie in the picture or near it, by that share of its size."""
        size = np.array([self.width, self.height])
        inside = (pixels > -near * size) & (pixels < (1.0 + near) * size)
        around: NDArray[np.bool_] = np.logical_and.reduce(inside, axis=1)
        return around


def _turned_back(ideal: Matrix, turned_rad: Matrix) -> Matrix:
    """(2, N) where a camera shows (N, 2) ideal points that is turned by (3, N) angles about its axes."""
    ahead = np.vstack([ideal.T, np.ones(len(ideal))])
    seen = ahead - np.cross(turned_rad, ahead, axis=0) + turned_rad * (turned_rad * ahead).sum(axis=0)
    shown: Matrix = seen[:2] / seen[2]
    return shown


@dataclass(frozen=True, slots=True)
class _Piece:
    """A stretch of a stripe, metres along it from its middle."""

    start_m: float
    end_m: float
    is_whole: bool = True
    """Nothing takes away a part of its width."""


def floor_labels(
    stripes: Sequence[Stripe], hidden: Sequence[Box], sight: FloorSight, faded: Sequence[Stripe] = ()
) -> tuple[list[LabelledLine], list[LabelledNode]]:
    """Lines and nodes of the painted `stripes` where nothing is `hidden`.

    A node in or beside a hidden place, and the end of the paint there, is a `bend`: it may be told or not.
    So is a node on one of the `faded` stripes, which may be found or not themselves."""
    lines: list[LabelledLine] = []
    bands: list[SceneBand] = []
    cut: list[LabelledNode] = []
    for stripe in stripes:
        whole = _band(stripe, _whole(stripe), sight)
        if whole is None:
            continue
        bands.append(whole)
        for piece in _pieces(stripe, hidden):
            band = _band(stripe, piece, sight)
            if band is None:
                continue
            seen = truth_lines(_scene((band,), sight))
            lines += seen if piece.is_whole else [_minor(line) for line in seen]
            cut += _cut_ends(stripe, piece, sight)
    covers = [_cover(box, sight) for box in hidden]
    nodes = [
        LabelledNode(x=node.x, y=node.y, kind="bend") if _is_under(node, covers) else node
        for node in truth_nodes(_scene(tuple(bands), sight))
    ]
    shown = [band for band in (_band(stripe, _whole(stripe), sight) for stripe in faded) if band is not None]
    lines += [_minor(line) for band in shown for line in truth_lines(_scene((band,), sight))]
    if shown:
        met = truth_nodes(_scene((*bands, *shown), sight))
        others = [LabelledNode(x=node.x, y=node.y, kind="bend") for node in met if node not in nodes]
        cut += [node for node in others if not any(_is_near(node, one) for one in nodes)]
    return lines, nodes + cut


def _is_near(node: LabelledNode, other: LabelledNode) -> bool:
    return math.hypot(node.x - other.x, node.y - other.y) < _SAME_PX


def _whole(stripe: Stripe) -> _Piece:
    return _Piece(-stripe.length_m / 2, stripe.length_m / 2)


def _minor(line: LabelledLine) -> LabelledLine:
    return msgspec.structs.replace(line, grade="minor")


def _scene(bands: tuple[SceneBand, ...], sight: FloorSight) -> Scene:
    return Scene(sight.width, sight.height, "grid", bands)


def _pieces(stripe: Stripe, hidden: Sequence[Box]) -> list[_Piece]:
    """What is left of a stripe, and what is left in part."""
    half_m = stripe.length_m / 2
    pieces, in_part = [_Piece(-half_m, half_m)], []
    for box in hidden:
        (start_m, end_m), (left_m, right_m) = _within(stripe, box)
        reach_m = stripe.width_m / 2
        if end_m <= -half_m or start_m >= half_m or right_m <= -reach_m or left_m >= reach_m:
            continue
        if left_m > -reach_m or right_m < reach_m:
            in_part.append(_Piece(max(start_m, -half_m), min(end_m, half_m), is_whole=False))
        pieces = [
            left
            for piece in pieces
            for left in (
                replace(piece, end_m=min(piece.end_m, start_m)),
                replace(piece, start_m=max(piece.start_m, end_m)),
            )
            if left.end_m > left.start_m
        ]
    return pieces + in_part


def _within(stripe: Stripe, box: Box) -> tuple[tuple[float, float], tuple[float, float]]:
    """The ranges along the stripe and across it that an upright box has."""
    x0, y0, x1, y1 = box
    c, s = math.cos(stripe.turn_rad), math.sin(stripe.turn_rad)
    corners = [(x - stripe.x_m, y - stripe.y_m) for x in (x0, x1) for y in (y0, y1)]
    along, across = [x * c + y * s for x, y in corners], [y * c - x * s for x, y in corners]
    return (min(along), max(along)), (min(across), max(across))


def _at(stripe: Stripe, along_m: Matrix, across_m: float) -> Matrix:
    """(N, 2) floor points of a stripe."""
    c, s = math.cos(stripe.turn_rad), math.sin(stripe.turn_rad)
    points: Matrix = np.column_stack(
        [stripe.x_m + along_m * c - across_m * s, stripe.y_m + along_m * s + across_m * c]
    )
    return points


def _band(stripe: Stripe, piece: _Piece, sight: FloorSight) -> SceneBand | None:
    """The piece as the picture shows it: the bisector of its edges, and the distance between them in the
    middle of what is seen.  None where it is not near the picture."""
    dx_m, dy_m = sight.foot_m[0] - stripe.x_m, sight.foot_m[1] - stripe.y_m
    c, s = math.cos(stripe.turn_rad), math.sin(stripe.turn_rad)
    near_m = dx_m * c + dy_m * s
    start_m, end_m = max(piece.start_m, near_m - sight.reach_m), min(piece.end_m, near_m + sight.reach_m)
    if start_m >= end_m or abs(dy_m * c - dx_m * s) > sight.reach_m:
        return None
    along_m = np.linspace(start_m, end_m, _SAMPLES)
    edges = [sight.pixels(_at(stripe, along_m, side * stripe.width_m / 2)) for side in (-1, 1)]
    around = [sight.is_around(edge) for edge in edges]
    if min(int(inside.sum()) for inside in around) < 3:
        return None
    centred = [edge - ((sight.width - 1) / 2, (sight.height - 1) / 2) for edge in edges]
    way = centred[0][-1] - centred[0][0]
    seen = [sight.is_around(edge, 0.0) for edge in edges]  # beyond it nothing vibrates as rows do
    seen = [within if within.sum() >= _SEEN else near for within, near in zip(seen, around, strict=True)]
    lines = [_edge_line(edge[of], way) for edge, of in zip(centred, seen, strict=True)]
    normal, rho = lines[0][0] + lines[1][0], lines[0][1] + lines[1][1]
    normal_x, normal_y = map(float, normal)
    centre = (centred[0] + centred[1]) / 2
    spot = centre[around[0] | around[1]].mean(axis=0)
    thickness = math.fsum(abs(float(edge_normal @ spot) - edge_rho) for edge_normal, edge_rho in lines)
    band = SceneBand(rho / math.hypot(normal_x, normal_y), math.atan2(normal_y, normal_x), thickness)
    onward = math.copysign(FAR, band.along(*way))
    ends = [
        float(band.along(*centre[k])) if along_m[k] == at_m else beyond
        for k, at_m, beyond in ((0, piece.start_m, -onward), (-1, piece.end_m, onward))
    ]
    return replace(band, start=min(ends), end=max(ends))


def _edge_line(points: Matrix, way: Matrix) -> tuple[Matrix, float]:
    """Normal and rho of the straight line nearest to points; the normal lies clockwise of `way`."""
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle)[2][0]
    if direction @ way < 0.0:
        direction = -direction
    normal: Matrix = np.array([direction[1], -direction[0]])
    return normal, float(normal @ middle)


def _cut_ends(stripe: Stripe, piece: _Piece, sight: FloorSight) -> list[LabelledNode]:
    """Where a piece ends although the stripe goes on."""
    half_m = stripe.length_m / 2
    cuts_m = [at_m for at_m in (piece.start_m, piece.end_m) if abs(at_m) < half_m]
    pixels = sight.pixels(_at(stripe, np.array(cuts_m), 0.0)) if cuts_m else np.empty((0, 2))
    return [LabelledNode(x=float(x), y=float(y), kind="bend") for x, y in pixels[sight.is_around(pixels)]]


def _cover(box: Box, sight: FloorSight) -> tuple[Matrix, Matrix] | None:
    """The picture's upright box around a box of the floor; None where it is out of sight."""
    x0, y0, x1, y1 = box
    foot_x_m, foot_y_m = sight.foot_m
    if max(x0 - foot_x_m, foot_x_m - x1, y0 - foot_y_m, foot_y_m - y1) > sight.reach_m:
        return None
    corners = sight.pixels(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))
    return corners.min(axis=0), corners.max(axis=0)


def _is_under(node: LabelledNode, covers: Sequence[tuple[Matrix, Matrix] | None]) -> bool:
    at = np.array([node.x, node.y])
    return any(bool(((at >= cover[0]) & (at <= cover[1])).all()) for cover in covers if cover is not None)
