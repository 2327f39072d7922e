"""A camera's exposure held as it was ordered: set, read back now and then, and told when it changes."""

from __future__ import annotations

from collections.abc import Callable

from flightd.adapters.camera.v4l2_controls import V4l2Controls
from flightd.core.exposure import ExposureOrder, ExposureState

_SETTLED = 3
"""Frames after which a camera that begins to send has its own say: some reset their settings then."""
_AGAIN = 100
"""Frames from one look to the next."""


class HeldExposure:
    """Call `look` with each frame; `tell` hears the state whenever it is another.  None for `controls`: the
    device shows none, nothing can be set."""

    def __init__(
        self, controls: V4l2Controls | None, order: ExposureOrder, tell: Callable[[ExposureState], None]
    ) -> None:
        self._controls = controls
        self._order = order
        self._tell = tell
        self._told: ExposureState | None = None
        self._frames = 0
        self._set()

    def look(self, usual: bool) -> None:
        """A frame came; `usual`: it, and the next, have the usual exposure, not a part of it."""
        self._frames += 1
        if not usual:
            return
        if self._frames == _SETTLED and self._read().mismatches(self._order):
            self._set()
        if self._frames == 2 * _SETTLED or self._frames % _AGAIN == 0:
            state = self._read()
            if state != self._told:
                self._told = state
                self._tell(state)

    def give_back(self) -> None:
        """Leave the device as it was found."""
        if self._controls is not None:
            self._controls.give_back()

    def _set(self) -> None:
        if self._controls is not None and not self._order.is_empty:
            self._controls.set(self._order)

    def _read(self) -> ExposureState:
        return ExposureState() if self._controls is None else self._controls.read()
