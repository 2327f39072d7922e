"""Delivering that makes way for a flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import FlightdError
from flightd.ground.ground_store.batch import Batch, Receipt
from flightd.ground.ground_store.sender import Target


class FlightBeganError(FlightdError):
    """The drone is armed: what is left is for later."""


@dataclass(frozen=True, slots=True)
class BetweenFlights:
    """A `Target` that raises FlightBeganError while there is a file `mark`: at once, and before whatever is
    asked of it or given to it."""

    target: Target
    mark: Path

    def __post_init__(self) -> None:
        self._check()

    def standings(self, looks: Sequence[str]) -> dict[str, int]:
        self._check()
        return self.target.standings(looks)

    def printed_texts(self, looks: Sequence[str]) -> dict[str, str]:
        self._check()
        return self.target.printed_texts(looks)

    def missing_pictures(self, names: Sequence[str]) -> set[str]:
        self._check()
        return self.target.missing_pictures(names)

    def keep_picture(self, jpeg: bytes) -> str:
        self._check()
        return self.target.keep_picture(jpeg)

    def take(self, batch: Batch) -> Receipt:
        self._check()
        return self.target.take(batch)

    def _check(self) -> None:
        if self.mark.exists():
            raise FlightBeganError("a flight is on, what is left is for later", file=self.mark)
