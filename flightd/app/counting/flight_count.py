"""What a flight that counts shelves needs beside the daemon: readers, store and writer, opened and closed."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import AsyncExitStack, ExitStack, nullcontext
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.counting.code_readers import ReaderPool, Readers
from flightd.app.counting.count import Counting
from flightd.app.counting.store_writer import StoreWriter, nobody, utc_at_zero_ns
from flightd.app.counting.text_searcher import TextSearcher
from flightd.app.startup_faults import ON_GROUND, StartupFaults
from flightd.config.schema import Config
from flightd.core.inventory import PlannedLocation
from flightd.core.scanning import CountedPlace
from flightd.doctor.machine import check_count_clock
from flightd.mission.plan.flight_plan import counts_shelves
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.site.site import Site
from flightd.vision.shelf.text_reader import needs_extra

_LOG = logging.getLogger(__name__)


class FlightCount:
    """The inventory of one flight, kept in `folder` if one is given, its looks named by `run`.  Raises what
    the store raises, unless the `faults` do without it: then nothing is kept."""

    def __init__(
        self,
        config: Config,
        site: Site,
        folder: Path | None,
        stack: ExitStack | AsyncExitStack,
        *,
        run: str,
        faults: StartupFaults = ON_GROUND,
    ) -> None:
        self._scan = config.scan
        self._stack = stack
        self._store: SqliteStore | None = None
        self._run = run
        self._counted: tuple[CountedPlace, ...] = ()
        self.newest_ns = 0
        """UTC of the newest look that the inventory had before this flight; 0 without one."""
        self.scans = counts_shelves(config, site)
        if not self.scans or folder is None:
            return
        with faults.tolerated():
            self._store, self._counted = self._opened(folder, site)
        if faults.in_air:  # on the ground nothing starts before that is put right
            for check in check_count_clock(self.newest_ns):
                _LOG.warning("%s; %s", check.text, check.remedy)

    def _opened(self, folder: Path, site: Site) -> tuple[SqliteStore, tuple[CountedPlace, ...]]:
        """The store, ready for this flight, and what is counted already."""
        with ExitStack() as opened:
            store = opened.enter_context(SqliteStore(folder))
            places = site.locations.values()
            planned = (PlannedLocation(place.code, place.node, place.pallets_deep) for place in places)
            store.plan(planned, site.name)
            store.withdraw_pending(self._run)
            counted, self.newest_ns = store.counted(self._run), store.newest_ns()
            self._stack.callback(opened.pop_all().close)
        return store, counted

    async def begun(
        self,
        clock: Clock,
        timed: Callable[[Readers], Readers] = lambda readers: readers,
        hold: Hold = nullcontext,
    ) -> Counting | None:
        """The count itself for the daemon, its readers started (and put behind what `timed` makes of them),
        time held by `hold` while processes and disk are waited for;
        None where nothing is scanned."""
        if not self.scans:
            return None
        scan = self._scan
        pool = self._stack.enter_context(ReaderPool(scan.workers, scan.timeout_s, clock, hold))
        await pool.ready()
        writer, texts = None, None
        if self._store is not None:
            texts = self._text_searcher(self._store, hold)
            writer = self._stack.enter_context(
                StoreWriter(
                    self._store,
                    self._run,
                    max(utc_at_zero_ns(clock), self.newest_ns - clock.now_ns()),  # never before what is there
                    clock,
                    _LOG.warning,
                    hold,
                    texts.put if texts else nobody,
                )
            )
        return Counting(timed(pool), scan.workers, writer, self._counted, texts)

    def _text_searcher(self, store: SqliteStore, hold: Hold) -> TextSearcher | None:
        """What reads printed text, where the site says what text means; told once where it cannot be read."""
        if not self._scan.text:
            return None
        missing = needs_extra()
        if missing is not None:
            _LOG.warning("%s", missing)
            return None
        return self._stack.enter_context(TextSearcher(store, self._scan.text, _LOG.warning, hold))
