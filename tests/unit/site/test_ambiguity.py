"""Which nodes the floor alone does not tell apart."""

from __future__ import annotations

from pathlib import Path

from flightd.site.ambiguity import alike
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Site
from flightd.site.site_file import load_site

CONFIGS = Path(__file__).parents[3] / "configs"


def row(*spacing_m: float) -> Site:
    return lay_out("row", [Aisle("A", 0.0, 0.0, spacing_m)], [], [Pad("home", "A1", 0.5)])


def test_the_middle_of_an_even_aisle_is_known_only_from_its_ends() -> None:
    site = row(*(1.5,) * 7)
    assert alike(site, 0) == [("A2", "A3", "A4", "A5", "A6", "A7")]
    assert alike(site, 2) == [("A4", "A5")]
    assert alike(site, 3) == []


def test_spacings_closer_than_what_is_resolved_tell_nothing_and_others_do() -> None:
    assert alike(row(1.50, 1.52, 1.54, 1.50, 1.52), 1) == [("A3", "A4")], "A2 and A5 see an end from there"
    assert alike(row(1.5, 1.8, 1.3, 1.5, 2.0), 1) == []


def test_the_demo_site_has_no_two_nodes_alike() -> None:
    assert alike(load_site(CONFIGS / "site-demo.toml"), 2) == []
