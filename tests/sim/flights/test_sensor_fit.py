"""`flightd calibrate --from-log` on a flight of a drone that its configuration does not know."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from flightd.core.topics import Document, Topic
from flightd.replay.log import read_log
from tests.command import Command


@pytest.mark.slow
def test_a_flight_tells_what_the_configuration_did_not_know(flightd: Command, recorded_flight: Path) -> None:
    truths = read_log(recorded_flight / "truth.mcap", {Topic.UNKNOWNS}).messages(Document)
    truth = json.loads(truths[-1].text)
    log = recorded_flight / "flight.mcap"
    code, out, _ = flightd("calibrate", "--from-log", log, "--json")
    found = json.loads(out)
    assert code == 0
    fitted = {row["name"]: row for row in found["sensors"]}
    for name, key, offset in (
        ("mount roll", "mount_roll_rad", 0.0),
        ("mount pitch", "mount_pitch_rad", 0.0),
        ("mount yaw", "mount_yaw_rad", 90.0),
    ):
        error_deg = fitted[name]["fitted"] - offset - math.degrees(truth[key])
        assert abs(error_deg) < 3.0 * fitted[name]["sigma"] < 1.8
    focal = fitted["focal length"]
    error_px = focal["fitted"] - focal["configured"] * truth["focal_share"]
    assert abs(error_px) < 3.0 * focal["sigma"] < 2.5
    delay = fitted["camera delay"]
    down_s, up_s = truth["path_s"]
    assert abs(delay["fitted"] - 0.06 - truth["camera_delay_s"] + 0.5 * (down_s - up_s)) < 0.012
    bias_deg = [-math.degrees(one) for one in truth["tilt_bias_rad"]]
    for axis, expected_deg in zip(("roll", "pitch"), bias_deg, strict=True):
        assert abs(fitted[f"tilt bias {axis}"]["fitted"] - expected_deg) < 0.75
    assert abs(fitted["lens residual k1"]["fitted"] - fitted["lens residual k1"]["configured"]) < 0.03

    code, out, _ = flightd("calibrate", "--from-log", log)
    assert (code, "[camera]" in out, "mount_yaw_deg = " in out) == (0, True, True)


def test_pictures_or_a_log_not_both(flightd: Command, tmp_path: Path) -> None:
    log = tmp_path / "empty.mcap"
    for given in ((), ("board.jpg", "--from-log", log)):
        code, _, err = flightd("calibrate", *given)
        assert (code, err) == (2, "flightd: give pictures of a board, or --from-log LOG\n")
    code, _, err = flightd("calibrate", "--from-log", log, "--board", "9x6")
    assert (code, err) == (2, "flightd: --board: a flight shows no board; leave it out, or --from-log\n")
    log.write_bytes(b"")
    code, _, err = flightd("calibrate", "--from-log", log)
    assert (code, "the file is empty" in err) == (2, True)
