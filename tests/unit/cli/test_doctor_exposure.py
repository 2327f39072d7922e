"""What `flightd doctor` says of a camera's exposure, brightness, blur and the light it looks by."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flightd.config.schema import Config, parse_config
from flightd.core.exposure import ExposureState
from flightd.doctor.check import CheckLevel
from flightd.doctor.exposure import Seen, check_exposure, check_front_exposure
from flightd.vision.floor.brightness import STRIPS, Brightness

HELD = ExposureState(True, 0.004, 30.0, 0)
LIT = Brightness(110.0, 0.01, 0.005, (110.0,) * STRIPS)
UNSEEN, OK, WARNING, ERROR = CheckLevel.UNSEEN, CheckLevel.OK, CheckLevel.WARNING, CheckLevel.ERROR


def config(**camera: Any) -> Config:
    table = {
        "mission": {"site": "site.toml", "speed_mps": 1.0, "height_m": 1.6},
        "camera": {"url": "device:/dev/video0", "fx_px": 400.0, "fy_px": 400.0, **camera},
    }
    return parse_config(table, Path("flightd.toml"))


def seen(state: ExposureState | None = HELD, picture: Brightness = LIT, rate_hz: float = 27.0) -> Seen:
    return Seen(state, [picture] * 30, rate_hz)


def said(settings: Config, found: Seen) -> dict[str, tuple[CheckLevel, str, str]]:
    checks = check_exposure(settings, found)
    for check in checks:
        assert "\n" not in check.text + check.remedy
        assert bool(check.remedy) is (check.level is not OK)
    assert len({check.name for check in checks}) == len(checks)
    return {check.name: (check.level, check.text, check.remedy) for check in checks}


@pytest.mark.parametrize(
    ("keys", "state", "level", "words"),
    [
        ({"exposure_s": 0.004, "gain": 30}, HELD, OK, "manual, 4 ms, gain 30, as it was set"),
        ({"exposure_s": 0.002, "gain": 30}, HELD, ERROR, "exposure_s was set to 0.002, the camera tells"),
        ({"exposure_s": 0.004}, ExposureState(False, 0.03), ERROR, "goes on exposing by itself"),
        ({}, HELD, OK, "manual, 4 ms, gain 30"),
        ({}, ExposureState(False, 0.0157, 64), WARNING, "automatic, 15.7 ms, gain 64: it grows in the dark"),
        ({}, ExposureState(True, 0.010), WARNING, "manual, 10 ms"),
        ({"exposure_s": 0.01}, ExposureState(True, 0.010), WARNING, "manual, 10 ms"),
        ({}, ExposureState(True, 0.005), OK, "manual, 5 ms"),
        ({}, ExposureState(), WARNING, "tells nothing of its exposure"),
        ({}, None, UNSEEN, "not read back yet"),
        ({"url": "stream:rtsp://eye/down"}, None, UNSEEN, "a stream carries no such setting"),
        ({"url": "udp://127.0.0.1:5600"}, None, UNSEEN, "set it there"),
    ],
)  # fmt: skip
def test_the_settings_are_held_against_what_was_read_back(
    keys: dict[str, Any], state: ExposureState | None, level: CheckLevel, words: str
) -> None:
    found, text, remedy = said(config(**keys), seen(state))["exposure"]
    assert found is level
    assert words in text
    if level is WARNING:
        assert "5 ms at most" in remedy


@pytest.mark.parametrize(
    ("picture", "level", "words"),
    [
        (LIT, OK, "median 110"),
        (Brightness(20.0, 0.05, 0.0, (20.0,) * STRIPS), WARNING, "dark"),
        (Brightness(90.0, 0.45, 0.0, (90.0,) * STRIPS), WARNING, "dark"),
        (Brightness(90.0, 0.0, 0.08, (90.0,) * STRIPS), WARNING, "too bright"),
        (Brightness(230.0, 0.0, 0.01, (230.0,) * STRIPS), WARNING, "too bright"),
    ],
)
def test_pictures_that_have_lost_something_at_an_end_are_told(
    picture: Brightness, level: CheckLevel, words: str
) -> None:
    found, text, _ = said(config(), seen(picture=picture))["brightness"]
    assert found is level
    assert words in text


def test_blur_is_told_in_pixels_at_the_speed_and_height_of_the_flight() -> None:
    assert said(config(), seen())["blur"][:2] == (
        OK, "1.0 px at mission.speed_mps 1 from 1.6 m, exposed for 4 ms"
    )  # fmt: skip
    level, text, remedy = said(config(), seen(ExposureState(True, 0.016)))["blur"]
    assert (level, text[:6]) == (WARNING, "4.0 px")
    assert remedy.endswith("camera.exposure_s = 0.005, or mission.speed_mps = 0.5"), "never beyond 5 ms"
    assert "blur" not in said(config(), seen(None))


def test_lamps_that_beat_are_told_with_what_anti_flicker_can_do_and_what_not() -> None:
    beat = [Brightness(100.0, 0.0, 0.0, (100.0 * (1.1 if k % 3 else 0.8),) * STRIPS) for k in range(30)]
    level, text, remedy = said(config(), Seen(HELD, beat, 30.0))["flicker"]
    assert level is WARNING
    assert "everywhere alike" in text
    assert "4 ms lets 76% of the beat through, only whole multiples of 10 ms none" in remedy
    assert "anti_flicker_hz does nothing below that" in remedy
    _, _, remedy = said(config(anti_flicker_hz=60), Seen(None, beat, 30.0))["flicker"]
    assert "5 ms lets 50% of the beat through, only whole multiples of 8.33 ms none" in remedy
    _, _, remedy = said(config(), Seen(ExposureState(False, 0.015), beat, 30.0))["flicker"]
    assert remedy.startswith("whole multiples of 10 ms")


@pytest.mark.parametrize(
    ("keys", "rate_hz", "level", "words"),
    [
        ({}, 27.0, OK, "none seen in 30 pictures"),
        ({}, 30.0, OK, "lamps on 60 Hz mains stand still at 30 pictures a second, unseen"),
        ({}, 20.0, UNSEEN, "lamps on 50 Hz or 60 Hz mains stand still at 20 pictures a second"),
        ({"anti_flicker_hz": 60}, 30.0, UNSEEN, "lamps on 60 Hz mains stand still"),
        ({"anti_flicker_hz": 50}, 30.0, OK, "none seen in 30 pictures"),
    ],
)
def test_flicker_that_cannot_be_seen_is_not_said_to_be_absent(
    keys: dict[str, Any], rate_hz: float, level: CheckLevel, words: str
) -> None:
    found, text, _ = said(config(**keys), seen(rate_hz=rate_hz))["flicker"]
    assert (found, text[-len(words) :] if level is OK else words in text) == (
        level, words if level is OK else True
    )  # fmt: skip
    assert said(config(), Seen(HELD, [], 30.0))["flicker"][0] is UNSEEN


def test_the_front_camera_is_told_of_where_there_is_one() -> None:
    assert check_front_exposure(config(), None) == []
    front = {"url": "device:/dev/video2", "manual_exposure": True}
    table = {"mission": {"site": "site.toml"}, "front_camera": front}
    settings = parse_config(table, Path("flightd.toml"))
    for state, level in (
        (ExposureState(True, 0.002), OK),
        (ExposureState(True, 0.02), ERROR),
        (None, UNSEEN),
    ):
        (check,) = check_front_exposure(settings, state)
        assert (check.name, check.level) == ("front exposure", level)
