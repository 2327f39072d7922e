"""A drone that stands and whose down camera can be told how to expose: link, settings and doctor's words are
a drone's, the camera is made up."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.ground_link.messages.answers import Accepted
from flightd.adapters.ground_link.messages.maintenance import (
    AskDoctor,
    CheckReport,
    DoctorAnswer,
    InstallProfile,
    Maintenance,
    ProposeSettings,
    Restart,
    SettingsAnswer,
)
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import Answer
from flightd.adapters.store.sent_profiles import sent_name
from flightd.app.maintenance.checks import exposure_reports
from flightd.app.maintenance.settings import key_reports, section_texts
from flightd.config.remote_change import checked, proposed
from flightd.config.schema import Config, parse_config
from flightd.core.exposure import ExposureState
from flightd.core.preview import CameraName, Preview
from flightd.core.types import Phase
from flightd.doctor.exposure import Seen, check_exposure
from flightd.runtime.clock import LoopClock
from flightd.vision.floor.brightness import brightness_of
from tests.rigs.event_loops import real
from tests.rigs.ground_link import SITE, local, tell_once

FILE = Path("flightd.toml")
AUTOMATIC = ExposureState(False, 0.020, 64.0, 0)
_LOOK_S = 0.05


def picture() -> np.ndarray[Any, np.dtype[np.uint8]]:
    """A grey floor with a line, a patch of it burnt out."""
    bgr = np.full((180, 320, 3), 90, np.uint8)
    cv2.line(bgr, (0, 120), (319, 60), (40, 200, 220), 14)
    bgr[:54, :64] = 255
    return bgr


class CameraDrone:
    """`ran`: the settings that it runs by; those in its file it takes when it is started anew."""

    def __init__(self) -> None:
        self.table: dict[str, Any] = {
            "mission": {"site": "site.toml", "speed_mps": 1.0, "height_m": 1.5},
            "camera": {"url": "device:/dev/video0", "fx_px": 400.0, "fy_px": 400.0},
        }
        self.ran = self.table
        self._ports: Future[str] = Future()
        self._ending = threading.Event()

    @property
    def at(self) -> str:
        """As `flightd ground --drone` takes it."""
        return self._ports.result(20)

    @contextmanager
    def standing(self) -> Iterator[CameraDrone]:
        """It stands there meanwhile."""
        thread = threading.Thread(target=lambda: real(self._stand()), name="camera drone", daemon=True)
        thread.start()
        try:
            yield self
        finally:
            self._ending.set()
            thread.join(20)
            assert not thread.is_alive()

    async def serve(self, request: Maintenance, _peer: Peer) -> Answer:
        """`Maintainer`."""
        match request:
            case AskDoctor():
                return self._report(request.id)
            case ProposeSettings():
                checked(self.table, request.changes, FILE)
                self.table = proposed(self.table, request.changes)
            case InstallProfile():
                file = sent_name(request.name, request.content)
                self.table = proposed(self.table, {"vision.profile": file})
            case Restart():
                self.ran = self.table
                return Accepted(request=request.id)
        return self._settings(request.id)

    def _report(self, request: str) -> DoctorAnswer:
        config = parse_config(self.ran, FILE)
        state = read_back(config)
        checks = check_exposure(config, Seen(state, [brightness_of(picture())] * 20, 30.0))
        return DoctorAnswer(
            request=request,
            fit=True,
            checks=tuple(CheckReport(one.name, one.level.value, one.text, one.remedy) for one in checks),
            versions={},
            log=(),
            exposures=exposure_reports(config, state, None),
        )

    def _settings(self, request: str) -> SettingsAnswer:
        return SettingsAnswer(
            request=request,
            file=str(FILE),
            tag=str(hash(str(self.table))),
            table=self.table,
            keys=key_reports(),
            sections=section_texts(),
            versions=(),
            pending=self.table != self.ran,
            locked="",
            restarts=True,
        )

    async def _stand(self) -> None:
        jpeg = cv2.imencode(".jpg", picture(), [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
        clock = LoopClock()
        with ZmqGround(local(picture_fps=5.0), SITE, clock, maintainer=self) as link:
            status, command = (int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints)
            async with asyncio.TaskGroup() as tasks:
                running = tasks.create_task(link.run())
                self._ports.set_result(f"eye=127.0.0.1:{status}/{command}")
                seq = 0
                while not self._ending.is_set():
                    tell_once(link, Phase.PREFLIGHT, armed=False)
                    now_ns = clock.now_ns()
                    if link.picture_due(now_ns):
                        link.picture(Preview(CameraName.DOWN, seq := seq + 1, now_ns, jpeg))
                    await asyncio.sleep(_LOOK_S)
                running.cancel()


def read_back(config: Config) -> ExposureState:
    """A camera that exposes by itself until it is told, and whose gain ends at 100."""
    order = config.camera.exposure_order()
    if order.exposure_s is None:
        return AUTOMATIC
    gain = AUTOMATIC.gain if order.gain is None else min(order.gain, 100.0)
    return ExposureState(True, order.exposure_s, gain, order.anti_flicker_hz)
