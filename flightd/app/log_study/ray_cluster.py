"""A Ray cluster: whether its nodes can do the work, and whether its head is there."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from flightd import __version__
from flightd.app.log_study.sources import LogSource
from flightd.core.errors import InputError, UnavailableError

ANSWERS_S: Final = 300.0
"""A node that has not started a worker by then is none that works."""
LOOKS_S: Final = 5.0
_GONE_S: Final = 30.0
"""A head that cannot be reached for so long is gone: after 60 s Ray ends the whole process over it."""


@dataclass(frozen=True, slots=True)
class NodeLook:
    """What a node has: which flightd ("" for none), and the first of the paths asked for that is not there
    ("" where all are)."""

    node: str
    version: str
    missing: str


def check_nodes(ray: Any, sources: Sequence[LogSource], key: str) -> None:
    """Each node that works is to have this flightd, or another release would judge, and what of `sources` is
    read there by its path.  `key` names the cluster.

    UnavailableError for a node with another flightd or none, or that does not answer; InputError for a path
    that one of them does not have."""
    nodes = [node for node in ray.nodes() if node["Alive"] and node["Resources"].get("CPU")]
    inventories = dict.fromkeys(source.inventory_file for source in sources if source.inventory)
    paths = [*inventories, *(source.place for source in sources if source.is_local)]
    for look in node_looks(ray, nodes, paths, key):
        check_node(look, key, is_log=look.missing not in inventories)


def check_node(look: NodeLook, key: str, *, is_log: bool) -> None:
    """As `check_nodes`, of one; `is_log`: what is missing is a log, which can be fetched from elsewhere."""
    if look.version != __version__:
        has = f"flightd {look.version}" if look.version else "no flightd"
        remedy = f"install flightd {__version__} there, where `ray start` runs"
        raise UnavailableError(f"node {look.node} has {has}", key=key, remedy=remedy)
    if look.missing:
        raise InputError(
            f"is not on node {look.node} of the Ray cluster",
            file=look.missing,
            key="" if is_log else "--inventory",
            remedy=f"give {'a URL, or ' if is_log else ''}a folder that each node has at the same place",
        )


def node_looks(
    ray: Any, nodes: Sequence[Mapping[str, Any]], paths: Sequence[str], key: str
) -> Iterator[NodeLook]:
    """What each of the nodes (as `ray.nodes()` has them) has; nothing of one that is gone meanwhile.
    UnavailableError for one that does not answer."""

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

    look = ray.remote(looked)
    asked = {
        look.options(
            num_cpus=0, scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        ).remote(paths): str(node["NodeManagerAddress"])
        for node in nodes
    }
    for answer, node in asked.items():
        try:
            version, missing = ray.get(answer, timeout=ANSWERS_S)
        except ray.exceptions.GetTimeoutError:
            raise UnavailableError(f"node {node} does not answer in {ANSWERS_S:.0f} s", key=key) from None
        except (ray.exceptions.TaskUnschedulableError, ray.exceptions.NodeDiedError):
            continue
        yield NodeLook(node, version, missing)


class Head:
    """The head of a cluster at HOST:PORT; empty: Ray's client tells by itself when it is gone."""

    def __init__(
        self, address: str, *, gone_s: float = _GONE_S, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._address = address
        self._gone_s = gone_s
        self._sleep = sleep
        self._seen_s = time.monotonic()

    def is_there(self) -> bool:
        """Whether it can be reached now.  ConnectionError where it could not for long."""
        if not self._address:
            return True
        host, _, port = self._address.rpartition(":")
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=LOOKS_S).close()
        except OSError as err:
            if time.monotonic() - self._seen_s > self._gone_s:
                raise ConnectionError(f"{self._address}: {err.strerror or err}") from None
            return False
        self._seen_s = time.monotonic()
        return True

    def was_away(self) -> bool:
        """False where it is there; else once it is there again.  ConnectionError where it does not come."""
        if self.is_there():
            return False
        while not self.is_there():
            self._sleep(1.0)
        return True
