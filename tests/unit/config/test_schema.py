"""The configuration: every mistake is one line with file, key and remedy; shipped files are good."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.hazards import HazardConfig
from flightd.config.schema import Config, load_config, parse_config
from flightd.core.errors import InputError
from flightd.mission.guidance import HazardParams

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
        ("", ["mission", "missing"]),
        ("[mission]\nsite = 1\n", ["mission.site"]),
        (MINIMAL + "hieght_m = 2\n", ["mission.hieght_m", "unknown key"]),
        (MINIMAL + "height_m = 99\n", ["mission.height_m", "less than or equal to 20"]),
        (MINIMAL + "height_m = nan\n", ["mission.height_m"]),
        (MINIMAL + "battery_land = 0.5\n", ["mission", "battery_land < battery_home"]),
        (MINIMAL + "[camera]\nwidth_px = 'wide'\n", ["camera.width_px"]),
        (MINIMAL + "[control.yaw]\nkp = 1\n", ["control.yaw.ki", "missing"]),
        ("[mission\n", ["not TOML"]),
    ],
)
def test_a_mistake_is_one_line_with_file_and_key(text: str, words: list[str], tmp_path: Path) -> None:
    path = tmp_path / "flightd.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_config(path)
    message = str(caught.value)
    assert "\n" not in message
    assert "flightd.toml" in message
    for word in words:
        assert word in message


def test_a_missing_file_and_one_that_is_no_text_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load_config(tmp_path / "nothing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_config(tmp_path / "binary.toml")


def test_the_site_is_found_from_the_configurations_own_folder(tmp_path: Path) -> None:
    path = tmp_path / "flightd.toml"
    path.write_text(MINIMAL)
    assert load_config(path).mission.site == tmp_path / "site.toml"


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
_SECTIONS = st.sampled_from([*Config.model_fields, "other"])


@given(st.dictionaries(_SECTIONS, _VALUES | st.dictionaries(st.text(), _VALUES, max_size=4), max_size=4))
def test_no_table_escapes_as_another_error(table: dict[str, object]) -> None:
    if set(table) == {"mission"}:
        table = {**table, "other": 1}
    with pytest.raises(InputError) as caught:
        parse_config(table, Path("fuzz.toml"))
    assert "\n" not in str(caught.value)


def test_the_hazards_defaults_stand_in_one_place() -> None:
    assert HazardConfig().params() == HazardParams()
