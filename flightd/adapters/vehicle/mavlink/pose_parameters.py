"""The parameters by which an autopilot's estimator takes our motion, or does not: data."""

from __future__ import annotations

from dataclasses import replace

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import Rule, one_of, within
from flightd.config.vehicle import PoseChoice

_PLACE, _HEIGHT, _SPEED, _HEADING = 1, 2, 4, 8
"""Bits of EKF2_EV_CTRL."""
_TAKEN = "by our motion (vehicle.pose_output) its attitude stays true"
_UNHEARD = "else our motion (vehicle.pose_output) is not heard"
_OWN_HEADING = "by ours its heading would leap"

_ARDUPILOT_SPEED = Rule(("EK3_SRC1_VELXY",), one_of(6), "6 (external)", _TAKEN, 6)
_ARDUPILOT = (
    Rule(("VISO_TYPE",), one_of(1, 3), "1 (MAVLink) or 3 (VOXL)", _UNHEARD, 1),
    Rule(("EK3_SRC1_POSXY",), one_of(6), "6 (external)", _TAKEN, 6),
    _ARDUPILOT_SPEED,
    Rule(("EK3_SRC1_YAW",), one_of(0, 1), "1 (compass) or 0 (gyro)", _OWN_HEADING, 1),
    Rule(("FS_EKF_ACTION",), one_of(1), "1 (land)", "by 3 it lands wherever our motion ends for a second", 1),
    Rule(
        ("VISO_DELAY_MS",),
        within(40, 200),
        "40 to 200 ms",
        "the fastest pose is taken to be so old",
        80,
        optional=True,
    ),
)
_ARDUPILOT_NONE = Rule(
    ("VISO_TYPE",),
    one_of(0),
    "0 (none)",
    "else it waits for poses and is not armed",
    0,
    optional=True,
)
_PX4_TIMES = tuple(
    Rule((name,), within(0, most), "0 (none)", "poses carry their own time and variances", 0, optional=True)
    for name, most in (("EKF2_EV_DELAY", 20), ("EKF2_EV_NOISE_MD", 0))
)


def pose_rules(firmware: Firmware, choice: PoseChoice, *, landing_target: bool) -> tuple[Rule, ...]:
    """What has to be set for `vehicle.pose_output`: only advised where that is left to the autopilot."""
    if choice == "none":
        return (_ARDUPILOT_NONE,) if firmware is Firmware.ARDUPILOT else ()
    tells_speed = choice != "vision_position"
    if firmware is Firmware.ARDUPILOT:
        rules = tuple(rule for rule in _ARDUPILOT if tells_speed or rule is not _ARDUPILOT_SPEED)
    else:
        bits = (_SPEED if tells_speed else _PLACE) | (_PLACE if landing_target else 0)
        rules = (_ev_ctrl(bits), *_PX4_TIMES)
    return tuple(replace(rule, advised=choice == "auto") for rule in rules)


def _ev_ctrl(bits: int) -> Rule:
    """It takes these at least, and neither height nor heading."""
    return Rule(
        ("EKF2_EV_CTRL",),
        lambda value: int(value) & bits == bits and not int(value) & (_HEIGHT | _HEADING),
        f"{bits}, without height and heading (bits 1 and 3)",
        _TAKEN,
        bits,
    )
