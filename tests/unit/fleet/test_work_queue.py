"""What is counted first, by whom, and what becomes of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.fleet.traffic.work_queue import HOURS_UNKNOWN, NodeWork, TourTimes, Value, WorkQueue

HOP_MS = 2_000


def work(node: str, value: Value = Value.NEVER_COUNTED, age_s: float = 0.0, drone: str = "") -> NodeWork:
    return NodeWork(node, node[0], int(node[1:]), (f"{node}-1", f"{node}-2"), 10_000, value, age_s, drone)


def times(pad_aisle: str = "A") -> TourTimes:
    """Aisles are 10 s apart, nodes 2 s; the pad lies before the first node of an aisle."""

    def between_ms(a: str, b: str) -> int:
        return 10_000 * abs(ord(a[0]) - ord(b[0])) + HOP_MS * abs(int(a[1:]) - int(b[1:]))

    return TourTimes(
        lambda node: between_ms(f"{pad_aisle}0", node),
        between_ms,
        lambda node: between_ms(node, f"{pad_aisle}0"),
    )


def test_a_tour_sweeps_the_nearest_aisle_from_its_nearer_end() -> None:
    queue = WorkQueue(work(node) for node in ("B1", "A3", "A1", "A2"))
    assert queue.tour(times(), 1_000_000) == ("A1", "A2", "A3", "B1")


def test_a_tour_fits_its_budget_with_the_way_home() -> None:
    queue = WorkQueue(work(f"A{i}") for i in range(1, 9))
    nodes = queue.tour(times(), 60_000)
    assert nodes == ("A1", "A2", "A3", "A4")  # 4 x 12 s, and 8 s home
    assert queue.tour(times(), 5_000) == ()


def test_a_share_of_the_work_is_one_of_its_time() -> None:
    near = [replace(work(f"A{i}"), dwell_ms=2_000) for i in range(1, 7)]
    far = [replace(work(f"D{i}"), dwell_ms=30_000) for i in range(1, 4)]
    queue = WorkQueue([*near, *far])
    assert queue.takes_ms(times()) == (2_000 + 5 * HOP_MS + 6 * 2_000) + (32_000 + 2 * HOP_MS + 3 * 30_000)
    nodes = queue.tour(times(), 1_000_000, share_ms=queue.takes_ms(times()) // 2)
    assert nodes == ("A1", "A2", "A3", "A4", "A5", "A6", "D3")
    two = WorkQueue([work("A1"), work("D1")])
    assert two.tour(times(), 1_000_000, share_ms=two.takes_ms(times()) // 2) == ("A1",)


def test_what_lies_too_far_for_the_battery_keeps_nobody_from_the_rest() -> None:
    queue = WorkQueue([work("D3", Value.ASKED), work("A1")])
    assert queue.tour(times(), 30_000) == ("A1",)


def test_the_most_valuable_places_come_first_however_far() -> None:
    queue = WorkQueue(
        [
            work("A1", Value.OLD),
            work("B1"),
            work("C2", Value.CONTRADICTED),
            work("D3", Value.ASKED),
            work("D1", Value.OLD),
        ]
    )
    assert queue.tour(times(), 100_000)[0] == "D3"
    queue.take("d", ["D3", "D1"])
    assert queue.tour(times(), 1_000_000)[0] == "C2"


def test_of_equal_value_and_way_the_oldest_aisle_comes_first() -> None:
    queue = WorkQueue([work("B1", Value.OLD, 10.0), work("D1", Value.OLD, 99.0)])
    assert queue.tour(times("C"), 1_000_000)[0] == "D1"


def test_an_aisle_in_which_somebody_flies_is_left_to_it() -> None:
    queue = WorkQueue(work(node) for node in ("A1", "A2", "B1"))
    queue.take("d", ["A1"])
    assert queue.tour(times(), 1_000_000, busy_aisles={"A"}) == ("B1",)


def test_what_is_handed_back_waits_again_or_has_its_reason() -> None:
    queue = WorkQueue(work(node) for node in ("A1", "A2", "A3"))
    queue.take("d", ["A1", "A2"])
    queue.hand_back(["A1"])
    queue.hand_back(["A2"], "aisle A is closed")
    assert queue.open == ("A3", "A1")
    assert queue.reasons == {"A2": "aisle A is closed"}
    queue.retry(["A2", "A3"])
    assert set(queue.open) == {"A1", "A2", "A3"}
    assert queue.reasons == {}
    queue.finish("A2")
    assert queue.done == ["A2"]
    assert set(queue.open) == {"A1", "A3"}


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize(
    ("before", "then", "stays"),
    [
        ((Value.ASKED, "b"), (Value.OLD, ""), (Value.ASKED, "b")),
        ((Value.ASKED, "b"), (Value.ASKED, ""), (Value.ASKED, "b")),
        ((Value.ASKED, "b"), (Value.ASKED, "c"), (Value.ASKED, "c")),
        ((Value.ASKED, ""), (Value.ASKED, "c"), (Value.ASKED, "c")),
        ((Value.OLD, ""), (Value.CONTRADICTED, ""), (Value.CONTRADICTED, "")),
    ],
)
def test_what_is_asked_for_while_it_waits_stays_with_whom_and_as_valuable_as_it_was(
    given: bool, before: tuple[Value, str], then: tuple[Value, str], stays: tuple[Value, str]
) -> None:
    queue = WorkQueue([work("A1", before[0], drone=before[1])])
    if given:
        queue.take("b", ["A1"])
    queue.ask([work("A1", then[0], drone=then[1])])
    assert (queue.work("A1").value, queue.work("A1").drone) == stays
    assert queue.given == ({"A1": "b"} if given else {})


def test_what_is_done_or_cannot_be_done_is_asked_for_anew_as_it_is_now() -> None:
    queue = WorkQueue([work("A1", Value.ASKED, drone="b"), work("A2", Value.ASKED, drone="b")])
    queue.finish("A1")
    queue.give_up("A2", "too far")
    queue.ask([work("A1", Value.OLD), work("A2", Value.OLD)])
    assert [queue.work(node) for node in queue.open] == [work("A1", Value.OLD), work("A2", Value.OLD)]


def test_of_equal_value_the_age_is_the_one_told_last() -> None:
    queue = WorkQueue([work("A1", Value.OLD, 10.0)])
    queue.ask([work("A1", Value.OLD, 20.0)])
    assert queue.work("A1").age_s == 20.0


def levels_at(queue: WorkQueue, node: str, *levels: int, run: str = "") -> None:
    queue.ask([replace(work(node), levels=levels, run=run)])


@pytest.mark.parametrize(
    ("first", "then", "both"), [((1,), (2,), (1, 2)), ((1,), (), ()), ((), (2,), ()), ((2,), (2,), (2,))]
)
def test_the_levels_of_all_who_ask_are_counted(
    first: tuple[int, ...], then: tuple[int, ...], both: tuple[int, ...]
) -> None:
    queue = WorkQueue(())
    levels_at(queue, "A1", *first)
    levels_at(queue, "A1", *then)
    assert queue.levels_of("A1") == both


def test_levels_that_a_drone_does_not_count_there_wait_again_once_it_is_done() -> None:
    queue = WorkQueue(())
    levels_at(queue, "A1", 1)
    queue.take("a", ["A1"])
    levels_at(queue, "A1", 2)
    levels_at(queue, "A1", 1)
    assert (queue.levels_of("A1"), queue.open) == ((1,), ()), "as it was told"
    assert WorkQueue.of(queue.kept()).levels_of("A1") == (1, 2), "nobody knows whether it still does"
    queue.finish("A1")
    assert (queue.levels_of("A1"), queue.open, queue.done) == ((2,), ("A1",), [])
    queue.take("a", ["A1"])
    levels_at(queue, "A1", 3)
    queue.hand_back(["A1"])
    assert (queue.levels_of("A1"), queue.open) == ((2, 3), ("A1",))


def test_work_of_a_run_is_begun_in_its_hours_alone_unless_somebody_else_asks_for_it() -> None:
    queue = WorkQueue(())
    for node in ("A1", "A2"):
        levels_at(queue, node, run="run-1")
    levels_at(queue, "A3")

    def begun() -> tuple[str, ...]:
        nodes = queue.tour(times(), 1_000_000)
        assert nodes == queue.ready
        return nodes

    assert begun() == ("A3",)
    assert queue.held == dict.fromkeys(("A1", "A2"), HOURS_UNKNOWN)
    queue.runs = {"run-1": "these are quiet hours"}
    assert queue.held == dict.fromkeys(("A1", "A2"), "these are quiet hours")
    levels_at(queue, "A2")
    levels_at(queue, "A3", run="run-1")
    assert begun() == ("A2", "A3")
    queue.runs = {"run-1": ""}
    assert {*begun()} == {"A1", "A2", "A3"}
    assert queue.runs_left == {"run-1"}
