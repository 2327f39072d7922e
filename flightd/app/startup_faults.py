"""What a start lacks, and whether the daemon does without it."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from flightd.core.errors import FlightdError, InputError, UnavailableError

_LOG = logging.getLogger(__name__)


class StartupFaults:
    """What could not be had.  Where the vehicle may be `in_air` it needs the daemon more than the daemon what
    it lacks: record, ground, metrics, codes."""

    def __init__(self, *, in_air: bool) -> None:
        self.in_air = in_air
        self.first: FlightdError | None = None
        """The first that is done without: it ends the daemon once its vehicle stands disarmed."""

    @contextmanager
    def tolerated(self) -> Iterator[None]:
        """What is opened within may be done without."""
        try:
            yield
        except (InputError, UnavailableError) as err:
            self.do_without(err)
        except OSError as err:  # such as a disk that fails, or a process that has no room
            if not self.in_air:
                raise
            self.do_without(UnavailableError(str(err)))

    def do_without(self, err: FlightdError) -> None:
        """Go on without a part that cannot be had.  Raises `err` where nothing can be in the air."""
        if not self.in_air:
            raise err
        _LOG.warning("%s; the vehicle may be in the air, it is done without", err)
        self.first = self.first or err


ON_GROUND: Final = StartupFaults(in_air=False)
"""Nothing is done without."""
