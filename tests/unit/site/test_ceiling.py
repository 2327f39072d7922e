"""A ceiling that nobody measured: nothing flies above 2 m under it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from flightd.app.build import pilot_of, plan_of
from flightd.cli.main import app
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.site.site import Site
from flightd.site.site_file import parse_site, site_toml

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
TOLD = (CONFIGS / "site-racks.toml").read_text(encoding="utf-8")
DEMO = (CONFIGS / "site-demo.toml").read_text(encoding="utf-8")


def without_ceiling(text: str) -> Site:
    kept = [line for line in text.splitlines() if not line.startswith("ceiling_m")]
    return parse_site("\n".join(kept), "site.toml")


def test_it_is_demanded_by_its_key_where_the_legs_are_flown_above_two_metres() -> None:
    site = without_ceiling(DEMO)
    pilot_of(CONFIG, site)
    high = CONFIG.with_values(mission={"height_m": 2.2})
    for make in (pilot_of, plan_of):
        with pytest.raises(
            InputError, match=r"site demo: site.ceiling_m: not given.*mission.height_m.*measure"
        ):
            make(high, site)
    pilot_of(high, parse_site(DEMO, "site.toml"))


def test_it_is_demanded_where_a_shelf_is_looked_at_from_above_two_metres() -> None:
    config = load_config(CONFIGS / "sim.toml").with_values(front_camera={"url": "udp://127.0.0.1:5000"})
    with pytest.raises(InputError, match=r"site.ceiling_m: not given, and the highest view of a shelf"):
        pilot_of(config, without_ceiling(TOLD))
    pilot_of(config.with_values(scan={"max_height_m": 1.9}), without_ceiling(TOLD))


def test_a_site_without_one_is_written_and_read_again_without_one() -> None:
    site = without_ceiling(DEMO)
    assert not site.ceiling_given
    assert parse_site(site_toml(site), "again") == site
    assert "ceiling_m" not in site_toml(site)


def test_a_new_map_says_nothing_that_nobody_measured(tmp_path: Path) -> None:
    out = tmp_path / "hall.toml"
    assert CliRunner().invoke(app, ["map", "new", str(out)]).exit_code == 0
    assert "ceiling_m" not in out.read_text(encoding="utf-8")
    assert CliRunner().invoke(app, ["map", "new", str(out), "--force", "--ceiling-m", "7.5"]).exit_code == 0
    assert "ceiling_m = 7.5" in out.read_text(encoding="utf-8")
