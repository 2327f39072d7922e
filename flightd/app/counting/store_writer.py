"""The mission's findings into the inventory: in order, in a thread of its own, through disk failures."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import Self

from flightd.core.errors import UnavailableError
from flightd.core.inventory import CountPose, LocationState, Observation
from flightd.core.scanning import Finding, Settled
from flightd.ports import Clock, Store
from flightd.runtime.clock import Hold

_MOST_WAITING = 20_000
_MOST_PICTURES = 400
_TELL_NS = 10_000_000_000
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.2, 5.0


def _is_empty(finding: Finding) -> bool:
    return finding.state is LocationState.EMPTY


def nobody(_observation: str, _jpeg: bytes) -> None:
    """Nobody wants to know."""


def utc_at_zero_ns(clock: Clock) -> int:
    """UTC at the clock's zero, by the date that the computer has now."""
    return time.time_ns() - clock.now_ns()


class StoreWriter:
    """A context manager around a flight: `put` and `settle` never wait, `run` writes, and leaving it
    writes what is left.

    Observations carry the name of the `run` and UTC, which is `utc_at_zero_ns` at the clock's zero.  While
    the disk refuses, everything waits and is tried again; beyond 400 waiting pictures further ones are
    left out (`pictures_dropped`), beyond 20,000 entries those too (`dropped`, told): they stand in the
    flight log.  Time is held by `hold` while the disk is written to.
    """

    def __init__(
        self,
        store: Store,
        run: str,
        utc_at_zero_ns: int,
        clock: Clock,
        on_trouble: Callable[[str], None],
        hold: Hold = nullcontext,
        on_written: Callable[[str, bytes], None] = nobody,
    ) -> None:
        """`on_written` is told id and picture of what is on the disk now, empty places aside."""
        self._store = store
        self._on_written = on_written
        self._run = run
        self._utc_at_zero_ns = utc_at_zero_ns
        self._clock = clock
        self._on_trouble = on_trouble
        self._hold = hold
        self._queue: deque[tuple[Finding, bytes] | Settled] = deque()
        self._arrived = asyncio.Event()
        self._pictures = 0
        self._told_ns: int | None = None
        self._thread = ThreadPoolExecutor(1, "store")
        self.written = 0
        self.dropped = 0
        self.pictures_dropped = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Write what is left, now; what the disk still refuses is told."""
        self._thread.shutdown()
        try:
            while self._queue:
                self._forget(self._write(self._queue[0]))
        except UnavailableError as err:
            self._on_trouble(f"{len(self._queue)} findings are not in the inventory: {err}")

    @property
    def waiting(self) -> int:
        """Entries that are not on the disk yet."""
        return len(self._queue)

    def put(self, finding: Finding, jpeg: bytes) -> None:
        """Write a pending finding with its picture (may be empty)."""
        if jpeg and self._pictures >= _MOST_PICTURES:
            self.pictures_dropped += 1
            jpeg = b""
        if self._add((finding, jpeg)):
            self._pictures += bool(jpeg)

    def take_off(self) -> None:
        """A flight begins: date what it finds by the computer's date as it is now, and never before what was
        found earlier: of two looks at a place the one with the newer date counts."""
        self._utc_at_zero_ns = max(self._utc_at_zero_ns, utc_at_zero_ns(self._clock))

    def settle(self, settled: Settled) -> None:
        """Confirm or withdraw what was put before."""
        self._add(settled)

    async def run(self, on_trouble: Callable[[str], None]) -> None:
        """Write until cancelled; a disk that refuses is told to `on_trouble`."""
        self._on_trouble = on_trouble
        loop, wait_s = asyncio.get_running_loop(), _FIRST_WAIT_S
        while True:
            while self._queue:
                try:
                    entry = self._queue[0]
                    with self._hold():
                        written = await loop.run_in_executor(self._thread, self._write, entry)
                except UnavailableError as err:
                    self._tell(f"inventory: {err}; {len(self._queue)} findings wait")
                    await asyncio.sleep(wait_s)
                    wait_s = min(2 * wait_s, _LONGEST_WAIT_S)
                    continue
                wait_s = _FIRST_WAIT_S
                self._forget(written)
            self._arrived.clear()
            await self._arrived.wait()

    def _add(self, entry: tuple[Finding, bytes] | Settled) -> bool:
        if len(self._queue) >= _MOST_WAITING:
            self.dropped += 1
            self._tell(f"inventory: {self.dropped} findings had no room to wait; the flight log holds them")
            return False
        self._queue.append(entry)
        self._arrived.set()
        return True

    def _forget(self, written: str) -> None:
        """The first entry is on the disk, as the observation `written` if it is one."""
        entry = self._queue.popleft()
        self.written += 1
        if isinstance(entry, tuple) and entry[1]:
            self._pictures -= 1
            if not _is_empty(entry[0]):
                self._on_written(written, entry[1])

    def _write(self, entry: tuple[Finding, bytes] | Settled) -> str:
        """The id of the observation that was written, if one was."""
        if isinstance(entry, Settled):
            if entry.booked:
                self._store.contradict(self._run, entry.locations)
            else:
                self._store.settle(self._run, entry.locations, entry.confirmed)
            return ""
        finding, jpeg = entry
        evidence = self._store.keep_evidence(jpeg) if jpeg else ""
        observation = self._observation(finding, evidence)
        self._store.commit(observation, confirmed=False)
        return observation.id

    def _observation(self, f: Finding, evidence: str) -> Observation:
        pose = CountPose(f.node, f.x_m, f.y_m, f.height_m, f.yaw_rad)
        utc_ns = self._utc_at_zero_ns + f.stamp_ns
        looked = self._run, f.location, utc_ns, f.state, f.confidence, f.reads, pose, evidence
        return Observation(*looked, fill=f.fill, again=f.again, undecided=f.undecided)

    def _tell(self, text: str) -> None:
        now_ns = self._clock.now_ns()
        if self._told_ns is None or now_ns - self._told_ns >= _TELL_NS:
            self._told_ns = now_ns
            self._on_trouble(text)
