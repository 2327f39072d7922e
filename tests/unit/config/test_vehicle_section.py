"""The [vehicle] section: keys that the chosen adapter cannot honour are refused, files lie beside it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.ardupilot import GUIDED, ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.signing import make_key, read_key
from flightd.config.schema import Config, parse_config
from flightd.core.errors import InputError
from flightd.ports import PoseTaker
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import virtual


def parsed(folder: Path, **vehicle: Any) -> Config:
    return parse_config({"mission": {"site": "site.toml"}, "vehicle": vehicle}, folder / "flightd.toml")


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ({"kind": "px4", "flying_mode": "guided"}, "flying_mode is ArduCopter's"),
        ({"kind": "px4", "raw_thrust": True}, "raw_thrust is ArduCopter's"),
        ({"own_system_id": 1}, "own_system_id 1 is the vehicle's system_id"),
        ({"own_system_id": 255}, "own_system_id 255 is what ground stations have"),
        ({"kind": "px4", "own_system_id": 190}, "own_system_id is for ArduCopter"),
        ({"kind": "ardrone", "pose_output": "odometry"}, 'pose_output needs kind = "ardupilot" or "px4"'),
        ({"kind": "mavsdk", "signing_key": "a.key"}, 'signing_key needs kind = "ardupilot" or "px4"'),
        ({"signing_stamp": "a"}, "signing_stamp without signing_key"),
        ({"landing_target": True}, "landing_target needs pose_output"),
        ({"pose_output": "gps"}, "vehicle.pose_output"),
    ],
)
def test_what_the_adapter_cannot_do_is_refused(tmp_path: Path, keys: dict[str, Any], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        parsed(tmp_path, **keys)


def test_key_files_lie_beside_the_configuration(tmp_path: Path) -> None:
    vehicle = parsed(tmp_path, signing_key="keys/mavlink.key").vehicle
    assert vehicle.signing_key == tmp_path / "keys/mavlink.key"
    assert vehicle.stamp_file == tmp_path / "keys/mavlink.key.stamp"
    chosen = parsed(tmp_path, signing_key="a.key", signing_stamp="state/stamp").vehicle
    assert chosen.stamp_file == tmp_path / "state/stamp"
    assert parsed(tmp_path).vehicle.stamp_file is None


def test_a_new_key_is_secret_and_never_replaces_another(tmp_path: Path) -> None:
    path = tmp_path / "mavlink.key"
    old = os.umask(0)
    try:
        make_key(path)
    finally:
        os.umask(old)
    assert path.stat().st_mode & 0o777 == 0o600
    first = read_key(path)
    assert len(set(first)) > 8
    with pytest.raises(InputError, match="there already"):
        make_key(path)
    assert read_key(path) == first
    with pytest.raises(InputError, match="cannot write the key"):
        make_key(tmp_path / "nowhere" / "key")


def test_the_adapter_gets_mode_key_and_outputs(tmp_path: Path) -> None:
    async def test() -> None:
        make_key(tmp_path / "mavlink.key")
        section = parsed(
            tmp_path, flying_mode="guided", signing_key="mavlink.key", pose_output="vision_position"
        ).vehicle
        vehicle = connect_vehicle(section, LoopClock())
        assert isinstance(vehicle, ArduPilotVehicle)
        assert isinstance(vehicle, PoseTaker)
        assert vehicle.flying_mode == GUIDED
        assert (tmp_path / "mavlink.key.stamp").exists()  # stamps are claimed before the first is used

    virtual(test())


def test_a_missing_key_is_told_before_anything_opens(tmp_path: Path) -> None:
    async def test() -> None:
        with pytest.raises(InputError, match=r"gone.key.*flightd keygen"):
            connect_vehicle(parsed(tmp_path, signing_key="gone.key").vehicle, LoopClock())

    virtual(test())
