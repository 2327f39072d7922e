"""The station feeds its store: what comes to lie in its folders, and what its people decide and do."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import platform
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.core.errors import FlightdError, InputError
from flightd.ground.access.audit import audit_files
from flightd.ground.access.people_book import PeopleBook
from flightd.ground.decision_book import FILE as DECISIONS
from flightd.ground.decision_book import DecisionBook
from flightd.ground.flights.log_folder import CUT, find_logs
from flightd.ground.ground_store.batch import MOST_LOOKS, Batch, SentLine, SentPerson
from flightd.ground.ground_store.sender import (
    Delivered,
    deliver_decisions,
    deliver_flights,
    deliver_inventory,
    stored_ns,
)
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.read_folders import ReadFolder
from flightd.ground.stores import Stores

_LOG = logging.getLogger(__name__)
_EACH_S = 10.0
_PUT_OFF_S = 600.0
"""Until what is wrong in itself is tried again, unchanged: a clock may have been set, and an inventory is
copied for it."""


@dataclass(frozen=True, slots=True)
class _Part:
    """Something that is delivered again whenever its `stamp` is another, or `deliver` said that it was not
    all yet."""

    name: str
    stamp: object
    deliver: Callable[[], bool]


@dataclass(frozen=True, slots=True)
class _PutOff:
    """What is left alone `until_s`, unless its stamp is another; without one it is however it changes."""

    stamp: object
    until_s: float
    why: str


class Feeder:
    """Delivers to `store` what lies under `folder` and the `others`, and of the station's `state` people and
    audit.  What cannot be delivered is said once, and tried again and again."""

    def __init__(
        self,
        store: GroundStore,
        folder: Path | None,
        others: Sequence[ReadFolder],
        state: Path,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._store = store
        self._folder = folder
        self._stores = Stores(folder, others, all_of_them=True)
        self._others = others
        self._state = state
        self._source = platform.node()
        self._done: dict[str, object] = {}
        self._now_s = now_s
        self._put_off: dict[str, _PutOff] = {}
        self._failures: dict[str, str] = {}
        self._read: dict[bytes, int] = {}
        """How much was delivered of each file of the audit since the station began, by the SHA-256 of its
        first line: an inode goes with a file that is put aside, and to another later.  Again is harmless."""
        self._turn = threading.Lock()
        self._ending = False

    async def run(self) -> None:
        """Until cancelled."""
        try:
            while True:
                await asyncio.to_thread(self.feed)
                await asyncio.sleep(_EACH_S)
        finally:
            self._ending = True

    def feed(self) -> None:
        """Deliver what has changed."""
        with self._turn:
            for kind in (self._inventories, self._flights, self._people, self._audit):
                with self._failure_told(kind.__name__.strip("_")):
                    for part in kind():
                        if self._is_due(part):
                            with self._failure_told(part.name):
                                self._deliver(part)

    def _is_due(self, part: _Part) -> bool:
        if self._ending or self._done.get(part.name) == part.stamp:
            return False
        return not self._why_put_off(part.name, part.stamp)

    def _why_put_off(self, what: str, stamp: object) -> str:
        """Empty for what is not."""
        known = self._put_off.get(what)
        if known is None or self._now_s() >= known.until_s:
            return ""
        return known.why if known.stamp is None or known.stamp == stamp else ""

    def _leave(self, what: str, stamp: object, err: Exception) -> None:
        """For a while; the stamp is that of what is wrong."""
        if isinstance(err, InventoryUnavailableError):
            stamp = None  # each try may be a copy, and a flight changes it all the time
        self._put_off[what] = _PutOff(stamp, self._now_s() + _PUT_OFF_S, str(err))

    def _deliver(self, part: _Part) -> None:
        try:
            if part.deliver():
                self._done[part.name] = part.stamp
        except (InputError, InventoryUnavailableError) as err:
            self._leave(part.name, part.stamp, err)
            raise

    @contextmanager
    def _failure_told(self, what: str) -> Iterator[None]:
        """In the log, once for each that is another."""
        try:
            yield
        except Exception as err:  # noqa: BLE001 - its end would be the station's
            why = str(err) if isinstance(err, FlightdError | OSError) else f"failed: {err!r}"
            if self._failures.get(what) != why:
                _LOG.warning("%s: not in the ground store: %s", what, why)
            self._failures[what] = why
        else:
            self._failures.pop(what, None)

    def _inventories(self) -> Iterator[_Part]:
        decided = None if self._folder is None else _changed(self._folder / DECISIONS)
        for name, written_ns in reversed(self._stores.names()):  # what follows on is soonest taken
            site, trouble = self._site(name, written_ns)
            deliver = partial(self._deliver_inventory, name, site, trouble)
            yield _Part(f"inventory {name}", (written_ns, site, trouble), deliver)
            if site and decided is not None:
                deliver = partial(self._deliver_decisions, name, site)
                yield _Part(f"decisions about {name}", (decided, site), deliver)

    def _deliver_inventory(self, name: str, site: str, trouble: str) -> bool:
        if trouble:
            raise InputError(trouble)
        done = Delivered()
        deliver_inventory(self._stores.folder(name), site, self._source, self._store, done)
        if done.failures:
            more = f" (and {len(done.failures) - 1} more)" if len(done.failures) > 1 else ""
            raise InputError(f"{done.failures[0]}{more}")
        done.check_clocks()
        return True

    def _site(self, name: str, written_ns: int) -> tuple[str, str]:
        """Of which site an inventory is, and why that cannot be told."""
        what = f"site of {name}"
        if trouble := self._why_put_off(what, written_ns):
            return "", trouble
        try:
            return self._stores.site_name(name), ""
        except (FlightdError, OSError) as err:
            self._leave(what, written_ns, err)
            return "", str(err)

    def _deliver_decisions(self, name: str, site: str) -> bool:
        if self._folder is not None:
            decisions = DecisionBook(self._folder).decisions(name)
            deliver_decisions(decisions, site, self._source, self._store, Delivered())
        return True

    def _flights(self) -> Iterator[_Part]:
        if self._folder is not None:
            found = find_logs(self._folder, self._others)
            for log in found.logs:
                deliver = partial(deliver_flights, [log], "", self._source, self._store, Delivered())
                yield _Part(f"flight {log.shown_path}", log.stamp, deliver)
            if found.cut:
                raise InputError(CUT, remedy="flightd store deliver PATH… delivers the others")

    def _people(self) -> Iterator[_Part]:
        people = PeopleBook(self._state).people()

        def deliver() -> bool:
            sent = tuple(SentPerson(person.name, person.role.value, time.time_ns()) for person in people)
            self._store.take(Batch("", self._source, people=sent))
            return True

        yield _Part("people", tuple((person.name, person.role) for person in people), deliver)

    def _audit(self) -> Iterator[_Part]:
        for file in audit_files(self._state):
            try:
                stamp = file.stat()
            except FileNotFoundError:
                continue
            mark = stamp.st_ino, stamp.st_size, stamp.st_mtime_ns
            yield _Part(f"audit {file.name}", mark, partial(self._deliver_audit, file))

    def _deliver_audit(self, file: Path) -> bool:
        """What was added since it was delivered last, in whole lines."""
        with file.open("rb") as lines:
            first = hashlib.sha256(lines.readline()).digest()
            lines.seek(self._read.get(first, 0))
            while part := list(islice(lines, MOST_LOOKS)):
                whole = [line for line in part if line.endswith(b"\n")]
                sent = [_sent_line(line.decode(errors="replace").rstrip("\n")) for line in whole]
                self._store.take(Batch("", self._source, audit=tuple(sent)))
                self._read[first] = self._read.get(first, 0) + sum(map(len, whole))
        return True


def _changed(file: Path) -> tuple[int, int] | None:
    """What is another whenever the file is; None where there is none."""
    try:
        stamp = file.stat()
    except OSError:
        return None
    return stamp.st_size, stamp.st_mtime_ns


def _sent_line(line: str) -> SentLine:
    try:
        entry = msgspec.json.decode(line, type=dict[str, Any])
    except msgspec.DecodeError:
        entry = {}  # a power cut in the middle of it

    def field(name: str) -> str:
        return str(entry.get(name, "")).replace("\0", "\N{REPLACEMENT CHARACTER}")

    try:
        utc_ns = stored_ns(datetime.fromisoformat(field("time")).timestamp())
    except (ValueError, OverflowError):
        utc_ns = 0
    return SentLine(
        utc_ns, field("person"), field("act"), field("target"), field("outcome"), line.replace("\0", "")
    )
