"""Fuzz the scenario file: `python -m tests.fuzz.scenario COUNT`."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.sim.scenario import load_scenario
from tests.fuzz.drive import Target, in_one_line, main
from tests.fuzz.mutate import spoil_text

_EVERY_KEY = b"""
[camera]
width_px = 640
height_px = 360
fps = 30
capture_delay_s = 0.060
jitter_s = 0.003
exposure_s = 0.004

[floor]
appearance = "default"

[wind]
mean_x_mps = 0.0
mean_y_mps = 0.0
gust_mps = 0.3

[vehicle]
battery = 1.0
radio_loss = 0.0
radio_delay_ms = 0.0
radio_jitter_ms = 0.0
"""


def target(folder: Path) -> Target:
    path = folder / "scenario.toml"

    def attempt(data: bytes) -> bool:
        path.write_bytes(data)
        try:
            scenario = load_scenario(path)
        except InputError as err:
            return in_one_line(err)
        scenario.camera.camera()
        scenario.floor.look()
        scenario.wind.draught()
        scenario.vehicle.radio()
        return False

    return Target("scenario", (_EVERY_KEY,), spoil_text, attempt)


if __name__ == "__main__":
    main(target)
