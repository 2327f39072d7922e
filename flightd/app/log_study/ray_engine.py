"""The logs on a Ray cluster: one that is there, whose nodes are looked at first, or one started here."""

from __future__ import annotations

import os
import socket
import time
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from typing import Any, Final

from flightd import __version__
from flightd.app.log_study.engines import DIED, MOST_DEATHS, WAITING, Work, study_source
from flightd.app.log_study.finding import LogFindings, Study, all_failed, first_line, told_in_line
from flightd.app.log_study.sources import LogSource
from flightd.core.errors import InputError, UnavailableError

_DEATHS: Final = frozenset({"WorkerCrashedError", "NodeDiedError", "LocalRayletDiedError"})
_CLIENT: Final = "ray://"
_ANSWERS_S: Final = 300.0
"""A node that has not started a worker by then is none that works."""
_LOOKS_S: Final = 5.0
_GONE_S: Final = 30.0
"""A head that cannot be reached for so long is gone: after 60 s Ray ends the whole process over it."""


def run_ray(
    sources: Sequence[LogSource],
    studies: tuple[Study, ...],
    workers: int,
    work: Work = study_source,
    *,
    address: str = "",
) -> Generator[tuple[int, LogFindings], None, None]:
    """As `run_local`, on the Ray cluster at `address` (or that of RAY_ADDRESS), or on one that is started
    here for it.  UnavailableError where there is no Ray, no cluster answers or it is gone, or where one of
    its nodes has another flightd or none; InputError for a log that one of them does not have."""
    ray = _ray()
    cluster = address or os.environ.get("RAY_ADDRESS", "")
    key = f"--address {address}" if address else f"RAY_ADDRESS={cluster}" if cluster else "--engine ray"
    started_here = not ray.is_initialized()
    if started_here:
        _begin(ray, cluster, key, workers)
    try:
        if cluster:
            _check_nodes(ray, sources, key)
        task = ray.remote(work).options(num_cpus=1, max_retries=MOST_DEATHS - 1)
        head = _Head("" if cluster.startswith(_CLIENT) else ray.get_runtime_context().gcs_address)
        yield from _remote(ray, task, head, sources, studies, workers)
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
            remedy="pip install 'flightd[ray]', or take --engine local",
        ) from None
    return ray


def _begin(ray: Any, cluster: str, key: str, workers: int) -> None:
    own = {} if cluster else {"num_cpus": workers, "include_dashboard": False}
    try:
        ray.init(cluster or "local", log_to_driver=False, logging_level="ERROR", **own)
    except (ConnectionError, RuntimeError, ValueError) as err:
        raise UnavailableError(f"no Ray cluster answers: {_line(err)}", key=key) from None


def _check_nodes(ray: Any, sources: Sequence[LogSource], key: str) -> None:
    """Each node that works is to have this flightd, or another release would judge, and the logs that are no
    URLs."""

    def looked(places: Sequence[str]) -> tuple[str, str]:
        # sent as it is, not by its name: a node may have no flightd
        import importlib
        import os

        try:
            version = str(importlib.import_module("flightd").__version__)
        except ImportError:
            version = ""
        return version, next((place for place in places if not os.path.exists(place)), "")  # noqa: PTH110

    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    here = [source.place for source in sources if source.is_local]
    nodes = [node for node in ray.nodes() if node["Alive"] and node["Resources"].get("CPU")]
    look = ray.remote(looked)
    asked = {
        look.options(
            num_cpus=0, scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        ).remote(here): str(node["NodeManagerAddress"])
        for node in nodes
    }
    for answer, node in asked.items():
        try:
            version, missing = ray.get(answer, timeout=_ANSWERS_S)
        except ray.exceptions.GetTimeoutError:
            raise UnavailableError(f"node {node} does not answer in {_ANSWERS_S:.0f} s", key=key) from None
        if version != __version__:
            has = f"flightd {version}" if version else "no flightd"
            remedy = f"install flightd {__version__} there, where `ray start` runs"
            raise UnavailableError(f"node {node} has {has}", key=key, remedy=remedy)
        if missing:
            remedy = "give a URL, or a folder that each node has at the same place"
            raise InputError(f"is not on node {node} of the Ray cluster", file=missing, remedy=remedy)


class _Head:
    """The head of a cluster at HOST:PORT; empty: Ray's client tells by itself when it is gone."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._seen_s = time.monotonic()

    def is_there(self) -> bool:
        """Whether it can be reached now.  ConnectionError where it could not for long."""
        if not self._address:
            return True
        host, _, port = self._address.rpartition(":")
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=_LOOKS_S).close()
        except OSError as err:
            if time.monotonic() - self._seen_s > _GONE_S:
                raise ConnectionError(f"{self._address}: {err.strerror or err}") from None
            return False
        self._seen_s = time.monotonic()
        return True

    def was_away(self) -> bool:
        """False where it is there; else once it is there again.  ConnectionError where it does not come."""
        if self.is_there():
            return False
        while not self.is_there():
            time.sleep(1.0)
        return True


def _remote(
    ray: Any,
    task: Any,
    head: _Head,
    sources: Sequence[LogSource],
    studies: tuple[Study, ...],
    workers: int,
) -> Iterator[tuple[int, LogFindings]]:
    """Few are handed out ahead: a cluster that grows takes what is left."""
    waiting = deque(range(len(sources)))
    handed: dict[Any, int] = {}
    ahead = workers * WAITING
    while waiting or handed:
        if head.is_there():  # what asks it otherwise does not return
            ahead = max(workers, int(ray.cluster_resources().get("CPU", 1))) * WAITING
        while waiting and len(handed) < ahead:
            number = waiting.popleft()
            handed[task.remote(sources[number], studies)] = number
        ready, _ = ray.wait(list(handed), num_returns=1, timeout=_LOOKS_S)
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
