"""A progress bar on stderr, only when a person watches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

T = TypeVar("T")
P = ParamSpec("P")


def track(items: Sequence[T] | Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """The items, with a bar called `what` while stderr is a terminal."""
    from rich.console import Console
    from rich.progress import track as rich_track

    console = Console(stderr=True)
    return iter(
        rich_track(items, what, total=total, console=console, disable=not console.is_terminal, transient=True)
    )


@contextmanager
def watched(call: Callable[P, T], what: str, total: int | None = None) -> Iterator[Callable[P, T]]:
    """The same function with a bar that moves on at every call; `total` calls, None if nobody knows."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task(what, total=total)

        def counted(*args: P.args, **kwargs: P.kwargs) -> T:
            result = call(*args, **kwargs)
            progress.advance(bar)
            return result

        yield counted
