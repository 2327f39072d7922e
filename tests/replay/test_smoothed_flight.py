"""The smoothed track against the truth: never worse than what was believed live, better where it matters."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from flightd.config.schema import load_config
from flightd.core.types import GridPose
from flightd.replay.report.figures import key_figures
from flightd.replay.report.flight import Track
from flightd.replay.report.loader import load_flight
from flightd.replay.report.page import render
from flightd.replay.smoothed_flight import backward, smooth
from flightd.site.site_file import load_site
from tests.replay.synthetic_flight import write_flight
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[2] / "configs"
TICK_NS = 20_000_000


def pose(tick: int, x_m: float, sigma_m: float = 0.01, vx_mps: float = 0.5) -> GridPose:
    spread = (sigma_m**2, 0.0, 0.0, 0.0, sigma_m**2, 0.0, 0.0, 0.0, 1e-4)
    return GridPose(tick * TICK_NS, "A1", 0.0, 0.0, 0.0, x_m, 0.0, vx_mps, 0.0, 1.5, spread, 1.0)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_of_a_recorded_flight_it_is_nearer_to_the_truth_than_the_live_pose(tmp_path: Path) -> None:
    flight = load_flight(write_flight(tmp_path))
    truth = flight.truth
    assert truth is not None

    def error_m(track: Track) -> float:
        x, y = truth.at(track.t_s)
        return rms(np.hypot(track.x_m - x, track.y_m - y)[flight.flying(track.t_s)])

    assert error_m(flight.smoothed) < 0.85 * error_m(flight.estimate)


def test_of_a_flight_by_simulated_sight_it_is_no_farther_from_the_truth() -> None:
    site = load_site(CONFIGS / "site-demo.toml")
    config = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
    flown = IdealFlight(site, config, visits=("A2", "A3")).fly()
    poses = [output.pose for output in flown.outputs if output.pose is not None]
    smoothed = smooth(poses)
    true_ns = np.array([at.stamp_ns for _, at in flown.truth])
    x, y = (
        np.interp(smoothed.stamp_ns, true_ns, of)
        for of in ([at.x_m for _, at in flown.truth], [at.y_m for _, at in flown.truth])
    )
    live = {one.stamp_ns: one for one in poses}
    live_x, live_y = np.array([(live[at].x_m, live[at].y_m) for at in smoothed.stamp_ns.tolist()]).T
    live_m, smoothed_m = (
        rms(np.hypot(live_x - x, live_y - y)),
        rms(np.hypot(smoothed.x_m - x, smoothed.y_m - y)),
    )
    assert smoothed_m <= 1.05 * live_m, (smoothed_m, live_m)  # millimetres both: little is left to smooth


def test_a_line_found_again_mends_the_way_there() -> None:
    """Blind for four seconds, the velocity wrong by 5 cm/s: the next line corrects it at once."""
    ticks = np.arange(400)
    true_m = ticks * 0.01
    blind = (ticks > 100) & (ticks <= 300)
    live_m = true_m + np.where(blind, (ticks - 100) * 0.001, 0.0)
    sigma_m = np.where(blind, 0.01 + (ticks - 100) * 0.0008, 0.01)
    poses = [
        pose(int(tick), float(x), float(sigma)) for tick, x, sigma in zip(ticks, live_m, sigma_m, strict=True)
    ]
    smoothed = smooth(poses)
    assert rms((smoothed.x_m - true_m)[blind]) < 0.75 * rms((live_m - true_m)[blind])
    assert np.all(smoothed.sigma_x_m <= sigma_m + 1e-9)
    assert smoothed.sigma_x_m[290] < 0.5 * sigma_m[290]
    assert np.abs(smoothed.x_m - true_m)[~blind].max() < 0.02


def test_another_place_believed_in_is_no_motion() -> None:
    before, after = (
        [pose(n, 0.01 * n) for n in range(100)],
        [pose(n, 2.0 + 0.01 * n) for n in range(100, 200)],
    )
    smoothed = smooth(before + after)
    assert smoothed.x_m == pytest.approx([one.x_m for one in before + after], abs=1e-6)


def test_what_comes_after_a_pause_says_nothing_of_before() -> None:
    first = [pose(n, 0.2 if n > 50 else 0.0, vx_mps=0.0) for n in range(100)]
    alone = smooth(first)
    with_more = smooth(first + [pose(n, 0.3, vx_mps=0.0) for n in range(1000, 1100)])
    assert with_more.x_m[:100] == pytest.approx(alone.x_m)


def test_poses_that_are_no_numbers_or_repeat_are_left_out() -> None:
    odd = dataclasses.replace(pose(3, 0.0), x_m=math.nan)
    smoothed = smooth([pose(1, 0.0), pose(2, 0.01), pose(2, 0.02), odd, pose(4, 0.03)])
    assert smoothed.stamp_ns.tolist() == [TICK_NS, 2 * TICK_NS, 4 * TICK_NS]
    assert np.isfinite(smoothed.x_m).all()
    for wild in ({"x_m": 1e308}, {"covariance": (-1.0, *pose(3, 0.0).covariance[1:])}):
        odd = dataclasses.replace(pose(3, 0.0), **wild)
        assert len(smooth([pose(1, 0.0), odd, pose(4, 0.03)]).x_m) == 2, wild
    assert len(smooth([]).x_m) == 0
    assert smooth([pose(1, 0.5)]).x_m.tolist() == [0.5]


def test_a_long_flight_is_thinned() -> None:
    assert len(smooth([pose(n, 0.01 * n) for n in range(20_001)]).x_m) == 10_001


def test_the_report_shows_it_and_says_how_far_the_live_pose_was_off(tmp_path: Path) -> None:
    log = write_flight(tmp_path)
    figures = {figure.label: figure for figure in key_figures(load_flight(log))}
    assert 0.3 < float(figures["Live pose"].value) < 1.5
    assert "smoothed" in figures["Position error"].note
    page = render(load_flight(log))
    assert 'class="flown smoothed"' in page
    assert 'class="curve smoothed"' in page


def test_it_is_step_for_step_the_smoother_of_the_library() -> None:
    from filterpy.kalman import rts_smoother

    rng = np.random.default_rng(4)
    steps_s, variances = rng.uniform(0.01, 0.3, 59), rng.uniform(1e-5, 4e-3, 60)
    places = np.column_stack([np.cumsum(rng.normal(0.01, 0.02, 60)), rng.normal(0.5, 0.1, 60)])
    found, left = backward(steps_s.tolist(), places.tolist(), variances.tolist())
    spreads = np.array([np.diag([p, 0.015**2]) for p in variances])
    dts_s = [*steps_s, 0.0]
    motions = [np.array([[1.0, dt_s], [0.0, 1.0]]) for dt_s in dts_s]
    noises = [np.diag([0.03**2 * dt_s, 0.3**2 * dt_s]) for dt_s in dts_s]
    states, spreads, *_ = rts_smoother(places[:, :, None], spreads, motions, noises)
    assert np.array(found) == pytest.approx(states[:, :, 0], rel=1e-9)
    assert np.array(left) == pytest.approx(spreads[:, 0, 0], rel=1e-9)
