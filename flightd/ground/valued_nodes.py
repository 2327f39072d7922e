"""Nodes of a floor by their value: how many are asked for, and which these are."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Annotated

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.messages.floor import FloorNode, FloorStatus
from flightd.core.errors import InputError
from flightd.core.planned_flight import MOST_NODES
from flightd.fleet.traffic.valued_work import UNKNOWN, Worth, most_valuable
from flightd.fleet.traffic.work_queue import NodeWork


class ByValue(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The so many most valuable `nodes`, or all of the so many most valuable `aisles`; neither: everything,
    the most valuable first."""

    nodes: Annotated[int, Meta(ge=1, le=MOST_NODES)] | None = None
    aisles: Annotated[int, Meta(ge=1, le=MOST_NODES)] | None = None

    def check(self) -> None:
        """InputError where both are given."""
        if self.nodes is not None and self.aisles is not None:
            raise InputError("nodes and aisles are given", remedy="leave one out")


def shelved_nodes(floor: FloorStatus) -> Sequence[FloorNode]:
    """The nodes that face a place; all, where the site knows no places."""
    return [node for node in floor.nodes if node.levels] or floor.nodes


def valued_nodes(
    floor: FloorStatus, worth: Mapping[str, Worth], asked: ByValue, without: Collection[str] = ()
) -> tuple[str, ...]:
    """The most valuable (`most_valuable`) of those that face a shelf, `without` some; of none of whose places
    anything is known, nobody knows what lies there."""
    found: list[NodeWork] = []
    for i, node in enumerate(shelved_nodes(floor)):
        its = worth.get(node.id, UNKNOWN)
        if node.id not in without:
            found.append(NodeWork(node.id, node.aisle, i, (), 0, its.value, its.age_s))
    return tuple(one.node for one in most_valuable(found, asked.nodes, asked.aisles))
