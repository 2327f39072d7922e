"""Fuzz the warehouse map, up to the route through it: `python -m tests.fuzz.site COUNT`."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.site.site_file import load_site, parse_site, site_toml
from tests.fuzz.drive import Target, in_one_line, main
from tests.fuzz.mutate import spoil_text

_CONFIGS = Path(__file__).parents[2] / "configs"
_RACK = b"""
[[rack]]
aisles = ["A"]
sides = ["left", "right"]
bay_width_m = 1.35
levels_m = [0.3, 1.5]
positions = 2
pattern = "{aisle}{side}-{bay:02}-{level}-{position}"
"""


def target(folder: Path) -> Target:
    path = folder / "site.toml"

    def attempt(data: bytes) -> bool:
        path.write_bytes(data)
        try:
            site = load_site(path)
        except InputError as err:
            return in_one_line(err)
        assert parse_site(site_toml(site), "written back") == site
        site.serpentine_route()
        return False

    demo = (_CONFIGS / "site-demo.toml").read_bytes()
    return Target("site", (demo, demo + _RACK), spoil_text, attempt)


if __name__ == "__main__":
    main(target)
