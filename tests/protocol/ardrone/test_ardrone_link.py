"""Radio gaps, reboots, foreign traffic, second clients."""

from __future__ import annotations

import asyncio
import itertools
import random

import pytest

from flightd.adapters.vehicle.ardrone.settings import DroneCamera
from flightd.core.refusal import words
from flightd.core.types import Demand
from flightd.sim.ardrone.navdata_writer import NavdataReport, packet
from flightd.sim.ardrone.states import REF_FLY, MajorState
from flightd.sim.autopilot.radio import RadioParams
from tests.rigs.ardrone import Ear, bench, make_drone
from tests.rigs.event_loops import virtual

MS = 1_000_000


def test_commands_keep_the_rhythm_with_and_without_setpoints() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            ear.commands.clear()
            await b.steer(2.0, roll_rad=0.02)
            await asyncio.sleep(2.0)
            times = sorted({now_ns for now_ns, _ in ear.commands})
            gaps = [after - before for before, after in itertools.pairwise(times)]
            assert max(gaps) <= 31 * MS
            assert min(gaps) >= 19 * MS

    virtual(main())


def test_a_setpoint_goes_out_at_once() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            await b.steer(0.5, roll_rad=0.02)
            ear.commands.clear()
            asked_ns = b.clock.now_ns()
            await b.steer(0.02, roll_rad=0.03)
            sent = [at_ns for at_ns, command in ear.commands if command.name == "PCMD" and command.integer(0)]
            assert sent[0] == asked_ns

    virtual(main())


def test_the_numbers_begin_at_one_and_never_fall_back() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            b.server.radio = False
            await asyncio.sleep(1.0)
            b.server.radio = True
            await asyncio.sleep(1.0)
        numbers = [command.sequence for _, command in ear.commands]
        assert numbers == sorted(numbers)
        assert drone.ignored_commands == 0

    virtual(main())


def test_the_first_command_of_all_is_number_one() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone):
            await asyncio.sleep(0.1)
        assert ear.commands[0][1].sequence == 1

    virtual(main())


def test_a_short_radio_gap_is_survived_in_the_air() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            await b.steer(0.5, pitch_rad=-0.05)
            b.server.radio = False
            await b.steer(1.0, pitch_rad=-0.05)
            assert not b.state.in_control, "no fresh telemetry"
            b.server.radio = True
            await b.until(lambda: b.state.in_control, limit_s=0.5)
            await b.steer(0.5, climb_mps=0.2)
            assert (b.state.mode, words(b.state.refusal)) == ("flying", "")

    virtual(main())


def test_setpoints_stop_at_the_drone_before_a_lost_link_ends() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            await b.steer(0.5, pitch_rad=-0.05)
            drone.streaming = False  # the way down is dead, the way up is not
            drone.wake = lambda: None  # type: ignore[method-assign]
            await b.steer(1.0, pitch_rad=-0.05)
            assert ear.named("PCMD")[-1].integer(0) == 0, "hover: flying blind"
            assert drone.major in (MajorState.GO_TO_FIX, MajorState.HOVERING)
            await b.until(lambda: drone.major == MajorState.LANDING, limit_s=2.0)
            assert "no navdata for 2 s" in words(b.state.refusal)

    virtual(main())


def test_after_a_long_gap_the_drone_stays_down_until_flight_is_demanded_anew() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.hovering()
            b.server.radio = False
            await b.until(lambda: drone.major == MajorState.LANDED, limit_s=15.0)
            b.server.radio = True
            await b.until(lambda: b.state.mode == "landed")
            await asyncio.sleep(8.0)
            assert drone.major == MajorState.LANDED
            assert not b.state.in_control
            await b.configured()
            b.vehicle.demand(Demand.FLY)
            await b.until(lambda: b.state.mode == "hovering")

    virtual(main())


@pytest.mark.parametrize("demand", [Demand.STANDBY, Demand.DISARM, Demand.HANDS_OFF, Demand.LAND])
def test_what_was_only_being_watched_is_not_sent_up_again_after_a_long_gap(demand: Demand) -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.hovering()
            b.vehicle.demand(demand)
            b.server.radio = False
            await b.until(lambda: drone.major == MajorState.LANDED, limit_s=15.0)
            b.server.radio = True
            await asyncio.sleep(5.0)
            assert drone.major == MajorState.LANDED

    virtual(main())


def test_flight_demanded_into_a_dead_radio_does_not_start_when_it_returns_unasked() -> None:
    async def main() -> None:
        drone = make_drone()
        dead = False
        ear = Ear(drone, lose=lambda _command: dead)
        async with bench(drone) as b:
            await b.configured()
            dead, drone.streaming = True, False
            drone.wake = lambda: None  # type: ignore[method-assign]
            await asyncio.sleep(1.0)
            ear.commands.clear()
            b.vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.0)
            assert ear.named("REF"), "it speaks, and none of it asks for flight"
            assert all(bits & REF_FLY == 0 for bits in (c.integer(0) or 0 for c in ear.named("REF")))
            assert ear.named("FTRIM") == []

    virtual(main())


def test_a_rebooted_drone_is_configured_again_and_flies() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.configured()
            await asyncio.sleep(5.0)
            b.server.radio = False
            b.server.reboot()
            await asyncio.sleep(3.0)
            b.server.radio = True
            await b.until(lambda: b.vehicle.camera_since_ns is None)
            ear = Ear(drone)
            await b.hovering()
            assert ear.named("FTRIM")

    virtual(main())


def test_an_adapter_that_starts_anew_is_obeyed_at_once() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.configured()
        before = drone.last_sequence
        assert before > 100
        async with bench(drone) as b:
            await asyncio.sleep(0.2)
            assert 1 <= drone.last_sequence < before

    virtual(main())


def test_a_second_client_that_ran_ahead_is_overcome_by_starting_at_one() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.configured()
            drone.command(b"AT*COMWDG=2000000\r", b.clock.now_ns())
            await asyncio.sleep(0.5)
            assert drone.last_sequence == 2000000
            await b.until(lambda: drone.last_sequence < 100, limit_s=1.0)  # before the drone gives us up
            await b.hovering()

    virtual(main())


def test_a_bad_radio_delays_and_does_not_stop_a_flight() -> None:
    async def main() -> None:
        bad = RadioParams(loss=0.15, delay_s=0.02, jitter_s=0.01, doubled=0.05)
        async with bench(air=bad) as b:
            await b.hovering()
            await b.steer(3.0, pitch_rad=-0.05)
            assert sum(b.sent) > 0.95 * len(b.sent)
            assert b.drone.airframe.vx_mps > 0.3
            await b.steer(10.0, climb_mps=-0.3, while_=lambda: b.state.armed)
            assert (b.drone.major, b.drone.emergency) == (MajorState.LANDED, False)

    virtual(main())


def test_the_drone_may_boot_long_after_the_daemon() -> None:
    async def main() -> None:
        async with bench() as b:
            b.server.radio = False
            await asyncio.sleep(30.0)
            assert b.vehicle.state() is None
            b.server.radio = True
            await b.hovering()

    virtual(main())


def test_damaged_and_foreign_navdata_costs_nothing() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.configured()
            rng = random.Random(3)
            good = packet(NavdataReport(state=0x0F800490, sequence=10, major=2, battery_percent=50), (0,))
            b.vehicle.attitudes()
            for _ in range(200):
                damaged = bytearray(good)
                for _ in range(rng.randrange(1, 5)):
                    damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
                b.server.send_navdata(bytes(damaged[: rng.randrange(1, 173)]))
                await asyncio.sleep(0.005)
            assert 14 <= len(b.vehicle.attitudes()) <= 16
            assert b.vehicle.bad_packets == 200
            assert b.state.battery_frac == 1.0

    virtual(main())


def test_navdata_that_was_overtaken_is_not_taken() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.configured()
            old = packet(NavdataReport(state=0x0F800490, sequence=3, major=3, battery_percent=5), (0,))
            for _ in range(20):
                b.server.send_navdata(old)
                await asyncio.sleep(0.01)
                assert (b.state.battery_frac, b.state.mode) == (1.0, "landed")
            assert b.vehicle.stale_packets == 20

    virtual(main())


def test_no_network_is_not_the_end() -> None:
    async def main() -> None:
        async with bench() as b:
            failures = 0

            async def no_network(*_args: object, **_more: object) -> None:
                nonlocal failures
                failures += 1
                raise OSError(101, "Network is unreachable")

            loop = asyncio.get_running_loop()
            working, loop.create_datagram_endpoint = loop.create_datagram_endpoint, no_network  # type: ignore[assignment,method-assign]
            await asyncio.sleep(10.0)
            assert 2 <= failures <= 8
            assert b.vehicle.state() is None
            loop.create_datagram_endpoint = working  # type: ignore[method-assign]
            await b.hovering()

    virtual(main())


def test_a_camera_asked_for_during_a_gap_is_switched_when_the_drone_is_back() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.configured()
            b.server.radio = False
            await asyncio.sleep(0.1)
            b.vehicle.select_camera(DroneCamera.FRONT)
            await asyncio.sleep(1.6)
            assert b.vehicle.camera_since_ns is None
            b.server.radio = True
            await b.until(lambda: b.vehicle.camera_since_ns is not None)
            assert int(b.server.channel) == DroneCamera.FRONT

    virtual(main())
