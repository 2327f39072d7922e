"""In what order a run takes its tests."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.rigs.schedule import FromBothEnds, in_order


class Worker:
    """One of xdist's, that only notes what it is given."""

    shutting_down = False

    def __init__(self, name: str) -> None:
        self.gateway = SimpleNamespace(id=name)
        self.given: list[int] = []

    def send_runtest_some(self, indices: list[int]) -> None:
        self.given += indices

    def shutdown(self) -> None:
        self.shutting_down = True


class Test:
    """As much of a collected test as its place depends on."""

    __test__ = False

    def __init__(self, nodeid: str, slow: bool = False, cores: float | None = None) -> None:
        self.nodeid = nodeid
        self._markers = {"slow": pytest.mark.slow.mark} if slow else {}
        if cores is not None:
            self._markers["realtime"] = pytest.mark.realtime(cores=cores).mark

    def get_closest_marker(self, name: str) -> pytest.Mark | None:
        return self._markers.get(name)


def ordered(*tests: Test) -> list[str]:
    items = list(tests)
    in_order(cast("list[pytest.Item]", items))
    return [test.nodeid for test in items]


def test_what_computes_long_stands_in_front_and_what_waits_long_at_the_end() -> None:
    pages, doctor = "tests/web/test_report_page.py::reads", "tests/protocol/test_doctor.py::asks"
    sums, hall = "tests/unit/core/test_cells.py::sums", "tests/sim/flights/test_random_halls.py::flies"
    hover = "tests/sim/ideal/test_orders.py::hovers"
    assert ordered(Test(pages), Test(hover), Test(doctor), Test(sums), Test(hall, slow=True)) == [
        hall,
        hover,
        sums,
        doctor,
        pages,
    ]


def test_those_by_the_clock_are_outermost_the_longest_first_from_both_ends() -> None:
    clocked = [Test(f"tests/sim/clocked.py::{cores}", cores=cores) for cores in (0.5, 1.0, 0.7, 0.6)]
    page = Test("tests/web/test_page.py::shows")
    assert [nodeid.rpartition(":")[2] for nodeid in ordered(page, *clocked)] == [
        "1.0",
        "0.6",
        "shows",
        "0.5",
        "0.7",
    ]


def test_every_second_worker_takes_from_the_end() -> None:
    tests = [f"tests/unit/test_sums.py::{number}" for number in range(20)]
    workers = [Worker("gw0"), Worker("gw1")]
    option = SimpleNamespace(loadscopereorder=True)
    config: Any = SimpleNamespace(getvalue=lambda _name: ["popen"] * len(workers), option=option)
    schedule: Any = FromBothEnds(config, None)
    for worker in workers:
        schedule.add_node(worker)
        schedule.add_node_collection(worker, tests)
    schedule.schedule()
    front, end = (worker.given for worker in workers)
    assert front == list(range(len(front)))
    assert end == list(range(19, 19 - len(end), -1))
    while not all(worker.shutting_down for worker in workers):
        for worker in workers:
            for index in worker.given:
                schedule.mark_test_complete(worker, index)
    assert sorted(front + end) == list(range(20)), "each once"
