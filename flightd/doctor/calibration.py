"""Are lens and mount, as configured, those of a camera that can fly by this floor?"""

from __future__ import annotations

import math

from flightd.adapters.store.learnt_sensors import load_learnt
from flightd.config.camera import CameraConfig
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.learnt import estimate_of
from flightd.doctor.check import Check, error, ok, warning
from flightd.site.site import Site

_FIELD_DEG = (15.0, 150.0)
_ASPECT = 0.03
_OFF_CENTRE = 0.15
_LINE_MIN_PX = 4.0
_CALIBRATE = "calibrate the camera: flightd calibrate"
_NAME = "calibration"
_STEPS = 50
_LEARNT, _DELAY_S, _HEIGHT_SHARE = "learnt", 0.02, 0.03
"""A delay that is off by more had better be configured, a height that is looked into."""


def check_calibration(camera: CameraConfig, site: Site, height_m: float) -> list[Check]:
    """One line for each complaint, or one that says all is well."""
    lens = camera.lens()
    field_deg = math.degrees(2.0 * math.atan(lens.width_px / (2.0 * lens.fx_px)))
    across_m = lens.width_px / lens.fx_px * height_m
    line_px = site.line_width_m * lens.fx_px / height_m
    text = (
        f"the lens sees {field_deg:.0f} deg across, {across_m:.1f} m of floor from {height_m:g} m; "
        f"a line is {line_px:.0f} px wide there"
    )
    checks = []
    if not _FIELD_DEG[0] < field_deg < _FIELD_DEG[1]:
        checks.append(
            error(_NAME, f"camera.fx_px {lens.fx_px:g}: {field_deg:.0f} deg across is no lens", _CALIBRATE)
        )
    if abs(lens.fx_px / lens.fy_px - 1.0) > _ASPECT:
        checks.append(
            warning(_NAME, f"camera.fx_px {lens.fx_px:g} and fy_px {lens.fy_px:g} differ", _CALIBRATE)
        )
    middle = (lens.width_px - 1) / 2, (lens.height_px - 1) / 2
    if (
        abs(lens.cx_px - middle[0]) > _OFF_CENTRE * lens.width_px
        or abs(lens.cy_px - middle[1]) > _OFF_CENTRE * lens.height_px
    ):
        place = f"camera.cx_px {lens.cx_px:g}, cy_px {lens.cy_px:g}"
        checks.append(error(_NAME, f"{place}: far from the picture's middle", _CALIBRATE))
    if not _unfolds(lens):
        checks.append(error(_NAME, "camera.distortion folds the picture over itself", _CALIBRATE))
    if line_px < _LINE_MIN_PX:
        remedy = (
            f"fly lower (mission.height_m), use larger pictures or a longer lens: {_LINE_MIN_PX:g} px needed"
        )
        checks.append(error(_NAME, text, remedy))
    if not {"fx_px", "fy_px"} & camera.model_fields_set:
        checks.append(warning(_NAME, "camera.fx_px and fy_px are not given: a guess is used", _CALIBRATE))
    return checks or [ok(_NAME, text)]


def check_learnt(config: Config) -> list[Check]:
    """What the last flights have learnt of the camera, where that is kept."""
    if config.tracking.learnt is None:
        return []
    try:
        learnt = load_learnt(config.tracking.learnt, config)
    except InputError as err:
        return [error(_LEARNT, str(err), "the next flight writes it anew")]
    if learnt is None:
        return [ok(_LEARNT, "nothing yet of this camera, as it is configured")]
    seen = estimate_of(learnt)
    delay_s, sigma_s = -seen.delay_s, seen.delay_sigma_s
    roll, pitch, mount, yaw, yaw_sigma, leant, lent, tilt = map(
        math.degrees,
        (
            seen.mount_roll_rad,
            seen.mount_pitch_rad,
            seen.mount_sigma_rad,
            seen.mount_yaw_rad,
            seen.mount_yaw_sigma_rad,
            seen.tilt_roll_rad,
            seen.tilt_pitch_rad,
            seen.tilt_sigma_rad,
        ),
    )
    height, height_sigma = seen.height_share, seen.height_sigma
    text = (
        f"beyond the configuration: delay {delay_s * 1e3:+.0f} ms (sigma {sigma_s * 1e3:.0f}), mount roll"
        f" {roll:+.1f} pitch {pitch:+.1f} deg (sigma {mount:.1f}) yaw {yaw:+.1f} (sigma {yaw_sigma:.1f}),"
        f" attitude {leant:+.1f} {lent:+.1f} deg (sigma {tilt:.1f}), focal length {seen.focal_share:+.1%}"
        f" (sigma {seen.scale_sigma:.1%}), height {height:+.1%} (sigma {height_sigma:.1%})"
    )
    if abs(delay_s) >= max(_DELAY_S, 3.0 * sigma_s):
        latency_s = max(config.camera.latency_s + delay_s, 0.0)
        return [warning(_LEARNT, text, f"camera.latency_s = {latency_s:.3f}")]
    if abs(height) >= max(_HEIGHT_SHARE, 2.0 * height_sigma):
        return [warning(_LEARNT, text, "check the range finder")]
    return [ok(_LEARNT, text)]


def _unfolds(lens: Lens) -> bool:
    """Whether the radial distortion grows from the middle to the corner of the picture."""
    k1, k2, _, _, k3 = lens.distortion
    corner = math.hypot(lens.width_px / 2 / lens.fx_px, lens.height_px / 2 / lens.fy_px)
    radii = [corner * step / _STEPS for step in range(1, _STEPS + 1)]
    return all(1.0 + 3.0 * k1 * r**2 + 5.0 * k2 * r**4 + 7.0 * k3 * r**6 > 0.0 for r in radii)
