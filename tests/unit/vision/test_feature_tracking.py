"""Points of the floor are followed where there is something to follow, and never told where there is not."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
import pytest

from flightd.core.geometry import Lens
from flightd.core.types import FloorFeature, Image
from flightd.vision.floor.feature_tracking import MOST_TOLD, FeatureTracker
from flightd.vision.lines.sampling import grid_for, sample
from flightd.vision.lines.undistortion import Plane

SIZE = 640, 360
PLANE = Plane(*SIZE)
FRAME_NS = 33_000_000


def concrete(seed: int = 1, contrast: float = 12.0) -> Image:
    """A floor larger than the picture: grain and stains, no line."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((600, 900)).astype(np.float32)
    soft = sum(cv2.GaussianBlur(noise, (0, 0), sigma) * sigma for sigma in (3.0, 8.0, 20.0))
    grey = np.clip(120.0 + contrast * soft / np.std(soft), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def view(floor: Image, x: float, y: float, turn_deg: float = 0.0, noise: int = 0) -> Image:
    """The picture of the floor about (450 + x, 300 + y)."""
    matrix = cv2.getRotationMatrix2D((450 + x, 300 + y), turn_deg, 1.0)
    matrix[:, 2] += np.array((SIZE[0] / 2 - 450 - x, SIZE[1] / 2 - 300 - y))
    seen = np.asarray(cv2.warpAffine(floor, matrix, SIZE, borderMode=cv2.BORDER_REFLECT), np.uint8)
    if noise:
        grain = np.random.default_rng(noise).normal(0.0, 2.0, seen.shape)
        seen = np.clip(seen + grain, 0, 255).astype(np.uint8)
    return seen


def find(
    tracker: FeatureTracker, picture: Image, seq: int, stamp_ns: int, plane: Plane
) -> tuple[FloorFeature, ...]:
    grid = grid_for(*SIZE)
    return tracker.find(sample(picture, grid), grid, seq, stamp_ns, plane)


def test_features_move_as_the_floor_does() -> None:
    tracker, floor = FeatureTracker(), concrete()
    first: dict[int, FloorFeature] = {}
    told = 0
    for n in range(25):
        x, y = 6.0 * n, 2.0 * n
        for seen in find(tracker, view(floor, x, y, noise=n + 1), n, n * FRAME_NS, PLANE):
            start = first.setdefault(seen.id, FloorFeature(seen.id, seen.x_px + x, seen.y_px + y))
            assert (seen.x_px + x, seen.y_px + y) == pytest.approx((start.x_px, start.y_px), abs=2.5)
            told += 1
    assert told > 20 * 4
    assert len(first) < told / 6  # each is followed for long


def test_a_turning_picture_is_followed() -> None:
    tracker, floor = FeatureTracker(), concrete(2)
    told = [find(tracker, view(floor, 0, 0, turn_deg=1.5 * n), n, n * FRAME_NS, PLANE) for n in range(15)]
    assert all(len(seen) >= 4 for seen in told[2:])
    ids = [{feature.id for feature in seen} for seen in told]
    assert all(before & after for before, after in pairwise(ids[2:]))


def test_a_floor_without_anything_tells_nothing() -> None:
    tracker, plain = FeatureTracker(), np.full((600, 900, 3), 120, np.uint8)
    for n in range(8):
        assert find(tracker, view(plain, 3.0 * n, 0.0, noise=n + 1), n, n * FRAME_NS, PLANE) == ()


def test_after_a_gap_and_in_a_first_frame_nothing_is_followed() -> None:
    tracker, floor = FeatureTracker(), concrete()
    assert find(tracker, view(floor, 0, 0), 0, 0, PLANE) == ()
    before = find(tracker, view(floor, 2, 0), 1, FRAME_NS, PLANE)
    assert before
    assert find(tracker, view(floor, 4, 0), 2, FRAME_NS + 400_000_000, PLANE) == ()
    after = find(tracker, view(floor, 6, 0), 3, 2 * FRAME_NS + 400_000_000, PLANE)
    assert not {seen.id for seen in before} & {seen.id for seen in after}


def test_what_moves_otherwise_than_most_is_not_told() -> None:
    """A lamp's mirror image stays behind while the floor goes on."""
    tracker, floor = FeatureTracker(), concrete(4)
    spot = concrete(9, 40.0)[:60, :60]
    for n in range(12):
        picture = view(floor, 6.0 * n, 0.0)
        picture[40:100, 80:140] = spot
        for seen in find(tracker, picture, n, n * FRAME_NS, PLANE):
            column, row = seen.x_px + SIZE[0] / 2, seen.y_px + SIZE[1] / 2
            assert not (90 < column < 130 and 50 < row < 90)


def test_features_are_those_of_a_camera_without_distortion() -> None:
    lens = Lens(640, 360, 381.4, 381.4, 319.5, 179.5, (-0.2, 0.0, 0.0, 0.0, 0.0))
    floor = concrete()
    seen: list[tuple[FloorFeature, ...]] = []
    for plane in (PLANE, Plane(*SIZE, lens)):
        tracker = FeatureTracker()
        find(tracker, view(floor, 0, 0), 0, 0, plane)
        seen.append(find(tracker, view(floor, 2, 0), 1, FRAME_NS, plane))
    raw, ideal = seen
    assert 0 < len(raw) <= MOST_TOLD
    for distorted, straight in zip(raw, ideal, strict=True):
        # barrel distortion pulls points towards the middle
        assert np.hypot(straight.x_px, straight.y_px) > np.hypot(distorted.x_px, distorted.y_px)


def slide(floor: Image, spoil: Callable[[Image], Image], frames: int = 25) -> float:
    """How much of a flight across the floor the features go along with, the median of all told."""
    tracker, at = FeatureTracker(), dict[int, tuple[int, float]]()
    shares = []
    for n in range(frames):
        for seen in find(tracker, spoil(view(floor, 0.0, 4.0 * n, noise=n + 1)), n, n * FRAME_NS, PLANE):
            begun, y_px = at.setdefault(seen.id, (n, seen.y_px))
            if n - begun >= 5:
                shares.append(abs(1.0 + (seen.y_px - y_px) / (4.0 * (n - begun))))
    assert len(shares) > 4 * frames / 2
    return float(np.quantile(shares, 0.9))


def test_lamps_mirrored_in_the_floor_pull_nothing_along() -> None:
    light = np.zeros(SIZE[::-1], np.float32)
    for x in (120, 260, 400, 540):
        cv2.circle(light, (x, 180), 30, 60.0, -1)
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), 18.0))[..., None]
    assert slide(concrete(4), lambda seen: np.clip(seen + light, 0, 255).astype(np.uint8)) < 0.05


def test_along_a_tyre_mark_no_point_is_followed() -> None:
    """Its edges show no motion along it."""
    floor = concrete(5, contrast=3.0)
    for x in range(150, 760, 60):
        floor[:, x : x + 14] -= 45
    assert slide(floor, lambda seen: seen) < 0.05
