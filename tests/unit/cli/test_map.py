"""`flightd map`: what it prints, writes and refuses."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from flightd.app.build import pilot_of
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.sim.random_sites import random_site
from flightd.sim.scenario.scenario import Scenario
from flightd.site.site_file import load_site, site_toml
from tests.command import Command

DEMO = Path(__file__).parents[3] / "configs" / "site-demo.toml"
HALL_LIF = Path(__file__).parents[1] / "site" / "hall.lif.json"
SVG = "{http://www.w3.org/2000/svg}"


def test_check_tells_what_a_sound_file_holds(flightd: Command) -> None:
    code, out, _ = flightd("map", "check", DEMO, "--json")
    facts = json.loads(out)
    assert code == 0
    assert (facts["ok"], facts["aisles"], facts["nodes"], facts["route_m"]) == (True, 2, 12, 21.8)
    assert "sound" in flightd("map", "check", DEMO)[1]


def test_check_names_the_mistake_in_one_line_and_exits_2(flightd: Command, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(DEMO.read_text().replace('node = "A1"', 'node = "A9"'))
    code, out, err = flightd("map", "check", bad, "--json")
    assert (code, out) == (2, "")
    assert err == f"flightd: {bad}: pad[0] (home).node: there is no node A9\n"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_drawing_is_svg_with_every_node_line_and_shelf(
    flightd: Command, tmp_path: Path, seed: int
) -> None:
    site = random_site(seed)
    file = tmp_path / "site.toml"
    file.write_text(site_toml(site))
    code, out, _ = flightd("map", "draw", file)
    assert (code, out.strip()) == (0, str(tmp_path / "site.svg"))
    picture = ET.parse(tmp_path / "site.svg").getroot()
    texts = {text.text for text in picture.iter(f"{SVG}text")}
    assert set(site.nodes) | {aisle.id for aisle in site.aisles} | {"home"} <= texts
    assert len([r for r in picture.iter(f"{SVG}rect") if r.get("class") == "shelf"]) == len(site.shelves)
    assert len([p for p in picture.iter(f"{SVG}path") if p.get("stroke") == "#6b6047"]) == len(site.lines)
    _, _, width, height = map(float, picture.attrib["viewBox"].split())
    for circle in picture.iter(f"{SVG}circle"):
        assert 0 < float(circle.attrib["cx"]) < width
        assert 0 < float(circle.attrib["cy"]) < height


def test_new_makes_a_site_that_loads(flightd: Command, tmp_path: Path) -> None:
    file = tmp_path / "hall.toml"
    numbers = ("--aisles", 4, "--nodes", 5, "--spacing-m", "1.4,1.7", "--pitch-m", 3.2)
    assert flightd("map", "new", file, *numbers)[0] == 0
    site = load_site(file)
    assert (site.name, len(site.aisles), site.aisles[0].spacing_m) == ("hall", 4, (1.4, 1.7, 1.4, 1.7))
    assert [aisle.y_m for aisle in site.aisles] == [0.0, 3.2, 6.4, 9.6]
    assert len(site.crosses) == 6


def test_a_hall_with_high_labels_and_no_ceiling_given_gets_one_told_and_can_be_flown(
    flightd: Command, tmp_path: Path
) -> None:
    hall = tmp_path / "hall.toml"
    size = ("--aisles", "6", "--nodes", "6", "--spacing-m", "1.4,1.9,1.2,2.1", "--pitch-m", "3.2")
    code, _, err = flightd("map", "new", hall, *size, "--levels-m", "0.4,1.3,2.2")
    assert (code, load_site(hall).ceiling_m) == (0, 4.5)
    assert "ceiling_m = 4.5 is assumed" in err
    simulation = prepare(SimOptions(warehouse=str(hall)), Scenario(), tmp_path / "out", lambda _: None)
    assert pilot_of(simulation.config, simulation.site, simulation.setting.order).plan.nodes


def test_new_keeps_a_file_that_is_there(flightd: Command, tmp_path: Path) -> None:
    file = tmp_path / "hall.toml"
    file.write_text("mine")
    code, _, err = flightd("map", "new", file)
    assert code == 2
    assert "--force" in err
    assert file.read_text() == "mine"
    assert flightd("map", "new", file, "--force")[0] == 0
    assert load_site(file).name == "hall"


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--spacing-m", "wide", "give metres"),
        ("--spacing-m", "nan", "spacing_m[0]: Input should be a finite number"),
        ("--pitch-m", "1.0", "cross lines need"),
        ("--line-colour", "pink", "line_colour"),
        ("--shelf-height-m", "9", "above the ceiling"),
    ],
)
def test_new_refuses_numbers_that_make_no_floor(
    flightd: Command, tmp_path: Path, option: str, value: str, words: str
) -> None:
    code, _, err = flightd("map", "new", tmp_path / "hall.toml", "--ceiling-m", "6", option, value)
    assert code == 2
    assert words in err
    assert err.count("\n") == 1
    assert not (tmp_path / "hall.toml").exists()


def test_check_holds_the_front_camera_against_the_shelves(flightd: Command, tmp_path: Path) -> None:
    file = tmp_path / "hall.toml"
    assert flightd("map", "new", file, "--levels-m", "0.4,1.4", "--positions", 2)[0] == 0
    sees = ("--fov-deg", 70, "--module-mm", 3)
    code, out, _ = flightd("map", "check", file, *sees, "--json")
    facts = json.loads(out)
    assert (code, facts["ok"], facts["scan"]["read_part"]) == (0, True, 1.0)
    assert facts["locations"] == len(load_site(file).locations) > 0
    code, out, _ = flightd("map", "check", file, *sees, "--exposure-ms", 20, "--json")
    facts = json.loads(out)
    assert (code, facts["ok"], facts["scan"]["speed_limit_mps"]) == (1, False, 0.1125)
    assert "problem: 0.3 m/s blurs" in flightd("map", "check", file, *sees, "--exposure-ms", 20)[1]


def test_restrictions_are_told_and_drawn(flightd: Command, tmp_path: Path) -> None:
    text = DEMO.read_text() + (
        '\n[[blocked]]\nnodes = ["A2", "A3"]\n'
        "\n[[keep_out]]\nx0_m = 3.0\ny0_m = 2.5\nx1_m = 3.5\ny1_m = 3.5\nto_m = 2.0\n"
    )
    file = tmp_path / "site.toml"
    file.write_text(text.replace('id = "B"\n', 'id = "B"\none_way = "+x"\n'))
    facts = json.loads(flightd("map", "check", file, "--json")[1])
    assert (facts["one_way"], facts["keep_outs"], facts["closed"]) == (5, 1, 3)
    _, out, _ = flightd("map", "draw", file)
    svg = ET.parse(out.strip()).getroot()
    classes = [part.get("class") for part in svg.iter()]
    assert (classes.count("shut"), classes.count("keep"), classes.count("way")) == (3, 1, 3)


def test_maps_go_out_to_other_programs_and_come_back_as_the_same_floor(
    flightd: Command, tmp_path: Path
) -> None:
    site = tmp_path / "hall.toml"
    site.write_text(site_toml(random_site(4)))
    for kind, ending in (("lif", ".lif.json"), ("csv", "-nodes.csv")):
        out = tmp_path / f"hall{ending}"
        code, told, _ = flightd("map", "export", site, "--as", kind)
        assert (code, told.splitlines()[0]) == (0, str(out))
        assert ("  LIF does not hold aisle.cross_half_m (" in told) == (kind == "lif")
        back = tmp_path / f"{kind}.toml"
        code, told, _ = flightd("map", "import", out, back, "--json")
        assert (code, json.loads(told)["ok"]) == (0, True)
        places = [
            {node.id: (node.x_m, node.y_m) for node in load_site(one).nodes.values()} for one in (site, back)
        ]
        assert places[1].keys() == places[0].keys()
        assert all(places[1][node] == pytest.approx(places[0][node]) for node in places[0])
    code, _, err = flightd("map", "import", tmp_path / "hall-nodes.csv", tmp_path / "csv.toml")
    assert code == 2
    assert "there already" in err


def test_a_map_goes_back_onto_the_file_that_it_came_from(flightd: Command, tmp_path: Path) -> None:
    base, site, out = HALL_LIF, tmp_path / "hall.toml", tmp_path / "out.lif.json"
    code, told, _ = flightd("map", "import", base, site, "--vehicle", "acme.drone")
    assert code == 0
    assert "  of stations not held by a site: stationDescription (1), stationName (1), theta (1)\n" in told
    onto = ("map", "export", site, "--onto", base, "--vehicle", "acme.drone", "--out", out)
    assert flightd(*onto)[:2] == (0, f"{out}\n")
    was, now = json.loads(base.read_text()), json.loads(out.read_text())
    assert now["layouts"] == was["layouts"]
    for wrong, words in (
        (
            ("map", "import", base, site, "--vehicle", "x"),
            f"{base}: no vehicle type is called 'x'; the file has",
        ),
        ((*onto, "--as", "csv"), "--onto: only a LIF is written onto another; leave out --as"),
        (("map", "export", site, "--vehicle", "acme.drone"), "--vehicle: it says of which vehicles the ways"),
        (("map", "export", site, "--onto", tmp_path), f"{tmp_path}: cannot read it"),
        (("map", "export", site, "--onto", site), f"{site}: this is no JSON, and so no LIF"),
    ):
        code, told, err = flightd(*wrong)
        assert (code, told) == (2, "")
        assert err.startswith(f"flightd: {words}")


def test_a_map_that_is_not_sound_yet_is_imported_and_says_so(flightd: Command, tmp_path: Path) -> None:
    table = tmp_path / "survey.csv"
    table.write_text("node;x_m;y_m;joined_to\nA1;0;0;B1\nA2;1,5;0;\nB1;0,02;0,8;\nB2;1,5;0,8;\n")
    code, out, _ = flightd("map", "import", table, tmp_path / "s.toml")
    assert code == 1
    assert "not sound yet: aisle (B).y_m: aisles A and B are 0.8 m apart" in out
    assert flightd("map", "check", tmp_path / "s.toml")[0] == 2


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.json", b"{", "no JSON, and so no LIF"),
        ("a.json", b"{}", "has no list 'layouts': this is no LIF"),
        ("a.csv", b"node,x_m,y_m\nA1,0,zero\n", "row 2: y_m is 'zero'"),
        ("a.csv", b'node,x_m,y_m\n"A1,0,0\n', "no CSV"),
        ("a.csv", b"\xff\xfe", "no UTF-8 text"),
    ],
)
def test_what_is_no_map_of_anybody_is_refused(
    flightd: Command, tmp_path: Path, name: str, data: bytes, words: str
) -> None:
    (tmp_path / name).write_bytes(data)
    code, out, err = flightd("map", "import", tmp_path / name, tmp_path / "s.toml")
    assert (code, out) == (2, "")
    assert err.startswith(f"flightd: {tmp_path / name}: ")
    assert words in err
    assert not (tmp_path / "s.toml").exists()


def test_fit_refuses_names_that_it_cannot_write_before_it_fits(flightd: Command, tmp_path: Path) -> None:
    log = tmp_path / "none.mcap"  # names come first, so that nobody waits for a fit that cannot be kept
    out = tmp_path / "hall.svg"
    for more in ((), ("--force",)):
        code, _, err = flightd("map", "fit", log, "--out", out, *more)
        assert (code, err) == (
            2,
            f"flightd: {out}: would be written twice; choose a name that ends otherwise\n",
        )
    out.write_text("a drawing")
    code, _, err = flightd("map", "fit", log, "--out", tmp_path / "hall.toml")
    assert (code, f"{out}: there already" in err) == (2, True)
    assert [file.name for file in tmp_path.iterdir()] == ["hall.svg"]
    code, _, err = flightd("map", "fit", log, "--out", tmp_path, "--force")
    assert (code, f"{tmp_path}: cannot write: it is a folder" in err) == (2, True)
