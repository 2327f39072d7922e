"""Which nodes a run counts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import InputError
from flightd.core.inventory import LocationState
from flightd.core.planned_flight import MOST_NODES
from flightd.core.utc_time import utc_time
from flightd.fleet.schedule.rolling import NodeCount, run_nodes
from flightd.fleet.traffic.valued_work import UNKNOWN, Worth
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.missions.mission_book import MissionBook
from flightd.ground.schedules.kept import CountAisles, CountMission, CountOfList, Schedule
from flightd.ground.site_stock import site_stock
from flightd.ground.valued_nodes import shelved_nodes

_MOST_RUNS = 400


@dataclass(frozen=True, slots=True)
class Work:
    """Nodes in the order in which they are flown, and shelf levels (none: all); `mission` is the id of the
    kept mission that they are of, or empty."""

    nodes: tuple[str, ...]
    levels: tuple[int, ...] = ()
    mission: str = ""


def work_of(
    schedule: Schedule,
    count: CountOfList,
    floor: FloorStatus,
    missions: MissionBook,
    store: GroundStore | None,
    now: datetime,
    first: Collection[str] = (),
) -> Work:
    """What a run of the schedule that has this `count` counts now; reads files.  The nodes that are to come
    `first` are exceptions, too.  InputError where that is nothing, or cannot be known."""
    if isinstance(count, CountMission):
        mission = missions.mission(count.mission)
        if mission.site != schedule.kept.site:
            raise InputError(f"the mission is one of site {mission.site}")
        return Work(mission.nodes, mission.levels, mission.id)
    if isinstance(count, CountAisles):
        return Work(_aisle_nodes(floor, count.aisles), count.levels)
    if store is None:
        raise InputError(
            "all of a site is counted by the ground store, and there is none", remedy="give --store FILE"
        )
    following = [one.at for one in schedule.rule.next_occurrences(now, _MOST_RUNS)]
    known = _counts(floor, list(site_stock(store, schedule.kept.site)), first)
    nodes = run_nodes(known, now, timedelta(days=count.within_days), following)
    return Work(nodes[:MOST_NODES])


def valued_work(floor: FloorStatus, worth: Mapping[str, Worth], chosen: Sequence[str]) -> Work:
    """Of the nodes that were chosen by their `worth`, the most valuable first, as many as a run has:
    exceptions first, then what was never counted, then the others, each in the order of the aisles.
    InputError where there are none."""
    first = {*chosen[:MOST_NODES]}
    nodes = [node.id for node in floor.nodes if node.id in first]
    nodes.sort(key=lambda node: -worth.get(node, UNKNOWN).value)
    if not nodes:
        raise InputError("all nodes wait already, or are closed")
    return Work(tuple(nodes))


def _aisle_nodes(floor: FloorStatus, aisles: Sequence[str]) -> tuple[str, ...]:
    found: list[str] = []
    for aisle in dict.fromkeys(aisles):
        nodes = [node.id for node in shelved_nodes(floor) if node.aisle == aisle]
        if not nodes:
            raise InputError(f"aisle {aisle} has no node at which something is counted")
        found += nodes
    return tuple(found)


def _counts(floor: FloorStatus, stock: Sequence[dict[str, Any]], first: Collection[str]) -> list[NodeCount]:
    """The nodes to be counted, aisle by aisle as on the floor, with the worst that is known of each."""
    oldest: dict[str, datetime | None] = {}
    exceptions = {*first}
    for place in stock:
        node, state = place["node"], LocationState(place["state"])
        if state in {LocationState.UNREADABLE, LocationState.OCCLUDED}:
            exceptions.add(node)
        ns = place["utc_ns"]
        never = ns is None or state is LocationState.NOT_VISITED
        at = None if never else utc_time(ns)
        before = oldest.get(node, at)
        oldest[node] = None if at is None or before is None else min(at, before)
    return [NodeCount(node.id, node.id in exceptions, oldest.get(node.id)) for node in shelved_nodes(floor)]
