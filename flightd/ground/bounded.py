"""Bounds on what may wait: whoever comes on top is refused at once, in words, and nothing piles up."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

from flightd.core.errors import FlightdError, UnavailableError

T = TypeVar("T")


class Room:
    """For so many at most."""

    def __init__(self, most: int, refusal: str) -> None:
        self._most = most
        self._refusal = refusal
        self._inside = 0

    @contextmanager
    def taken(self) -> Iterator[None]:
        """A place in it meanwhile.  UnavailableError where there is none."""
        if self._inside >= self._most:
            raise UnavailableError(self._refusal, remedy="try again in a moment")
        self._inside += 1
        try:
            yield
        finally:
            self._inside -= 1


class Threads:
    """Work beside the loop, few at a time; `most` may wait or be in work."""

    def __init__(self, at_once: int, most: int, refusal: str) -> None:
        self._turn = asyncio.Semaphore(at_once)
        self._room = Room(most, refusal)

    async def run(self, work: Callable[..., T], *arguments: Any) -> T:
        """The work's result.  UnavailableError where too much waits already."""
        with self._room.taken():
            async with self._turn:
                return await asyncio.to_thread(work, *arguments)


class Shared(Generic[T]):
    """One question at a time: whoever asks while it is on its way has its answer, or its error, too."""

    def __init__(self, ask: Callable[[], Awaitable[T]]) -> None:
        self._ask = ask
        self._turn = asyncio.Lock()
        self._answers = 0
        self._newest: tuple[T] | FlightdError | None = None

    async def answer(self) -> T:
        """What is answered next.  Raises as the question does."""
        before = self._answers
        async with self._turn:
            if self._newest is None or self._answers == before:
                try:
                    self._newest = (await self._ask(),)
                except FlightdError as err:
                    self._newest = err
                self._answers += 1
            newest = self._newest
        if isinstance(newest, FlightdError):
            raise newest
        return newest[0]
