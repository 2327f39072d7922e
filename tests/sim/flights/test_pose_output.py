"""The flying daemon gives the autopilot's estimator its pose, and shows the pad where it lands."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from flightd.app.simulation import launch as simulate
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.simulator_config import simulator_config
from flightd.core.types import Phase
from flightd.sim.autopilot.autopilot import AutopilotPeer
from flightd.sim.scenario.scenario import Scenario
from tests.rigs.small_camera import with_small_camera


@pytest.mark.slow
def test_a_flight_tells_its_motion_by_every_frame_and_the_pad_while_near(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: dict[str, list[tuple[Any, Any]]] = {"ODOMETRY": [], "LANDING_TARGET": []}
    aided: list[Any] = []
    receive = AutopilotPeer.received

    def listen(self: AutopilotPeer, channel: Any, message: Any) -> None:
        if message.get_type() in heard and self.armed:
            exposed_ns = getattr(message, "time_usec", 0) * 1000
            heard[message.get_type()].append((message, self.truth_at(exposed_ns)))
        receive(self, channel, message)
        if self.armed and self.truth().height_m > 1.0 and self.vision.aided:
            aided.append(message)

    monkeypatch.setattr(AutopilotPeer, "received", listen)
    scenario = with_small_camera(Scenario())
    mission = 'mission.nodes=["A2"]', "mission.dwell_s=0.5", "mission.autostart_countdown_s=0"
    vehicle = "vehicle.pose_output=odometry", "vehicle.landing_target=true"
    config, site = simulator_config(None, None, scenario, [*mission, *vehicle])
    result = simulate.fly(Simulation(config, site, scenario, 2, None, tmp_path, lambda _: None))
    assert result.phase is Phase.DONE
    poses, targets = heard["ODOMETRY"], heard["LANDING_TARGET"]
    span_s = (poses[-1][0].time_usec - poses[0][0].time_usec) * 1e-6
    assert 18.0 < len(poses) / span_s < 31.0  # by frames in the air, thirty times while it stands
    errors_mps = sorted(
        abs(math.hypot(message.vx, message.vy) - math.hypot(truth.vx_mps, truth.vy_mps))
        for message, truth in poses
        if truth.height_m > 1.0
    )
    assert errors_mps[len(errors_mps) // 2] < 0.05
    assert aided
    pad = site.nodes[site.home.node]
    away_m = [math.hypot(truth.x_m - pad.x_m, truth.y_m - pad.y_m) for _, truth in targets]
    assert 0 < len(targets) < len(poses)
    assert max(away_m) < 1.3
