"""A file that is there while the motors may turn, for what shall not run beside a flight."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

from flightd.core.snapshot import Snapshot
from flightd.core.types import Event

_NAME = "armed"


class ArmedMark:
    """`ports.Monitor`: made and taken away as the vehicle is armed and disarmed.

    It lies in the service's run-time folder, in memory: what a daemon that died in the air left there stays
    until the next one hears that the vehicle is disarmed, a person stops the service, or the machine starts.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self._armed: bool | None = None

    @classmethod
    def of_environment(cls, environment: Mapping[str, str]) -> ArmedMark | None:
        """None where no service manager gave a folder."""
        folder = environment.get("RUNTIME_DIRECTORY", "").split(":")[0]
        return cls(Path(folder) / _NAME) if folder else None

    def tell(self, snapshot: Snapshot) -> None:
        vehicle = snapshot.vehicle
        if vehicle is None or vehicle.armed is self._armed:
            return
        self._armed = vehicle.armed
        try:
            if vehicle.armed:
                self.file.touch()
            else:
                self.file.unlink(missing_ok=True)
        except OSError as err:
            logging.getLogger(__name__).warning(
                "%s: %s; what waits for the end of a flight is not told", self.file, err.strerror
            )

    def event(self, event: Event) -> None:
        """Arming is in the status."""

    def over(self) -> None:
        """What the vehicle does then is not known: the mark stays as it is."""
