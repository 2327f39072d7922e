"""Reads files in a process of its own: the station's loop never waits for one, and a file that is endless or
hostile costs that process, not the station."""

from __future__ import annotations

import asyncio
import contextlib
import resource
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar, cast

from flightd.core.errors import FlightdError, TransientError, UnavailableError
from flightd.ground.bounded import Room
from flightd.runtime.child_process import Child
from flightd.runtime.niceness import give_way
from flightd.runtime.within import Within

MOST_WAITING = 32
"""More requests than this are refused, unless less is said."""
_MOST_MEMORY_BYTES = 4 << 30
_NICE = 5
"""Whoever flies on this machine goes first; by more, it would not get to its code on a busy one in time."""
_START_S = 60.0
_SHOWN_CHARS = 120

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _Job:
    function: Callable[..., Any]
    args: tuple[Any, ...]
    named: dict[str, Any]


@dataclass(frozen=True, slots=True)
class _Failed:
    error: FlightdError


class NotStartedError(TransientError):
    """There was no process to read anything."""


class ReadingProcess:
    """One process, started when it is first needed and again after its death; one job at a time."""

    def __init__(
        self, most_waiting: int = MOST_WAITING, refusal: str = "too many flights are being read"
    ) -> None:
        self._turn = asyncio.Lock()
        self._room = Room(most_waiting, refusal)
        self._child: Child | None = None
        self._ready = asyncio.Event()

    async def run(self, function: Callable[P, T], within_s: float, *args: P.args, **named: P.kwargs) -> T:
        """What `function` (of a module, with picklable arguments) returns over there.

        FlightdErrors come through; UnavailableError when too much waits already, TransientError when the
        process dies over it or it takes longer than `within_s` (it is killed then)."""
        with self._room.taken():
            async with self._turn:
                answer = await self._answer(_Job(function, args, named), within_s)
        if isinstance(answer, _Failed):
            raise answer.error
        return cast("T", answer)

    def close(self) -> None:
        """End the process; it may be used again."""
        if self._child is not None:
            self._child.kill("the station ends")
        self._child = None

    async def _answer(self, job: _Job, within_s: float) -> object:
        try:
            async with Within(_START_S):
                child = await self._started()
        except TimeoutError:
            self.close()
            raise NotStartedError("the reading process does not start") from None
        except OSError as err:  # no more file descriptors, say
            self._child = None
            raise NotStartedError(f"the reading process does not start: {err.strerror or err}") from None
        try:
            async with Within(within_s):
                return await child.ask(job)
        except TimeoutError:
            self.close()
            raise TransientError(f"it takes longer than {within_s:.0f} s to read") from None
        except asyncio.CancelledError:
            self.close()  # its answer would be taken for that of the next job
            raise
        except TransientError as err:
            self._child = None
            raise TransientError(f"the reading process failed: {err.what}") from None

    async def _started(self) -> Child:
        if self._child is None or not self._child.alive:
            self._ready = ready = asyncio.Event()
            self._child = Child(_begin, lambda _: ready.set(), lambda _: ready.set())
        await self._ready.wait()
        return self._child


def _begin() -> Callable[[_Job], object]:
    """In the child: what answers its jobs."""
    give_way(_NICE)
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY_BYTES, _MOST_MEMORY_BYTES))
    return _done


def _done(job: _Job) -> object:
    try:
        return job.function(*job.args, **job.named)
    except FlightdError as err:
        return _Failed(err)
    except MemoryError:
        return _Failed(UnavailableError("it is too large to be read here"))
    except OSError as err:
        return _Failed(UnavailableError(f"cannot be read: {err.strerror or err}"))
    except Exception as err:  # noqa: BLE001 - the last line before the process: a file may be anything
        return _Failed(TransientError(f"cannot be read: {type(err).__name__}: {str(err)[:_SHOWN_CHARS]}"))
