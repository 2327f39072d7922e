"""Who works the logs off: all cores of this computer (`ray_engine` has a Ray cluster).  Either gives the same
findings, and a worker that dies costs time alone."""

from __future__ import annotations

import multiprocessing
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Final, TypeAlias

from flightd.app.log_study.finding import LogFindings, Study, all_failed, told_in_line
from flightd.app.log_study.sources import LogSource
from flightd.runtime.undisturbed_start import undisturbed

Work: TypeAlias = Callable[[LogSource, tuple[Study, ...]], LogFindings]
"""One log, in another process: both have to be picklable."""

MOST_DEATHS: Final = 3
"""A log whose workers die so often is what kills them."""
DIED: Final = f"its worker died {MOST_DEATHS} times"
WAITING: Final = 2
"""Logs for each worker that are handed out ahead."""


def study_source(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """Fetch one log and study it.  Raises nothing: what goes wrong is what is found."""
    try:
        from flightd.app.log_study.studies import study_log

        with source.fetched(studies) as path:
            return study_log(path, source.name, studies, source.inventory)
    except Exception as err:  # noqa: BLE001 - its end would be that of all the others
        return all_failed(source.name, studies, told_in_line(err))


def run_local(
    sources: Sequence[LogSource], studies: tuple[Study, ...], workers: int, work: Work = study_source
) -> Generator[tuple[int, LogFindings], None, None]:
    """Findings with the place of their log in `sources`, as they come.  Where a worker died, the logs in hand
    are taken up again, each by itself, so that the one that kills its worker is found."""
    deaths: Counter[int] = Counter()
    left = list(range(len(sources)))
    while left:
        alone = [number for number in left if deaths[number]]
        batch, width = (alone[:1], 1) if alone else (left, workers)
        done: set[int] = set()
        for number, found in _pooled(sources, studies, batch, width, work):
            if found is None:
                deaths[number] += 1
                if deaths[number] < MOST_DEATHS:
                    continue
            done.add(number)
            yield number, found or all_failed(sources[number].name, studies, DIED)
        left = [number for number in left if number not in done]


def _pooled(
    sources: Sequence[LogSource], studies: tuple[Study, ...], numbers: Sequence[int], workers: int, work: Work
) -> Iterator[tuple[int, LogFindings | None]]:
    """Findings of one pool; None for the logs in hand when a worker died, with which it ends.  Whoever stops
    asking ends its processes, whatever they do."""
    waiting = iter(numbers)
    handed: dict[Future[LogFindings], int] = {}
    others = {*multiprocessing.active_children()}
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            while True:
                while len(handed) < workers * WAITING and (number := next(waiting, None)) is not None:
                    with undisturbed():  # Ctrl-C is for this process, which ends them
                        handed[pool.submit(work, sources[number], studies)] = number
                if not handed:
                    return
                ready, _ = wait(handed, return_when=FIRST_COMPLETED)
                for future in ready:
                    found = _found(future, sources[handed[future]], studies)
                    yield handed.pop(future), found
        except BrokenProcessPool:
            yield from ((number, None) for number in sorted(handed.values()))
        except BaseException:
            for child in {*multiprocessing.active_children()} - others:
                child.terminate()
            raise


def _found(future: Future[LogFindings], source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """BrokenProcessPool where a worker died."""
    try:
        return future.result()
    except BrokenProcessPool:
        raise
    except Exception as err:  # noqa: BLE001 - such as findings that cannot be sent
        return all_failed(source.name, studies, told_in_line(err))
