"""How fast a shelf is flown past: every limit holds, and the lowest is named."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.schema import Config
from flightd.mission.scan.sweep_speed import Limit, Shelf, StopCause, SweepOptics, sweep_speed
from flightd.site.coverage import MAX_BLUR_MODULES, MIN_PX_PER_MODULE, FrontView
from tests.unit.mission.configured import configured

SHELF = Shelf(distance_m=1.2, place_m=0.65)


def of(**sections: Any) -> SweepOptics:
    return SweepOptics.of(Config.model_validate(configured().model_dump() | sections))


@st.composite
def optics(draw: st.DrawFn) -> SweepOptics:
    view = FrontView(
        fov_rad=math.radians(draw(st.floats(20.0, 110.0))),
        width_px=draw(st.integers(320, 4000)),
        exposure_s=draw(st.floats(1e-4, 0.02)),
        module_m=draw(st.floats(3e-4, 0.01)),
    )
    return SweepOptics(
        view,
        least_exposure=draw(st.floats(0.05, 1.0)),
        fps=draw(st.floats(0.5, 60.0)),
        label_m=draw(st.floats(0.02, 0.3)),
        views=draw(st.integers(2, 8)),
        cruise_mps=draw(st.floats(0.1, 3.0)),
        configured_mps=draw(st.none() | st.floats(0.1, 3.0)),
    )


@settings(max_examples=60)
@given(optics(), st.floats(0.5, 4.0), st.floats(0.2, 1.5))
def test_no_limit_is_broken_and_the_lowest_is_told(
    optics: SweepOptics, distance_m: float, place_m: float
) -> None:
    speed = sweep_speed(Shelf(distance_m, place_m), optics)
    limits = dict(speed.limits_mps)
    assert speed.speed_mps == limits[speed.limit] == min(limits.values())
    assert speed.blur_modules <= MAX_BLUR_MODULES + 1e-9
    assert optics.least_exposure - 1e-9 <= speed.exposure <= 1.0
    assert all(math.isfinite(value) for value in (speed.views, speed.needed_fps, speed.blur_modules))
    if speed.stops_for is None:
        assert speed.px_per_module >= MIN_PX_PER_MODULE - 1e-3
        assert speed.views >= optics.views - 1e-6
        assert speed.needed_fps <= optics.fps + 1e-6


@settings(max_examples=40)
@given(optics(), st.floats(0.5, 4.0))
def test_more_light_more_frames_or_larger_labels_never_slow_it_down(
    optics: SweepOptics, distance_m: float
) -> None:
    shelf = Shelf(distance_m, 0.5)
    before = sweep_speed(shelf, optics).speed_mps
    view = optics.view
    shorter = FrontView(view.fov_rad, view.width_px, view.exposure_s / 2, view.module_m)
    larger = FrontView(view.fov_rad, view.width_px, view.exposure_s, 2 * view.module_m)
    for better in (
        SweepOptics(shorter, *fields(optics)),
        SweepOptics(larger, *fields(optics)),
        SweepOptics(view, optics.least_exposure, 2 * optics.fps, *fields(optics)[2:]),
    ):
        assert sweep_speed(shelf, better).speed_mps >= before - 1e-9


def fields(optics: SweepOptics) -> tuple[float, float, float, int, float, float | None]:
    o = optics
    return o.least_exposure, o.fps, o.label_m, o.views, o.cruise_mps, o.configured_mps


def test_the_shipped_camera_is_limited_by_the_cruise_speed() -> None:
    speed = sweep_speed(SHELF, of())
    assert (speed.limit, speed.speed_mps, speed.exposure) == (Limit.CRUISE, 0.8, 1.0)
    assert speed.stops_for is None


@pytest.mark.parametrize(
    ("sections", "limit"),
    [
        ({"front_camera": {"exposure_s": 0.004}}, Limit.BLUR),
        ({"front_camera": {"fps": 2.0}}, Limit.OVERLAP),
        ({"scan": {"sweep": {"read_s": 0.6}}}, Limit.OVERLAP),
        ({"scan": {"sweep": {"speed_mps": 0.3}}}, Limit.CONFIGURED),
    ],
)
def test_each_limit_is_named_where_it_is_the_lowest(
    sections: dict[str, dict[str, object]], limit: Limit
) -> None:
    speed = sweep_speed(SHELF, of(**sections))
    assert speed.limit is limit
    assert speed.speed_mps < 0.8


def test_a_shorter_exposure_is_taken_only_as_far_as_the_speed_asks_for() -> None:
    slow = {"exposure_s": 0.004}
    dark = sweep_speed(SHELF, of(front_camera=slow))
    lit = sweep_speed(SHELF, of(front_camera=slow, scan={"sweep": {"least_exposure": 0.3}}))
    assert dark.speed_mps == pytest.approx(0.5625)
    assert lit.speed_mps == pytest.approx(0.8)
    assert lit.exposure == pytest.approx(0.5625 / 0.8)


def test_labels_too_small_in_the_picture_are_not_flown_past() -> None:
    assert sweep_speed(Shelf(1.5, 0.65), of()).stops_for is StopCause.LABELS


def test_places_that_are_wider_than_the_picture_are_not_flown_past() -> None:
    speed = sweep_speed(Shelf(1.2, 3.0), of())
    assert (speed.stops_for, speed.speed_mps, speed.needed_fps) == (StopCause.WIDTH, 0.0, 0.0)


def test_a_place_that_could_only_be_crawled_past_is_stopped_before() -> None:
    """Two centimetres of way on which it is wholly in the picture."""
    wide_m = next(m / 100 for m in range(300, 0, -1) if sweep_speed(Shelf(1.2, m / 100), of()).window_m > 0.0)
    crawl = sweep_speed(Shelf(1.2, wide_m), of())
    assert (crawl.limit, crawl.stops_for) == (Limit.OVERLAP, StopCause.WIDTH)
    assert sweep_speed(Shelf(1.2, wide_m - 0.3), of()).stops_for is None
