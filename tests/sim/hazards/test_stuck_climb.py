"""A climb rate that stands still, where thrust is ours: it would be answered with ever more of it."""

from __future__ import annotations

import asyncio
import itertools
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flightd.adapters.vehicle.mavlink.climb_check import ClimbCheck
from flightd.cli.main import app
from flightd.core.types import Demand, VehicleState
from flightd.replay.log import read_log
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.sensors.instruments import SensorParams
from tests.rigs.event_loops import virtual
from tests.rigs.small_camera import at_once, small_camera_file
from tests.rigs.vehicles import ardupilot_rig, px4_rig

_STEP_S = 0.02
RAW: dict[str, tuple[Any, dict[str, float]]] = {
    "px4": (px4_rig, {}),
    "ardupilot, raw thrust": (ardupilot_rig, {"GUID_OPTIONS": 8}),
}


def raw_rig(name: str, **config: Any) -> Any:
    make, parameters = RAW[name]
    return make(PeerConfig(ready_s=0.5, parameters=parameters, **config))


def believed(
    told_mps: Callable[[float], float], height_m: Callable[[float], float], wanted_mps: float
) -> list[tuple[float, float]]:
    """Time, s, and climb rate believed in four seconds, by a range finder with 20 samples a second."""
    check, found = ClimbCheck(), []
    for step in range(200):
        now_s = step * _STEP_S
        sampled_s = math.floor(now_s * 20.0) / 20.0
        check.height(round(sampled_s * 1e9) + 1, height_m(sampled_s))
        found.append((now_s, check.believed_mps(round(now_s * 1e9) + 2, told_mps(now_s), wanted_mps)))
    return found


def test_the_heights_slope_is_flown_by_where_the_told_rate_stands_still() -> None:
    rates = believed(lambda _: 0.0, lambda t_s: 0.2 + 0.8 * t_s, wanted_mps=0.8)
    late = [rate_mps for at_s, rate_mps in rates if at_s > 0.9]
    assert late == pytest.approx([0.8] * len(late), abs=0.01)


@pytest.mark.parametrize(
    "height_m",
    [
        pytest.param(lambda _: 0.1, id="it sticks"),
        pytest.param(lambda t_s: 0.1 + 0.12 * (math.floor(t_s * 20.0) % 2), id="it swings"),
        pytest.param(lambda t_s: 0.3 * t_s, id="it follows by a third"),
    ],
)
@pytest.mark.parametrize("told_mps", [0.8, 0.5])
def test_a_range_finder_that_does_not_follow_never_takes_the_rates_place(
    height_m: Callable[[float], float], told_mps: float
) -> None:
    """Neither where the vehicle climbs as it should nor where it is too heavy for that."""
    rates = believed(lambda _: told_mps, height_m, wanted_mps=0.8)
    assert {rate_mps for _, rate_mps in rates} == {told_mps}


@pytest.mark.parametrize("edge_s", [0.05, 0.15, 0.3])
@pytest.mark.parametrize("step_m", [-0.4, 0.4, -1.2, 1.2])
def test_goods_below_are_no_climb(step_m: float, edge_s: float) -> None:
    """By an edge that is passed within so long, while the drone is to have its old height over them."""
    rates = believed(
        lambda _: 0.0, lambda t_s: 2.0 + step_m * min(max(t_s - 1.0, 0.0) / edge_s, 1.0), -0.4 * step_m
    )
    assert {rate_mps for _, rate_mps in rates} == {0.0}


@pytest.mark.parametrize("stuck_mps", [0.0, -0.3])
@pytest.mark.parametrize("make", RAW)
def test_it_never_shoots_up_and_comes_down_by_the_height(make: str, stuck_mps: float) -> None:
    async def test() -> None:
        async with raw_rig(make) as rig:
            await rig.take_off(1.0)
            rig.peer.sensors.fault.climb_stuck_mps = stuck_mps
            fastest_mps = 0.0
            for _ in range(100):
                await rig.stream(0.02, climb_mps=0.4)
                fastest_mps = max(fastest_mps, rig.peer.truth().climb_mps)
            assert fastest_mps < 1.8
            # an ArduPilot that tells no speed at all is known by its height's slope anyway
            if (make, stuck_mps) != ("ardupilot, raw thrust", 0.0):
                assert rig.known().climb_contradicted
            slowest_mps, began_s = 0.0, asyncio.get_running_loop().time()
            while not rig.peer.airframe.on_floor:
                assert asyncio.get_running_loop().time() - began_s < 20.0
                await rig.stream(0.02, climb_mps=-0.3)
                slowest_mps = min(slowest_mps, rig.peer.truth().climb_mps)
            assert slowest_mps > -1.0
            rig.vehicle.demand(Demand.LAND)
            await rig.until(lambda: not rig.peer.armed, 20.0)
            await rig.until(lambda: not rig.known().climb_contradicted)

    virtual(test())


@pytest.mark.parametrize("make", RAW)
def test_a_noisy_range_finder_contradicts_no_sound_rate(make: str) -> None:
    noisy = SensorParams(range_noise_m=0.04, range_dropout=0.08)

    async def test() -> None:
        async with raw_rig(make, sensors=noisy) as rig:
            await rig.take_off(1.0)
            for climb_mps in [0.5, 0.0, 0.3, -0.2, 0.0, 0.1, -0.4, 0.2] * 6:
                await rig.stream(1.0, climb_mps=climb_mps)
                assert not rig.known().climb_contradicted
                if rig.peer.truth().height_m < 0.7:
                    await rig.stream(1.5, climb_mps=0.5)

    virtual(test())


@pytest.mark.slow
def test_a_whole_flight_whose_climb_rate_sticks_from_the_floor_on_stays_below_its_height(
    tmp_path: Path,
) -> None:
    scenario = tmp_path / "stuck.toml"
    scenario.write_text('[[fault]]\nkind = "climb_stuck"\nat_s = 0.0\n')
    seen = ["--scenario", str(scenario), "--scenario", str(small_camera_file(tmp_path))]
    options = [*seen, "--vehicle", "px4", "--out", str(tmp_path / "out"), "--json"]
    result = CliRunner().invoke(app, ["sim", *options, "--set", "mission.nodes=A2", *at_once()])
    assert result.exit_code == 1
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["mission"] == "aborted"
    assert "climb" in summary["reason"]
    assert summary["max_overshoot_m"] < 0.5
    states = read_log(tmp_path / "out" / "flight.mcap").messages(VehicleState)
    kept = [mode for mode, _ in itertools.groupby(state.mode for state in states)]
    assert kept.count("OFFBOARD") == 1, "it is not taken back and forth"
