"""In what order the tests of a run go to its workers.

A flight computes, a page mostly waits: of one kind alone there is too much or too little to do for the cores.
So what computes stands in front and what waits at the end, on either side the dearest outermost.  Every
second worker takes from the end and the others from the front, until they meet among what is cheap."""

from __future__ import annotations

import re
from typing import Any

import pytest
from xdist.scheduler.loadscope import LoadScopeScheduling

from tests.rigs.machine import Needs

_TOGETHER = {
    "tests/bench/test_vision_cost.py",
    "tests/replay/test_decisions.py",
    "tests/replay/test_log_command.py",
    "tests/replay/test_playback.py",
    "tests/replay/test_report.py",
    "tests/replay/test_report_inventory.py",
    "tests/sim/flights/test_scan_flight.py",
    "tests/sim/flights/test_stream_flight.py",
    "tests/sim/ground/test_ground_lost.py",
    "tests/sim/ideal/test_height_changes.py",
    "tests/sim/ideal/test_ideal_sweep.py",
    "tests/sim/pictures/test_face_light.py",
    "tests/sim/pictures/test_shelf_reading.py",
    "tests/unit/cli/test_vision_commands.py",
    "tests/unit/log_study/test_log_study.py",
    "tests/unit/foxglove/test_logged_for_viewers.py",
    "tests/web/test_flight_folder.py",
    "tests/web/test_flight_functions.py",
    "tests/web/test_flight_fuzz.py",
    "tests/web/test_flights_api.py",
    "tests/web/test_studio_api.py",
}
"""Modules whose tests share what took long to make, or each need more than a core for themselves."""
_ON_ONE_DATABASE = "tests/unit/ground_store/"
_IN_BROWSER = re.compile(r"tests/web/test_(?:\w*page|language|navigation)\.py")
"""Each starts a Chromium, and a station for all its tests."""
_COMPUTING = (
    "tests/sim/",
    "tests/replay/",
    "tests/unit/log_study/",
    "tests/unit/mission/test_every_state.py",
)
_WAITING = (
    "tests/protocol/",
    "tests/web/",
    "tests/unit/guide/test_guide_commands.py",
    _ON_ONE_DATABASE,
    "tests/protocol/test_doctor",
    "tests/protocol/test_vehicle_contract.py",
)
"""For other processes and for a library's clock."""


def module_of(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def in_browser(nodeid: str) -> bool:
    return _IN_BROWSER.fullmatch(module_of(nodeid)) is not None


def cores_of(item: pytest.Item) -> float:
    """What a test that flies by the clock needs free; 0: another one."""
    marker = item.get_closest_marker("realtime")
    return 0.0 if marker is None else Needs(**marker.kwargs).cores


def place_of(nodeid: str, *, slow: bool) -> int:
    """Where among the others a test stands: the more below 0 the longer it computes, the more above 0 the
    longer it waits."""
    whole = module_of(nodeid) in _TOGETHER
    waiting = [rank for rank, part in enumerate(_WAITING, 1) if nodeid.startswith(part)]
    if in_browser(nodeid) or (waiting and whole):
        return len(_WAITING) + 1
    if waiting:
        return max(waiting)
    return -1 - slow - whole if nodeid.startswith(_COMPUTING) or whole else 0


def in_order(items: list[pytest.Item]) -> None:
    """Sort them.  Those by the clock are outermost, and of them what needs little of the machine comes last:
    it is short."""
    clocked = sorted(filter(cores_of, items), key=cores_of, reverse=True)
    others = [item for item in items if not cores_of(item)]
    others.sort(key=lambda item: place_of(item.nodeid, slow=item.get_closest_marker("slow") is not None))
    items[:] = [*clocked[::2], *others, *reversed(clocked[1::2])]


class FromBothEnds(LoadScopeScheduling):  # type: ignore[misc]  # its library has no types
    """The tests of a module that share what took long to make stay on one worker; others go anywhere."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        super().__init__(config, log)
        config.option.loadscopereorder = False  # by the number of a module's tests, which says little

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(_ON_ONE_DATABASE):
            return _ON_ONE_DATABASE
        module = module_of(nodeid)
        return module if module in _TOGETHER or in_browser(nodeid) else nodeid

    def _assign_work_unit(self, node: Any) -> None:
        if self.nodes.index(node) % 2:
            self.workqueue.move_to_end(next(reversed(self.workqueue)), last=False)
        super()._assign_work_unit(node)
