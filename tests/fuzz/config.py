"""Fuzz the configuration file, up to the pilot that is made of it: `python -m tests.fuzz.config COUNT`."""

from __future__ import annotations

from pathlib import Path

from flightd.app.build import pilot_of
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.site.site_file import load_site
from tests.fuzz.drive import Target, in_one_line, main
from tests.fuzz.mutate import spoil_text

_CONFIGS = Path(__file__).parents[2] / "configs"


def target(folder: Path) -> Target:
    path, site = folder / "flightd.toml", load_site(_CONFIGS / "site-demo.toml")

    def attempt(data: bytes) -> bool:
        path.write_bytes(data)
        try:
            config = load_config(path)
            pilot_of(config, site)
        except InputError as err:
            return in_one_line(err)
        return False

    seeds = tuple((_CONFIGS / name).read_bytes() for name in ("ardupilot.toml", "sim.toml", "ardrone.toml"))
    return Target("config", seeds, spoil_text, attempt)


if __name__ == "__main__":
    main(target)
