"""What a flight that counts shelves needs beside the daemon: readers, store and writer, opened and closed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import AsyncExitStack, ExitStack
from datetime import UTC, datetime
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app import scanner_of
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.core.inventory import PlannedLocation
from flightd.grid.site import Site
from flightd.mission.scanner import nodes_to_count
from flightd.ports import Clock
from flightd.runtime.counting import Counting
from flightd.runtime.readers import ReaderPool, Readers
from flightd.runtime.store_writer import StoreWriter


class FlightCount:
    """The inventory of one flight.  `config` visits only the nodes that the count still needs.

    Raises InputError when nothing is left of it, and what the store raises."""

    def __init__(
        self, config: Config, site: Site, folder: Path | None, stack: ExitStack | AsyncExitStack
    ) -> None:
        self.config = config
        self._site = site
        self._stack = stack
        self._store: SqliteStore | None = None
        self._run = config.inventory.run or f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        self._counted: frozenset[str] = frozenset()
        self.scans = scanner_of(config, site) is not None
        if not self.scans or folder is None:
            return
        self._store = stack.enter_context(SqliteStore(folder))
        self._store.plan(
            PlannedLocation(location.code, location.node) for location in site.locations.values()
        )
        self._counted = self._store.counted(self._run)
        if self._counted:
            self._go_on()

    async def begun(
        self, clock: Clock, timed: Callable[[Readers], Readers] = lambda readers: readers
    ) -> Counting | None:
        """The count itself for the daemon, its readers started (and put behind what `timed` makes of them);
        None where nothing is scanned."""
        if not self.scans:
            return None
        scan = self.config.scan
        pool = self._stack.enter_context(ReaderPool(scan.workers, scan.timeout_s, clock))
        await pool.ready()
        writer = None
        if self._store is not None:
            utc_at_zero_ns = time.time_ns() - clock.now_ns()
            writer = self._stack.enter_context(
                StoreWriter(self._store, self._run, utc_at_zero_ns, clock, _to_stderr)
            )
        return Counting(timed(pool), scan.workers, writer, self._counted)

    def _go_on(self) -> None:
        mission = self.config.mission
        nodes = nodes_to_count(self._site, mission.nodes or self._site.serpentine_route(), self._counted)
        if not nodes:
            raise InputError(
                f"inventory.run {self._run!r}: every location is counted; give the next count another name"
            )
        self.config = self.config.model_copy(update={"mission": mission.model_copy(update={"nodes": nodes})})


def _to_stderr(text: str) -> None:
    print(f"flightd: {text}", file=sys.stderr)
