"""Brightness of pictures, and lamps that beat with the mains: seen where they are, and nowhere else."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightd.core.exposure import beat_passed, motion_blur_px
from flightd.sim.appearance import HARSH
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.site.site_file import load_site
from flightd.vision.floor.brightness import STRIPS, Brightness, brightness_of
from flightd.vision.floor.light_flicker import FEWEST_PICTURES, Flicker, flicker_of, is_hidden

SITE = Path(__file__).parents[3] / "configs" / "site-demo.toml"
Levels = NDArray[np.float64]
SERIES = 1000


def series(levels: Levels) -> list[Brightness]:
    return [Brightness(100.0, 0.0, 0.0, tuple(row)) for row in np.clip(levels, 0.0, 255.0)]


def still(rng: np.random.Generator, count: int) -> Levels:
    """Strips of a scene that does not change, with the noise of a dark sensor."""
    noise = rng.normal(1.0, rng.uniform(0.0, 0.01), (count, STRIPS))
    levels: Levels = rng.uniform(20.0, 200.0, STRIPS) * noise
    return levels


def beating(rng: np.random.Generator, share: float, rate_hz: float, read_s: float, mains_hz: int) -> Levels:
    """Under lamps; the rows are read over `read_s`."""
    at_s = np.arange(24)[:, None] / rate_hz + np.linspace(0.0, read_s, STRIPS)
    beat = np.cos(math.tau * 2 * mains_hz * at_s + rng.uniform(0.0, math.tau))
    levels: Levels = still(rng, 24) * (1.0 + share * beat)
    return levels


def drifting(rng: np.random.Generator, count: int) -> Levels:
    """The camera's automatic looks for its exposure."""
    swing = rng.uniform(0.0, 0.3) * np.sin(math.tau * rng.uniform(0.0, 0.06) * np.arange(count))
    levels: Levels = 1.0 + swing[:, None] * np.ones(STRIPS)
    return levels


def passing(rng: np.random.Generator, count: int) -> Levels:
    """People and shadows go through the picture."""
    found = np.ones((count, STRIPS))
    for _ in range(rng.integers(1, 5)):
        at = rng.uniform(0, STRIPS) + rng.uniform(-1, 1) * np.arange(count)
        near = (np.arange(STRIPS) - at[:, None]) / rng.uniform(0.5, 2.0)
        found *= 1.0 + rng.uniform(-0.6, 0.6) * np.exp(-(near**2))
    return found


def shaking(rng: np.random.Generator, count: int) -> Levels:
    """A camera that shakes: edges in some strips come and go."""
    much = rng.uniform(0.0, 0.3, STRIPS) * (rng.random(STRIPS) < 0.6) * rng.choice([-1, 1], STRIPS)
    shake = np.sin(math.tau * rng.uniform(0.1, 0.5) * np.arange(count) + rng.uniform(0, 6))
    levels: Levels = 1.0 + much * shake[:, None]
    return levels


def switching(rng: np.random.Generator, count: int) -> Levels:
    """Somebody turns two lamps on or off."""
    found = np.ones((count, STRIPS))
    for _ in range(2):
        found[rng.integers(0, count) :] *= rng.uniform(0.5, 1.5)
    return found


@pytest.mark.parametrize("change", [drifting, passing, shaking, switching])
def test_what_is_no_flicker_is_taken_for_it_less_than_once_in_a_thousand(
    change: Callable[[np.random.Generator, int], Levels],
) -> None:
    rng = np.random.default_rng(20)
    for _ in range(SERIES):
        count = int(rng.integers(FEWEST_PICTURES, 60))
        found = flicker_of(series(still(rng, count) * change(rng, count)))
        assert found is None or not found.is_seen


@pytest.mark.parametrize("read_s", [0.0, 0.02])
@pytest.mark.parametrize("mains_hz", [50, 60])
@pytest.mark.parametrize("rate_hz", [15.0, 20.0, 24.9, 25.0, 27.0, 30.0, 50.0, 60.0, 90.0])
def test_lamps_that_beat_are_seen_where_their_beat_does_not_stand_still(
    rate_hz: float, mains_hz: int, read_s: float
) -> None:
    rng = np.random.default_rng(7)
    found = [flicker_of(series(beating(rng, 0.12, rate_hz, read_s, mains_hz))) for _ in range(40)]
    seen = [one is not None and one.is_seen for one in found]
    assert all(seen) or is_hidden(mains_hz, rate_hz)
    if 2 * mains_hz % rate_hz == 0:
        assert is_hidden(mains_hz, rate_hz)
        assert not any(seen)


def test_a_beat_that_does_not_disturb_is_left_unsaid() -> None:
    rng = np.random.default_rng(3)
    found = [flicker_of(series(beating(rng, 0.03, 30.0, 0.0, 50))) for _ in range(50)]
    assert [one.is_seen for one in found if one is not None] == [False] * 50


def test_too_few_pictures_and_too_dark_ones_tell_nothing() -> None:
    rng = np.random.default_rng(3)
    assert flicker_of(series(beating(rng, 0.3, 30.0, 0.0, 50)[: FEWEST_PICTURES - 1])) is None
    assert flicker_of(series(np.full((30, STRIPS), 3.0))) is None
    assert flicker_of(series(np.full((30, STRIPS), 90.0))) == Flicker(0.0, 0.0)


@pytest.mark.parametrize(("share", "is_seen"), [(0.03, False), (0.15, True)])
def test_simulated_pictures_of_a_drone_that_swings(share: float, is_seen: bool) -> None:
    renderer = Renderer(
        load_site(SITE), SimCamera(lens=wide_lens(160, 90)), replace(HARSH, flicker=share), seed=4
    )
    rest = {field.name: 0.0 for field in fields(Kinematics)}
    pictures = []
    for seq in range(24):
        at_s = seq / 30
        swing = {
            "x_m": 0.1 * math.sin(2.0 * at_s),
            "roll_rad": 0.06 * math.sin(3.0 * at_s) + 0.02 * math.sin(math.tau * 11 * at_s),
        }
        kinematics = Kinematics(**(rest | {"stamp_ns": round(at_s * 1e9), "height_m": 1.2} | swing))  # type: ignore[arg-type]
        pictures.append(brightness_of(renderer.render(kinematics, seq)))
    found = flicker_of(pictures)
    assert found is not None
    assert found.is_seen is is_seen
    assert found.amplitude == pytest.approx(share, rel=0.4)


@given(
    level=st.integers(5, 250),
    width=st.integers(16, 400),
    height=st.integers(16, 300),
    lost=st.sampled_from([0, 255]),
)
@settings(max_examples=30)
def test_the_brightness_of_a_picture_is_that_of_its_middle(
    level: int, width: int, height: int, lost: int
) -> None:
    bgr = np.full((height, width, 3), level, np.uint8)
    bgr[: height // 4, : width // 4] = lost
    found = brightness_of(bgr)
    assert found.median == level
    assert found.strips[-1] == level
    at_ends = (found.black, found.burnt)
    assert at_ends[lost // 255] == pytest.approx(1 / 16, abs=0.04)
    assert at_ends[1 - lost // 255] == 0.0


@given(mains_hz=st.sampled_from([50, 60]), halves=st.integers(1, 6), exposure_s=st.floats(1e-5, 0.1))
@settings(max_examples=30)
def test_whole_half_periods_of_the_mains_let_no_beat_through(
    mains_hz: int, halves: int, exposure_s: float
) -> None:
    assert beat_passed(halves * 0.5 / mains_hz, mains_hz) < 1e-9
    assert (
        0.0 <= beat_passed(exposure_s, mains_hz) <= min(1.0, 1.0 / (math.tau * mains_hz * exposure_s) + 1e-9)
    )


def test_how_much_of_a_beat_five_milliseconds_let_through_and_how_far_the_floor_smears() -> None:
    assert beat_passed(0.0, 50) == 1.0
    assert beat_passed(0.005, 50) == pytest.approx(2 / math.pi)
    assert motion_blur_px(0.005, 0.8, 1.6, 400.0) == pytest.approx(1.0)
