"""One slot, newest wins, drops counted: how sensor data passes between tasks."""

from __future__ import annotations

import asyncio
from typing import Generic, TypeVar

T = TypeVar("T")


class Latest(Generic[T]):
    """Holds the newest value; a value that is replaced before it was taken counts as dropped."""

    def __init__(self) -> None:
        self._value: T | None = None
        self._ready = asyncio.Event()
        self.dropped = 0

    def put(self, value: T) -> None:
        if self._value is not None:
            self.dropped += 1
        self._value = value
        self._ready.set()

    async def get(self) -> T:
        """Wait for a value and take it."""
        while self._value is None:
            self._ready.clear()
            await self._ready.wait()
        value, self._value = self._value, None
        return value
