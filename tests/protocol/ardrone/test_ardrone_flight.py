"""Flying: take-off, steering, landing, refusals and emergencies, over real sockets in virtual time."""

from __future__ import annotations

import asyncio
import itertools
import math

import pytest

from flightd.adapters.vehicle.ardrone.navdata import DroneState
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.core.refusal import words
from flightd.core.types import AttitudeSetpoint, Demand, LandedState
from flightd.runtime.clock import LoopClock
from flightd.sim.ardrone.at_commands import DroneCommand
from flightd.sim.ardrone.server import ArDroneServer
from flightd.sim.ardrone.states import BIT_CUTOUT, DroneOptions, MajorState
from flightd.sim.sensors.instruments import SensorParams
from tests.rigs.ardrone import ANY_PORTS, Ear, bench, ended, make_drone, settings_for
from tests.rigs.event_loops import virtual


def ref_bits(commands: list[DroneCommand]) -> list[int]:
    return [bits & 0x300 for command in commands if (bits := command.integer(0)) is not None]


def test_take_off_trims_once_on_the_ground_then_orders_until_the_drone_lifts() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.configured()
            assert set(ref_bits(ear.named("REF"))) == {0}
            assert ear.named("FTRIM") == []
            ear.commands.clear()
            await b.hovering()
            order = [command.name for command in ear.named("REF", "FTRIM")]
            last_trim = len(order) - 1 - order[::-1].index("FTRIM")
            assert 0x200 not in ref_bits(ear.named("REF"))[: last_trim - order[:last_trim].count("FTRIM")]
            assert set(ref_bits(ear.named("REF"))[-20:]) == {0x200}
            assert (b.state.armed, b.state.in_control, b.state.landed) == (True, True, LandedState.IN_AIR)
            assert b.state.height_m == pytest.approx(drone.airframe.height_m, abs=0.05)

    virtual(main())


def test_flat_trim_takes_the_bias_out_of_a_crooked_drone() -> None:
    async def main() -> None:
        crooked = SensorParams(tilt_bias_rad=math.radians(3.0), tilt_wander_rad=0.0)
        drone = make_drone(sensors=crooked)
        async with bench(drone) as b:
            await b.hovering()
            await b.steer(1.0, climb_mps=0.1)
            assert abs(b.state.attitude.roll_rad - drone.airframe.roll_rad) < math.radians(0.1)
            assert abs(b.state.attitude.pitch_rad - drone.airframe.pitch_rad) < math.radians(0.1)

    virtual(main())


@pytest.mark.parametrize(
    ("wish", "moves"),
    [
        ({"pitch_rad": -0.1}, ("vx_mps", 1)),
        ({"pitch_rad": 0.1}, ("vx_mps", -1)),
        ({"roll_rad": 0.1}, ("vy_mps", 1)),
        ({"roll_rad": -0.1}, ("vy_mps", -1)),
        ({"climb_mps": 0.4}, ("climb_mps", 1)),
        ({"climb_mps": -0.4}, ("climb_mps", -1)),
        ({"yaw_rate_radps": 0.5}, ("yaw_speed_radps", 1)),
        ({"yaw_rate_radps": -0.5}, ("yaw_speed_radps", -1)),
    ],
)
def test_each_axis_moves_the_way_its_sign_says(wish: dict[str, float], moves: tuple[str, int]) -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            await b.steer(1.0, **wish)  # type: ignore[arg-type]
            name, sign = moves
            assert all(b.sent)
            assert sign * getattr(b.drone.airframe, name) > 0.25

    virtual(main())


def test_tilt_climb_and_turn_come_out_in_si_units() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            await b.steer(1.5, roll_rad=0.08, yaw_rate_radps=0.6, climb_mps=0.3)
            air = b.drone.airframe
            assert air.roll_rad == pytest.approx(0.08, abs=0.01)
            assert air.yaw_speed_radps == pytest.approx(0.6, rel=0.1)
            assert air.climb_mps == pytest.approx(0.3, abs=0.1)
            assert b.state.climb_mps == pytest.approx(air.climb_mps, abs=0.1)

    virtual(main())


def test_tilt_beyond_the_drones_limit_is_clamped() -> None:
    async def main() -> None:
        async with bench(tilt_max_rad=0.1) as b:
            await b.hovering()
            await b.steer(1.0, roll_rad=0.5)
            assert b.drone.airframe.roll_rad == pytest.approx(0.1, abs=0.015)

    virtual(main())


def test_late_setpoints_turn_into_hover_and_the_drone_brakes() -> None:
    async def main() -> None:
        async with bench(setpoint_timeout_s=0.15) as b:
            await b.hovering()
            await b.steer(1.5, pitch_rad=-0.1)
            assert b.drone.major == MajorState.FLYING
            took_s = await b.until(lambda: b.drone.major != MajorState.FLYING)
            assert 0.1 < took_s < 0.2
            await b.until(lambda: b.state.mode == "hovering")
            assert math.hypot(b.drone.airframe.vx_mps, b.drone.airframe.vy_mps) < 0.25

    virtual(main())


def test_a_setpoint_without_any_motion_holds_the_place() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            await b.steer(1.0)
            assert b.drone.major == MajorState.HOVERING

    virtual(main())


def test_setpoints_are_refused_while_the_vehicle_is_not_ours() -> None:
    async def main() -> None:
        async with bench() as b:
            assert not b.vehicle.send(AttitudeSetpoint(b.clock.now_ns()))
            await b.configured()
            for demand in (Demand.STANDBY, Demand.HANDS_OFF, Demand.DISARM):
                b.vehicle.demand(demand)
                assert not b.vehicle.send(AttitudeSetpoint(b.clock.now_ns(), climb_mps=0.5))

    virtual(main())


def test_sinking_low_becomes_the_drones_own_landing() -> None:
    async def main() -> None:
        async with bench(land_below_m=0.35) as b:
            await b.hovering()
            await b.steer(8.0, climb_mps=-0.3, while_=lambda: b.drone.major != MajorState.LANDING)
            assert 0.2 < b.drone.airframe.height_m < 0.4
            assert b.state.in_control
            await b.steer(5.0, climb_mps=-0.2, while_=lambda: b.state.armed)
            assert (b.state.landed, b.state.mode) == (LandedState.ON_GROUND, "landed")
            await b.steer(3.0, climb_mps=0.5)
            assert b.drone.major == MajorState.LANDED, "a finished landing does not start again by itself"

    virtual(main())


def test_with_a_deaf_sonar_the_height_is_unknown_and_a_descent_becomes_a_landing() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            b.drone.warnings |= DroneState.ULTRASOUND
            await b.steer(0.3)
            assert math.isnan(b.state.height_m)
            assert not math.isnan(b.state.climb_mps)
            await b.steer(1.0)
            assert math.isnan(b.state.climb_mps), "it is not known to stand still in the air"
            await b.steer(0.3, climb_mps=-0.3)
            assert b.drone.major == MajorState.LANDING

    virtual(main())


def test_a_sonar_echo_of_something_else_is_passed_over() -> None:
    async def main() -> None:
        async with bench(full_navdata=True) as b:
            await b.hovering()
            before_m = b.state.height_m
            b.drone.loops.height_m += 2.0
            await asyncio.sleep(0.02)
            assert b.state.height_m == pytest.approx(before_m, abs=0.02)
            await asyncio.sleep(0.4)
            assert b.state.height_m > before_m + 1.0, "what persists is believed"

    virtual(main())


def test_landing_never_cuts_the_motors() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            b.vehicle.demand(Demand.LAND)
            await b.until(lambda: not b.state.armed)
            assert not drone.emergency
            assert drone.airframe.touchdown_mps < 0.7
            assert all(bits & 0x100 == 0 for bits in ref_bits(ear.named("REF")))

    virtual(main())


def test_standby_leaves_a_flying_drone_in_the_air() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.hovering()
            b.vehicle.demand(Demand.STANDBY)
            await asyncio.sleep(3.0)
            assert drone.major == MajorState.HOVERING

    virtual(main())


def test_an_adapter_that_starts_beside_a_flying_drone_does_not_land_it() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.hovering()
            b.server.radio = False  # killed, it says nothing more
        async with bench(drone) as b:
            b.vehicle.demand(Demand.STANDBY)
            await asyncio.sleep(6.0)
            assert drone.major == MajorState.HOVERING

    async def nothing() -> None:
        """The first daemon was killed: it says nothing more."""

    virtual(main())


def test_a_weak_battery_refuses_in_silence_and_the_adapter_says_so() -> None:
    async def main() -> None:
        async with bench(make_drone(battery_frac=0.15)) as b:
            await b.configured()
            b.vehicle.demand(Demand.FLY)
            await b.until(lambda: b.state.refusal)
            assert "stays landed" in words(b.state.refusal)
            assert "15 %" in words(b.state.refusal)
            b.drone.airframe.battery_frac = 0.9
            await b.until(lambda: b.state.mode == "hovering")
            assert b.state.refusal is None

    virtual(main())


def test_a_drone_that_lands_by_itself_is_not_sent_up_again() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            b.drone.airframe.battery_frac = 0.04
            await b.until(lambda: not b.state.in_control)
            assert "landed by itself, battery at 4 %" in words(b.state.refusal)
            await b.until(lambda: not b.state.armed)
            b.drone.airframe.battery_frac = 0.9
            await asyncio.sleep(3.0)
            assert b.drone.major == MajorState.LANDED
            b.vehicle.demand(Demand.STANDBY)
            b.vehicle.demand(Demand.FLY)
            await b.until(lambda: b.state.mode == "hovering")

    virtual(main())


def test_an_emergency_in_flight_is_told_and_not_cleared_by_itself() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.hovering()
            b.drone.faults = BIT_CUTOUT
            await b.until(lambda: b.state.mode == "emergency")
            assert (b.state.armed, b.state.in_control) == (False, False)
            assert "a propeller was blocked" in words(b.state.refusal)
            b.drone.faults = 0
            await asyncio.sleep(3.0)
            assert b.drone.emergency

    virtual(main())


def test_an_emergency_from_before_is_cleared_when_flight_is_demanded() -> None:
    async def main() -> None:
        drone = make_drone()
        drone.emergency = True
        drone.major = MajorState.DEFAULT
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.configured()
            assert b.state.mode == "emergency"
            ear.commands.clear()
            b.vehicle.demand(Demand.FLY)
            await b.until(lambda: b.state.mode == "hovering")
            pressed = [bits & 0x100 for bits in ref_bits(ear.named("REF"))]
            edges = sum(1 for a, c in itertools.pairwise(pressed) if c and not a)
            assert edges + bool(pressed[0]) == 1, "each further edge would cut the motors"

    virtual(main())


def test_a_lasting_fault_is_pressed_again_and_told() -> None:
    async def main() -> None:
        drone = make_drone()
        drone.faults = BIT_CUTOUT
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.configured()
            ear.commands.clear()
            b.vehicle.demand(Demand.FLY)
            await asyncio.sleep(5.0)
            pressed = [bool(bits & 0x100) for bits in ref_bits(ear.named("REF"))]
            edges = sum(1 for a, c in itertools.pairwise(pressed) if c and not a)
            assert 3 <= edges <= 4
            assert "cut-out" in words(b.state.refusal)
            drone.faults = 0
            await b.until(lambda: b.state.mode == "hovering")

    virtual(main())


def test_hands_off_in_the_air_hovers_once_and_falls_silent() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            await b.steer(1.0, pitch_rad=-0.1)
            ear.commands.clear()
            b.vehicle.demand(Demand.HANDS_OFF)
            await asyncio.sleep(1.0)
            names = [command.name for _, command in ear.commands]
            assert names == ["REF", "PCMD", "COMWDG"]
            assert ear.commands[-1][1].sequence == 1, "whoever takes over is obeyed at once"
            assert ear.named("PCMD")[0].integer(0) == 0
            await asyncio.sleep(1.5)
            assert drone.major == MajorState.LANDING, "nobody took over: it lands itself"

    virtual(main())


def test_a_drone_found_flying_that_nobody_asks_for_is_held_then_landed() -> None:
    async def main() -> None:
        drone = make_drone()
        clock = LoopClock()
        seen: list[int] = []
        async with ArDroneServer(drone, clock, ANY_PORTS) as server:
            serving = asyncio.create_task(server.run())
            for number in range(1, 200):
                drone.command(b"AT*REF=%d,290718208\r" % number, clock.now_ns())
                await asyncio.sleep(0.03)
            seen.append(drone.major)
            vehicle = ArDroneVehicle(settings_for(server, unattended_s=6.0), clock)
            running = asyncio.create_task(vehicle.run())
            await asyncio.sleep(5.5)
            seen.append(drone.major)
            await asyncio.sleep(1.5)
            seen.append(drone.major)
            state = vehicle.state()
            assert state is not None
            assert "nothing demanded" in words(state.refusal)
            await asyncio.sleep(8.0)
            seen.append(drone.major)
            assert seen == [MajorState.HOVERING, MajorState.HOVERING, MajorState.LANDING, MajorState.LANDED]
            await ended(running)
            await ended(serving)

    virtual(main())


def test_what_another_pilot_starts_in_hands_off_is_not_interfered_with() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.configured()
            b.vehicle.demand(Demand.HANDS_OFF)
            await asyncio.sleep(0.5)
            obey = drone.command
            ear = Ear(drone)
            obey(b"AT*COMWDG=1\r", b.clock.now_ns())
            for number in range(5000, 5400):
                obey(b"AT*REF=%d,290718208\r" % number, b.clock.now_ns())
                await asyncio.sleep(0.03)
            assert drone.major == MajorState.HOVERING
            assert ear.named("REF", "PCMD") == []

    virtual(main())


def test_another_pilot_takes_over_unhindered() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.hovering()
            b.vehicle.demand(Demand.HANDS_OFF)
            await asyncio.sleep(0.5)
            for number in range(1, 200):
                drone.command(
                    b"AT*REF=%d,290718208\rAT*PCMD=%d,0,0,0,0,0\r" % (2 * number - 1, 2 * number),
                    b.clock.now_ns(),
                )
                await asyncio.sleep(0.03)
            assert drone.major == MajorState.HOVERING
            assert drone.last_sequence == 398

    virtual(main())


def test_cancelled_in_flight_the_adapter_orders_a_landing() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            ear.commands.clear()
        assert ref_bits(ear.named("REF"))[-3:] == [0, 0, 0]
        assert drone.major == MajorState.LANDING

    virtual(main())


def test_full_navdata_gives_two_hundred_attitudes_a_second() -> None:
    async def main() -> None:
        async with bench(full_navdata=True) as b:
            await b.configured()
            b.vehicle.attitudes()
            await asyncio.sleep(1.0)
            samples = b.vehicle.attitudes()
            assert 195 <= len(samples) <= 201
            gaps = {c.stamp_ns - a.stamp_ns for a, c in itertools.pairwise(samples)}
            assert max(gaps) <= 10_000_000
            assert b.state.battery_v == pytest.approx(b.drone.airframe.battery_v, abs=0.01)

    virtual(main())


def test_demo_navdata_is_stamped_by_the_drones_clock_less_the_latency() -> None:
    async def main() -> None:
        async with bench(attitude_latency_s=0.02) as b:
            await b.configured()
            await asyncio.sleep(1.0)
            assert 14 <= len(b.vehicle.attitudes()[-15:]) <= 16
            age_ns = b.state.heartbeat_ns - b.state.attitude.stamp_ns
            assert 20_000_000 <= age_ns < 21_000_000

    virtual(main())


def test_the_options_of_a_strict_drone_change_nothing() -> None:
    async def main() -> None:
        async with bench(make_drone(DroneOptions(config_needs_navdata=True))) as b:
            await b.hovering()
            assert b.state.in_control
            await b.steer(3.0, climb_mps=0.3)
            assert b.state.height_m > 1.5

    virtual(main())
