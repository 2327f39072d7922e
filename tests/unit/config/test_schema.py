"""The configuration: every mistake is one line with file, key and remedy; shipped files are good."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from flightd.config.reference import rows
from flightd.config.schema import Config, load_config, parse_config
from flightd.core.errors import InputError

CONFIGS = Path(__file__).parents[3] / "configs"
FLIGHTS = sorted(path for path in CONFIGS.glob("*.toml") if "[mission]" in path.read_text())
MINIMAL = '[mission]\nsite = "site.toml"\n'


@pytest.mark.parametrize("path", FLIGHTS, ids=lambda path: path.name)
def test_shipped_configurations_load(path: Path) -> None:
    config = load_config(path)
    assert config.mission.site.is_file()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "mission: is missing; add it"),
        ("mission = 1\n", "mission: expected a table, [mission]"),
        ("[mission]\nsite = 1\n", "mission.site: expected a path in quotes"),
        (MINIMAL + "hieght_m = 2\n", "mission.hieght_m: unknown key; did you mean height_m?"),
        (MINIMAL + "colour = 2\n", "mission.colour: unknown key; take it out or correct its spelling"),
        (MINIMAL + "height_m = 99\n", "mission.height_m: 99 is outside 0.5 to 20 m"),
        (MINIMAL + "height_m = nan\n", "mission.height_m: nan is outside 0.5 to 20 m"),
        (MINIMAL + "height_m = 'high'\n", "mission.height_m: expected a number in m"),
        (MINIMAL + "nodes = 'A2'\n", 'mission.nodes: expected a list, e.g. ["A2"]'),
        (MINIMAL + "nodes = [2]\n", "mission.nodes[0]: expected text in quotes"),
        (MINIMAL + "heading = 'left'\n", 'mission.heading: expected one of "along", "shelf"'),
        (MINIMAL + "autostart = 'perhaps'\n", "mission.autostart: expected true or false"),
        (MINIMAL + "battery_start = 30\n", "mission.battery_start: 30 is outside 0 to 1 (share of full)"),
        (MINIMAL + "battery_land = 0.5\n", "mission: battery_land < battery_home <= battery_start is"),
        (MINIMAL + "expert = 3\n", "mission.expert: expected a table, [mission.expert]"),
        (
            MINIMAL + "[mission.expert]\ntouch_mps = 9\n",
            "mission.expert.touch_mps: 9 is outside",
        ),
        (MINIMAL + "[camera]\nwidth_px = 'wide'\n", "camera.width_px: expected a whole number in px"),
        (
            MINIMAL + "[camera]\nmount_offset_m = 1\n",
            "mount_offset_m: expected a list, e.g. [0.0,",
        ),
        (MINIMAL + "[camera]\nmount_offset_m = [1]\n", "camera.mount_offset_m: expected a list of 3 numbers"),
        (
            MINIMAL + "[camera]\nmount_offset_m = [1, 2, 0, 0]\n",
            "mount_offset_m: expected a list of 3 numbers",
        ),
        (MINIMAL + "[vision]\nmethod = 'ai'\n", 'vision.method: expected one of "combined", "centroid", '),
        (MINIMAL + "[hazards]\nsearch_s = 1\n", "hazards.search_s: moved to hazards.expert.search_s"),
        (MINIMAL + "[control.yaw]\noutput_limit = 1\n", "moved to control.expert.yaw_output_limit_radps"),
        ("[mission\n", "not TOML"),
    ],
)
def test_a_mistake_is_one_line_with_file_key_and_remedy(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "flightd.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_config(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"config {path}: ")
    assert words in message


def test_a_missing_file_and_one_that_is_no_text_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load_config(tmp_path / "nothing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_config(tmp_path / "binary.toml")


def test_files_are_found_from_the_configurations_own_folder(tmp_path: Path) -> None:
    path = tmp_path / "flightd.toml"
    path.write_text(MINIMAL + 'progress = "left.json"\n[inventory]\nfolder = "stock"\n')
    config = load_config(path)
    assert config.mission.site == tmp_path / "site.toml"
    assert config.mission.progress == tmp_path / "left.json"
    assert config.inventory.folder == tmp_path / "stock"


def test_a_colour_profile_is_found_beside_the_configuration_and_a_shipped_name_stays_one(
    tmp_path: Path,
) -> None:
    path = tmp_path / "flightd.toml"
    (tmp_path / "orange.npz").write_bytes(b"")
    for told, meant in (
        ("orange.npz", str(tmp_path / "orange.npz")),
        ("yellow", "yellow"),
        ("x" * 999, "x" * 999),
    ):
        path.write_text(MINIMAL + f'[vision]\nprofile = "{told}"\n')
        assert load_config(path).vision.profile == meant


def test_other_values_are_checked_as_those_of_a_file() -> None:
    config = load_config(CONFIGS / "sim.toml")
    other = config.with_values(mission={"dwell_s": 0.5, "expert": {"doubt_s": 1.0}})
    assert (other.mission.dwell_s, other.mission.expert.doubt_s) == (0.5, 1.0)
    assert other.mission.height_m == config.mission.height_m
    assert other.camera is config.camera
    with pytest.raises(ValidationError):
        config.with_values(mission={"dwell_s": -1.0})
    with pytest.raises(ValidationError):
        config.with_values(mission={"dwel_s": 1.0})


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
_SECTIONS = st.sampled_from([*Config.model_fields, "other"])
_KEYS = st.text() | st.sampled_from([row.key for row in rows()])


@given(st.dictionaries(_SECTIONS, _VALUES | st.dictionaries(_KEYS, _VALUES, max_size=4), max_size=4))
def test_no_table_escapes_as_another_error(table: dict[str, object]) -> None:
    table = {**table, "other": 1}
    with pytest.raises(InputError) as caught:
        parse_config(table, Path("fuzz.toml"))
    assert "\n" not in str(caught.value)
