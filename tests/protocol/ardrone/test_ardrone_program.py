"""The emulator as a program of its own, and the addresses under which the drone is named."""

from __future__ import annotations

import socket
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.vehicle.ardrone.settings import settings_of
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.config.camera import CameraConfig
from flightd.config.schema import load_table, parse_config
from flightd.config.vehicle import VehicleConfig
from flightd.core.errors import InputError
from flightd.sim.ardrone.__main__ import main

ROOT = Path(__file__).parents[3]


class StillClock:
    """Nobody runs here: time stands."""

    def now_ns(self) -> int:
        return 0

    def hold(self) -> object:
        raise AssertionError("nothing is awaited")


def test_the_url_names_host_ports_and_navdata() -> None:
    plain = settings_of("ardrone://192.168.1.1")
    assert (plain.host, plain.at_port, plain.navdata_port) == ("192.168.1.1", 5556, 5554)
    assert not plain.full_navdata
    assert settings_of("ardrone://192.168.1.1", highest_m=3.5).height_max_m == 3.5
    assert settings_of("ardrone://192.168.1.1", highest_m=99.0).height_max_m == plain.height_max_m
    other = settings_of("ardrone://localhost?at=1&navdata=2&video=3&control=4&full=1")
    assert (other.at_port, other.navdata_port, other.video_port, other.control_port) == (1, 2, 3, 4)
    assert other.full_navdata


@pytest.mark.parametrize(
    "url",
    [
        "udpout://192.168.1.1",
        "ardrone://",
        "ardrone:",
        "ardrone://x?port=5",
        "ardrone://x?at=0",
        "ardrone://x?at=-5",
    ],
)
def test_a_wrong_url_is_named_with_its_remedy(url: str) -> None:
    with pytest.raises(InputError, match=r"vehicle\.url .*expected ardrone://HOST"):
        settings_of(url)


def test_the_drones_camera_needs_the_drone() -> None:
    clock = StillClock()
    plane = connect_vehicle(VehicleConfig(kind="ardupilot"), clock)
    with pytest.raises(InputError, match=r'needs vehicle\.kind = "ardrone"'):
        connect_camera(CameraConfig(url="ardrone:"), clock, lambda _: None, plane)  # type: ignore[arg-type]


def test_the_shipped_configuration_is_sound() -> None:
    path = ROOT / "configs" / "ardrone.toml"
    config = parse_config(load_table(path), path)
    assert config.vehicle.kind == "ardrone"
    assert settings_of(config.vehicle.url).tilt_max_rad > 0.0


def test_a_port_that_is_taken_is_one_clear_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        assert main(["--ports", str(taken.getsockname()[1]), "0", "0", "0"]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert main(["--site", "no-such-site.toml"]) == 2
    assert "no-such-site.toml" in capsys.readouterr().err


@pytest.mark.slow
def test_the_program_serves_a_drone() -> None:
    command = [sys.executable, "-m", "flightd.sim.ardrone", "--ports", "0", "0", "0", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as program:
        try:
            assert program.stdout is not None
            line = program.stdout.readline()
            port = int(line.partition("navdata=")[2].partition(",")[0])
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
                client.settimeout(30.0)
                client.sendto(b"\x01", ("127.0.0.1", port))
                data = client.recv(4096)
        finally:
            program.terminate()
    assert struct.unpack_from("<I", data)[0] == 0x55667788
    assert len(data) == 24
