"""The truth of an external simulator, placed on the map: axes, scale, smoothing, a link that is lost."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.errors import InputError, UnavailableError
from flightd.core.geometry import wrap_pi
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_port
from flightd.sim.external.external_simulator import ExternalVehicle
from flightd.sim.external.external_truth import Placement, TruthReader
from flightd.sim.plant.kinematics import Kinematics
from tests.command import Command
from tests.rigs.event_loops import virtual

LAT0, LON0, ALT0 = -35.363262, 149.165237, 584.0
HEADING0 = math.radians(353.0)
PAD = Placement(x_m=2.0, y_m=-1.0, yaw_rad=math.pi / 2)
METRES_PER_DEGREE = 111_319.49


def sim_state(north: float, east: float, up: float, heading: float = HEADING0, **more: float) -> Any:
    """ArduPilot's SIM_STATE for a place relative to the start."""
    lat = LAT0 + north / METRES_PER_DEGREE
    lon = LON0 + east / (METRES_PER_DEGREE * math.cos(math.radians(LAT0)))
    values = {"roll": 0.0, "pitch": 0.0, "vn": 0.0, "ve": 0.0, "vd": 0.0} | more
    return dialect.MAVLink_sim_state_message(
        *(1.0, 0.0, 0.0, 0.0),
        *(values["roll"], values["pitch"], heading),
        *(0.0, 0.0, -9.8, 0.01, 0.02, 0.03),
        *(lat, lon, ALT0 + up, 0.0, 0.0),
        *(values["vn"], values["ve"], values["vd"]),
        round(lat * 1e7),
        round(lon * 1e7),
    )


def read(reader: TruthReader, message: Any, now_ns: int) -> Kinematics:
    truth = reader.take(message, now_ns)
    assert truth is not None
    return truth


def test_the_vehicle_stands_on_the_pad_when_first_heard() -> None:
    truth = read(TruthReader(PAD), sim_state(0.0, 0.0, 0.0), 5)
    assert (truth.x_m, truth.y_m, truth.height_m) == (2.0, -1.0, 0.1)
    assert truth.yaw_rad == pytest.approx(math.pi / 2)
    assert truth.stamp_ns == 5


def test_forward_is_where_the_nose_pointed_at_the_start() -> None:
    reader = TruthReader(PAD)
    read(reader, sim_state(0.0, 0.0, 0.0), 0)
    now_ns = 0
    for step in range(1, 301):  # three metres ahead, half a metre up, turning right
        ahead, now_ns = 0.01 * step, step * 10_000_000
        north, east = ahead * math.cos(HEADING0), ahead * math.sin(HEADING0)
        speed = {"vn": math.cos(HEADING0), "ve": math.sin(HEADING0), "vd": -0.2}
        truth = read(reader, sim_state(north, east, 0.5, HEADING0 + 0.3, **speed), now_ns)
    assert (truth.x_m, truth.y_m) == pytest.approx((2.0, 2.0), abs=0.01)  # the pad's nose points to +y
    assert (truth.vx_mps, truth.vy_mps, truth.climb_mps) == pytest.approx((0.0, 1.0, 0.2), abs=1e-6)
    assert truth.height_m == pytest.approx(0.6, abs=1e-3)
    assert wrap_pi(truth.yaw_rad - math.pi / 2) == pytest.approx(0.3, abs=1e-6)
    assert truth.yaw_rate_radps == pytest.approx(0.03)


def test_the_centimetre_steps_of_latitude_are_smoothed() -> None:
    reader = TruthReader(Placement(0.0, 0.0, 0.0))
    read(reader, sim_state(0.0, 0.0, 0.0, 0.0), 0)
    errors = []
    for step in range(1, 500):
        north = 0.002 * step
        truth = read(reader, sim_state(north, 0.0, 1.0, 0.0, vn=0.2), step * 10_000_000)
        errors.append(truth.x_m - north)
    settled = errors[100:]
    spread = max(settled) - min(settled)
    assert spread < 0.006  # the raw steps are 0.011


def test_an_estimate_serves_until_the_truth_is_told() -> None:
    reader = TruthReader(Placement(0.0, 0.0, 0.0))
    ned = dialect.MAVLink_local_position_ned_message(0, 5.0, 5.0, -1.0, 0.1, 0.0, 0.0)
    assert reader.take(ned, 1) is None  # without an attitude it is half a pose
    assert reader.take(dialect.MAVLink_attitude_message(0, 0.1, 0.0, 0.5, 0.0, 0.0, 0.0), 2) is None
    assert read(reader, ned, 3).roll_rad == pytest.approx(0.1)
    truth = read(reader, sim_state(0.0, 0.0, 0.0), 4)
    assert (truth.x_m, truth.y_m) == (0.0, 0.0)  # the warehouse is laid anew, by the truth
    assert reader.take(ned, 5) is None


def test_px4s_ground_truth_is_read() -> None:
    def hil(up_mm: int) -> Any:
        half = HEADING0 / 2
        quaternion = [math.cos(half), 0.0, 0.0, math.sin(half)]
        place = (round(LAT0 * 1e7), round(LON0 * 1e7), 488_000 + up_mm)
        return dialect.MAVLink_hil_state_quaternion_message(
            0, quaternion, 0.0, 0.0, 0.1, *place, 0, 0, -30, 0, 0, 0, 0, 0
        )

    reader = TruthReader(PAD)
    read(reader, hil(0), 0)
    truth = read(reader, hil(1500), 10_000_000)
    assert truth.height_m == pytest.approx(1.6)
    assert truth.climb_mps == pytest.approx(0.3)
    assert truth.yaw_rad == pytest.approx(math.pi / 2)


def test_simstate_corrects_where_the_autopilot_believes_to_be() -> None:
    def simstate(north: float) -> Any:
        place = (round((LAT0 + north / METRES_PER_DEGREE) * 1e7), round(LON0 * 1e7))
        return dialect.MAVLink_simstate_message(0.1, 0.0, 0.0, 0.0, 0.0, -9.8, 0.0, 0.0, 0.2, *place)

    reader = TruthReader(Placement(0.0, 0.0, 0.0))
    assert reader.take(dialect.MAVLink_attitude_message(0, 0.0, 0.0, 0.7, 0.0, 0.0, 0.0), 0) is None
    estimate = dialect.MAVLink_local_position_ned_message(0, 40.0, -30.0, -0.2, 0.0, 0.0, 0.0)
    assert read(reader, estimate, 0).x_m == pytest.approx(0.0)
    for step in range(201):  # a metre ahead, the estimate astray
        assert reader.take(simstate(0.005 * step), step * 10_000_000) is None
        estimate = dialect.MAVLink_local_position_ned_message(0, 40.0, -30.0, -1.2, 0.5, 0.0, -0.3)
        truth = read(reader, estimate, step * 10_000_000)
    assert (truth.x_m, truth.y_m) == pytest.approx((1.0, 0.0), abs=0.02)
    assert (truth.climb_mps, truth.roll_rad, truth.yaw_rate_radps) == pytest.approx((0.3, 0.1, 0.2))
    assert truth.yaw_rad == pytest.approx(0.0)


class Sitl(asyncio.Protocol):
    """A simulator that climbs at 0.5 m/s and tells it once it has been asked."""

    climbed_m = 0.0
    connections: list[Sitl] = []  # noqa: RUF012 - one list for all connections of a test

    def connection_made(self, transport: Any) -> None:
        self.transport, self.asked = transport, set[int]()
        self.mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.mav.robust_parsing = True
        Sitl.connections.append(self)

    def data_received(self, data: bytes) -> None:
        for message in self.mav.parse_buffer(data) or ():
            if message.get_type() == "COMMAND_LONG" and message.command == 511:
                self.asked.add(int(message.param1))

    @classmethod
    async def fly(cls, duration_s: float) -> None:
        for _ in range(round(duration_s * 100)):
            cls.climbed_m += 0.005
            for sitl in cls.connections:
                if 108 in sitl.asked and not sitl.transport.is_closing():
                    state = sim_state(0.0, 0.0, cls.climbed_m, vd=-0.5)
                    sitl.transport.write(state.pack(sitl.mav))
            await asyncio.sleep(0.01)


@asynccontextmanager
async def sitl() -> AsyncIterator[int]:
    """The simulator's side, listening; its port."""
    Sitl.connections, Sitl.climbed_m = [], 0.0
    server = await asyncio.get_running_loop().create_server(Sitl, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        for connection in Sitl.connections:
            connection.transport.abort()
        server.close()
        await server.wait_closed()
        await asyncio.sleep(0.01)


def test_the_link_is_opened_followed_and_found_again() -> None:
    async def test() -> None:
        async with sitl() as port:
            clock = LoopClock()
            vehicle = ExternalVehicle(f"tcp:127.0.0.1:{port}", clock, PAD)
            flying = asyncio.create_task(Sitl.fly(20.0))
            assert await vehicle.open() == ("127.0.0.1", port)
            running = asyncio.create_task(vehicle.run())
            await asyncio.sleep(4.0)
            start = vehicle.truth().height_m
            assert 1.5 < start < 2.6
            earlier = vehicle.truth_at(clock.now_ns() - 500_000_000).height_m
            assert start - earlier == pytest.approx(0.25, abs=0.02)
            Sitl.connections[0].transport.abort()
            await asyncio.sleep(5.0)
            assert len(Sitl.connections) == 2
            assert vehicle.truth().height_m - start == pytest.approx(2.5, abs=0.05)  # the pad has not moved
            running.cancel()
            flying.cancel()
            await asyncio.gather(running, flying, return_exceptions=True)

    virtual(test())


class UdpSitl(asyncio.DatagramProtocol):
    """PX4's side: speaks first, to a fixed port; keeps what comes back."""

    def __init__(self) -> None:
        self.mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.heard: list[Any] = []

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self.heard += self.mav.parse_buffer(data) or []


def test_a_simulator_on_udp_is_heard_and_told_the_distance_to_our_floor() -> None:
    def hil(up_m: float) -> Any:
        place = (round(LAT0 * 1e7), round(LON0 * 1e7), round((ALT0 + up_m) * 1000))
        attitude = [math.cos(0.1), math.sin(0.1), 0.0, 0.0]  # 0.2 rad to the right
        return dialect.MAVLink_hil_state_quaternion_message(
            0, attitude, 0.0, 0.0, 0.0, *place, 0, 0, 0, 0, 0, 0, 0, 0
        )

    async def test() -> None:
        loop, port = asyncio.get_running_loop(), free_port()
        vehicle = ExternalVehicle(f"udpin:127.0.0.1:{port}", LoopClock(), PAD)
        opening = asyncio.create_task(vehicle.open())
        await asyncio.sleep(0.1)
        transport, sitl = await loop.create_datagram_endpoint(UdpSitl, remote_addr=("127.0.0.1", port))
        other = dialect.MAVLink(None, srcSystem=2, srcComponent=1)  # another vehicle, and not an autopilot:
        gimbal = dialect.MAVLink(None, srcSystem=1, srcComponent=154)  # neither is believed
        for step in range(400):
            transport.sendto(b"\xfd\x1c\x00" + bytes(3))  # a torn frame costs no other
            transport.sendto(hil(9.0).pack(gimbal))
            if step:
                transport.sendto(hil(5.0).pack(other))
            transport.sendto(hil(1.5 if step else 0.0).pack(sitl.mav))
            await asyncio.sleep(0.01)
        await opening
        asked = {int(m.param1) for m in sitl.heard if m.get_type() == "COMMAND_LONG"}
        assert {108, 115, 32, 30} <= asked
        ranges = [m for m in sitl.heard if m.get_type() == "DISTANCE_SENSOR"]
        assert len(ranges) == pytest.approx(100, abs=12)
        assert ranges[-1].orientation == dialect.MAV_SENSOR_ROTATION_PITCH_270
        assert ranges[-1].current_distance == pytest.approx(160.0 / math.cos(0.2), abs=1.0)
        assert vehicle.truth().height_m == pytest.approx(1.6)
        running = asyncio.create_task(vehicle.run())
        await asyncio.sleep(0.1)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        transport.close()
        await asyncio.sleep(0.01)

    virtual(test())


def test_what_a_stalled_simulator_does_not_read_is_not_piled_up() -> None:
    async def test() -> None:
        async with sitl() as port:
            vehicle = ExternalVehicle(f"tcp:127.0.0.1:{port}", LoopClock(), PAD)
            opening = asyncio.create_task(vehicle.open())
            await Sitl.fly(0.5)
            await opening
            Sitl.connections[0].transport.pause_reading()
            for _ in range(100_000):  # far more than the sockets hold
                vehicle.ask_streams()
            assert 0 < vehicle.unsent_bytes < 5000
            await vehicle.close()

    virtual(test())


def test_between_samples_the_motion_goes_on_for_a_moment() -> None:
    async def test() -> None:
        async with sitl() as port:
            clock = LoopClock()
            vehicle = ExternalVehicle(f"tcp:127.0.0.1:{port}", clock, PAD)
            opening = asyncio.create_task(vehicle.open())
            await Sitl.fly(4.0)  # and falls silent
            await opening
            now_ns = clock.now_ns()
            newest_m = vehicle.truth_at(now_ns - 20_000_000).height_m
            assert vehicle.truth_at(now_ns + 40_000_000).height_m - newest_m == pytest.approx(0.03, abs=0.008)
            later_m = vehicle.truth_at(now_ns + 10_000_000_000).height_m
            assert later_m - newest_m < 0.08
            running = asyncio.create_task(vehicle.run())
            await asyncio.sleep(0.01)
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)

    virtual(test())


def test_a_simulator_that_is_not_there_is_told_in_one_line() -> None:
    async def test() -> None:
        vehicle = ExternalVehicle("tcp:127.0.0.1:9", LoopClock(), PAD, patience_s=5.0)
        with pytest.raises(UnavailableError, match="--truth-url"):
            await vehicle.open()

    virtual(test())


@pytest.mark.parametrize(
    "url", ["", "udp:127.0.0.1:14550", "udpin:host", "tcp:host", "tcp:host:0", "tcp:host:99999"]
)
def test_a_wrong_address_names_the_right_form(url: str) -> None:
    async def test() -> None:
        with pytest.raises(InputError, match="tcp:HOST:PORT"):
            ExternalVehicle(url, LoopClock(), PAD)

    virtual(test())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--truth-url", "tcp:127.0.0.1:5762"], "belong together"),
        (["--truth-url", "nowhere", "--vehicle-url", "tcp:127.0.0.1:5760"], "tcp:HOST:PORT"),
    ],
)
def test_the_command_names_what_is_wrong_with_its_addresses(
    flightd: Command, arguments: list[str], told: str
) -> None:
    run = flightd("sim", *arguments)
    assert run.returncode == 2
    assert told in run.stderr
    assert "Traceback" not in run.stderr
