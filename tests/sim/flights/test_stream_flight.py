"""Flights by a camera that streams its frames: in real time, by what `CaptureCamera` reads of them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from flightd.app.simulation.ports import WorldPorts, peers_at
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.core.errors import InputError
from flightd.core.topics import Topic
from flightd.core.types import LineSet
from flightd.replay.log import read_log
from flightd.sim.scenario.scenario import CameraScenario, Scenario
from flightd.sim.sensors.camera_path import CameraPath
from tests.rigs.real_time_flight import flown, is_sound
from tests.rigs.small_camera import SMALL

STREAMS = [path for path in CameraPath if path.is_stream]
CAMERA = SMALL | {"height_px": 184, "capture_delay_s": 0.03}
"""RTP takes multiples of 8; what two frames of this rate add to the usual delay is too late to fly by."""
INTERVAL_NS = 1e9 / SMALL["fps"]
GAP = """
[[fault]]
kind = "camera_gone"
at_s = 2.0
duration_s = 0.2
"""
HOLDS_ON = ("--set", "mission.lines_hold_s=0.6")
"""Not to stop for the gap."""


@pytest.mark.realtime
@pytest.mark.parametrize("path", STREAMS)
def test_a_mission_is_flown_by_a_stream_whose_frames_have_the_time_of_their_exposure(
    path: CameraPath, tmp_path: Path
) -> None:
    gap = tmp_path / "gap.toml"
    gap.write_text(GAP)
    summary = flown(tmp_path, "--camera", path, "--scenario", str(gap), *HOLDS_ON, **CAMERA)
    assert is_sound(summary), summary
    assert_true(tmp_path, path, summary)


def assert_true(folder: Path, path: CameraPath, summary: dict[str, Any]) -> None:
    """Each stamp is that of an exposure, but for what the configuration does not know of the delay.  A stamp
    wrong by whole frames has no exposure near it where the camera took none for a while."""
    camera = CameraScenario.model_validate(CAMERA).camera()
    unknown_ns = (summary["drawn"]["camera_delay_s"] - path.latency_s(camera)) * 1e9
    truth = read_log(folder / "truth.mcap", {Topic.EXPOSED}).entries
    exposed_ns = [entry.message["stamp_ns"] for entry in truth if isinstance(entry.message, dict)]
    seen = read_log(folder / "flight.mcap", {Topic.LINES}).messages(LineSet)
    stamps_ns = [lines.stamp_ns - unknown_ns for lines in seen]
    gap = max(pairwise(exposed_ns), key=lambda one: one[1] - one[0])
    assert gap[1] - gap[0] > 3 * INTERVAL_NS
    for edge_ns in gap:
        assert min(abs(stamp - edge_ns) for stamp in stamps_ns) < 2.5 * INTERVAL_NS, "flown by beside the gap"
    errors = [min(abs(stamp - one) for one in exposed_ns) / INTERVAL_NS for stamp in stamps_ns]
    assert max(errors) < 0.4, "true to a part of a frame's interval"
    late_ns = (summary["estimated"]["camera_delay_s"] - summary["drawn"]["camera_delay_s"]) * 1e9
    assert abs(late_ns) < 0.4 * INTERVAL_NS, "and so say the lines while the drone tilts"


@pytest.mark.parametrize(
    ("options", "size", "said"),
    [
        (SimOptions(camera="tape"), {}, r"--camera tape: .* shared, stream:mjpeg, stream:h264"),
        (SimOptions(camera="stream:h264", speed="max"), {}, r"--speed max: a stream .* leave --speed out"),
        (SimOptions(camera="stream:mjpeg", speed="2"), {}, r"--speed 2: a stream .* --speed 1 only"),
        (SimOptions(camera="stream:h264", vehicle="ardrone"), {}, "leave --camera out"),
        (
            SimOptions(camera="stream:mjpeg"),
            {"height_px": 180},
            "of 8 up to 2040, not 640x180; give",
        ),
        (SimOptions(camera="stream:h264"), {"width_px": 321}, "even numbers, not 321x360; give"),
    ],
)
def test_what_cannot_be_streamed_is_refused_with_what_to_do(
    options: SimOptions, size: dict[str, int], said: str, tmp_path: Path
) -> None:
    scenario = Scenario.model_validate({"camera": size})
    with pytest.raises(InputError, match=said):
        prepare(options, scenario, tmp_path, lambda _: None)


@pytest.mark.parametrize("path", STREAMS)
def test_a_stream_is_flown_by_in_real_time_and_named_as_the_cameras_address(
    path: CameraPath, tmp_path: Path
) -> None:
    simulation = prepare(SimOptions(camera=path), Scenario(), tmp_path, lambda _: None)
    assert simulation.speed == 1.0
    peers = peers_at(WorldPorts((14550,), 5600, None), simulation.config, simulation.camera)
    assert peers.camera == "stream:rtp://127.0.0.1:5600"
