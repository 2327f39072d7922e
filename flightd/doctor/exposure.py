"""How the cameras expose: as they were set, short enough, bright enough, under light that does not beat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from flightd.config.camera import CameraConfig
from flightd.config.exposure_keys import can_be_told, cannot_be_told
from flightd.config.front_camera import FrontCameraConfig
from flightd.config.schema import Config
from flightd.core.exposure import MOST_EXPOSURE_S, ExposureState, beat_passed, motion_blur_px
from flightd.doctor.check import Check, error, ok, unseen, warning
from flightd.vision.floor.brightness import Brightness
from flightd.vision.floor.light_flicker import FEWEST_PICTURES, flicker_of, is_hidden

_DARK, _BRIGHT = 30.0, 215.0
_BLACK, _BURNT = 0.4, 0.05
"""Shares of a picture."""
_MOST_BLUR_PX = 2.0
"""So far a line's edges smear and are still found where they are."""
_MAINS = (50, 60)


@dataclass(frozen=True, slots=True)
class Seen:
    """What was seen of the down camera: how it was read back (None: not at all), and how bright a short
    series of its pictures was that came at this rate."""

    state: ExposureState | None
    series: Sequence[Brightness]
    rate_hz: float


def check_exposure(config: Config, seen: Seen) -> list[Check]:
    """The down camera: settings, blur, brightness, flicker."""
    camera = config.camera
    checks = _check_settings("exposure", "camera", camera, seen.state)
    if seen.state is not None and seen.state.exposure_s:
        checks.append(_check_blur(config, seen.state.exposure_s))
    return [*checks, *_check_brightness(seen.series), *_check_flicker(camera, seen)]


def check_front_exposure(config: Config, state: ExposureState | None) -> list[Check]:
    """The front camera's settings, where there is one."""
    if not config.front_camera.is_fitted:
        return []
    return _check_settings("front exposure", "front_camera", config.front_camera, state)


def blur_px(config: Config, exposure_s: float) -> float:
    """Of the floor in the down camera's picture, at the speed and from the height of the flight."""
    mission = config.mission
    return motion_blur_px(exposure_s, mission.speed_mps, mission.height_m, config.camera.fx_px)


def _check_settings(
    name: str, section: str, camera: CameraConfig | FrontCameraConfig, state: ExposureState | None
) -> list[Check]:
    by_hand = f"manual, {MOST_EXPOSURE_S * 1e3:g} ms at most"
    if not can_be_told(camera.url):
        text = f"how the camera exposes is not told: {cannot_be_told(camera.url)}"
        return [unseen(name, text, f"{by_hand}, with a fixed gain")]
    if state is None:
        return [unseen(name, "the camera was not read back yet", "see the camera's line; look again soon")]
    if wrong := state.mismatches(camera.exposure_order()):
        remedy = f"[{section}]: give what it offers (v4l2-ctl --list-ctrls-menus), or leave the key out"
        return [error(name, "; ".join(map(str, wrong)), remedy)]
    return [_check_state(name, section, camera, state)]


def _check_state(
    name: str, section: str, camera: CameraConfig | FrontCameraConfig, state: ExposureState
) -> Check:
    most = f"{MOST_EXPOSURE_S * 1e3:g} ms at most"
    key = "exposure_s" if section == "camera" else "manual_exposure = true and exposure_s"
    if state.is_manual is None and state.exposure_s is None:
        text = "the camera tells nothing of its exposure"
        return warning(name, text, f"another driver or camera: manual, {most}")
    text = _in_words(state)
    if not state.is_manual:
        return warning(
            name, f"{text}: it grows in the dark, and blur with it", f"set {section}.{key}, {most}"
        )
    if state.exposure_s is not None and state.exposure_s > MOST_EXPOSURE_S * 1.001:
        return warning(name, text, f"{most}, with more light or gain: {section}.{key}")
    return ok(name, f"{text}, as it was set" if camera.exposure_order().exposure_s else text)


def _in_words(state: ExposureState) -> str:
    parts = ["manual" if state.is_manual else "automatic"]
    if state.exposure_s is not None:
        parts.append(f"{state.exposure_s * 1e3:.3g} ms")
    if state.gain is not None:
        parts.append(f"gain {state.gain:g}")
    if state.anti_flicker_hz:
        parts.append(f"anti-flicker {state.anti_flicker_hz} Hz")
    return ", ".join(parts)


def _check_blur(config: Config, exposure_s: float) -> Check:
    mission, blur = config.mission, blur_px(config, exposure_s)
    text = (
        f"{blur:.1f} px at mission.speed_mps {mission.speed_mps:g} from {mission.height_m:g} m, exposed for"
        f" {exposure_s * 1e3:.3g} ms"
    )
    if blur <= _MOST_BLUR_PX:
        return ok("blur", text)
    part = _MOST_BLUR_PX / blur
    shorter_s = min(exposure_s * part, MOST_EXPOSURE_S)
    remedy = (
        f"{_MOST_BLUR_PX:g} px at most: camera.exposure_s = {shorter_s:.2g}, or mission.speed_mps ="
        f" {mission.speed_mps * part:.2g}"
    )
    return warning("blur", text, remedy)


def _check_brightness(series: Sequence[Brightness]) -> list[Check]:
    if not series:
        return []
    level = median(one.median for one in series)
    black, burnt = median(one.black for one in series), median(one.burnt for one in series)
    text = f"median {level:.0f} of 255, {burnt:.0%} burnt out, {black:.0%} black"
    where = "hold it over the floor in the light it flies in"
    if level < _DARK or black > _BLACK:
        remedy = f"{where}; then more light, more gain, or up to {MOST_EXPOSURE_S * 1e3:g} ms"
        return [warning("brightness", f"pictures are dark: {text}", remedy)]
    if level > _BRIGHT or burnt > _BURNT:
        remedy = f"{where}; then a shorter exposure, then less gain"
        return [warning("brightness", f"pictures are too bright: {text}", remedy)]
    return [ok("brightness", text)]


def _check_flicker(camera: CameraConfig, seen: Seen) -> list[Check]:
    found = flicker_of(seen.series)
    if found is None:
        text = f"{len(seen.series)} pictures of use, {FEWEST_PICTURES} are needed to see lamps flicker"
        return [unseen("flicker", text, "brighter pictures, more a second")]
    if found.is_seen:
        text = f"brightness beats by {found.amplitude:.0%} from picture to picture, everywhere alike: lamps"
        return [warning("flicker", text, _against_flicker(camera, seen.state))]
    mains = (camera.anti_flicker_hz,) if camera.anti_flicker_hz else _MAINS
    hidden = [hz for hz in mains if seen.rate_hz and is_hidden(hz, seen.rate_hz)]
    lamps = f"lamps on {' or '.join(f'{hz} Hz' for hz in hidden)} mains"
    still = f"{lamps} stand still at {seen.rate_hz:.0f} pictures a second"
    if len(hidden) == len(mains):
        return [unseen("flicker", f"{still}: nothing to see", "another camera.fps, to see them once")]
    text = f"none seen in {len(seen.series)} pictures"
    return [ok("flicker", f"{text}; {still}, unseen" if hidden else text)]


def _against_flicker(camera: CameraConfig, state: ExposureState | None) -> str:
    mains = camera.anti_flicker_hz or _MAINS[0]
    half_s = 0.5 / mains
    exposure_s = state.exposure_s if state is not None and state.exposure_s else MOST_EXPOSURE_S
    if exposure_s < half_s:
        return (
            f"lamps with an electronic ballast, or LEDs on direct current: {exposure_s * 1e3:.3g} ms lets"
            f" {beat_passed(exposure_s, mains):.0%} of the beat through, only whole multiples of"
            f" {half_s * 1e3:.3g} ms none; anti_flicker_hz does nothing below that"
        )
    return (
        f"whole multiples of {half_s * 1e3:.3g} ms let none of it through, and blur more; better: other lamps"
    )
