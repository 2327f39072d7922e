"""A bound on how long a task may wait, in its clean-up, too."""

from __future__ import annotations

import asyncio
from types import TracebackType


class Within:
    """`async with Within(seconds):` as `asyncio.timeout`: TimeoutError where the body takes longer; with no
    time left (0, or less) at its first wait.

    Also in a task that was cancelled before and is cleaning up: before Python 3.11.3, which Debian 12 and
    Raspberry Pi OS do not have, `asyncio.timeout` ends such a task by CancelledError instead, and what came
    after it was left out."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._expired = False

    async def __aenter__(self) -> None:
        task = asyncio.current_task()
        if task is None:
            raise RuntimeError("there is no task to end")
        self._task, self._cancelled_before = task, task.cancelling()
        loop = asyncio.get_running_loop()
        # where no time is left, before what is ready at once: a timer would come after it
        self._expiry = (
            loop.call_later(self._seconds, self._expire)
            if self._seconds > 0.0
            else loop.call_soon(self._expire)
        )

    def _expire(self) -> None:
        self._expired = True
        self._task.cancel()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        _: TracebackType | None,
    ) -> None:
        self._expiry.cancel()
        if (
            self._expired
            and self._task.uncancel() <= self._cancelled_before
            and kind is asyncio.CancelledError
        ):
            raise TimeoutError from error
