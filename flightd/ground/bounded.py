"""Bounds on what may wait: whoever comes on top is refused at once, in words, and nothing piles up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from flightd.core.errors import UnavailableError

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
