"""Scenario files with faults: typed, found by name, laid over each other, one for each hazard."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.app.simulation.process_faults import check_faults
from flightd.app.simulation.scenario_sweep import hazard_scenarios
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.fault_schema import BareFloor, CameraFault
from flightd.sim.scenario.faults import FaultSchedule, bare_boxes
from flightd.sim.scenario.scenario_files import load_scenario, load_scenarios, shipped_scenarios
from flightd.site.site_file import load_site

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
FLOOR = Kinematics(0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
FROZEN = '[[fault]]\nkind = "camera_frozen"\nat_s = 2.0\nduration_s = 1.0\n'
EXPECT = FROZEN + '[expect]\nhazard = "camera_frozen"\nends = "landed"\n'


def written(folder: Path, text: str, name: str = "s.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_every_hazard_has_a_shipped_scenario_and_every_shipped_scenario_names_a_hazard() -> None:
    shipped = {name: load_scenario(path) for name, path in shipped_scenarios().items()}
    assert {row.name for row in HAZARDS} <= set(shipped)
    rows = hazard_scenarios()
    assert set(shipped) == set(rows)
    for name, scenario in shipped.items():
        assert scenario.expect is not None
        assert scenario.expect.hazard == rows[name].name
        FaultSchedule(scenario.fault, SITE)  # its places are on the demo site


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[[fault]]\nkind = "gremlin"\nat_s = 1\n', r"s\.toml: fault\.0: .*'camera_frozen'"),
        ('[[fault]]\nkind = "camera_frozen"\nat_s = 1\nvolume = 3\n', r"fault\.0\.camera_frozen\.volume"),
        (
            '[[fault]]\nkind = "camera_frozen"\n',
            "give one of at_s, .*, or from_start",
        ),
        ('[[fault]]\nkind = "camera_frozen"\nat_s = 1\nat_node = "A2"\n', "give one of"),
        ('[[fault]]\nkind = "camera_frozen"\nat_x_m = 1\n', "belong together"),
        ('[[fault]]\nkind = "camera_frozen"\nat_s = 1\nfrom_start = true\n', "give one of"),
        ('[[fault]]\nkind = "step_fails"\nfrom_start = true\n', "for vehicle, air and cameras"),
        ('[[fault]]\nkind = "bare_floor"\nat_s = 1\n', "at a place for good"),
        ('[[fault]]\nkind = "bare_floor"\nfrom_start = true\n', "at a place for good"),
        ('[[fault]]\nkind = "battery"\nat_s = 1\ncharge = 1.5\n', r"fault\.0\.battery\.charge"),
        ("fault = 3\n", "fault"),
        ("[vehicle]\nswap_s = 9.0\ncontact_s = 90.0\n", r"s\.toml: vehicle: .*leave one out"),
        (EXPECT + 'bears = ["left_leg"]\n', r"expect\.bears"),
        (EXPECT + 'tolerates = ["gremlin"]\n', r"expect\.tolerates: .*no such fault: 'gremlin'"),
        (EXPECT + 'tolerates = ["hit_rack"]\n', "'hit_rack' must never be, whatever goes wrong"),
    ],
)
def test_a_scenario_that_is_none_is_refused_in_one_clear_line(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=told) as refused:
        load_scenario(written(tmp_path, text))
    assert "\n" not in str(refused.value)


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"--scenario lines_last: no such scenario.*lines_lost"):
        load_scenarios(["lines_last"])


def test_scenarios_laid_over_each_other_have_all_faults_and_refuse_a_conflict(tmp_path: Path) -> None:
    one = written(tmp_path, "[wind]\ngust_mps = 0.2\n" + FROZEN, "one.toml")
    two = written(tmp_path, "[wind]\ngust_mps = 0.2\nmean_x_mps = 1.0\n" + FROZEN, "two.toml")
    three = written(tmp_path, "[wind]\ngust_mps = 0.3\n", "three.toml")
    both = load_scenarios([str(one), str(two)])
    assert len(both.fault) == 2
    assert (both.wind.gust_mps, both.wind.mean_x_mps) == (0.2, 1.0)
    with pytest.raises(InputError, match=re.escape(f"{three}: wind.gust_mps: {one} gives another value")):
        load_scenarios([str(one), str(two), str(three)])


def test_a_fault_begins_so_long_after_take_off_and_ends() -> None:
    schedule = FaultSchedule([CameraFault(kind="camera_black", at_s=2.0, duration_s=1.0)], SITE)
    turns = []
    for tenth in range(100):
        now_ns = tenth * 100_000_000
        height_m = 0.1 if tenth < 30 else 1.6
        turns += [(tenth, *turn) for turn in schedule.step(now_ns, replace(FLOOR, height_m=height_m))]
    assert turns == [(50, 0, True), (60, 0, False)]


def test_a_fault_from_the_start_is_there_while_it_stands_and_others_are_not() -> None:
    there = CameraFault(kind="camera_black", from_start=True, duration_s=2.0)
    schedule = FaultSchedule([there, CameraFault(kind="camera_gone", at_s=0.0)], SITE)
    assert schedule.step(0, FLOOR) == [(0, True)]
    assert schedule.step(1_000_000_000, FLOOR) == []
    assert schedule.step(2_000_000_000, replace(FLOOR, height_m=0.3)) == [(0, False), (1, True)]


def test_a_fault_begins_at_its_place_and_nowhere_else() -> None:
    fault = CameraFault(kind="camera_black", at_node="A2")
    schedule = FaultSchedule([fault], SITE)
    node = SITE.nodes["A2"]
    assert schedule.step(0, replace(FLOOR, height_m=1.6)) == []
    there = replace(FLOOR, height_m=1.6, x_m=node.x_m - 0.3, y_m=node.y_m)
    assert schedule.step(1, there) == [(0, True)]
    with pytest.raises(InputError, match="no node Z9"):
        FaultSchedule([CameraFault(kind="camera_black", at_node="Z9")], SITE)


def test_the_floor_is_bare_in_a_square_around_the_place() -> None:
    fault = BareFloor(kind="bare_floor", at_x_m=3.0, at_y_m=1.0, half_m=0.5)
    assert bare_boxes([fault], SITE) == ((2.5, 0.5, 3.5, 1.5),)


@pytest.mark.parametrize(
    ("text", "vehicle", "external", "told"),
    [
        ('kind = "height_lost"', "ardrone", False, "only the simulated MAVLink autopilots"),
        ('kind = "height_lost"', "ardupilot", True, "only the simulated MAVLink autopilots"),
        ('kind = "battery"\ncharge = 0.1', "ardupilot", True, "leave out --truth-url"),
        ('kind = "camera_gone"\ncamera = "front"', "ardupilot", False, "no front camera"),
    ],
)
def test_a_fault_that_a_vehicle_cannot_have_is_refused(
    tmp_path: Path, text: str, vehicle: str, external: bool, told: str
) -> None:
    scenario = load_scenario(written(tmp_path, f"[[fault]]\nat_s = 1\n{text}\n"))
    config = load_config(CONFIGS / "sim.toml")
    config = config.model_copy(update={"vehicle": config.vehicle.model_copy(update={"kind": vehicle})})
    with pytest.raises(InputError, match=told):
        check_faults(scenario.fault, config, SITE, external=external)
