"""The configuration handshake against the emulated drone, and against drones that misbehave."""

from __future__ import annotations

import asyncio
import itertools
import math

import pytest

from flightd.adapters.vehicle.ardrone.configurator import parse_text, same_value, wanted_values
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings, DroneCamera, profile_id, settings_of
from flightd.config.control import ControlConfig
from flightd.core.types import Demand
from flightd.sim.ardrone import configuration
from flightd.sim.ardrone.at_commands import DroneCommand
from flightd.sim.ardrone.configuration import Configuration, Ids
from flightd.sim.ardrone.states import DroneOptions
from tests.rigs.ardrone import Bench, Ear, bench, make_drone
from tests.rigs.event_loops import virtual


def in_force(b: Bench) -> dict[str, str]:
    return {key: b.drone.configuration.text(key) for key in configuration.KEYS}


def test_every_wanted_key_is_in_force_afterwards_also_the_profiled_ones() -> None:
    async def main() -> None:
        async with bench(tilt_max_rad=0.15, climb_max_mps=0.5) as b:
            await b.configured()
            values = in_force(b)
            for key, value in wanted_values(ArDroneSettings(tilt_max_rad=0.15, climb_max_mps=0.5)).items():
                assert same_value(values[key], value), key
            assert values["custom:session_id"] == profile_id("flightd session")
            assert values["general:navdata_demo"] == "TRUE"

    virtual(main())


def test_config_ids_stand_right_before_each_profiled_config() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.configured()
        commands = [command for _, command in ear.commands]
        switched = max(n for n, command in enumerate(commands) if command.text(0) == "custom:profile_id")
        for before, command in itertools.pairwise(commands[switched:]):
            profiled = command.name == "CONFIG" and command.text(0) in wanted_values(ArDroneSettings())
            assert not profiled or (before.name, before.sequence) == ("CONFIG_IDS", command.sequence - 1)

    virtual(main())


def test_the_next_config_waits_until_the_acknowledge_bit_is_cleared() -> None:
    async def main() -> None:
        drone = make_drone()
        configs: list[tuple[str | None, bool]] = []

        def note(command: DroneCommand) -> bool:
            if command.name == "CONFIG":
                configs.append((command.text(0), drone.acknowledges))
            return False

        Ear(drone, lose=note)
        async with bench(drone) as b:
            await b.configured()
        firsts = [new for old, new in itertools.pairwise(configs) if new[0] != old[0]]
        assert {"custom:profile_id", "control:altitude_max", "video:bitrate"} <= {key for key, _ in firsts}
        assert [key for key, acknowledged in firsts if acknowledged] == []

    virtual(main())


def test_nothing_is_configured_before_the_first_navdata() -> None:
    async def main() -> None:
        drone = make_drone(DroneOptions(config_needs_navdata=True))
        ear = Ear(drone)
        async with bench(drone) as b:
            b.server.radio = False
            await asyncio.sleep(1.0)
            b.server.radio = True
            await b.configured()
            first = next(command for command in ear.named("CONFIG"))
            assert first.text(0) == "general:navdata_demo"
            assert in_force(b)["general:navdata_demo"] == "TRUE"

    virtual(main())


def test_lost_config_and_control_datagrams_are_repeated() -> None:
    async def main() -> None:
        drone = make_drone()
        counts = {"CONFIG": 0, "CTRL": 0}

        def lose(command: DroneCommand) -> bool:
            if command.name not in counts:
                return False
            counts[command.name] += 1
            return counts[command.name] % 3 != 0

        Ear(drone, lose)
        async with bench(drone) as b:
            await b.configured()
            values = in_force(b)
            assert all(same_value(values[k], v) for k, v in wanted_values(ArDroneSettings()).items())

    virtual(main())


def test_a_stale_acknowledge_bit_delays_but_does_not_stop() -> None:
    async def main() -> None:
        drone = make_drone(DroneOptions(config_needs_clear_ack=False))
        Ear(drone, lose=lambda command: command.name == "CTRL")
        async with bench(drone) as b:
            b.vehicle.demand(Demand.STANDBY)
            await b.until(lambda: b.vehicle.camera_since_ns is not None, limit_s=120.0)
            values = in_force(b)
            assert all(same_value(values[k], v) for k, v in wanted_values(ArDroneSettings()).items())

    virtual(main())


def test_without_the_configuration_port_everything_is_written_blind() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone, tilt_max_rad=0.1) as b:
            drone.send_configuration = lambda _text: None
            b.vehicle.demand(Demand.STANDBY)
            await b.until(lambda: b.vehicle.camera_since_ns is not None, limit_s=60.0)
            assert drone.configuration.number("control:euler_angle_max") == pytest.approx(0.1)

    virtual(main())


def test_setpoints_are_scaled_by_the_limits_which_the_drone_really_has() -> None:
    async def main() -> None:
        drone = make_drone()
        write = drone.configuration.write
        drone.configuration.write = (  # type: ignore[method-assign]
            lambda name, value, ids: name != "control:euler_angle_max" and write(name, value, ids)
        )
        async with bench(drone, tilt_max_rad=0.4) as b:
            await b.hovering()
            await b.steer(1.0, pitch_rad=-0.1)
            assert drone.configuration.number("control:euler_angle_max") == pytest.approx(0.20944)
            assert drone.airframe.pitch_rad == pytest.approx(-0.1, abs=0.012)

    virtual(main())


def test_the_set_points_limits_become_the_drones_own() -> None:
    async def main() -> None:
        limits = ControlConfig(max_descend_mps=0.6)
        chosen = settings_of("ardrone://127.0.0.1", limits)
        drone = make_drone()
        names = ("tilt_max_rad", "climb_max_mps", "yaw_rate_max_radps")
        async with bench(drone, **{name: getattr(chosen, name) for name in names}) as b:
            await b.hovering()
            values = in_force(b)
            assert float(values["control:euler_angle_max"]) == pytest.approx(math.radians(10.0), abs=1e-5)
            assert float(values["control:control_vz_max"]) == 800.0
            assert float(values["control:control_yaw"]) == pytest.approx(math.radians(45.0), abs=1e-5)
            await b.steer(1.0, roll_rad=math.radians(5.0))
            assert drone.airframe.roll_rad == pytest.approx(math.radians(5.0), abs=0.012)
            await b.steer(1.0, roll_rad=math.radians(20.0))
            assert drone.airframe.roll_rad == pytest.approx(math.radians(10.0), abs=0.015)

    virtual(main())


def test_limits_outside_the_drones_ranges_are_brought_into_them() -> None:
    chosen = settings_of(
        "ardrone://127.0.0.1",
        ControlConfig(max_tilt_deg=30.0, max_yaw_rate_degps=5.0, max_climb_mps=0.1, max_descend_mps=3.0),
    )
    assert (chosen.tilt_max_rad, chosen.yaw_rate_max_radps, chosen.climb_max_mps) == (0.52, 0.7, 2.0)


def test_a_configured_drone_is_not_written_to_again() -> None:
    async def main() -> None:
        drone = make_drone()
        async with bench(drone) as b:
            await b.configured()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.configured()
            written = {command.text(0) for command in ear.named("CONFIG")}
            assert written == {"general:navdata_demo", "general:navdata_options", "video:video_channel"}

    virtual(main())


def test_the_camera_is_switched_and_known_to_be_switched_only_after_settling() -> None:
    async def main() -> None:
        async with bench(camera_settle_s=0.3) as b:
            await b.configured()
            b.vehicle.select_camera(DroneCamera.FRONT)
            assert b.vehicle.camera_since_ns is None
            await b.until(lambda: b.vehicle.camera_since_ns is not None, limit_s=2.0)
            assert b.drone.configuration.number("video:video_channel") == DroneCamera.FRONT
            ahead_ns = (b.vehicle.camera_since_ns or 0) - b.clock.now_ns()
            assert 290_000_000 <= ahead_ns <= 300_000_000

    virtual(main())


def test_settings_outside_the_drones_ranges_are_refused() -> None:
    with pytest.raises(ValueError, match=r"tilt_max_rad = 0.6 outside"):
        ArDroneSettings(tilt_max_rad=0.6)
    with pytest.raises(ValueError, match=r"climb_max_mps = 0.1 outside"):
        ArDroneSettings(climb_max_mps=0.1)
    with pytest.raises(ValueError, match=r"yaw_rate_max_radps = 7.0 outside"):
        ArDroneSettings(yaw_rate_max_radps=7.0)
    with pytest.raises(ValueError, match=r"period_s = 0.1 outside"):
        ArDroneSettings(period_s=0.1)


def test_the_dump_is_read_up_to_its_closing_nul() -> None:
    text = b"general:x = 1\ncontrol:y = a = b\nnonsense\n\0general:z = 3\n"
    assert parse_text(text) == {"general:x": "1", "control:y": "a = b"}


# The emulator's own rules


def test_custom_profiles_need_their_ids_right_before() -> None:
    stored = Configuration()
    ids = Ids("00000001", "00000002", "00000003")
    assert not stored.write("video:video_codec", "131", None), "read only in the default profile"
    assert not stored.write("video:video_codec", "131", ids), "not the ids in force"
    stored.write("custom:session_id", ids.session, None)
    stored.write("custom:profile_id", ids.user, None)
    stored.write("custom:application_id", ids.application, None)
    assert stored.write("video:video_codec", "131", ids)
    assert stored.text("video:video_codec") == "131"
    stored.write("custom:session_id", "00000000", None)
    assert stored.text("video:video_codec") == "129"
    assert stored.write("custom:session_id", "-all", None)
    stored.write("custom:session_id", ids.session, None)
    assert stored.text("video:video_codec") == "129", "deleted profiles are gone"


def test_writes_that_are_not_allowed_or_not_of_the_type_change_nothing() -> None:
    stored = Configuration()
    for key, value in (
        ("general:vbat_min", "1"),
        ("general:nonsense", "1"),
        ("general:navdata_demo", "true"),
        ("control:altitude_max", "high"),
        ("control:euler_angle_max", "1e3"),
        ("custom:session_id", "xyz"),
    ):
        before = stored.dump()
        assert not stored.write(key, value, None)
        assert stored.dump() == before


def test_outdoor_selects_its_own_limits() -> None:
    stored = Configuration()
    stored.write("control:outdoor", "TRUE", None)
    assert stored.number("control:euler_angle_max") == pytest.approx(0.349066)
    stored.write("control:outdoor", "FALSE", None)
    assert stored.number("control:control_vz_max") == 700.0


def test_a_drone_is_unfit_until_it_is_configured() -> None:
    async def main() -> None:
        async with bench() as b:
            await b.until(lambda: b.vehicle.state() is not None)
            assert "still being configured" in str(b.state.unfit)
            await b.configured()
            assert b.state.unfit is None

    virtual(main())


def test_a_watchdog_that_another_program_left_is_set_back() -> None:
    async def main() -> None:
        drone = make_drone()
        drone.configuration.write("general:com_watchdog", "1000", None)
        async with bench(drone) as b:
            await b.configured()
            assert in_force(b)["general:com_watchdog"] == "2"
            assert b.state.unfit is None

    virtual(main())


def test_a_drone_that_would_stay_up_without_us_is_unfit_and_says_so() -> None:
    async def main() -> None:
        drone = make_drone()
        drone.configuration.write("general:com_watchdog", "1000", None)
        Ear(drone, lose=lambda command: command.text(0) == "general:com_watchdog")
        async with bench(drone) as b:
            await b.configured()
            assert "keeps general:com_watchdog = 1000 instead of 2" in str(b.state.unfit)

    virtual(main())


def test_a_drone_that_keeps_another_limit_of_height_is_unfit_and_says_so() -> None:
    async def main() -> None:
        drone = make_drone()
        Ear(drone, lose=lambda command: command.text(0) == "control:altitude_max")
        async with bench(drone, height_max_m=2.5) as b:
            await b.configured()
            assert "keeps control:altitude_max" in str(b.state.unfit)
            assert "instead of 2500" in str(b.state.unfit)

    virtual(main())
