"""A progress bar on stderr, only when a person watches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

T = TypeVar("T")
P = ParamSpec("P")

_STEPS = 10
"""So often at least it is drawn anew on its way, however short that is."""


def track(items: Sequence[T] | Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """The items, with a bar called `what` while stderr is a terminal."""
    if total is None and isinstance(items, Sized):
        total = len(items)
    with _bar(what, total) as advance:
        for item in items:
            yield item
            advance()


@contextmanager
def watched(call: Callable[P, T], what: str, total: int | None = None) -> Iterator[Callable[P, T]]:
    """The same function with a bar that moves on at every call; `total` calls, None if nobody knows."""
    with _bar(what, total) as advance:

        def counted(*args: P.args, **kwargs: P.kwargs) -> T:
            result = call(*args, **kwargs)
            advance()
            return result

        yield counted


@contextmanager
def _bar(what: str, total: int | None) -> Iterator[Callable[[], None]]:
    """A bar and what moves it on by one."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task(what, total=total)
        done = 0

        def advance() -> None:
            nonlocal done
            done += 1
            progress.advance(bar)
            if total and done * _STEPS // total > (done - 1) * _STEPS // total:
                progress.refresh()

        yield advance
