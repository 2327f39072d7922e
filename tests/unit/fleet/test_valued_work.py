"""What a fleet counts next is what is worth most."""

from __future__ import annotations

from flightd.fleet.traffic.valued_work import PlaceFacts, Worth, most_valuable, worth_of
from flightd.fleet.traffic.work_queue import NodeWork, Value

DAY_S = 86_400.0


def work(node: str, value: Value, age_s: float = 0.0) -> NodeWork:
    return NodeWork(node, node[0], int(node[1:]), (), 1_000, value, age_s)


WORK = (
    work("A1", Value.OLD, DAY_S),
    work("A2", Value.OLD, 9 * DAY_S),
    work("B1", Value.NEVER_COUNTED),
    work("B2", Value.CONTRADICTED, 60.0),
    work("C1", Value.OLD, 3 * DAY_S),
)


def test_a_node_is_worth_what_its_most_valuable_place_is_and_as_old_as_its_oldest_count() -> None:
    places = [
        PlaceFacts("A1", DAY_S),
        PlaceFacts("A1", 3 * DAY_S),
        PlaceFacts("A2", None),
        PlaceFacts("A2", DAY_S),
        PlaceFacts("A3", 60.0, contradicted=True),
        PlaceFacts("A3", None),
        PlaceFacts("A4", DAY_S, contradicted=True, asked=True),
        PlaceFacts("A4", None),
    ]
    assert worth_of(places) == {
        "A1": Worth(Value.OLD, 3 * DAY_S),
        "A2": Worth(Value.NEVER_COUNTED, DAY_S),
        "A3": Worth(Value.CONTRADICTED, 60.0),
        "A4": Worth(Value.ASKED, DAY_S),
    }


def test_the_most_valuable_nodes_are_contradicted_then_never_counted_then_old() -> None:
    assert [one.node for one in most_valuable(WORK)] == ["B2", "B1", "A2", "C1", "A1"]
    assert [one.node for one in most_valuable(WORK, nodes=3)] == ["B2", "B1", "A2"]


def test_of_the_most_valuable_aisles_everything_is_counted() -> None:
    assert {one.node for one in most_valuable(WORK, aisles=2)} == {"B1", "B2", "A1", "A2"}
