"""A daemon's child processes, one of each kind, for whoever kills their parent."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from flightd.adapters.camera.capture_process import SLOTS, capture
from flightd.adapters.camera.source import Source, SourceKind
from flightd.adapters.lamp import keep_led
from flightd.adapters.recorder.recorder import McapRecorder
from flightd.app.counting.code_readers import ReaderPool
from flightd.app.detection.detector_pool import DetectorPool
from flightd.runtime.child_process import Child, LinkedProcess
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing
from flightd.vision.line_detector import Detector
from tests.rigs.event_loops import real

WIDTH_PX, HEIGHT_PX = 64, 36


def hanging() -> Callable[[Any], Any]:
    """Of a child that never answers."""
    return lambda _: signal.pause()


async def keep(folder: Path) -> None:
    """Start them all, say so, and wait to be killed.  A LED and a folder of pictures lie in `folder`."""
    picture = np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    for number in range(9):
        cv2.imwrite(str(folder / "pictures" / f"{number}.png"), picture)
    ring = FrameRing.create(SLOTS, WIDTH_PX, HEIGHT_PX)
    source = Source(SourceKind.FOLDER, str(folder / "pictures"), WIDTH_PX, HEIGHT_PX, 1.0)
    came = asyncio.Event()
    lit = LinkedProcess(keep_led, (folder / "led",), print, print)
    captures = LinkedProcess(capture, (source, ring.name, 0), lambda _: came.set(), print)
    hangs = Child(hanging, lambda child: print(child.ask(None)), print)
    make = partial(Detector, "centroid", "yellow")
    with (
        McapRecorder(folder / "flight.mcap") as recorder,
        DetectorPool(make, 1, 60.0, LoopClock()) as detectors,
        ReaderPool(1, 60.0, LoopClock()) as readers,
    ):
        recorder.record("/some", 1, {"value": 1})
        recorder.push()
        await detectors.ready()
        await readers.ready()
        await came.wait()
        while (folder / "led" / "brightness").read_text() != "255" or not hangs.pid:
            lit.send(True)
            await asyncio.sleep(0.02)
        print("all are there", captures.pid, flush=True)
        while True:
            lit.send(True)
            await asyncio.sleep(0.1)


if __name__ == "__main__":
    real(keep(Path(sys.argv[1])))
