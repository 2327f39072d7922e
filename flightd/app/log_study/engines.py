"""Who works the logs off: all cores of this computer, or a Ray cluster.  Either gives the same findings, and
a worker that dies costs time alone."""

from __future__ import annotations

import multiprocessing
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Final, TypeAlias

from flightd.app.log_study.finding import Finding, LogFindings, Outcome, Study
from flightd.app.log_study.sources import LogSource
from flightd.core.errors import FlightdError, UnavailableError

Work: TypeAlias = Callable[[LogSource, tuple[Study, ...]], LogFindings]
"""One log, in another process: both have to be picklable."""

_MOST_DEATHS: Final = 3
"""A log whose workers die so often is what kills them."""
_DIED: Final = f"its worker died {_MOST_DEATHS} times"
_WAITING: Final = 2
"""Logs for each worker that are handed out ahead."""


def study_source(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """Fetch one log and study it."""
    from flightd.app.log_study.studies import study_log

    try:
        with source.fetched() as path:
            return study_log(path, source.name, studies)
    except FlightdError as err:
        return _failed(source, studies, str(err))


def run_local(
    sources: Sequence[LogSource], studies: tuple[Study, ...], workers: int, work: Work = study_source
) -> Iterator[tuple[int, LogFindings]]:
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
                if deaths[number] < _MOST_DEATHS:
                    continue
            done.add(number)
            yield number, found or _failed(sources[number], studies, _DIED)
        left = [number for number in left if number not in done]


def _pooled(
    sources: Sequence[LogSource], studies: tuple[Study, ...], numbers: Sequence[int], workers: int, work: Work
) -> Iterator[tuple[int, LogFindings | None]]:
    """Findings of one pool; None for the logs in hand when a worker died, with which it ends."""
    waiting = iter(numbers)
    handed: dict[Future[LogFindings], int] = {}
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        while True:
            while len(handed) < workers * _WAITING and (number := next(waiting, None)) is not None:
                handed[pool.submit(work, sources[number], studies)] = number
            if not handed:
                return
            ready, _ = wait(handed, return_when=FIRST_COMPLETED)
            for future in ready:
                try:
                    found: LogFindings | None = future.result()
                except BrokenProcessPool:
                    found = None
                if found is None:
                    yield from ((number, None) for number in sorted(handed.values()))
                    return
                yield handed.pop(future), found


def run_ray(
    sources: Sequence[LogSource],
    studies: tuple[Study, ...],
    workers: int,
    work: Work = study_source,
    *,
    address: str = "",
) -> Iterator[tuple[int, LogFindings]]:
    """The same on the Ray cluster at `address` (or that of RAY_ADDRESS), or on one that is started here for
    it.  UnavailableError where there is no Ray, or no cluster answers."""
    ray = _ray()
    cluster = address or os.environ.get("RAY_ADDRESS", "")
    started_here = not ray.is_initialized()
    if started_here:
        _begin(ray, cluster, workers)
    try:
        task = ray.remote(work).options(num_cpus=1, max_retries=_MOST_DEATHS - 1)
        yield from _remote(ray, task, sources, studies, workers)
    finally:
        if started_here:
            ray.shutdown()


def _ray() -> Any:
    # nothing is told to anybody outside, and no second process reports on this one
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray
    except ImportError:
        raise UnavailableError(
            "Ray is not installed",
            key="--engine ray",
            remedy="pip install 'flightd[ray]', or take --engine local",
        ) from None
    return ray


def _begin(ray: Any, cluster: str, workers: int) -> None:
    own = {} if cluster else {"num_cpus": workers, "include_dashboard": False}
    try:
        ray.init(cluster or "local", log_to_driver=False, logging_level="ERROR", **own)
    except (ConnectionError, RuntimeError, ValueError) as err:
        first = str(err).strip().splitlines()[0] if str(err).strip() else type(err).__name__
        raise UnavailableError(
            f"no Ray cluster answers: {first}", key=f"--address {cluster}".strip()
        ) from None


def _remote(
    ray: Any, task: Any, sources: Sequence[LogSource], studies: tuple[Study, ...], workers: int
) -> Iterator[tuple[int, LogFindings]]:
    """Few are handed out ahead: a cluster that grows takes what is left."""
    waiting = iter(range(len(sources)))
    handed: dict[Any, int] = {}
    while True:
        ahead = max(workers, int(ray.cluster_resources().get("CPU", 1))) * _WAITING
        while len(handed) < ahead and (number := next(waiting, None)) is not None:
            handed[task.remote(sources[number], studies)] = number
        if not handed:
            return
        ready, _ = ray.wait(list(handed), num_returns=1)
        for reference in ready:
            number = handed.pop(reference)
            try:
                found = ray.get(reference)
            except ray.exceptions.RayError:
                found = _failed(sources[number], studies, _DIED)
            yield number, found


def _failed(source: LogSource, studies: tuple[Study, ...], text: str) -> LogFindings:
    return LogFindings(source.name, {study: Finding(Outcome.FAILED, text) for study in studies})
