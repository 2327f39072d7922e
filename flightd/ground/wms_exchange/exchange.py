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
from flightd.ground.wms_exchange.exchange_file import CountsSection, ExchangeFile, InboxSection
from flightd.ground.wms_exchange.inbox import Inbox, TakenFile, Taker
from flightd.ground.wms_exchange.outbox import deliver_counts
from flightd.ground.wms_exchange.question_taker import QuestionTaker
from flightd.ground.wms_exchange.stock_taker import StockTaker


@dataclass(slots=True)
class Exchanged:
    """What a pass did, and what kept it from more: each part goes on without the others."""

    files: list[TakenFile] = field(default_factory=list)
    sent: list[str] = field(default_factory=list)
    failures: list[FlightdError] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Exchange:
    """By the file at `path`, with the `store` for questions and counts; `folder` opens one by address, file
    and key."""

    path: Path
    asked: ExchangeFile
    store: GroundStore | None
    folder: Callable[[str, Path, str], SharedFolder] = SharedFolder
    sleep: Callable[[float], None] = time.sleep
    utc_ns: Callable[[], int] = time.time_ns

    def once(self) -> Exchanged:
        """One pass.  InputError where questions or counts are exchanged without a store."""
        expected, questions, counts = self.asked.expected, self.asked.questions, self.asked.counts
        self._check_store()
        done = Exchanged()
        if expected is not None:
            with _kept(done.failures):
                taker = StockTaker(expected, self.asked.name, self.path, self.utc_ns)
                self._take(expected, "expected", taker, done)
        if questions is not None and self.store is not None:
            with _kept(done.failures):
                asker = QuestionTaker(self.store, questions, self.asked.name, self.path)
                self._take(questions, "questions", asker, done)
        if counts is not None and self.store is not None:
            with _kept(done.failures):
                self._deliver(counts, self.store, done)
        return done

    def _check_store(self) -> None:
        for key, asked, what in (
            ("questions", self.asked.questions, "questions are kept in a store"),
            ("counts", self.asked.counts, "counts come out of a store"),
        ):
            if asked is not None and self.store is None:
                raise InputError(what, file=self.path, key=key, remedy="give --store")

    def _take(self, asked: InboxSection, key: str, taker: Taker, done: Exchanged) -> None:
        with closing(self.folder(asked.inbox, self.path, f"{key}.inbox")) as folder:
            done.files.extend(Inbox(folder, asked, taker).take(self.sleep))

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
