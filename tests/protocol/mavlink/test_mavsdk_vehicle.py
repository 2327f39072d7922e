"""MAVSDK's own setpoint repeater never keeps a dead loop flying; what the adapter refuses, and why."""

from __future__ import annotations

import asyncio
import math
import sys
import threading
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.transport import make_transport
from flightd.adapters.vehicle.mavsdk.connection import MavsdkConnection
from flightd.adapters.vehicle.mavsdk.gate import FRESH_NS, SetpointGate, message_id
from flightd.adapters.vehicle.mavsdk.vehicle import MavsdkVehicle
from flightd.config.vehicle import VehicleConfig
from flightd.core.errors import UnavailableError
from flightd.core.refusal import words
from flightd.core.types import Attitude, Demand
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
