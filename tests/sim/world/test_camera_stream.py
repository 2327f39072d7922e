"""The simulated camera's own side of its streams."""

from __future__ import annotations

import sys
from contextlib import closing

import numpy as np
import pytest

from flightd.app.absent_parts import NO_RECORDER
from flightd.config.paths import shipped
from flightd.core.errors import UnavailableError
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_port
from flightd.sim.sensors.camera_path import CameraPath
from flightd.sim.sensors.camera_stream import CameraStream
from flightd.sim.sensors.optics import wide_lens
from flightd.sim.world import World, WorldSpec
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual

STREAMS = [path for path in CameraPath if path.is_stream]


@pytest.mark.parametrize("path", STREAMS)
def test_a_stream_is_in_order_whatever_its_frames_are(path: CameraPath) -> None:
    lens = wide_lens().scaled(64, 40)
    frame = np.zeros((40, 64, 3), dtype=np.uint8)
    with closing(CameraStream(path, ("127.0.0.1", free_port()), lens, 20.0)) as stream:
        sent = [stream.send(frame, exposed_ns) for exposed_ns in (50, 10_050, 5_050, 10_050, 20_050)]
    assert sent == [True, True, False, False, True]


def test_without_pyav_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.delitem(sys.modules, "flightd.sim.sensors.camera_stream")
    site = load_site(shipped("site-demo.toml"))
    spec = WorldSpec(site, 1, ("127.0.0.1", 9), camera_path=CameraPath.H264)

    async def main() -> None:
        World(spec, LoopClock(), NO_RECORDER)

    with pytest.raises(UnavailableError, match=r"--camera stream:h264 .*extra ardrone.* -m pip install 'av"):
        virtual(main())
