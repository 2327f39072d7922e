"""An autopilot as it is shipped takes our motion by default; one that is not set up for it flies without."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import pytest

from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm
from flightd.adapters.vehicle.mavlink.pose_parameters import pose_rules
from flightd.adapters.vehicle.mavlink.pose_sharing import PoseSharing, pose_use
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.config.vehicle import PoseChoice, VehicleConfig
from flightd.core.refusal import words
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude, Demand, Event, EventLevel, LandedState, PoseUse, VehicleState
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


CANBERRA_DEG = (-35.363262, 149.165237)


def rig_of(
    kind: Any,
    settings: Mapping[str, Any] = MappingProxyType({}),
    place_deg: tuple[float, float] = (51.4778, 0.0),
    /,
    **parameters: float,
) -> Any:
    """An adapter as it is configured by default but for these settings, and a peer at a place on earth as it
    is shipped but for these parameters."""
    make_peer: Any = ArduCopterPeer if kind == "ardupilot" else Px4Peer
    mode = CopterMode.ALT_HOLD if kind == "ardupilot" else Px4Mode.ALTCTL
    config = PeerConfig(
        ready_s=0.5,
        sensors=LEAKS,
        has_position=settings.get("flying_mode") == "guided",
        place_deg=place_deg,
        parameters=SHIPPED[kind] | parameters,
    )

    def connect(url: str, clock: LoopClock) -> ArduPilotVehicle | Px4Vehicle:
        vehicle = connect_vehicle(VehicleConfig(kind=kind, **settings), clock, url=url)
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


@pytest.mark.parametrize(("kind", "parameters"), [("ardupilot", {}), ("px4", {"EKF2_EV_CTRL": 4})])
def test_set_to_take_our_motion_it_is_armed_and_its_attitude_stays_true(
    kind: str, parameters: dict[str, float]
) -> None:
    async def test() -> None:
        async with rig_of(kind, **parameters) as rig:
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
    ("kind", "parameters", "level"),
    [
        ("ardupilot", {"VISO_TYPE": 0.0}, EventLevel.WARNING),
        ("px4", {}, EventLevel.INFO),  # as shipped
        ("px4", {"EKF2_EV_CTRL": 13}, EventLevel.INFO),
    ],
)
def test_one_that_is_not_set_up_for_it_is_told_nothing_and_flies(
    kind: str, parameters: dict[str, float], level: EventLevel, monkeypatch: pytest.MonkeyPatch
) -> None:
    events: list[Event] = []

    async def test() -> None:
        async with rig_of(kind, **parameters) as rig:
            notify = rig.vehicle.notify

            def keep(event: Event) -> None:
                events.append(event)
                notify(event)

            monkeypatch.setattr(rig.vehicle, "notify", keep)
            sharing = asyncio.create_task(share(rig, []))
            try:
                await rig.take_off()
            finally:
                sharing.cancel()
            assert rig.known().pose_use is PoseUse.NOT_TAKEN
            assert not rig.peer.vision.is_heard
            assert "does not take our motion" in "".join(rig.texts() or ())
            assert [event.level for event in events if event.name == "pose_output"] == [level]

    virtual(test())


@pytest.mark.parametrize(("viso", "least_m", "most_m"), [(1.0, 0.2, 2.0), (0.0, 2.5, 9.0)])
def test_arducopter_brakes_when_its_companion_dies_only_if_it_took_our_motion(
    viso: float, least_m: float, most_m: float
) -> None:
    async def test() -> None:
        async with rig_of("ardupilot", VISO_TYPE=viso) as rig:
            sharing = asyncio.create_task(share(rig, []))
            try:
                await rig.take_off()
                await rig.stream(1.2, pitch_rad=-0.1)
            finally:
                sharing.cancel()
            begun = rig.peer.truth()
            assert math.hypot(begun.vx_mps, begun.vy_mps) > 0.6
            rig.cut(True)
            await rig.until(lambda: not rig.peer.armed, 20.0)
            ended = rig.peer.truth()
            assert least_m < math.hypot(ended.x_m - begun.x_m, ended.y_m - begun.y_m) < most_m

    virtual(test())


def test_arducopter_that_takes_our_motion_is_armed_wherever_on_earth_it_stands() -> None:
    async def test() -> None:
        async with rig_of("ardupilot", {}, CANBERRA_DEG) as rig:
            sharing = asyncio.create_task(share(rig, []))
            try:
                await rig.take_off()
                await rig.stream(1.0)
                assert rig.known().pose_use is PoseUse.GIVEN
                assert rig.peer.vision.aided
            finally:
                sharing.cancel()

    virtual(test())


@pytest.mark.parametrize(("settings", "armed"), [({}, False), ({"origin_deg": CANBERRA_DEG}, True)])
def test_arducopter_in_guided_is_not_armed_by_an_origin_where_the_earths_field_is_another(
    settings: dict[str, Any], armed: bool
) -> None:
    async def test() -> None:
        guided = {"flying_mode": "guided"} | settings
        async with rig_of("ardupilot", guided, CANBERRA_DEG) as rig:
            sharing = asyncio.create_task(share(rig, []))
            try:
                await rig.until(lambda: rig.vehicle.state() is not None)
                await asyncio.sleep(5.0)
                rig.vehicle.demand(Demand.FLY)
                await asyncio.sleep(5.0)
                assert rig.peer.armed is armed
                refusal = words(rig.known().refusal)
                assert armed or "Check mag field (z diff:" in refusal
                assert armed or "vehicle.origin_deg is the shipped default: set it" in refusal
            finally:
                sharing.cancel()

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


@pytest.mark.parametrize("choice", ["auto", "odometry"])
def test_what_sharing_needs_is_known_whether_it_is_advised_or_demanded(choice: PoseChoice) -> None:
    """An examination waits for the ground; one found flying is told of its motion all the same."""
    rules = pose_rules(Firmware.ARDUPILOT, choice, landing_target=False)
    sharing = PoseSharing(PoseForm.ODOMETRY, Firmware.ARDUPILOT, rules, lambda _: None)
    assert ("EK3_SRC1_VELXY",) in sharing.needed_names
    assert ("VISO_DELAY_MS",) not in sharing.needed_names
    assert not PoseSharing(None, Firmware.ARDUPILOT, rules, lambda _: None).needed_names


def test_a_delay_that_is_read_and_wrong_keeps_the_motion_back() -> None:
    rules = pose_rules(Firmware.ARDUPILOT, "auto", landing_target=False)
    values = {name: float(rule.better or 0) for rule in rules for name in rule.names}
    assert pose_use(rules, read_of(values)) is PoseUse.GIVEN
    values["VISO_DELAY_MS"] = 10.0
    assert pose_use(rules, read_of(values)) is PoseUse.NOT_TAKEN
    del values["VISO_DELAY_MS"]
    assert pose_use(rules, read_of(values)) is PoseUse.GIVEN


@pytest.mark.parametrize(
    ("before", "height_m", "stands"),
    [
        (LandedState.ON_GROUND, math.nan, True),  # not off the floor yet
        (LandedState.IN_AIR, math.nan, False),  # it sinks with little thrust, unmeasured
        (LandedState.IN_AIR, 0.1, True),
        (LandedState.IN_AIR, 0.8, False),
    ],
)
def test_one_that_flew_stands_only_where_its_height_says_so(
    before: LandedState, height_m: float, stands: bool
) -> None:
    rules = pose_rules(Firmware.PX4, "odometry", landing_target=False)
    values = {name: float(rule.better or 0) for rule in rules for name in rule.names}
    sharing = PoseSharing(PoseForm.ODOMETRY, Firmware.PX4, rules, read_of(values))
    list(sharing.messages(0, told(before, 1.0), None, None))
    now_ns = 1_000_000_000
    sent = list(sharing.messages(now_ns, told(LandedState.ON_GROUND, height_m), None, None))
    assert bool(sent) is stands


def read_of(values: dict[str, float]) -> Callable[[tuple[str, ...]], tuple[str, float] | None]:
    return lambda names: (names[0], values[names[0]]) if names[0] in values else None


def told(landed: LandedState, height_m: float) -> VehicleState:
    """An armed vehicle's state."""
    level = Attitude(0, 0.0, 0.0, 0.0)
    return VehicleState(level, height_m, 0, 0.0, "GUIDED", True, True, landed, 0.9, 12.0, 0)
