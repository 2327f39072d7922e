"""What one would write in an afternoon, to compare with: textbook and library ways to find yellow lines.

Each takes a BGR picture and returns (rho, theta) pairs, rho from the top left corner in pixels, theta in
radians.  They are done as their books and manuals do them, on every pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.extras import missing_extra
from flightd.core.types import Image

Lines: TypeAlias = list[tuple[float, float]]
Baseline: TypeAlias = Callable[[Image], Lines]

_YELLOW_HSV = (np.array([18, 80, 60]), np.array([36, 255, 255]))
_SURELY_YELLOW_HSV = (np.array([21, 120, 80]), np.array([33, 255, 255]))
_FEWEST_SLICES, _MOST_SLICES = 8, 40
_CLUSTER_PX, _CLUSTER_RAD = 0.06, math.radians(5)
_SIDE_BY_SIDE = 0.12


def textbook_naive(bgr: Image) -> Lines:
    """The paper's baseline: HSV range, Canny, Hough, averaging of like lines."""
    edges = np.asarray(cv2.Canny(_in_range(bgr), 50, 150), np.uint8)
    return _average(_hough(edges, min(bgr.shape[:2]) // 4), bgr.shape[1] * _SIDE_BY_SIDE)


def textbook_centroid(bgr: Image) -> Lines:
    """The paper's centroid method: region growing, square cells, the fewer the more paint there is, the
    largest contour of each, its moments, a robust line through the centroids."""
    mask = _region_grown(bgr)
    height, width = mask.shape
    coverage = max(cv2.countNonZero(mask) / mask.size, 1e-3)
    cell = height // round(min(max(1.5 / coverage, _FEWEST_SLICES), _MOST_SLICES))
    points = []
    for top in range(0, height, cell):
        for left in range(0, width, cell):
            contours, _ = cv2.findContours(
                mask[top : top + cell, left : left + cell], cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
            )
            if not contours:
                continue
            moments = cv2.moments(max(contours, key=cv2.contourArea))
            if moments["m00"] > cell:
                x, y = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
                points.append((left + x, top + y))
    return _ransac(np.array(points).reshape(-1, 2), cell / 2)


def skimage_skeleton(bgr: Image) -> Lines:
    """The paper's skeleton method: region growing, Zhang-Suen thinning by scikit-image, Hough, clustering."""
    try:
        from skimage.morphology import skeletonize
    except ImportError as err:
        raise missing_extra("bench", "scikit-image's skeleton") from err
    thin = skeletonize(_region_grown(bgr) > 0).astype(np.uint8) * 255
    return _average(_hough(thin, min(bgr.shape[:2]) // 6), bgr.shape[1] * _CLUSTER_PX)


def lsd_merged(bgr: Image) -> Lines:
    """OpenCV's line segment detector on the grey picture, collinear segments merged, edges paired."""
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    found: object = cv2.createLineSegmentDetector().detect(grey)[0]
    segments = np.empty((0, 4)) if found is None else np.asarray(found, float).reshape(-1, 4)
    dx, dy = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    length = np.hypot(dx, dy)
    long = length > 0.05 * bgr.shape[1]
    theta = np.arctan2(dx[long], -dy[long]) % math.pi
    rho = segments[long, 0] * np.cos(theta) + segments[long, 1] * np.sin(theta)
    order = np.argsort(-length[long], kind="stable")
    return _average([(float(rho[i]), float(theta[i])) for i in order], bgr.shape[1] * _SIDE_BY_SIDE)


BASELINES: dict[str, Baseline] = {
    "naive, every pixel": textbook_naive,
    "textbook centroid": textbook_centroid,
    "skimage skeleton + Hough": skimage_skeleton,
    "LSD + merging": lsd_merged,
}


def _in_range(bgr: Image) -> NDArray[np.uint8]:
    hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    return np.asarray(cv2.inRange(hsv, *_YELLOW_HSV), np.uint8)


def _region_grown(bgr: Image) -> NDArray[np.uint8]:
    """Everything perhaps yellow that is joined to something surely yellow."""
    hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    perhaps, surely = (cv2.inRange(hsv, *limits) for limits in (_YELLOW_HSV, _SURELY_YELLOW_HSV))
    count, parts = cv2.connectedComponents(perhaps)
    kept = np.zeros(count, np.uint8)
    kept[np.asarray(parts)[np.asarray(surely) > 0]] = 255
    kept[0] = 0
    return kept.take(np.asarray(parts))


def _hough(mask: NDArray[np.uint8], votes: int) -> Lines:
    found = cv2.HoughLines(mask, 1, math.pi / 180, max(votes, 10))
    if found is None:
        return []
    return [(float(rho), float(theta)) for rho, theta in np.asarray(found)[..., :2].reshape(-1, 2)]


def _average(lines: Lines, near_px: float) -> Lines:
    """Means of lines alike in rho and theta, the first of each cluster deciding who belongs."""
    clusters: list[Lines] = []
    for rho, theta in lines:
        for cluster in clusters:
            first_rho, first_theta = cluster[0]
            turn = (theta - first_theta + math.pi / 2) % math.pi - math.pi / 2
            same = rho if abs(theta - first_theta) < math.pi / 2 else -rho
            if abs(turn) < _CLUSTER_RAD and abs(same - first_rho) < near_px:
                cluster.append((same, first_theta + turn))
                break
        else:
            clusters.append([(rho, theta)])
    return [(sum(r for r, _ in c) / len(c), sum(t for _, t in c) / len(c)) for c in clusters]


def _ransac(points: NDArray[np.float64], near_px: float) -> Lines:
    """Lines through at least five points, the best first, each taking its points away."""
    rng = np.random.default_rng(0)
    lines: Lines = []
    while len(points) >= 5 and len(lines) < 6:
        best = np.zeros(len(points), bool)
        for _ in range(60):
            i, j = rng.choice(len(points), 2, replace=False)
            along = points[j] - points[i]
            across = np.abs((points - points[i]) @ np.array([-along[1], along[0]])) / math.hypot(*along)
            best = max(best, across < near_px, key=np.count_nonzero)
        if np.count_nonzero(best) < 5:
            break
        vx, vy, x, y = (float(v) for v in cv2.fitLine(points[best], cv2.DIST_L2, 0, 0.01, 0.01).ravel())
        theta = math.atan2(vx, -vy) % math.pi
        lines.append((x * math.cos(theta) + y * math.sin(theta), theta))
        points = points[~best]
    return lines
