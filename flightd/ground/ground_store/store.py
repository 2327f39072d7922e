"""The ground store itself: takes batches once, however often they come, and answers in pages."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from flightd.core.errors import InputError
from flightd.core.inventory import LocationState, Standing
from flightd.ground.drop import Drop
from flightd.ground.ground_store import events, outbox, pages, questions
from flightd.ground.ground_store.batch import Batch, Receipt, SentLook
from flightd.ground.ground_store.engine import Engine, Session, listed
from flightd.ground.ground_store.events import Event
from flightd.ground.ground_store.evidence import Evidence
from flightd.ground.ground_store.migrations import brought_up
from flightd.ground.ground_store.outbox import Outbox, OutgoingFile
from flightd.ground.ground_store.pages import MOST_ROWS, Mark
from flightd.ground.ground_store.parquet import export
from flightd.ground.ground_store.questions import Question
from flightd.ground.ground_store.reads_text import NOTHING_PRINTED
from flightd.ground.ground_store.take_batch import Taken, take_batch

MOST_AHEAD_NS = 1_800_000_000_000
"""So far ahead of the store's clock a look may be: clocks differ, and a simulated flight may be flown faster
than time goes by."""
_LOOKED_FOR_AT_ONCE = 16
"""Pictures."""


class GroundStore:
    """A store behind either engine, with its pictures.  Safe from any thread.

    UnavailableError where the database cannot be had, InputError for what is asked wrongly."""

    def __init__(self, engine: Engine, evidence: Evidence, utc_ns: Callable[[], int] = time.time_ns) -> None:
        """Made, or brought up to date.  InputError for one of a newer flightd."""
        self._engine = engine
        self._utc_ns = utc_ns
        self.evidence = evidence
        try:
            self.id = brought_up(engine)
        except BaseException:
            engine.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """What was taken stays."""
        self._engine.close()

    @property
    def shown(self) -> str:
        """Where it is, for people."""
        return self._engine.shown

    def take(self, batch: Batch) -> Receipt:
        """Keep a batch.  When this returns, all of it is on the store's disk; where it raises, perhaps so:
        the same batch again changes nothing.

        Looks of a time that has not come yet are left to their sender, unless they are withdrawn: newer than
        all that is counted later, they would stand for good."""
        batch.check()
        identity, utc_ns = batch.id, self._utc_ns()
        looks = tuple(look for look in batch.looks if not _is_ahead(look, utc_ns))
        ahead, is_noted = len(batch.looks) - len(looks), not batch.is_plan
        with self._engine.writing() as session:
            if is_noted and session.rows("SELECT 1 FROM delivery WHERE id = ?", identity):
                taken = Taken()
            else:
                planned_ns = 0 if batch.planned_ns > utc_ns + MOST_AHEAD_NS else batch.planned_ns
                kept = replace(batch, looks=looks, planned_ns=planned_ns)
                taken = take_batch(self._engine, session, kept, utc_ns)
                if is_noted and not ahead:
                    note = "INSERT INTO delivery VALUES (?, ?, ?, ?)"
                    session.run(note, identity, batch.source, utc_ns, len(looks))
        already = len(looks) - taken.new - taken.changed
        return Receipt(self.id, identity.hex(), taken.new, taken.changed, already, ahead)

    def standings(self, looks: Sequence[str]) -> dict[str, int]:
        """Of these looks by id, those that the store has, each with its standing there."""
        kept: dict[str, int] = {}
        with self._engine.reading() as session:
            for marks, part in listed([bytes.fromhex(look) for look in looks]):
                rows = session.rows(f"SELECT id, standing FROM observation WHERE id IN {marks}", *part)
                kept |= {identity.hex(): standing for identity, standing in rows}
        return kept

    def printed_texts(self, looks: Sequence[str]) -> dict[str, str]:
        """Of these looks by id, those of which something printed is kept, each as `printed_text` has it."""
        kept: dict[str, str] = {}
        with self._engine.reading() as session:
            for marks, part in listed([bytes.fromhex(look) for look in looks]):
                rows = session.rows(f"SELECT id, printed FROM observation WHERE id IN {marks}", *part)
                kept |= {identity.hex(): text for identity, text in rows if text != NOTHING_PRINTED}
        return kept

    def missing_pictures(self, names: Sequence[str]) -> set[str]:
        """Those that the store has not.  InputError for what names no picture."""
        with ThreadPoolExecutor(_LOOKED_FOR_AT_ONCE) as threads:  # a bucket is far away
            found = threads.map(self.evidence.has, names)
            return {name for name, is_there in zip(names, found, strict=True) if not is_there}

    def keep_picture(self, jpeg: bytes) -> str:
        """Keep a picture, through to the disk; its name."""
        return self.evidence.keep(jpeg)

    def waiting_events(self, hook: str, most: int) -> tuple[list[Event], int]:
        """As `events.waiting`, of a hook that is known from now on."""
        with self._engine.writing() as session:
            events.register(session, hook)
            return events.waiting(session, hook, most)

    def event_taken(self, hook: str, event: int) -> None:
        """As `events.taken`."""
        with self._engine.writing() as session:
            events.taken(session, hook, event)

    def next_file(self, site: str, box: Outbox) -> OutgoingFile | None:
        """As `outbox.next_file`, of a site that the store knows."""
        with self._engine.writing() as session:
            return outbox.next_file(session, pages.site_id(session, site), box)

    def file_lies_there(self, box: str, file: str) -> None:
        """As `outbox.file_lies_there`."""
        with self._engine.writing() as session:
            outbox.file_lies_there(session, box, file)

    def ask(self, site: str, who: str, asked: Sequence[Question], drop: Drop | None = None) -> list[str]:
        """As `questions.ask`, of a site that the store knows."""
        with self._engine.writing() as session:
            number = pages.site_id(session, site)
            return questions.ask(session, number, who, asked, self._utc_ns(), drop)

    def dropped(self, inbox: str) -> Drop | None:
        """As `questions.dropped`."""
        with self._engine.reading() as session:
            return questions.dropped(session, inbox)

    def moved(self, inbox: str) -> None:
        """As `questions.moved`."""
        with self._engine.writing() as session:
            questions.moved(session, inbox)

    def open_places(self, site: str) -> frozenset[str]:
        """As `questions.open_places`."""
        with self._engine.reading() as session:
            return questions.open_places(session, pages.site_id(session, site))

    def counts(self) -> dict[str, int]:
        """How much the store holds."""
        with self._engine.reading() as session:
            return {
                "sites": session.rows("SELECT count(*) FROM site")[0][0],
                "places": session.rows("SELECT count(*) FROM place")[0][0],
                "runs": session.rows("SELECT count(*) FROM run")[0][0],
                "looks": int(session.rows("SELECT coalesce(sum(looks), 0) FROM run")[0][0]),
                "flights": session.rows("SELECT count(*) FROM flight")[0][0],
                "decisions": session.rows("SELECT count(*) FROM decision")[0][0],
                "questions": session.rows("SELECT count(*) FROM question")[0][0],
                "audit": session.rows("SELECT count(*) FROM audit")[0][0],
            }

    def export(self, site: str, folder: Path) -> dict[str, int]:
        """As `parquet.export`."""
        return export(self._engine, site, folder)

    def sites(self) -> list[dict[str, Any]]:
        """As `pages.sites`."""
        with self._engine.reading() as session:
            return pages.sites(session)

    def stock(
        self, site: str, after: str = "", limit: int = MOST_ROWS, state: LocationState | None = None
    ) -> list[dict[str, Any]]:
        """As `pages.stock`."""
        with self._asked(site, limit) as (session, number):
            return pages.stock(session, number, after, limit, state)

    def history(
        self, site: str, code: str, after: Mark | None = None, limit: int = MOST_ROWS
    ) -> list[dict[str, Any]]:
        """As `pages.history`."""
        with self._asked(site, limit) as (session, number):
            return pages.history(session, pages.place_id(session, number, code), after, limit)

    def runs(self, site: str, after: str = "", limit: int = MOST_ROWS) -> list[dict[str, Any]]:
        """As `pages.runs`."""
        with self._asked(site, limit) as (session, number):
            return pages.runs(session, number, after, limit)

    def differences(
        self, site: str, run: str, after: str = "", limit: int = MOST_ROWS
    ) -> list[dict[str, Any]]:
        """As `pages.differences`."""
        with self._asked(site, limit) as (session, number):
            return pages.differences(session, pages.run_id(session, number, run), after, limit)

    def looks(
        self, site: str, run: str, after: Mark | None = None, limit: int = MOST_ROWS
    ) -> list[dict[str, Any]]:
        """As `pages.looks_of_run`."""
        with self._asked(site, limit) as (session, number):
            return pages.looks_of_run(session, pages.run_id(session, number, run), after, limit)

    def flights(self, site: str, after: Mark | None = None, limit: int = MOST_ROWS) -> list[dict[str, Any]]:
        """As `pages.flights`."""
        with self._asked(site, limit) as (session, number):
            return pages.flights(session, number, after, limit)

    def decisions(self, site: str, code: str, limit: int = MOST_ROWS) -> list[dict[str, Any]]:
        """As `pages.decisions`."""
        with self._asked(site, limit) as (session, number):
            return pages.decisions(session, number, code, limit)

    def questions(self, site: str, after: Mark | None = None, limit: int = MOST_ROWS) -> list[dict[str, Any]]:
        """As `pages.questions`."""
        with self._asked(site, limit) as (session, number):
            return pages.questions(session, number, after, limit)

    @contextmanager
    def _asked(self, site: str, limit: int) -> Iterator[tuple[Session, int]]:
        if not 1 <= limit <= MOST_ROWS:
            raise InputError(f"a page has 1 to {MOST_ROWS} rows", key=f"limit={limit}")
        with self._engine.reading() as session:
            yield session, pages.site_id(session, site)


def _is_ahead(look: SentLook, utc_ns: int) -> bool:
    return look.observation.utc_ns > utc_ns + MOST_AHEAD_NS and look.standing is not Standing.WITHDRAWN
