"""The down camera's frames on their way to the detectors, for whoever looks at some of them meanwhile."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from flightd.doctor.camera import brightness_series
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest
from flightd.runtime.within import Within
from flightd.vision.floor.brightness import Brightness


class FrameTap:
    """Hands each ticket on to `onward`; while somebody looks, the newest one to him, too."""

    def __init__(self, onward: Callable[[FrameTicket], None]) -> None:
        self._onward = onward
        self._looking: Latest[FrameTicket] | None = None

    def put(self, ticket: FrameTicket) -> None:
        """A frame came."""
        self._onward(ticket)
        if self._looking is not None:
            self._looking.put(ticket)

    async def brightness(self, seconds: float) -> list[Brightness]:
        """Of the pictures that come within so long; one looks at a time."""
        self._looking = Latest()
        found: list[Brightness] = []
        try:
            with contextlib.suppress(TimeoutError):
                async with Within(seconds):
                    async for one in brightness_series(self._looking):
                        found.append(one)  # noqa: PERF401 - what came until the time is over is kept
        finally:
            self._looking = None
        return found


def _nowhere(_ticket: FrameTicket) -> None: ...


NO_FRAMES = FrameTap(_nowhere)
"""Of a flight whose camera was connected elsewhere."""
