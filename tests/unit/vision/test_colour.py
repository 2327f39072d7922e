"""Colour profiles: the table, its normalisation and region growing."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.types import Image
from flightd.vision.lines.colour_profile import (
    SHIPPED,
    STRONG,
    ColourProfile,
    classify,
    floor_field,
    grow,
    level,
    load_profile,
    read_profile,
    save_profile,
)

PAINT_BGR = {
    "yellow": (30, 190, 225),
    "white": (225, 228, 230),
    "red": (40, 35, 190),
    "blue": (180, 90, 35),
    "green": (70, 150, 40),
    "black": (22, 22, 24),
    "orange": (28, 100, 222),
}


def band(colour: str, floor: tuple[int, int, int] = (108, 112, 114)) -> tuple[Image, NDArray[np.bool_]]:
    picture = np.full((90, 160, 3), floor, np.uint8)
    picture[40:56] = PAINT_BGR[colour]
    inside = np.zeros((90, 160), bool)
    inside[40:56] = True
    return picture, inside


@pytest.mark.parametrize("colour", SHIPPED)
def test_each_shipped_profile_finds_its_paint_and_nothing_on_the_floor(colour: str) -> None:
    picture, inside = band(colour)
    assert np.array_equal(grow(classify(picture, load_profile(colour))) == 255, inside)


@pytest.mark.parametrize("colour", SHIPPED)
@pytest.mark.parametrize("exposure", [0.25, 0.5, 1.0, 2.0, 4.0])
def test_a_factor_sixteen_of_brightness_does_not_lose_the_line(colour: str, exposure: float) -> None:
    """The floor is dark enough that fourfold exposure does not saturate it."""
    picture, inside = band(colour, (50, 52, 53))
    if colour != "black":
        picture[inside] = (np.array(PAINT_BGR[colour]) * 0.47).astype(np.uint8)
    else:
        picture[inside] = 8
    lit = np.clip(picture * exposure, 0, 255).astype(np.uint8)
    mask = grow(classify(lit, load_profile(colour))) == 255
    assert (mask == inside).mean() > 0.995


@pytest.mark.parametrize("colour", SHIPPED)
@pytest.mark.parametrize("cast", [(1.35, 1.0, 0.75), (0.75, 1.0, 1.35), (0.9, 1.15, 0.9)])
def test_a_colour_cast_does_not_lose_the_line(colour: str, cast: tuple[float, float, float]) -> None:
    picture, inside = band(colour)
    tinted = np.clip(picture * np.array(cast), 0, 255).astype(np.uint8)
    mask = grow(classify(tinted, load_profile(colour))) == 255
    assert (mask == inside).mean() > 0.995


def test_a_frame_full_of_paint_keeps_its_colour() -> None:
    picture = np.full((90, 160, 3), PAINT_BGR["yellow"], np.uint8)
    assert (classify(picture, load_profile("yellow")) == STRONG).all()


@pytest.mark.parametrize("colour", SHIPPED)
def test_a_deep_shadow_over_half_the_frame_leaves_the_line_whole(colour: str) -> None:
    picture, inside = band(colour)
    picture[:, 80:] = (picture[:, 80:] * 0.45).astype(np.uint8)
    mask = grow(classify(picture, load_profile(colour))) == 255
    assert mask[inside].mean() > 0.9
    assert not mask[~inside].any()


def test_levelling_brings_a_tinted_floor_to_grey() -> None:
    floor = np.full((40, 60, 3), (60, 70, 80), np.uint8)
    assert np.abs(level(floor, "yellow").astype(int) - 112).max() <= 1


def test_the_floor_field_is_the_floor_also_where_a_line_crosses_it() -> None:
    picture, _ = band("black")
    assert np.abs(floor_field(picture, "black").astype(int) - (108, 112, 114)).max() <= 1


@pytest.mark.parametrize("shape", [(1, 1), (3, 700), (700, 3), (16, 16), (720, 1280)])
def test_any_size_of_picture_is_classified(shape: tuple[int, int]) -> None:
    levels = classify(np.full((*shape, 3), 90, np.uint8), load_profile("yellow"))
    assert levels.shape == shape
    assert not levels.any()


def test_many_specks_are_grown_as_few_are() -> None:
    """Beyond 16 bits of separate parts the slower way takes over, with the same answer."""
    levels = np.zeros((600, 800), np.uint8)
    levels[::2, ::2] = 1
    levels[::6, ::4] = 2
    expected = np.where(levels == 2, 255, 0)
    assert np.array_equal(grow(levels), expected)


def test_growing_keeps_weak_pixels_only_where_they_touch_strong_ones() -> None:
    levels = np.array([[0, 1, 1, 2, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 1, 0, 0]], np.uint8)
    levels[1, 4] = 1  # diagonal neighbour of the strong pixel
    kept = grow(levels)
    assert kept[0].tolist() == [0, 255, 255, 255, 0, 0, 0]
    assert kept[1].tolist() == [0, 0, 0, 0, 255, 0, 0]
    assert kept[2].tolist() == [0, 0, 0, 0, 255, 0, 0]


def test_growing_keeps_a_long_weak_band_that_touches_no_strong_pixel() -> None:
    levels = np.zeros((90, 160), np.uint8)
    levels[20:26, 30:130] = 1
    levels[60:80] = STRONG
    levels[40:44, 70:80] = 1
    mask = grow(levels)
    assert mask[20:26, 30:130].all()
    assert not mask[40:44].any()


def test_white_on_grass_stays_white() -> None:
    picture, inside = band("white", (52, 121, 96))
    picture[inside] = (205, 215, 210)
    assert np.array_equal(grow(classify(picture, load_profile("white"))) == 255, inside)


def test_a_profile_survives_its_file_and_the_file_is_small(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    profile = ColourProfile("mine", rng.integers(0, 3, 65536).astype(np.uint8), "yellow", "abc", 0.97)
    save_profile(profile, tmp_path / "mine.npz")
    again = load_profile(tmp_path / "mine.npz")
    assert np.array_equal(again.lut, profile.lut)
    assert (again.name, again.colour, again.training_hash, again.score) == ("mine", "yellow", "abc", 0.97)
    assert (tmp_path / "mine.npz").stat().st_size < 200_000


def test_the_same_profile_is_written_as_the_same_bytes(tmp_path: Path) -> None:
    save_profile(load_profile("red"), tmp_path / "a.npz")
    save_profile(load_profile("red"), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("content", [b"", b"not a profile", b"PK\x03\x04rest"])
def test_a_file_that_is_no_profile_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.npz"):
        load_profile(path)


def test_spoilt_content_is_no_profile(tmp_path: Path) -> None:
    save_profile(load_profile("yellow"), tmp_path / "good.npz")
    good = (tmp_path / "good.npz").read_bytes()
    assert read_profile(good, "good").training_hash == load_profile("yellow").training_hash
    for at in range(0, len(good), 7):
        with contextlib.suppress(InputError):  # what is no lookup and no name may be anything
            read_profile(good[:at] + bytes([good[at] ^ 0xFF]) + good[at + 1 :], "spoilt")
        with pytest.raises(InputError, match="profile spoilt: not a colour profile"):
            read_profile(good[:at], "spoilt")
    np.savez_compressed(tmp_path / "bomb.npz", lut=np.zeros(2 << 20, np.uint8), about=np.zeros(1, np.uint8))
    with pytest.raises(InputError, match=r"unpacks to \d+ bytes"):
        read_profile((tmp_path / "bomb.npz").read_bytes(), "bomb")


def test_an_unknown_name_lists_the_shipped_ones() -> None:
    with pytest.raises(InputError, match=r"purple.*yellow, white"):
        load_profile("purple")


@pytest.mark.parametrize("name", SHIPPED)
def test_each_shipped_profile_says_what_it_was_trained_on(name: str) -> None:
    profile = load_profile(name)
    assert (profile.name, profile.colour) == (name, name)
    assert profile.score > 0.95
    assert len(profile.training_hash) == 16


@pytest.mark.parametrize("lut", [np.zeros(10, np.uint8), np.full(65536, 3, np.uint8), np.zeros(65536)])
def test_a_table_of_the_wrong_kind_is_refused(lut: NDArray[np.uint8]) -> None:
    with pytest.raises(ValueError, match="table"):
        ColourProfile("bad", lut, "yellow")


def test_an_older_opencv_gives_the_same_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before OpenCV 5, `LUT` took no 16-bit index."""
    picture, _ = band("yellow")
    profile = load_profile("yellow")
    levels = classify(picture, profile)
    monkeypatch.setattr("flightd.vision.lines.colour_profile._LUT_TAKES_16_BITS", False)
    assert np.array_equal(classify(picture, profile), levels)
    assert np.array_equal(grow(levels), np.where(levels > 0, 255, 0))


def test_dull_paint_throughout_seeds_itself() -> None:
    """Worn white on a light floor: no pixel is surely paint, yet the band is a band."""
    levels = np.zeros((60, 80), np.uint8)
    levels[:, 38:42] = 1
    assert np.array_equal(grow(levels) == 255, levels == 1)
