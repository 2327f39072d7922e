"""One pass of an exchange: what lies in the inbox is taken, what changed goes into the outbox."""

from __future__ import annotations

import fcntl
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.shared_folder import SharedFolder
from flightd.ground.wms_exchange.exchange_file import CountsSection, ExchangeFile, ExpectedSection
from flightd.ground.wms_exchange.inbox import Inbox, TakenFile
from flightd.ground.wms_exchange.outbox import deliver_counts


@dataclass(slots=True)
class Exchanged:
    """What a pass did, and what kept it from more: one side goes on without the other."""

    files: list[TakenFile] = field(default_factory=list)
    sent: list[str] = field(default_factory=list)
    failures: list[FlightdError] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Exchange:
    """By the file at `path`, with the `store` for counts; `folder` opens one by address, file and key."""

    path: Path
    asked: ExchangeFile
    store: GroundStore | None
    folder: Callable[[str, Path, str], SharedFolder] = SharedFolder
    sleep: Callable[[float], None] = time.sleep
    utc_ns: Callable[[], int] = time.time_ns

    def once(self) -> Exchanged:
        """One pass.  InputError where counts are asked for without a store."""
        expected, counts = self.asked.expected, self.asked.counts
        if counts is not None and self.store is None:
            raise InputError(
                "counts come out of a store", file=self.path, key="counts", remedy="give --store"
            )
        done = Exchanged()
        if expected is not None:
            with _kept(done.failures):
                self._take(expected, done)
        if counts is not None and self.store is not None:
            with _kept(done.failures):
                self._deliver(counts, self.store, done)
        return done

    def _take(self, asked: ExpectedSection, done: Exchanged) -> None:
        with closing(self.folder(asked.inbox, self.path, "expected.inbox")) as folder:
            inbox = Inbox(folder, asked, self.asked.name, self.path, self.utc_ns)
            done.files.extend(inbox.take(self.sleep))

    def _deliver(self, asked: CountsSection, store: GroundStore, done: Exchanged) -> None:
        with closing(self.folder(asked.outbox, self.path, "counts.outbox")) as folder:
            done.sent.extend(deliver_counts(folder, store, asked, self.asked.name, self.path))


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Nobody else exchanges by this file meanwhile.  UnavailableError where somebody does."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UnavailableError(
                "another process exchanges by this file", file=path, remedy="wait until it is done"
            ) from None
        yield


@contextmanager
def _kept(failures: list[FlightdError]) -> Iterator[None]:
    try:
        yield
    except FlightdError as err:
        failures.append(err)
