"""The paper's baseline done competently: threshold, Canny, Hough, averaging of the edge pairs."""

from __future__ import annotations

import math

import cv2
import numpy as np

from flightd.core.types import Image
from flightd.vision.lines.band import Band, LinearFit
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import Plane

_CANNY = (50.0, 150.0)
_VOTES_FRACTION = 0.18
"""Votes a line needs, as a part of the picture's shorter side."""
_CLUSTER_RAD = math.radians(5.0)
_MAX_LINES = 60


def find(mask: Image, grid: Grid, plane: Plane) -> list[Band]:
    """Centre lines as the mean of Hough lines of like angle; each cluster's extremes are the edges."""
    smooth = cv2.GaussianBlur(mask, (5, 5), 0)
    edges = cv2.Canny(smooth, *_CANNY)
    votes = max(10, round(_VOTES_FRACTION * min(mask.shape)))
    found = cv2.HoughLines(edges, 1, math.pi / 180, votes)
    if found is None:
        return []
    lines = np.asarray(found, float).reshape(-1, found.shape[-1])[:_MAX_LINES, :2]
    origin_x, origin_y = float(grid.x(0)), float(grid.y(0))
    centred = [
        (rho * grid.step + origin_x * math.cos(theta) + origin_y * math.sin(theta), theta)
        for rho, theta in lines
    ]
    reach = 0.12 * min(plane.width_px, plane.height_px)
    strips = []
    for cluster in _clusters(centred, reach):
        strip = _average(cluster, plane)
        if strip is not None:
            strips.append(strip)
    return strips


def _clusters(lines: list[tuple[float, float]], reach_px: float) -> list[list[tuple[float, float]]]:
    clusters: list[list[tuple[float, float]]] = []
    for rho, theta in lines:
        for cluster in clusters:
            turn = theta - cluster[0][1]
            rho_like, theta_like = (
                (rho, theta) if abs(turn) < math.pi / 2 else (-rho, theta - math.copysign(math.pi, turn))
            )
            if abs(theta_like - cluster[0][1]) < _CLUSTER_RAD and abs(rho_like - cluster[0][0]) < reach_px:
                cluster.append((rho_like, theta_like))
                break
        else:
            clusters.append([(rho, theta)])
    return clusters


def _average(cluster: list[tuple[float, float]], plane: Plane) -> Band | None:
    rhos, thetas = (np.array(column) for column in zip(*cluster, strict=True))
    # Mean of the two edges, not of the votes: the stronger edge must not pull.
    rho, theta = (rhos.min() + rhos.max()) / 2, float(thetas.mean())
    c, s = math.cos(theta), math.sin(theta)
    steep = abs(c) >= abs(s)
    n, other = (c, s) if steep else (s, c)
    half_u = (plane.height_px if steep else plane.width_px) / 2
    half_v = (plane.width_px if steep else plane.height_px) / 2
    spread = max(1.0, float(rhos.max() - rhos.min()) / 2)
    var_b, var_a = math.radians(1.0) ** 2, spread * spread / 4 + 1.0

    def line(r: float) -> LinearFit:
        return LinearFit(r / n, -other / n, var_a, var_b)

    low, high = sorted((line(float(rhos.min())), line(float(rhos.max()))), key=lambda f: f.a)
    centre = line(float(rho))
    u = np.linspace(-half_u, half_u, 65)
    visible = u[np.abs(centre.a + centre.b * u) <= half_v]
    if len(visible) < 2:
        return None
    return Band(steep, centre, low, high, float(visible[0]), float(visible[-1]), 1.0)
