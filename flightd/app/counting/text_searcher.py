"""Printed values from the pictures of what was just counted, in a process of low priority."""

from __future__ import annotations

import asyncio
import signal
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any, Protocol, Self

from flightd.config.label_text import LabelTextConfig
from flightd.core.errors import TransientError, UnavailableError
from flightd.core.label_values import LabelValue
from flightd.runtime.child_process import Child
from flightd.runtime.clock import Hold
from flightd.runtime.disk_threads import on_disk
from flightd.runtime.niceness import give_way
from flightd.vision.shelf.text_search import BrokenPictureError, TextSearch, search_name

_MOST_WAITING = 200
"""Pictures of 50 KB at most."""
_NICE = 15
_LONGEST_S = 60.0
"""For one picture; a process that takes longer hangs, and ends."""
_MOST_DEATHS = 3
"""Of the process; then nothing more is searched in this flight."""


class TextStore(Protocol):
    """Where values of printed text are kept."""

    def keep_texts(self, observation: str, texts: Sequence[LabelValue], asked: str) -> None: ...


class TextSearcher:
    """A context manager around a flight: `put` never waits, `run` searches one picture after the other.

    Beyond 200 waiting pictures the oldest are left out.  What was left out, or is waiting when the flight
    ends, is `unsearched`, and told: `flightd inventory texts` does the rest.  `make` is for tests."""

    def __init__(
        self,
        store: TextStore,
        patterns: Sequence[LabelTextConfig],
        on_trouble: Callable[[str], None],
        hold: Hold = nullcontext,
        make: Callable[[], Callable[[bytes], Any]] | None = None,
    ) -> None:
        self._store = store
        self._asked = search_name(patterns)
        self._on_trouble = on_trouble
        self._hold = hold
        self._make = partial(_in_time, make or partial(_searching, tuple(patterns)), _LONGEST_S)
        self._waiting: deque[tuple[str, bytes]] = deque(maxlen=_MOST_WAITING)
        self._arrived = asyncio.Event()
        self._child: Child | None = None
        self._ready = asyncio.Event()
        self._deaths = self._in_work = 0
        self.searched = 0
        self.lost = 0
        self.dropped = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.join(1.0)
        if self.unsearched:
            text = f"inventory: {self.unsearched} pictures were not searched for printed text"
            self._on_trouble(f"{text}; flightd inventory texts does it")

    @property
    def unsearched(self) -> int:
        """Pictures whose text nobody has read."""
        return len(self._waiting) + self._in_work + self.dropped + self.lost

    def put(self, observation: str, jpeg: bytes) -> None:
        """Search the picture of a look (by its id) when there is time."""
        self.dropped += len(self._waiting) == _MOST_WAITING
        self._waiting.append((observation, jpeg))
        self._arrived.set()

    async def run(self) -> None:
        """Search until cancelled; nothing more where the process has died too often."""
        while True:
            while not self._waiting or self._deaths >= _MOST_DEATHS:
                self._arrived.clear()
                await self._arrived.wait()
            observation, jpeg = self._waiting.popleft()
            self._in_work = 1
            found = await self._found_in(jpeg)
            await self._keep(observation, found)
            self._in_work = 0

    async def _found_in(self, jpeg: bytes) -> tuple[LabelValue, ...] | None:
        """What the process finds; None where it died or hung over it, or the picture is broken."""
        child = await self._living_child()
        try:
            found: tuple[LabelValue, ...] | None = await child.ask(jpeg)
        except TransientError:
            self._child, self._deaths = None, self._deaths + 1
            if self._deaths == _MOST_DEATHS:
                self._on_trouble("inventory: printed text is read no more in this flight: its process dies")
            return None
        return found

    async def _keep(self, observation: str, found: tuple[LabelValue, ...] | None) -> None:
        if found is None:
            self.lost += 1
            return
        try:
            with self._hold():
                await on_disk(self._store.keep_texts, observation, found, self._asked)
        except (UnavailableError, TransientError):
            self.lost += 1  # the writer of the inventory tells of the disk
            return
        self.searched += 1

    async def _living_child(self) -> Child:
        if self._child is None:
            self._ready.clear()
            self._child = Child(self._make, lambda _: self._ready.set(), lambda _: self._ready.set())
            await self._ready.wait()
        return self._child


def _in_time(make: Callable[[], Callable[[bytes], Any]], longest_s: float) -> Callable[[bytes], Any]:
    """What the process does, which the system ends where that takes too long: also in code that heeds no
    signal handler, and whatever clock the flight goes by."""
    search = make()

    def searched(jpeg: bytes) -> Any:
        signal.setitimer(signal.ITIMER_REAL, longest_s)
        try:
            return search(jpeg)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    return searched


def _searching(patterns: Sequence[LabelTextConfig]) -> Callable[[bytes], tuple[LabelValue, ...] | None]:
    """What the process does: the values in a picture, None for one that is broken."""
    give_way(_NICE)
    search = TextSearch(patterns)

    def searched(jpeg: bytes) -> tuple[LabelValue, ...] | None:
        try:
            return search(jpeg)
        except BrokenPictureError:
            return None

    return searched
