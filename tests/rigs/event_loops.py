"""How every asynchronous test runs: `virtual` in time that jumps, `real` by the machine's clock.

A test fails that leaves something behind: a task, an open transport, an exception which nobody heard of."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Coroutine
from typing import Any, ParamSpec, TypeVar

from flightd.runtime.event_loops import HOLD_PATIENCE_S, ScaledLoop, VirtualLoop

_P = ParamSpec("_P")
_T = TypeVar("_T")

_CLOSING_TURNS = 20
"""A closed transport leaves its loop a few turns later."""


def virtual(main: Coroutine[Any, Any, _T], patience_s: float = HOLD_PATIENCE_S) -> _T:
    """What `main` returns, run in virtual time."""
    return run_in(lambda: VirtualLoop(patience_s=patience_s), main)


def real(main: Coroutine[Any, Any, _T], speed: float = 1.0) -> _T:
    """What `main` returns, run `speed` times as fast as the machine's clock."""
    return run_in(lambda: ScaledLoop(speed), main)


def in_real_time(test: Callable[_P, Coroutine[Any, Any, None]]) -> Callable[_P, None]:
    """A test written as a coroutine function, as one that `real` runs."""

    @functools.wraps(test)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> None:
        real(test(*args, **kwargs))

    return run


def run_in(make_loop: Callable[[], asyncio.AbstractEventLoop], main: Coroutine[Any, Any, _T]) -> _T:
    """What `main` returns, run on a new loop; fails when it leaves anything behind on it."""
    unheard: list[str] = []

    async def watched() -> _T:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: unheard.append(_described(context)))
        before = _transports(loop)
        result = await main
        lingering = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        assert not lingering, f"tasks left behind: {lingering}"
        for _ in range(_CLOSING_TURNS):
            if not (still_open := _transports(loop).items() - before.items()):
                break
            await asyncio.sleep(0)
        assert not still_open, f"transports left open: {sorted(what for _, what in still_open)}"
        return result

    with asyncio.Runner(loop_factory=make_loop) as runner:
        result = runner.run(watched())
    assert not unheard, f"exceptions nobody heard of: {unheard}"
    return result


def _described(context: dict[str, Any]) -> str:
    return f"{context['message']}: {context.get('exception')!r}"


def _transports(loop: asyncio.AbstractEventLoop) -> dict[int, str]:
    """What the loop watches: file descriptor -> whose it is."""
    selector = loop._selector  # type: ignore[attr-defined]  # noqa: SLF001 - asyncio tells nobody what it watches
    return {fd: repr(key.data) for fd, key in selector.get_map().items()}
