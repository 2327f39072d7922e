"""The logs on a Ray cluster: one that is there, whose nodes are looked at first, or one started here."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from typing import Any, Final

from flightd.app.log_study.engines import DIED, MOST_DEATHS, WAITING, Work, study_source
from flightd.app.log_study.finding import LogFindings, Study, all_failed, first_line, told_in_line
from flightd.app.log_study.ray_cluster import LOOKS_S, Head, check_nodes
from flightd.app.log_study.sources import LogSource
from flightd.core.errors import UnavailableError

_DEATHS: Final = frozenset({"WorkerCrashedError", "NodeDiedError", "LocalRayletDiedError"})
_CLIENT: Final = "ray://"
_MOST_SHOWN: Final = 300
"""Of what Ray says."""


def run_ray(
    sources: Sequence[LogSource],
    studies: tuple[Study, ...],
    workers: int | None,
    work: Work = study_source,
    *,
    address: str = "",
) -> Generator[tuple[int, LogFindings], None, None]:
    """As `run_local`, on the Ray cluster at `address` (or that of RAY_ADDRESS), or on one that is started
    here for it; without `workers` on all cores that there are.  UnavailableError where there is no Ray, no
    cluster answers or it is gone, or where one of its nodes has another flightd or none; InputError for a
    path that one of them does not have."""
    ray = _ray()
    cluster = address or os.environ.get("RAY_ADDRESS", "")
    key = f"--address {address}" if address else f"RAY_ADDRESS={cluster}" if cluster else "--engine ray"
    started_here = not ray.is_initialized()
    if started_here:
        _begin(ray, cluster, key, min(workers or os.cpu_count() or 1, len(sources)))
    try:
        if cluster:
            check_nodes(ray, sources, key)
        task = ray.remote(work).options(num_cpus=1, max_retries=MOST_DEATHS - 1)
        head = Head("" if cluster.startswith(_CLIENT) else ray.get_runtime_context().gcs_address)
        yield from _remote(ray, task, head, sources, studies, workers if cluster else None)
    except (ray.exceptions.RayError, ConnectionError) as err:
        raise UnavailableError(f"the Ray cluster is gone: {_line(err)}", key=key) from None
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
            remedy="pip install -e '.[ray]' in the checkout, or take --engine local",
        ) from None
    return ray


def _begin(ray: Any, cluster: str, key: str, workers: int) -> None:
    own = {} if cluster else {"num_cpus": workers, "include_dashboard": False}
    try:
        ray.init(cluster or "local", log_to_driver=False, logging_level="ERROR", **own)
    except (ray.exceptions.RayError, OSError, RuntimeError, ValueError) as err:
        what = "no Ray cluster answers" if cluster else "no Ray can be started here"
        why = " ".join(str(err).split())  # such as the versions on both sides, a line each
        raise UnavailableError(f"{what}: {why[:_MOST_SHOWN] or type(err).__name__}", key=key) from None


def _remote(
    ray: Any,
    task: Any,
    head: Head,
    sources: Sequence[LogSource],
    studies: tuple[Study, ...],
    most: int | None,
) -> Iterator[tuple[int, LogFindings]]:
    """Few are handed out ahead: a cluster that grows takes what is left.  `most`: so many at a time at most,
    whatever cores there are."""
    waiting = deque(range(len(sources)))
    handed: dict[Any, int] = {}
    ahead = most or WAITING
    while waiting or handed:
        if head.is_there() and most is None:  # what asks it otherwise does not return
            ahead = max(1, int(ray.cluster_resources().get("CPU", 1))) * WAITING
        while waiting and len(handed) < ahead:
            number = waiting.popleft()
            handed[task.remote(sources[number], studies)] = number
        ready, _ = ray.wait(list(handed), num_returns=1, timeout=LOOKS_S)
        for reference in ready:
            number = handed.pop(reference)
            try:
                yield number, _found(ray, reference, sources[number], studies)
            except ray.exceptions.RayError as err:
                if head.was_away():
                    waiting.appendleft(number)
                else:
                    text = DIED if type(err).__name__ in _DEATHS else told_in_line(err)
                    yield number, all_failed(sources[number].name, studies, text)


def _found(ray: Any, reference: Any, source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """RayError where not the work failed, but what does it."""
    try:
        found: LogFindings = ray.get(reference)
    except ray.exceptions.RayTaskError as err:
        return all_failed(source.name, studies, told_in_line(err.cause))
    return found


def _line(err: Exception) -> str:
    return first_line(err) or type(err).__name__
