"""An autopilot as it is shipped takes our motion by default; one that is not set up for it flies without."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.config.vehicle import VehicleConfig
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Demand, PoseUse
from flightd.ports import PoseTaker
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS, PX4_PARAMETERS
from flightd.sim.autopilot.px4 import Px4Mode, Px4Peer
from flightd.sim.autopilot.shipped_parameters import shipped_parameters
from flightd.sim.sensors.instruments import SensorParams
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, mavlink_rig

LEAKS = SensorParams(tilt_bias=(0.0, 0.0), tilt_wander_rad=math.radians(0.1), leak_s=2.0)
SHIPPED: dict[str, dict[str, float]] = {
    "ardupilot": dict(shipped_parameters("ardupilot", COPTER_PARAMETERS)),
    "px4": dict(shipped_parameters("px4", PX4_PARAMETERS)),
}


def rig_of(kind: Any, **parameters: float) -> Any:
    """An adapter as it is configured by default, and a peer as it is shipped but for these parameters."""
    make_peer: Any = ArduCopterPeer if kind == "ardupilot" else Px4Peer
    mode = CopterMode.ALT_HOLD if kind == "ardupilot" else Px4Mode.ALTCTL
    config = PeerConfig(ready_s=0.5, sensors=LEAKS, parameters=SHIPPED[kind] | parameters)

    def connect(url: str, clock: LoopClock) -> ArduPilotVehicle | Px4Vehicle:
        vehicle = connect_vehicle(VehicleConfig(kind=kind), clock, url=url)
        assert isinstance(vehicle, ArduPilotVehicle | Px4Vehicle)
        return vehicle

    return mavlink_rig(make_peer, connect, mode, config)


async def share(rig: Rig, seen: list[float]) -> None:
    """What a perfect camera makes of the motion, at each exposure of thirty a second, and 70 ms late."""
    assert isinstance(rig.vehicle, PoseTaker)
    while True:
        await asyncio.sleep(1 / 30)
        stamp_ns = LoopClock().now_ns() - 70_000_000
        truth, state = rig.peer.truth_at(stamp_ns), rig.vehicle.state()
        pose = None
        if state is not None and truth.height_m > 0.5:
            pose = SharedPose(
                stamp_ns,
                state.attitude,
                truth.yaw_rad,
                truth.x_m,
                truth.y_m,
                truth.vx_mps,
                truth.vy_mps,
                truth.height_m,
                (0.001, 0.001),
                (0.001, 0.001),
                0.001,
                1.0,
            )
        rig.vehicle.share_pose(pose)
        drift = max(map(abs, rig.peer.sensors.drift_rad))
        seen.append(math.degrees(drift))


@pytest.mark.parametrize("kind", ["ardupilot", "px4"])
def test_as_shipped_it_is_armed_and_its_attitude_stays_true_by_our_motion(kind: str) -> None:
    async def test() -> None:
        async with rig_of(kind) as rig:
            seen: list[float] = []
            sharing = asyncio.create_task(share(rig, seen))
            try:
                await rig.take_off()
                assert rig.known().pose_use is PoseUse.GIVEN
                for _ in range(3):  # sways, by which the accelerometers alone would be taken in
                    await rig.stream(1.0, roll_rad=0.15)
                    await rig.stream(1.0, roll_rad=-0.15)
                assert rig.peer.vision.aided
                assert rig.peer.vision.rejected == 0
                told = max(seen[-150:])
            finally:
                sharing.cancel()
            alone = []
            for _ in range(6):
                await rig.stream(1.0, roll_rad=0.15)
                await rig.stream(1.0, roll_rad=-0.15)
                alone.append(math.degrees(max(map(abs, rig.peer.sensors.drift_rad))))
            assert not rig.peer.vision.aided
            assert max(alone) > 3.0 * told

    virtual(test())


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("ardupilot", {"VISO_TYPE": 0.0}),
        ("px4", {"EKF2_EV_CTRL": 0}),
        ("px4", {"EKF2_EV_CTRL": 13}),
    ],
)
def test_one_that_is_not_set_up_for_it_is_told_nothing_and_flies(
    kind: str, parameters: dict[str, float]
) -> None:
    async def test() -> None:
        async with rig_of(kind, **parameters) as rig:
            sharing = asyncio.create_task(share(rig, []))
            try:
                await rig.take_off()
            finally:
                sharing.cancel()
            assert rig.known().pose_use is PoseUse.NOT_TAKEN
            assert not rig.peer.vision.is_heard
            assert "does not take our motion" in "".join(rig.texts() or ())

    virtual(test())


def test_arducopter_that_waits_for_our_motion_is_not_armed_without() -> None:
    async def test() -> None:
        async with rig_of("ardupilot") as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(8.0)
            assert not rig.known().armed
            assert "VisOdom: not healthy" in str(rig.known().refusal)

    virtual(test())
