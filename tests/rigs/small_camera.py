"""The simulated camera at half of what a flight with it costs, for flights that prove something else than
what a picture shows: fewer pixels, fewer pictures; brisk, and without waiting on the pad."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from flightd.sim.scenario.scenario import Scenario
from tests.rigs.brisk import BRISK

SMALL: Final[dict[str, float]] = {"width_px": 320, "height_px": 180, "fps": 20.0}

AT_ONCE: Final = (
    "mission.autostart_countdown_s=0",
    *(f"mission.{key}={value}" for key, value in BRISK.items()),
)
"""Settings: the countdown has tests of its own."""


def at_once() -> list[str]:
    """The same as words of a command."""
    return [word for setting in AT_ONCE for word in ("--set", setting)]


def with_small_camera(scenario: Scenario) -> Scenario:
    """The same scenario, seen by the small camera."""
    return scenario.model_copy(update={"camera": scenario.camera.model_copy(update=SMALL)})


def small_camera_file(folder: Path, **others: float) -> Path:
    """A scenario file of the small camera, to be laid over another; `others` are keys of its section."""
    path = folder / "small-camera.toml"
    keys = [f"{key} = {value}" for key, value in (SMALL | others).items()]
    path.write_text("\n".join(["[camera]", *keys, ""]))
    return path
