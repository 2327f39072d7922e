"""JPEG files of any origin: what shows something is decoded, and nothing else raises."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from flightd.vision.jpeg import decoded_jpeg, jpeg_size
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg
from tests.rigs.odd_jpegs import resized

GREY = evidence_jpeg(np.full((48, 64, 3), 90, np.uint8))


def test_the_size_is_read_from_the_header() -> None:
    jpeg = evidence_jpeg(np.zeros((123, 456, 3), np.uint8))
    assert jpeg_size(jpeg) == (456, 123)
    for length in range(len(jpeg)):
        assert jpeg_size(jpeg[:length]) in {None, (456, 123)}


def test_a_picture_is_decoded() -> None:
    picture = decoded_jpeg(GREY)
    assert picture is not None
    assert picture.shape == (48, 64, 3)
    assert abs(int(picture[20, 20, 1]) - 90) <= 2


@pytest.mark.parametrize(
    "data",
    [b"", b"no picture", GREY[:40], bytes(cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1])],
    ids=["empty", "text", "header cut off", "png"],
)
def test_what_is_no_jpeg_shows_nothing(data: bytes) -> None:
    assert decoded_jpeg(data) is None


@pytest.mark.parametrize("side", [7000, 65_000])
def test_what_claims_more_than_any_camera_gives_is_not_decoded(side: int) -> None:
    assert decoded_jpeg(resized(GREY, side, side)) is None


def test_a_file_spoilt_anywhere_raises_nothing() -> None:
    chance = np.random.default_rng(5)
    for _ in range(300):
        spoilt = bytearray(GREY)
        for at in chance.integers(2, len(spoilt), 3):
            spoilt[at] = chance.integers(256)
        decoded_jpeg(bytes(spoilt))
