"""Site files: read, refused with a useful line, written back."""

import pickle
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.sim.random_sites import random_site
from flightd.site.floor_plan_svg import draw_site
from flightd.site.site import LineColour, Side, Site
from flightd.site.site_file import load_site, parse_site, site_toml

CONFIGS = Path(__file__).parents[3] / "configs"

GOOD = """
[site]
name = "small"
line_width_m = 0.06

[[aisle]]
id = "A"
x_m = 0
y_m = 0
spacing_m = [1.5, 1.8]
shelves = ["left"]

[[aisle]]
id = "B"
x_m = 0.0
y_m = 3.0
spacing_m = [3.3]

[[cross]]
nodes = ["A1", "B1"]

[[pad]]
id = "home"
node = "A1"
"""


def test_a_file_reads_as_written() -> None:
    site = parse_site(GOOD, "small.toml")
    assert (site.name, site.line_width_m, site.line_colour) == ("small", 0.06, LineColour.YELLOW)
    assert list(site.nodes) == ["A1", "A2", "A3", "B1", "B2"]
    assert site.aisles[0].shelves == (Side.LEFT,)
    assert site.home.size_m == 0.5


@pytest.mark.parametrize(("name", "aisles", "least_nodes"), [("demo", 2, 12), ("large", 10, 100)])
def test_the_sites_that_ship_are_sound(name: str, aisles: int, least_nodes: int) -> None:
    site = load_site(CONFIGS / f"site-{name}.toml")
    assert len(site.aisles) == aisles
    assert len(site.nodes) >= least_nodes
    assert all(len(set(aisle.spacing_m)) > 1 for aisle in site.aisles)
    assert site.home.node == "A1"


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 100_000))
def test_what_is_written_reads_back_the_same(seed: int) -> None:
    site = random_site(seed)
    assert parse_site(site_toml(site), "x.toml") == site


def test_a_name_with_quotes_and_umlauts_survives() -> None:
    site = parse_site(GOOD.replace('"small"', r'"Halle \"3\" - Süd\\2"'), "x.toml")
    assert site.name == 'Halle "3" - Süd\\2'
    assert parse_site(site_toml(site), "x.toml") == site


def test_a_site_goes_to_another_process() -> None:
    site = parse_site(GOOD, "small.toml")
    site.serpentine_route()
    again: Site = pickle.loads(pickle.dumps(site))
    assert again == site
    assert again.path("A3", "B2") == ("A3", "A2", "A1", "B1", "B2")


@pytest.mark.parametrize("paint", ["orange", "green", "black", "#7A3FA0"])
def test_lines_may_be_of_any_paint(paint: str) -> None:
    site = parse_site(GOOD.replace('"small"', f'"small"\nline_colour = "{paint}"'), "x.toml")
    assert site.line_colour == paint.lower()
    assert parse_site(site_toml(site), "x.toml") == site
    assert 'fill="#' in draw_site(site)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[site]", "[site", "not valid TOML"),
        ("[site]", "[sight]", "unknown key; known here: site, aisle, cross, blocked, keep_out, rack, pad, "),
        ('name = "small"', "", "site.name: missing; add it"),
        ("line_width_m = 0.06", "line_width_m = 0.2", "site.line_width_m: Input should be less than"),
        (
            "line_width_m = 0.06",
            'line_colour = "mauve"',
            "site.line_colour: no paint; give one of yellow, white, ",
        ),
        ("line_width_m = 0.06", "line_with_m = 0.06", "site.line_with_m: unknown key; known here: name, "),
        ('id = "B"', 'id = "b2"', "aisle[1] (b2).id: 'b2': an aisle's id is one to three capital letters"),
        ("spacing_m = [1.5, 1.8]", "spacing_m = [1.5, -1.8]", "aisle[0] (A).spacing_m[1]: Input should be g"),
        ("spacing_m = [1.5, 1.8]", "spacing_m = [1.5, inf]", "aisle[0] (A).spacing_m[1]: Input should be"),
        ("spacing_m = [3.3]", "spacing_m = []", "aisle[1] (B).spacing_m: "),
        ('nodes = ["A1", "B1"]', 'nodes = ["A1"]', "cross[0].nodes"),
        ('nodes = ["A1", "B1"]', 'nodes = ["A2", "B2"]', "cross[0].nodes: A2 (x 1.5 m) and B2 (x 3.3 m)"),
        ('node = "A1"', 'node = "A7"', "pad[0] (home).node: there is no node A7"),
        ('id = "B"', 'id = "A"', "aisle[1] (A).id: A is taken"),
    ],
)
def test_a_mistake_is_one_line_with_file_key_and_remedy(old: str, new: str, words: str) -> None:
    assert old in GOOD
    with pytest.raises(InputError) as refused:
        parse_site(GOOD.replace(old, new, 1), "small.toml")
    text = str(refused.value)
    assert text.startswith("small.toml: ")
    assert words in text
    assert "\n" not in text


def test_a_file_that_is_not_there_or_not_text_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.toml: cannot read"):
        load_site(tmp_path / "nowhere.toml")
    (tmp_path / "picture.toml").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputError, match="not a UTF-8 text file"):
        load_site(tmp_path / "picture.toml")
