"""Fuzz the scenario file: `python -m tests.fuzz.scenario COUNT`."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.sim.scenario import scenario
from flightd.sim.scenario.scenario_files import load_scenario
from flightd.site.site_file import load_site
from tests.fuzz.drive import Target, in_one_line, main
from tests.fuzz.mutate import spoil_text

_EVERY_KEY = ("[" + (scenario.__doc__ or "").partition("\n[")[2]).encode()
"""The sample in the module's own description names every section."""


def target(folder: Path) -> Target:
    path = folder / "scenario.toml"
    site = load_site(Path(__file__).parents[2] / "configs" / "site-demo.toml")

    def attempt(data: bytes) -> bool:
        path.write_bytes(data)
        try:
            read = load_scenario(path)
        except InputError as err:
            return in_one_line(err)
        read.camera.camera()
        read.front_camera.camera()
        read.racks.appearance()
        read.floor.surface()
        read.floor.site(site)
        read.wind.params()
        read.vehicle.radio()
        return False

    return Target("scenario", (_EVERY_KEY,), spoil_text, attempt)


if __name__ == "__main__":
    main(target)
