"""Lines drawn with exact truth come back, by every method; what is no line does not."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.types import UNCHECKED, JunctionKind, LineSet
from flightd.vision.line_detector import METHODS, Detector
from tests.unit.vision.drawing import Band, coverage, draw, errors, grid, nearest, picture

RHO_PX = {"naive": 4.0, "centroid": 1.2, "skeleton": 1.2, "combined": 0.1}
THETA_DEG = {"naive": 1.5, "centroid": 0.25, "skeleton": 0.25, "combined": 0.05}


def assert_found(seen: LineSet, bands: list[Band], rho_px: float = 0.2, theta_deg: float = 0.1) -> None:
    """Every band is there, and nothing else is."""
    for band in bands:
        _, rho, theta = nearest(seen, band)
        assert abs(rho) < rho_px, f"{band}: rho off by {rho}"
        assert abs(math.degrees(theta)) < theta_deg, f"{band}: theta off by {math.degrees(theta)} deg"
    assert len(seen.lines) == len(bands)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("theta_deg", [0.0, 17.0, 45.0, 90.0, 133.0, 178.0])
def test_a_single_line_is_found_at_any_angle(method: str, theta_deg: float) -> None:
    band = Band(31.0, math.radians(theta_deg), 24.0)
    seen = Detector(method).detect(draw([band]))
    assert seen.method == method
    _, rho, theta = nearest(seen, band)
    assert abs(rho) < RHO_PX[method]
    assert abs(math.degrees(theta)) < THETA_DEG[method]
    assert len(seen.lines) == 1 or method == "naive"


@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined"])
@pytest.mark.parametrize(
    ("size", "thickness"), [((1920, 1080), 6.0), ((1920, 1080), 200.0), ((640, 360), 6.0)]
)
def test_thin_and_thick_lines_are_found(method: str, size: tuple[int, int], thickness: float) -> None:
    band = Band(-43.7, 1.15, thickness)
    seen = Detector(method).detect(draw([band], *size))
    assert_found(seen, [band], 4 * RHO_PX[method], 4 * THETA_DEG[method])


@settings(max_examples=25, deadline=None)
@given(
    rho=st.floats(-90, 90),
    theta=st.floats(0, math.pi, exclude_max=True),
    thickness=st.floats(7, 50),
    seed=st.integers(0, 1000),
)
def test_a_line_anywhere_is_found_to_a_fraction_of_a_pixel(
    rho: float, theta: float, thickness: float, seed: int
) -> None:
    band = Band(rho, theta, thickness)
    seen = Detector().detect(draw([band], seed=seed))
    assert_found(seen, [band], 0.15, 0.08)
    assert seen.lines[0].width_px == pytest.approx(thickness, abs=0.5)


@settings(max_examples=10, deadline=None)
@given(rho=st.floats(-60, 60), theta=st.floats(0.1, math.pi / 2 - 0.1), seed=st.integers(0, 99))
def test_turning_the_picture_a_quarter_turns_the_lines(rho: float, theta: float, seed: int) -> None:
    image = draw([Band(rho, theta, 20.0)], 400, 400, seed)
    detector = Detector()
    upright = detector.detect(image).lines[0]
    turned = detector.detect(np.ascontiguousarray(np.rot90(image, -1))).lines[0]
    off_rho, off_theta = errors(turned, Band(upright.rho_px, upright.theta_rad + math.pi / 2, 20.0))
    assert abs(off_rho) < 0.1
    assert abs(off_theta) < math.radians(0.08)


def test_one_frame_has_one_answer() -> None:
    image = draw([Band(10.0, 0.3, 18.0), Band(-20.0, 1.9, 18.0)])
    assert Detector().detect(image) == Detector().detect(image)


@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined"])
def test_parallel_lines_are_told_apart(method: str) -> None:
    bands = [Band(rho, 0.4, 12.0) for rho in (-95.0, -60.0, 5.0, 70.0)]
    assert_found(Detector(method).detect(draw(bands)), bands, RHO_PX[method], THETA_DEG[method])


@pytest.mark.parametrize("gap_px", [3, 5])
def test_a_line_along_the_border_is_found_with_both_its_edges(gap_px: int) -> None:
    band = Band(180.0 - gap_px - 13.0, math.pi / 2, 26.0, -200.0, 150.0)
    assert_found(Detector().detect(draw([band])), [band])


@pytest.mark.parametrize("theta_deg", [0.0, 30.0, 45.0])
def test_crossing_lines_are_both_found_with_their_crossing(theta_deg: float) -> None:
    theta = math.radians(theta_deg)
    bands = [Band(20.0, theta, 26.0), Band(-35.0, theta + math.pi / 2, 18.0)]
    seen = Detector().detect(draw(bands))
    assert_found(seen, bands)
    (crossing,) = seen.junctions
    assert crossing.kind is JunctionKind.CROSS
    c, s = math.cos(theta), math.sin(theta)
    assert crossing.x_px == pytest.approx(20 * c + 35 * s, abs=0.3)
    assert crossing.y_px == pytest.approx(20 * s - 35 * c, abs=0.3)
    assert len(crossing.arms_rad) == 4


@pytest.mark.parametrize(
    ("bands", "kind", "arms_deg"),
    [
        ([Band(0, 0, 20), Band(0, math.pi / 2, 20, end=0)], JunctionKind.TEE, [-90, 0, 90]),
        ([Band(0, 0, 20, start=-10), Band(0, math.pi / 2, 20, end=10)], JunctionKind.CORNER, [0, 90]),
        ([Band(0, 0, 20, start=0)], JunctionKind.END, [90]),
    ],
)
def test_tees_corners_and_ends_are_told_by_their_arms(
    bands: list[Band], kind: JunctionKind, arms_deg: list[float]
) -> None:
    seen = Detector().detect(draw(bands))
    (junction,) = seen.junctions
    assert junction.kind is kind
    assert math.hypot(junction.x_px, junction.y_px) < 8
    assert sorted(math.degrees(a) for a in junction.arms_rad) == pytest.approx(arms_deg, abs=1)


@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined"])
def test_an_occluder_does_not_move_or_split_a_line(method: str) -> None:
    band = Band(-12.0, 1.2, 28.0)
    image = draw([band])
    cv2.circle(image, (330, 172), 34, (70, 74, 70), -1)
    assert_found(Detector(method).detect(image), [band], 2 * RHO_PX[method], 2 * THETA_DEG[method])


def test_worn_paint_is_still_one_line() -> None:
    band = Band(25.0, 0.7, 40.0)
    x, y = grid(640, 360)
    rng = np.random.default_rng(5)
    grain = cv2.GaussianBlur(rng.normal(size=(360, 640)), (0, 0), 3.0)
    paint = coverage([band], x, y) * (grain > np.quantile(grain, 0.25))
    seen = Detector().detect(picture(paint))
    assert_found(seen, [band], 0.6, 0.3)


@pytest.mark.parametrize("light", [0.4, 0.7, 1.3])
def test_the_light_does_not_matter(light: float) -> None:
    band = Band(25.0, 0.7, 30.0)
    seen = Detector().detect(picture(coverage([band], *grid(640, 360)), light=light))
    assert_found(seen, [band])


def test_with_the_lens_known_lines_come_out_straight_and_in_place() -> None:
    lens = Lens(640, 360, 420.0, 420.0, 322.0, 178.0, (-0.22, 0.06, 0.001, -0.001, 0.0))
    bands = [Band(95.0, 0.25, 22.0), Band(-60.0, 1.75, 22.0)]
    image = draw(bands, lens=lens)
    seen = Detector(lens=lens).detect(image)
    assert_found(seen, bands, 0.3, 0.15)
    (crossing,) = seen.junctions
    assert crossing.kind is JunctionKind.CROSS


def test_a_lens_nobody_calibrated_costs_accuracy_but_no_line() -> None:
    lens = Lens(1920, 1080, 1260.0, 1260.0, 959.5, 539.5, (-0.15, 0.0, 0.0, 0.0, 0.0))
    band = Band(300.0, 1.5, 50.0)
    line, rho, theta = nearest(Detector().detect(draw([band], 1920, 1080, lens=lens)), band)
    assert abs(rho) < 30
    assert abs(rho) < 4 * line.sigma_rho_px
    assert abs(math.degrees(theta)) < 1


def test_a_short_wide_line_bent_by_such_a_lens_is_no_curve() -> None:
    lens = Lens(640, 480, 420.0, 420.0, 319.5, 239.5, (-0.3, 0.0, 0.0, 0.0, 0.0))
    band = Band(180.0, 0.9, 50.0, -80.0, 80.0)
    _, rho, theta = nearest(Detector().detect(draw([band], 640, 480, lens=lens)), band)
    assert abs(rho) < 15
    assert abs(math.degrees(theta)) < 1


@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined"])
@pytest.mark.parametrize("radius", [110.0, 220.0])
def test_a_curve_is_not_a_straight_line(method: str, radius: float) -> None:
    x, y = grid(640, 360)
    ring = np.clip(12.0 - np.abs(np.hypot(x, y - radius + 40) - radius) + 0.5, 0, 1)
    assert Detector(method).detect(picture(ring)).lines == ()


@pytest.mark.parametrize("sagitta_px", [12.0, 20.0, 60.0])
def test_a_gentle_curve_is_not_a_straight_line(sagitta_px: float) -> None:
    radius = (320.0**2 + sagitta_px**2) / (2 * sagitta_px)
    x, y = grid(640, 360)
    ring = np.clip(9.0 - np.abs(np.hypot(x, y - radius + sagitta_px / 2) - radius) + 0.5, 0, 1)
    assert Detector().detect(picture(ring)).lines == ()


def test_a_side_of_a_rounded_square_is_a_line() -> None:
    sides = [Band(0.0 + side, 0.0, 14.0, -75.0, 75.0) for side in (-110.0, 110.0)]
    x, y = grid(640, 360)
    corner = np.hypot(np.maximum(np.abs(x) - 75, 0), np.maximum(np.abs(y) - 75, 0))
    square = np.clip(7.0 - np.abs(corner - 35) + 0.5, 0, 1)
    seen = Detector().detect(picture(square))
    for side in sides:
        _, rho, theta = nearest(seen, side)
        assert abs(rho) < 1.0
        assert abs(math.degrees(theta)) < 1.0


def test_dark_and_dull_paint_is_found() -> None:
    """A quarter of the light leaves eight grey levels between floor and paint."""
    band = Band(40.0, 1.0, 24.0)
    dull = 0.4 * coverage([band], *grid(640, 360))
    seen = Detector().detect(picture(dull, light=0.25, noise=0.7))
    assert_found(seen, [band], 0.3, 0.15)


@pytest.mark.parametrize("method", METHODS)
def test_a_bare_floor_has_no_line(method: str) -> None:
    seen = Detector(method).detect(draw([]))
    assert seen.lines == ()
    assert seen.junctions == ()


def test_blobs_of_paint_are_no_lines() -> None:
    image = draw([])
    for x, y, r in ((100, 90, 30), (210, 110, 22), (330, 130, 36), (480, 140, 26), (560, 300, 40)):
        cv2.circle(image, (x, y), r, (35, 190, 230), -1)
    cv2.rectangle(image, (60, 220), (150, 300), (35, 190, 230), -1)
    assert Detector().detect(image).lines == ()


def test_the_uncertainty_is_the_error_s() -> None:
    rng = np.random.default_rng(11)
    rhos, thetas = [], []
    for seed in range(40):
        band = Band(rng.uniform(-80, 80), rng.uniform(0, math.pi), rng.uniform(8, 40))
        line, rho, theta = nearest(Detector().detect(draw([band], seed=seed)), band)
        rhos.append(rho / line.sigma_rho_px)
        thetas.append(theta / line.sigma_theta_rad)
    for normalised in (rhos, thetas):
        assert 0.6 < float(np.sqrt(np.mean(np.square(normalised)))) < 1.8


def test_of_a_short_end_rho_and_theta_are_known_together_only() -> None:
    # Seen far from the centre only: the line there is sure, its rho at the centre is not.
    band = Band(10.0, 0.2, 20.0, start=60.0)
    line, _, _ = nearest(Detector().detect(draw([band])), band)
    t = (line.start_px + line.end_px) / 2
    # Across the line, t along it from the foot of its normal, it is off by d rho - t d theta.
    there = line.sigma_rho_px**2 - 2 * t * line.rho_theta_cov + (t * line.sigma_theta_rad) ** 2
    assert math.sqrt(there) < 0.5 * line.sigma_rho_px


@pytest.mark.parametrize("size", [(16, 16), (33, 57), (641, 359), (360, 640), (3000, 40)])
def test_any_size_is_looked_at(size: tuple[int, int]) -> None:
    image = draw([Band(0.0, 0.0, min(size) / 6)], *size)
    seen = Detector().detect(image)
    assert (seen.width_px, seen.height_px) == size


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    grain=st.sampled_from([0.0, 1.0, 3.0, 8.0]),
    share=st.floats(0.02, 0.98),
    method=st.sampled_from(METHODS),
    size=st.sampled_from([(640, 360), (160, 120), (64, 64), (321, 243)]),
)
def test_paint_strewn_at_random_is_no_trouble(
    seed: int, grain: float, share: float, method: str, size: tuple[int, int]
) -> None:
    noise = np.random.default_rng(seed).normal(size=(size[1], size[0]))
    if grain:
        noise = np.asarray(cv2.GaussianBlur(noise, (0, 0), grain))
    seen = Detector(method).detect(picture((noise < np.quantile(noise, share)).astype(float), seed))
    assert all(math.isfinite(line.rho_px) and line.sigma_rho_px > 0 for line in seen.lines)


@pytest.mark.parametrize("value", [0, 255])
@pytest.mark.parametrize("method", METHODS)
def test_black_and_white_pictures_have_no_line(method: str, value: int) -> None:
    assert Detector(method).detect(np.full((360, 640, 3), value, np.uint8)).lines == ()


def test_a_picture_that_is_a_view_into_another_is_looked_at_in_place() -> None:
    band = Band(20.0, 0.5, 24.0)
    image = draw([band])
    framed = np.zeros((400, 700, 3), np.uint8)
    view = framed[20:380, 30:670]
    view[:] = image
    assert Detector().detect(view) == Detector().detect(image)


@pytest.mark.parametrize("shape", [(360, 640), (360, 640, 4), (0, 0, 3), (4, 640, 3)])
def test_pictures_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError):
        Detector().detect(np.zeros(shape, np.uint8))


def test_sixteen_bit_pictures_are_refused() -> None:
    with pytest.raises(InputError, match="uint16"):
        Detector().detect(np.zeros((360, 640, 3), np.uint16))


def test_an_unknown_method_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="centroid, skeleton, combined, naive"):
        Detector("hough")


def test_pads_and_exposure_are_only_looked_at_in_flight() -> None:
    image = draw([Band(0.0, 0.5, 20.0)])
    seen, flown = Detector().detect(image), Detector(in_flight=True).detect(image)
    assert seen.picture is UNCHECKED
    assert flown.picture is not UNCHECKED
    assert seen.lines == flown.lines


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("focal_px", [300.0, 400.0])
def test_a_lens_model_that_folds_ends_nothing(method: str, focal_px: float) -> None:
    lens = Lens(640, 360, focal_px, focal_px, 320.0, 180.0, (-0.44, 0.25, 0.0, 0.0, -0.09))
    for seed in range(4):
        bands = [Band(250.0 - 60 * seed, 0.3 * seed, 20.0), Band(-100.0, 1.4, 12.0), Band(150.0, 1.6, 9.0)]
        seen = Detector(method, lens=lens).detect(draw(bands, seed=seed))
        assert (seen.width_px, seen.height_px) == (640, 360)
        assert all(math.isfinite(value) for line in seen.lines for value in (line.rho_px, line.sigma_rho_px))


def test_the_stages_are_timed_when_a_clock_is_given() -> None:
    ticks = iter(range(0, 10_000_000, 1_000_000))
    detector = Detector(in_flight=True, now_ns=lambda: next(ticks))
    seen = detector.detect(draw([Band(0.0, 0.5, 20.0)]))
    stages = ("colour", "guess", "refine", "junctions", "pads", "features")
    assert seen.timings_ms == dict.fromkeys(stages, 1.0)


def test_frames_looked_at_ahead_are_told_as_those_that_are_detected_in_turn() -> None:
    """What is followed from frame to frame goes by the order in which they are told."""
    rng = np.random.default_rng(3)
    floor = cv2.GaussianBlur(rng.integers(40, 200, (420, 760, 3), dtype=np.uint8), (0, 0), 3.0)
    frames = [np.array(floor[4 * n : 4 * n + 360, 6 * n : 6 * n + 640], np.uint8) for n in range(3)]
    stamps_ns = [(n + 1) * 33_000_000 for n in range(3)]
    in_turn, ahead = Detector(in_flight=True), Detector(in_flight=True)
    detected = [in_turn.detect(frame, n, stamps_ns[n]) for n, frame in enumerate(frames)]
    looks = [ahead.look(frame) for frame in frames]
    assert [ahead.told(look, n, stamps_ns[n]) for n, look in enumerate(looks)] == detected
    assert detected[-1].features
