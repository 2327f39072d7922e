"""The examination of an autopilot's parameters: what it names, what it mends, what it leaves alone."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.examination import Examination, ExaminationReport
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import ParameterFinding, judge
from flightd.adapters.vehicle.mavlink.pose_parameters import pose_rules
from flightd.adapters.vehicle.mavlink.pose_sharing import pose_use
from flightd.adapters.vehicle.mavlink.required_parameters import RULES, Job, advice_for, rules_for
from flightd.adapters.vehicle.mavlink.services.heartbeat_rate import too_slow
from flightd.config.battery import BatteryConfig
from flightd.config.vehicle import PoseChoice
from flightd.core.errors import UnavailableError
from flightd.core.types import PoseUse
from flightd.ports import Clock
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.autopilot.link import MavlinkChannel
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS
from flightd.sim.autopilot.px4 import Px4Peer
from flightd.sim.autopilot.streams import MessageStreams
from flightd.sim.plant.airframe import Airframe
from tests.rigs.event_loops import virtual

_FACTORY = {"GUID_TIMEOUT": 3.0, "FS_GCS_TIMEOUT": 5.0, "FS_THR_ENABLE": 1.0, "BATT_FS_LOW_ACT": 0.0}


@asynccontextmanager
async def examined(
    make_peer: type[ArduCopterPeer | Px4Peer], **parameters: float
) -> AsyncIterator[tuple[AutopilotPeer, Examination]]:
    clock = LoopClock()
    peer = make_peer(clock, Airframe(), PeerConfig(ready_s=0.0, parameters=parameters))
    host, port = await peer.open()
    serving = asyncio.create_task(peer.run())
    examination = Examination(f"udpout://{host}:{port}", clock)
    try:
        async with examination.connected():
            yield peer, examination
    finally:
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)


def required(report: ExaminationReport) -> list[ParameterFinding]:
    """Without what is only advised."""
    return [finding for finding in report.findings if not finding.advised]


def test_the_factory_settings_of_arducopter_are_named_and_mended() -> None:
    async def test() -> None:
        async with examined(ArduCopterPeer, **_FACTORY) as (peer, examination):
            report = await examination.report()
            assert report.firmware is Firmware.ARDUPILOT
            assert report.version == "4.5.6"
            wrong = {finding.name for finding in required(report)}
            assert wrong == {"GUID_TIMEOUT", "FS_GCS_TIMEOUT", "FS_THR_ENABLE", "BATT_FS_LOW_ACT"}
            assert "ARMING_SKIPCHK" in report.unread  # a name of 4.7
            assert await examination.fix(report.findings) == []
            assert peer.parameters["GUID_TIMEOUT"] == pytest.approx(0.3)
            assert required(await examination.report()) == []

    virtual(test())


@pytest.mark.parametrize(
    ("timeout_s", "fits"), [(0.3, False), (0.4, True), (0.5, True), (1, True), (1.5, False)]
)
def test_a_copter_waits_a_second_at_most_for_a_companion_that_is_silent(timeout_s: float, fits: bool) -> None:
    """No longer: it drifts meanwhile; and no shorter: what is lost on the way is no death."""

    async def test() -> None:
        async with examined(ArduCopterPeer, FS_GCS_TIMEOUT=timeout_s) as (peer, examination):
            report = await examination.report()
            assert [finding.name for finding in required(report)] == ([] if fits else ["FS_GCS_TIMEOUT"])
            assert await examination.fix(report.findings) == []
            assert peer.parameters["FS_GCS_TIMEOUT"] == pytest.approx(timeout_s if fits else 0.5)

    virtual(test())


def test_a_limit_that_has_another_unit_in_a_newer_version_is_mended_in_that() -> None:
    (rule,) = (one for one in rules_for(Firmware.ARDUPILOT, Job()) if "WP_ACC_Z" in one.names)
    for name, slow, better in (("WPNAV_ACCEL_Z", 100.0, 250.0), ("WP_ACC_Z", 1.0, 2.5)):
        finding = judge(rule, (name, slow))
        assert finding is not None
        assert finding.better == better
        assert judge(rule, (name, better)) is None
    assert judge(rule, ("WPNAV_ACCEL_Z", 2.5)) is not None


def test_px4s_whole_numbers_are_read_and_written_as_bytes() -> None:
    async def test() -> None:
        async with examined(Px4Peer, COM_OBL_RC_ACT=0, COM_RCL_EXCEPT=0) as (peer, examination):
            report = await examination.report()
            assert report.firmware is Firmware.PX4
            found = {finding.name: finding.value for finding in required(report)}
            assert found == {"COM_OBL_RC_ACT": 0, "COM_RCL_EXCEPT": 0}
            (left,) = await examination.fix(report.findings)
            assert left.name == "COM_RCL_EXCEPT"  # a person must say whether there is RC
            assert peer.parameters["COM_OBL_RC_ACT"] == 4

    virtual(test())


@pytest.mark.parametrize("choice", ["auto", "none", "odometry", "vision_position"])
@pytest.mark.parametrize("firmware", list(Firmware))
def test_what_our_motion_needs_is_advised_where_it_is_left_to_the_autopilot_else_required(
    firmware: Firmware, choice: PoseChoice
) -> None:
    rules = pose_rules(firmware, choice, landing_target=False)
    assert all(rule.advised is (choice == "auto") for rule in rules)
    assert all(rule.better is not None and rule.fits(rule.better) for rule in rules)
    assert all("\n" not in str(judge(rule, (rule.names[0], -7.0))) for rule in rules)


def test_an_arducopter_left_the_choice_takes_our_motion_as_shipped_and_a_px4_is_left_as_it_is() -> None:
    job = Job(pose_output="auto")
    for firmware, values in shipped_parameters():
        rules = pose_rules(firmware, "auto", landing_target=False)
        taken = firmware is Firmware.ARDUPILOT
        assert all(rule.fits(values[rule.names[0]]) for rule in rules) is taken
        assert advice_for(firmware, job) == (rules if taken else ())
    demanded = {rule.names[0] for rule in rules_for(Firmware.PX4, Job(pose_output="odometry"))}
    assert "EKF2_EV_CTRL" in demanded


@pytest.mark.parametrize("bits", range(16))
def test_px4_is_told_our_motion_where_it_takes_the_speed_and_neither_height_nor_heading(bits: int) -> None:
    rules = pose_rules(Firmware.PX4, "auto", landing_target=False)
    use = pose_use(rules, lambda names: (names[0], float(bits) if names[0] == "EKF2_EV_CTRL" else 0.0))
    assert use is (PoseUse.GIVEN if bits in {4, 5} else PoseUse.NOT_TAKEN)
    assert pose_use(rules, lambda _: None) is PoseUse.UNKNOWN


def test_sticks_that_px4_ignores_are_named_and_left_to_a_person() -> None:
    async def test() -> None:
        async with examined(Px4Peer, COM_RC_IN_MODE=4) as (peer, examination):
            (finding,) = [f for f in (await examination.report()).findings if f.name == "COM_RC_IN_MODE"]
            assert "no pilot could take over" in str(finding)
            assert await examination.fix([finding]) == [finding]
            assert peer.parameters["COM_RC_IN_MODE"] == 4

    virtual(test())


class _FixedRates(MessageStreams):
    def set_interval(self, *_: Any) -> int:
        return int(dialect.MAV_RESULT_DENIED)

    def send_now(self, channel: MavlinkChannel, message_id: float) -> int:
        return int(dialect.MAV_RESULT_UNSUPPORTED)


class _DeniesRates(ArduCopterPeer):
    """Firmware that changes no message's interval, and sends none on request."""

    def __init__(self, clock: Clock, airframe: Airframe, config: PeerConfig | None = None) -> None:
        config = config or PeerConfig()
        super().__init__(clock, airframe, config)
        self.streams = _FixedRates(self.link, self, clock.now_ns(), config.step_ns)


def test_the_rate_of_heartbeats_is_measured_and_a_slow_one_is_named() -> None:
    async def test() -> None:
        async with examined(ArduCopterPeer) as (_, examination):
            report = await examination.report()
            assert report.heartbeat_hz == pytest.approx(20.0, abs=2.0)
            assert too_slow(report.heartbeat_hz) is None
        async with examined(_DeniesRates) as (_, examination):
            report = await examination.report()
            assert report.heartbeat_hz == pytest.approx(1.0)
            assert "seen up to 1.0 s late" in str(too_slow(report.heartbeat_hz))
        async with examined(Px4Peer) as (_, examination):  # keeps its rate, and sends one when asked
            report = await examination.report()
            assert too_slow(report.heartbeat_hz) is None

    virtual(test())


@pytest.mark.parametrize(
    ("make_peer", "name"), [(ArduCopterPeer, "EK3_SRC1_POSZ"), (Px4Peer, "EKF2_HGT_REF")]
)
def test_a_climb_rate_that_comes_from_the_range_finder_is_named(
    make_peer: type[ArduCopterPeer | Px4Peer], name: str
) -> None:
    async def test() -> None:
        async with examined(make_peer, **{name: 2}) as (_, examination):
            (finding,) = [one for one in (await examination.report()).findings if one.name == name]
            assert "barometer" in finding.expected
            assert "sticks" in finding.reason

    virtual(test())


def test_an_armed_vehicle_is_left_alone() -> None:
    async def test() -> None:
        async with examined(ArduCopterPeer, **_FACTORY) as (peer, examination):
            assert peer.pilot_arm()
            await asyncio.sleep(1.5)
            report = await examination.report()
            assert report.armed
            assert len(await examination.fix(report.findings)) == len(report.findings)
            assert peer.parameters["GUID_TIMEOUT"] == 3

    virtual(test())


def test_a_value_that_does_not_stay_is_still_found() -> None:
    async def test() -> None:
        async with examined(ArduCopterPeer, **_FACTORY) as (peer, examination):
            report = await examination.report()
            peer.parameters.locked.add("GUID_TIMEOUT")
            (left,) = await examination.fix(report.findings)
            assert left.name == "GUID_TIMEOUT"

    virtual(test())


def test_silence_is_told_in_one_line() -> None:
    async def test() -> None:
        with pytest.raises(UnavailableError, match=r"no ArduPilot or PX4 heard in 5 s"):
            async with Examination("udpout://127.0.0.1:9", LoopClock()).connected():
                pytest.fail("nobody is there")

    virtual(test())


@pytest.mark.parametrize("firmware", list(Firmware))
def test_every_better_value_passes_its_own_rule(firmware: Firmware) -> None:
    for rule in RULES[firmware]:
        assert rule.names
        assert all(len(name) <= 16 for name in rule.names)
        if rule.better is not None:
            assert judge(rule, (rule.names[0], rule.better)) is None, rule.names
        wrong = next(v for v in (-1.0, 0.0, 1.0, 99.0, 256.0) if not rule.fits(v))
        finding = judge(rule, (rule.names[0], wrong))
        assert finding is not None
        assert "\n" not in str(finding)
        assert not math.isnan(finding.value)


CONFIGS = Path(__file__).parents[3] / "configs"


def shipped_parameters() -> list[tuple[Firmware, dict[str, float]]]:
    """The parameter files that are shipped, by firmware."""
    copter = [line.split() for line in (CONFIGS / "arducopter-nogps.parm").read_text().splitlines()]
    px4 = [line.split() for line in (CONFIGS / "px4-nogps.params").read_text().splitlines()]
    return [
        (Firmware.ARDUPILOT, {row[0]: float(row[1]) for row in copter if row and row[0] != "#"}),
        (Firmware.PX4, {row[2]: float(row[3]) for row in px4 if row[0] != "#"}),
    ]


@pytest.mark.parametrize(("firmware", "values"), shipped_parameters(), ids=["arducopter", "px4"])
def test_the_shipped_parameter_files_are_fit_and_complete(
    firmware: Firmware, values: dict[str, float]
) -> None:
    judged = 0
    for rule in RULES[firmware]:
        name = next((name for name in rule.names if name in values), None)
        if name is not None:
            judged += 1
            assert judge(rule, (name, values[name])) is None
        elif rule.better is not None:  # what a fix could write must be there, or be a name of another version
            assert rule.names[-1] in {"ARMING_CHECK", "ARMING_SKIPCHK"}
    assert judged >= 8
    assert all(len(name) <= 16 for name in values)


def test_what_is_shipped_is_what_a_fix_would_write_and_a_simulated_copter_has() -> None:
    (_, shipped), _ = shipped_parameters()
    better = {rule.names[0]: rule.better for rule in RULES[Firmware.ARDUPILOT]}
    for name in ("GUID_TIMEOUT", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT"):
        assert shipped[name] == better[name] == COPTER_PARAMETERS[name]
    assert shipped["FS_GCS_TIMEOUT"] == 0.5
    (low,) = (
        rule
        for rule in rules_for(Firmware.ARDUPILOT, Job(battery=BatteryConfig(cells=3)))
        if rule.names == ("BATT_LOW_VOLT",)
    )
    assert shipped["BATT_LOW_VOLT"] == low.better == COPTER_PARAMETERS["BATT_LOW_VOLT"]


def test_range_finders_and_cells_are_looked_at() -> None:
    async def test() -> None:
        async with examined(ArduCopterPeer) as (_, examination):
            report = await examination.report()
            assert [sample.measures for sample in report.range_finders] == [True]
            assert report.cells == 3

    virtual(test())
