"""A take-off to a high flying height that loses sight of the floor on its way: up no further, and down."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.types import FloorFeature, LineSet, Phase
from flightd.sim.plant.wind import WindParams
from flightd.sim.unknowns import Unknowns
from flightd.site.site_file import load_site
from tests.sim.ideal.floor_points import FloorPoints
from tests.sim.ideal.ideal_flight import FRAME_NS, Flown, IdealFlight
from tests.sim.ideal.ideal_sight import EyeView

CONFIGS = Path(__file__).parents[3] / "configs"
HIGH = load_config(CONFIGS / "sim.toml").with_values(mission={"height_m": 4.2})
SITE = load_site(CONFIGS / "site-demo.toml")
RISES_M = 0.9
"""So much higher it comes at most: what it climbs until it is found, or to see more."""
_ENOUGH_S = 20.0
"""By then it is down, or on its way."""


def fly(fault: str, from_m: float, lasts_s: float = math.inf) -> Flown:
    """A fault that begins at a height of the take-off."""
    flight = IdealFlight(SITE, HIGH, visits=("A2",))
    begun_ns: list[int] = []

    def watch(phase: Phase, now_ns: int) -> None:
        if not begun_ns and phase is Phase.TAKE_OFF and flight.airframe.height_m > from_m:
            begun_ns.append(now_ns)
        over = bool(begun_ns) and (now_ns - begun_ns[0]) * 1e-9 > lasts_s
        setattr(flight.faults, fault, bool(begun_ns) and not over)

    flight.on_tick = watch
    return flight.fly(_ENOUGH_S)


@pytest.mark.parametrize(
    ("fault", "from_m"), [("blank", 0.3), ("blank", 0.9), ("frozen", 0.9), ("bare", 0.9), ("bare", 2.5)]
)
def test_it_climbs_no_further_and_lands(fault: str, from_m: float) -> None:
    flown = fly(fault, from_m)
    truth = [k for _, k in flown.truth]
    assert flown.phase is Phase.ABORTED, flown.reason
    assert max(k.height_m for k in truth) < from_m + RISES_M
    assert truth[-1].height_m < 0.2
    assert max(math.hypot(k.x_m, k.y_m) for k in truth) < 1.0


@pytest.mark.parametrize(("fault", "from_m"), [("blank", 0.9), ("bare", 1.2)])
def test_a_moment_without_sight_is_tolerated(fault: str, from_m: float) -> None:
    flown = fly(fault, from_m, lasts_s=0.6)
    assert Phase.FOLLOW in {phase for phase, _ in flown.truth}, flown.reason


AIR = WindParams(mean_x_mps=1.0, mean_y_mps=-1.5, gust_rms_mps=0.1)
"""Pushes it aside by half a metre a second within a second."""


class Stuck:
    """Features that are none of the floor, always at the same place in the picture: dust on the lens."""

    def see(self, _: EyeView) -> tuple[FloorFeature, ...]:
        return tuple(FloorFeature(n, 10.0 * n - 30.0, 4.0 * n - 120.0) for n in range(6))


class Shadow:
    """The drone's own, of a lamp so far aside (tangents of its angle to the vertical), on the floor: it flies
    along, as does what is mirrored, right below."""

    def __init__(self, x: float, y: float) -> None:
        self._x, self._y = x, y

    def see(self, view: EyeView) -> tuple[FloorFeature, ...]:
        x_m, y_m, down_m = view.eye.tolist()
        x_m, y_m = x_m - self._x * down_m, y_m - self._y * down_m
        at = (view.pixel(x_m + 0.05 * n, y_m + 0.04 * (-1) ** n) for n in range(-3, 3))
        return tuple(FloorFeature(n, *pixel) for n, pixel in enumerate(at) if pixel is not None)


def blown(
    features: FloorPoints | Stuck | Shadow | None,
    seed: int,
    *,
    across: bool,
    unknowns: Unknowns | None = None,
) -> Flown:
    """Up, and down again where need be, by lines that run `across` the picture, or along it, alone."""
    config = load_config(CONFIGS / "sim.toml")
    flight = IdealFlight(SITE, config, visits=("A2",), wind=AIR, seed=seed, unknowns=unknowns)

    def half_blind(seen: LineSet, view: EyeView) -> LineSet:
        kept = tuple(line for line in seen.lines if (abs(math.cos(line.theta_rad)) < 0.5) is across)
        told = () if features is None else features.see(view)
        return replace(seen, lines=kept, junctions=(), pads=(), features=told)

    flight.detected_as = half_blind
    return flight.fly(_ENOUGH_S)


@pytest.mark.parametrize("across", [True, False])
@pytest.mark.parametrize("seed", [2, 3])
def test_a_take_off_brakes_by_features_that_move_as_the_one_line_does(seed: int, across: bool) -> None:
    by_line, by_both = (
        max(math.hypot(k.x_m, k.y_m) for _, k in blown(features, seed, across=across).truth)
        for features in (None, FloorPoints(seed))
    )
    assert by_both < 0.4 * by_line


@pytest.mark.parametrize("across", [True, False])
@pytest.mark.parametrize("shaken_deg", [0.0, 0.5])
@pytest.mark.parametrize(
    "lamp", [None, (0.0, 0.0), (0.3, 0.0), (-0.3, 0.0), (0.0, 0.4), (0.0, -0.4)], ids=str
)
def test_what_is_none_of_the_floor_tells_no_motion(
    lamp: tuple[float, float] | None, shaken_deg: float, across: bool
) -> None:
    shaken = Unknowns(shake_rad=math.radians(shaken_deg))
    flown = blown(Shadow(*lamp) if lamp else Stuck(), 1, across=across, unknowns=shaken)
    told = [output.tracks.features_ns for output in flown.outputs if output.tracks is not None]
    assert told
    frames = {max(one) for one in told} - {0}
    # the shadow of a drone that rises along the ray of its lamp lies still, until that drifts off it
    assert len(frames) * FRAME_NS < (500_000_000 if lamp else 1)
