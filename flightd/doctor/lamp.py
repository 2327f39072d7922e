"""The lamp beside the front camera: whether there is what it hangs on."""

from __future__ import annotations

import os
from pathlib import Path

from flightd.adapters.lamp import LEDS
from flightd.config.lamp import SWITCHED_BY, LampKind, lamp_switch
from flightd.config.schema import Config
from flightd.doctor.check import Check, error, ok, unseen


def check_lamp(config: Config, leds: Path = LEDS) -> list[Check]:
    """Whether the LED can be written, or the vehicle has such an output; nothing without a lamp."""
    text = config.front_camera.lamp
    switch = lamp_switch(text)
    if switch is None:
        return []
    if switch.kind is LampKind.LED:
        return [_check_led(leds / switch.name, leds)]
    kind = SWITCHED_BY[switch.kind]
    if config.vehicle.kind != kind:
        return [error("lamp", f"front_camera.lamp {text}: only a vehicle of kind {kind} has it", "led:NAME")]
    seen = "look whether it is lit while shelves are looked at"
    return [unseen("lamp", f"front_camera.lamp {text}: not tried", seen)]


def _check_led(led: Path, leds: Path) -> Check:
    key = f"front_camera.lamp led:{led.name}"
    if not led.is_dir():
        known = ", ".join(sorted(path.name for path in leds.glob("*"))) or "none"
        return error("lamp", f"{key}: there is no {led}", f"name one of these: {known}")
    if not os.access(led / "brightness", os.W_OK):
        return error("lamp", f"{key}: {led}/brightness cannot be written", "a udev rule, see the guide")
    return ok("lamp", f"{key}: can be written")
