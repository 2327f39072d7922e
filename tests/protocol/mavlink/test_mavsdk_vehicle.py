"""MAVSDK's own setpoint repeater never keeps a dead loop flying; what the adapter refuses, and why."""

from __future__ import annotations

import asyncio
import json
import math
import random
import sys
import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mavsdk.plugins.telemetry import LandedState as SdkLanded
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.transport import make_transport
from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavsdk.connection import MavsdkConnection
from flightd.adapters.vehicle.mavsdk.gate import FRESH_NS, SetpointGate, message_id
from flightd.adapters.vehicle.mavsdk.library import whole_fields
from flightd.adapters.vehicle.mavsdk.telemetry import MavsdkTelemetry
from flightd.adapters.vehicle.mavsdk.vehicle import MavsdkVehicle
from flightd.config.vehicle import VehicleConfig
from flightd.core.errors import UnavailableError
from flightd.core.refusal import words
from flightd.core.types import Attitude, Demand, LandedState
from flightd.ports import CountsDrops
from flightd.runtime.clock import LoopClock
from flightd.runtime.event_loops import ScaledLoop
from flightd.runtime.free_ports import free_port
from flightd.runtime.within import Within
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.link import MavlinkChannel, Message
from flightd.sim.autopilot.px4 import Px4Mode, Px4Peer
from flightd.sim.plant.airframe import Airframe
from tests.rigs.event_loops import real, run_in
from tests.rigs.patient_loop import patient
from tests.rigs.vehicles import Rig, mavlink_rig, mavsdk_rig


class _CountingPx4(Px4Peer):
    """Counts the setpoints that reach it."""

    def __init__(self, clock: LoopClock, airframe: Airframe, config: PeerConfig | None = None) -> None:
        super().__init__(clock, airframe, config)
        self.setpoints = 0
        self.streaming = asyncio.Event()
        """Set once they keep it in OFFBOARD."""

    def _setpoint(self, message: Message) -> None:
        super()._setpoint(message)
        self.setpoints += 1
        if self.mode == Px4Mode.OFFBOARD:
            self.streaming.set()


class _DeafToModes(Px4Peer):
    """Neither obeys nor answers a change of mode."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.passed_over: list[Message] = []

    def received(self, channel: MavlinkChannel, message: Message) -> None:
        if message.get_type() == "COMMAND_LONG" and message.command == 176:
            self.passed_over.append(message)
        else:
            super().received(channel, message)


def _packed(message: Message, *, v1: bool = False) -> bytes:
    frame: bytes = message.pack(dialect.MAVLink(None, 1, 191), force_mavlink1=v1)
    return frame


_TARGET = dialect.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.5)
_COMMAND = dialect.MAVLink_command_long_message(1, 1, 511, 0, 0, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("v1", [False, True])
def test_the_gate_passes_set_points_only_while_they_are_fresh_and_all_else_always(v1: bool) -> None:
    gate = SetpointGate()
    setpoint, command = _packed(_TARGET, v1=v1), _packed(_COMMAND, v1=v1)
    assert message_id(setpoint) == 82
    assert not gate.passes(setpoint, 5)
    gate.refresh(1_000)
    assert gate.passes(setpoint, 1_000 + FRESH_NS - 1)
    assert not gate.passes(setpoint, 1_000 + FRESH_NS)
    gate.refresh(2_000_000_000)
    gate.close()
    assert not gate.passes(setpoint, 2_000_000_001)
    assert gate.passes(command, 2_000_000_001)
    assert gate.passes(b"", 2_000_000_001)
    assert gate.held_back == 3


@given(frame=st.binary(max_size=60), marker=st.sampled_from([b"", b"\xfd", b"\xfe"]))
def test_the_gate_takes_any_bytes_and_holds_back_only_whole_frames(frame: bytes, marker: bytes) -> None:
    gate = SetpointGate()
    if not gate.passes(marker + frame, 5):
        assert message_id(marker + frame) in {11, 75, 76, 82}


def test_frames_that_no_line_takes_are_counted_and_those_held_back_are_not() -> None:
    async def test() -> None:
        clock, gate = LoopClock(), SetpointGate()
        line = MavsdkConnection(make_transport(parse_endpoint("tcp:127.0.0.1:9")), gate, clock)  # not open
        line.send(_packed(_COMMAND))
        line.send(_packed(_TARGET))
        assert (line.dropped, gate.held_back) == (1, 1)
        vehicle = MavsdkVehicle("tcp:127.0.0.1:9", clock)
        assert isinstance(vehicle, CountsDrops)
        assert vehicle.dropped == 0

    real(test())


_SET_MODE = dialect.MAVLink_command_long_message(1, 1, 176, 1, 1, 6, 0, 0, 0, 0, 0)
_COMMANDS = (
    _SET_MODE,
    dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
    dialect.MAVLink_command_long_message(1, 1, 21, 1, 0, 0, 0, math.nan, 0, 0, 0),
    dialect.MAVLink_command_int_message(1, 1, 0, 176, 0, 0, 1, 6, 0, 0, 0, 0, 0),
    dialect.MAVLink_set_mode_message(1, 1, 6 << 16),
)


@pytest.mark.parametrize("v1", [False, True])
def test_the_gate_passes_changes_of_mode_and_arming_only_while_we_command(v1: bool) -> None:
    gate = SetpointGate()
    for message in _COMMANDS:
        frame = _packed(message, v1=v1)
        gate.commanding = False
        assert not gate.passes(frame, 5), message
        gate.commanding = True
        assert gate.passes(frame, 5), message
    gate.commanding = False
    assert gate.passes(_packed(_COMMAND), 5)


def test_the_library_repeats_no_change_of_mode_once_we_let_go() -> None:
    async def test() -> None:
        async with mavlink_rig(_DeafToModes, MavsdkVehicle, Px4Mode.ALTCTL) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            heard = rig.peer.passed_over
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: bool(heard))
            rig.vehicle.demand(Demand.HANDS_OFF)
            await asyncio.sleep(0.1)
            heard.clear()
            await asyncio.sleep(2.5)
            assert not heard
            assert isinstance(rig.vehicle, MavsdkVehicle)
            assert rig.vehicle.gate.held_back > 0

    patient(test())


def test_a_landed_state_is_believed_for_a_second() -> None:
    readings = MavsdkTelemetry(ClockSync())
    readings.take_landed(SdkLanded.ON_GROUND, 5)
    assert readings.landed(5 + 10**9) is LandedState.ON_GROUND
    assert readings.landed(6 + 10**9) is LandedState.UNKNOWN


_ATTITUDE = ("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
_RANGED = {
    "id": 0,
    "orientation": 25,
    "current_distance": 160,
    "min_distance": 10,
    "max_distance": 800,
    "signal_quality": 0,
}


def test_a_range_finder_whose_signal_is_none_tells_no_height() -> None:
    """As over our own link: the library's form of the message leaves the quality out."""
    readings = MavsdkTelemetry(ClockSync())
    readings.take_range(json.dumps(_RANGED), 1)
    assert readings.height_m(2) == pytest.approx(1.6)
    readings.take_range(json.dumps(_RANGED | {"signal_quality": 1, "current_distance": 30}), 3)
    assert readings.height_m(4) == pytest.approx(1.6)
    readings.take_range(json.dumps(_RANGED | {"id": 1, "current_distance": 30, "signal_quality": 90}), 5)
    assert readings.height_m(6) == pytest.approx(0.3), "disarmed, the better one is chosen"
    readings.take_range("{}", 7)
    assert readings.height_m(8) == pytest.approx(0.3)


def test_attitudes_keep_their_time_when_boot_times_begin_anew_after_49_days() -> None:
    """They were taken for a reboot's, and had the time of their arrival from then on."""
    sync, ms = ClockSync(), 1_000_000
    wrap_ms, late_ns = 2**32, 30 * ms
    boot_ns = -(wrap_ms - 3_000) * ms  # ours at their boot
    readings = MavsdkTelemetry(sync)
    for now_ns in range(0, 6_000 * ms, 100 * ms):
        asked = sync.ask(now_ns)
        assert sync.answered(asked, asked - boot_ns, asked + 2 * ms)
        angles = dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": (now_ns - boot_ns) // ms % wrap_ms}
        readings.take_attitude(json.dumps(angles), now_ns + late_ns)
        (attitude,) = readings.attitudes()
        assert attitude.stamp_ns == pytest.approx(now_ns, abs=2 * ms)


def test_attitudes_whose_time_makes_no_sense_are_counted_and_make_no_reboot_of_the_next() -> None:
    """The count was always 0: a clock that jumped was never found by it."""
    sync, ms = ClockSync(), 1_000_000
    readings = MavsdkTelemetry(sync)
    readings.take_mode(1, 1)

    def refused(now_ms: int, boot_ms: int) -> int:
        angles = dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": boot_ms}
        readings.take_attitude(json.dumps(angles), now_ms * ms)
        state = readings.state(now_ms * ms, in_control=True, refusal=None)
        assert state is not None
        return state.stamps_refused

    for now_ms in range(1_000, 3_000, 100):
        asked = sync.ask(now_ms * ms)
        assert sync.answered(asked, asked + 500 * ms, asked + 2 * ms)
        assert refused(now_ms + 10, now_ms + 500) == 0
    assert refused(3_010, 9_500) == 1, "seconds ahead"
    assert refused(3_110, 3_600) == 1, "as before"
    assert refused(3_210, 3_000) == 2, "long past"


def test_the_current_of_the_battery_is_taken_where_it_is_known() -> None:
    readings = MavsdkTelemetry(ClockSync())
    readings.take_mode(1, 1)
    readings.take_attitude(json.dumps(dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": 7}), 1)
    for told_a, taken_a in ((14.2, 14.2), (math.nan, math.nan), (-0.01, math.nan)):
        battery = SimpleNamespace(id=0, voltage_v=15.0, remaining_percent=80.0, current_battery_a=told_a)
        readings.take_battery(battery, 2)
        state = readings.state(3, in_control=True, refusal=None)
        assert state is not None
        assert state.battery_a == pytest.approx(taken_a, nan_ok=True)


def test_whatever_the_library_hands_over_nothing_raises_and_nothing_absurd_is_believed() -> None:
    rng = random.Random(11)
    odd = [math.nan, math.inf, -math.inf, 1e30, -1.0, 0.0, 0.7, 90.0, 270.0, 2**63, -(2**40), 255, 3]
    readings = MavsdkTelemetry(ClockSync())
    for now_ns in range(0, 20_000 * 1_000_000, 1_000_000):

        def some(*names: str) -> Any:
            return SimpleNamespace(**{name: rng.choice(odd) for name in names})

        whole = rng.choice([value for value in odd if isinstance(value, int)])
        angles = {name: rng.choice([*odd, None]) for name in _ATTITUDE} | {"time_boot_ms": whole}
        ranged = {name: rng.choice([*odd, 25, None]) for name in _RANGED}
        readings.take_mode(whole, now_ns)
        readings.take_landed(whole, now_ns)
        readings.take_armed(bool(whole), now_ns)
        readings.take_attitude(json.dumps(angles), now_ns)
        readings.take_range(json.dumps(ranged), now_ns)
        readings.take_velocity(SimpleNamespace(velocity=some("down_m_s")), now_ns)
        readings.take_battery(some("id", "voltage_v", "remaining_percent", "current_battery_a"), now_ns)
        state = readings.state(now_ns, in_control=False, refusal=None)
        if state is not None:
            assert abs(state.attitude.roll_rad) < 10.0
            assert not state.height_m < 0.0
            assert not state.battery_frac > 1.0
            assert math.isnan(state.battery_a) or 0.0 <= state.battery_a < math.inf
            assert state.attitude.stamp_ns <= now_ns
    stamps = [sample.stamp_ns for sample in readings.attitudes()]
    assert stamps == sorted(stamps)


@given(document=st.text() | st.recursive(st.none() | st.floats() | st.text(), st.lists).map(json.dumps))
def test_fields_of_any_text_are_whole_numbers_or_none(document: str) -> None:
    fields = whole_fields(document, "tc1")
    assert fields is None or all(isinstance(field, int) for field in fields)


@pytest.mark.parametrize("document", ["", "{", "[]", "null", '{"tc1": 1}', '{"tc1": null, "ts1": {}}', "7"])
def test_a_message_whose_fields_are_not_as_known_is_passed_over(document: str) -> None:
    assert whole_fields(document, "tc1", "ts1") is None
    assert whole_fields('{"tc1": "12", "ts1": 5}', "tc1", "ts1") == (12, 5)


def test_a_tick_that_died_in_the_air_is_not_flown_on_and_px4s_own_failsafe_acts() -> None:
    async def test() -> None:
        config = PeerConfig(ready_s=0.5, parameters={"COM_OF_LOSS_T": 0.5})
        async with mavlink_rig(_CountingPx4, MavsdkVehicle, Px4Mode.ALTCTL, config) as rig:
            assert isinstance(rig.vehicle, MavsdkVehicle)
            await rig.take_off()
            await rig.stream(0.3, roll_rad=0.1)
            await asyncio.sleep(FRESH_NS * 1e-9 + 0.1)
            arrived, held_back = rig.peer.setpoints, rig.vehicle.gate.held_back
            assert rig.peer.mode == Px4Mode.OFFBOARD
            await asyncio.sleep(1.0)
            assert rig.peer.setpoints == arrived
            assert rig.vehicle.gate.held_back > held_back  # the library did try
            assert rig.peer.mode != Px4Mode.OFFBOARD
            assert abs(rig.peer.truth().roll_rad) < 0.02
            assert not rig.known().in_control

    patient(test())


def test_a_loop_that_hangs_sends_nothing_though_the_librarys_threads_live() -> None:
    async def test() -> None:
        peer = _CountingPx4(LoopClock(), Airframe(), PeerConfig(ready_s=0.5))
        host, port = await peer.open()
        serving = asyncio.create_task(peer.run())
        companion = _Companion(f"udpout://{host}:{port}")
        try:
            async with Within(20.0):
                await peer.streaming.wait()
            companion.hang()
            await asyncio.sleep(0.1)
            arrived = peer.setpoints
            await asyncio.sleep(1.0)
            assert peer.setpoints == arrived
        finally:
            await asyncio.to_thread(companion.end)
            serving.cancel()
            await asyncio.wait([serving])

    real(test())


class _Companion:
    """The adapter on a loop and a thread of its own, demanding to fly."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._loop = ScaledLoop(1.0)
        self._over = asyncio.Event()
        self._released = threading.Event()
        self._thread = threading.Thread(target=self._live, name="companion")
        self._thread.start()

    def hang(self) -> None:
        self._loop.call_soon_threadsafe(self._released.wait, 30.0)

    def end(self) -> None:
        self._released.set()
        self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join()

    def _live(self) -> None:
        run_in(lambda: self._loop, self._fly())

    async def _fly(self) -> None:
        vehicle = MavsdkVehicle(self._url, LoopClock())
        flying = asyncio.create_task(vehicle.run())
        vehicle.demand(Demand.FLY)
        await self._over.wait()
        flying.cancel()
        await asyncio.wait([flying])


def _refusal_of(rig: Rig) -> str:
    return words(rig.known().refusal)


def test_arducopter_is_refused_with_the_reason() -> None:
    async def test() -> None:
        async with mavlink_rig(ArduCopterPeer, MavsdkVehicle, CopterMode.ALT_HOLD) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: "PX4" in _refusal_of(rig))
            assert rig.peer.mode == CopterMode.STABILIZE
            assert not rig.known().armed

    patient(test())


def test_a_refused_arming_is_told_with_the_autopilots_words_and_tried_again() -> None:
    async def test() -> None:
        async with mavsdk_rig() as rig:
            rig.peer.arming_block = "Accel 0 uncalibrated"
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: "arming" in _refusal_of(rig) and "uncalibrated" in _refusal_of(rig), 20.0)
            rig.peer.arming_block = ""
            await rig.until(lambda: rig.known().armed and rig.known().refusal is None)

    patient(test())


def test_a_rebooted_autopilot_is_asked_for_its_streams_again_and_its_new_clock_is_taken() -> None:
    async def test() -> None:
        async with mavsdk_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await asyncio.sleep(3.0)
            rig.peer.reboot()
            await asyncio.sleep(0.3)
            rig.vehicle.attitudes()
            seen: list[Attitude] = []

            def streams() -> bool:
                seen.extend(rig.vehicle.attitudes())
                return len(seen) >= 50

            await rig.until(streams, 20.0)
            assert [sample.stamp_ns for sample in seen] == sorted({sample.stamp_ns for sample in seen})
            assert 0 <= LoopClock().now_ns() - seen[-1].stamp_ns < 100_000_000

    patient(test())


def test_a_companion_that_boots_first_finds_the_autopilot_later() -> None:
    async def test() -> None:
        async with mavsdk_rig(peer_runs=False) as rig:
            await asyncio.sleep(4.0)
            assert rig.vehicle.state() is None
            serving = asyncio.create_task(rig.peer.run())
            await rig.until(lambda: rig.vehicle.state() is not None)
            serving.cancel()
            await asyncio.wait([serving])

    patient(test())


def test_without_any_autopilot_it_ends_at_once_and_quietly(caplog: pytest.LogCaptureFixture) -> None:
    async def test() -> None:
        vehicle = MavsdkVehicle(f"udpin://127.0.0.1:{free_port()}", LoopClock())
        running = asyncio.create_task(vehicle.run())
        vehicle.demand(Demand.FLY)
        await asyncio.sleep(1.5)
        started_s = time.monotonic()
        running.cancel()
        await asyncio.wait([running])
        assert time.monotonic() - started_s < 1.0
        assert vehicle.state() is None

    patient(test())
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_with_the_link_gone_it_still_ends() -> None:
    async def test() -> None:
        async with mavsdk_rig() as rig:
            await rig.take_off()
            rig.cut(True)
            assert rig.flying_task is not None
            rig.flying_task.cancel()
            await asyncio.wait([rig.flying_task], timeout=20.0)
            assert rig.flying_task.done()
            rig.cut(False)
            await rig.until(lambda: rig.peer.mode != Px4Mode.OFFBOARD)  # its own failsafe

    patient(test())


def test_a_port_in_use_is_told_at_once() -> None:
    async def test() -> None:
        loop = asyncio.get_running_loop()
        taken, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, local_addr=("127.0.0.1", 0))
        port = taken.get_extra_info("sockname")[1]
        with pytest.raises(UnavailableError, match=str(port)):
            await MavsdkVehicle(f"udpin://127.0.0.1:{port}", LoopClock()).run()
        taken.close()
        await asyncio.sleep(0.05)

    patient(test())


def test_without_the_library_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "mavsdk"]:
        monkeypatch.setitem(sys.modules, name, None)
    for name in [name for name in sys.modules if name.startswith("flightd.adapters.vehicle.mavsdk")]:
        monkeypatch.delitem(sys.modules, name)
    config = VehicleConfig(kind="mavsdk", url="udpout://127.0.0.1:14550")

    async def test() -> None:
        with pytest.raises(UnavailableError, match=r"extra mavsdk.* -m pip install 'mavsdk"):
            connect_vehicle(config, LoopClock())

    real(test())


@pytest.mark.parametrize(("name", "value"), [("COM_OBL_RC_ACT", 0), ("COM_OF_LOSS_T", 20.0)])
def test_nothing_is_armed_by_the_library_either_that_would_stay_in_the_air(name: str, value: float) -> None:
    async def test() -> None:
        async with mavsdk_rig(PeerConfig(ready_s=0.5, parameters={name: value})) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(
                lambda: name in words(rig.known().unfit) and "expected" in words(rig.known().unfit)
            )
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(4.0)
            assert not rig.known().armed

    patient(test())


def test_the_cells_of_the_battery_are_counted_though_the_library_adds_them_up() -> None:
    async def test() -> None:
        async with mavsdk_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None and rig.known().battery_cells == 3)

    patient(test())
