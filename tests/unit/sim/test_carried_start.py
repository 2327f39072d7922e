"""A scenario may carry the drone off before it flies: it stands elsewhere, the daemon is not told."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.simulation.ports import free_ports
from flightd.app.simulation.simulation import Simulation, world_spec
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.runtime.clock import LoopClock
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.scenario_files import load_scenario
from flightd.sim.world import World
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual

CONFIGS = Path(__file__).parents[3] / "configs"


def test_the_drone_stands_where_the_scenario_carried_it(tmp_path: Path) -> None:
    file = tmp_path / "carried.toml"
    file.write_text("[vehicle]\nstart_offset_m = [1.5, -0.2]\nstart_yaw_deg = 10.0\n")
    site, config = load_site(CONFIGS / "site-demo.toml"), load_config(CONFIGS / "sim.toml")
    simulation = Simulation(config, site, load_scenario(file), 1, None, tmp_path)

    async def start() -> Kinematics:
        with McapRecorder(tmp_path / "truth.mcap", when_full=wait_for_disk) as recorder:
            spec = world_spec(simulation, free_ports(config))
            return World(spec, LoopClock(), recorder).vehicle.truth()

    truth = virtual(start())
    pad_x_m, pad_y_m = site.pad_centre(site.home)
    assert (truth.x_m - pad_x_m, truth.y_m - pad_y_m) == pytest.approx((1.5, -0.2))
    assert math.degrees(truth.yaw_rad) == pytest.approx(config.mission.start_yaw_deg + 10.0)


@pytest.mark.parametrize(
    "key", ["start_offset_m = [1.0]", "start_offset_m = [nan, 0]", "start_yaw_deg = 200"]
)
def test_a_start_that_is_none_is_one_clear_line(tmp_path: Path, key: str) -> None:
    file = tmp_path / "carried.toml"
    file.write_text(f"[vehicle]\n{key}\n")
    with pytest.raises(InputError, match=rf"carried\.toml: vehicle\.{key.partition(' ')[0]}"):
        load_scenario(file)
