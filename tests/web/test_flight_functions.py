"""What the flights' pages work out by themselves: places in time, ranges of plots, selections."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.web.chromium import opened, running, station

pytest.importorskip("playwright", reason="the tests of the page need playwright: pip install -e '.[dev]'")

Called = Callable[..., Any]
"""Module below app/flights, function, arguments."""


@pytest.fixture(scope="module")
def call() -> Iterator[Called]:
    with running() as browser, station(["demo=127.0.0.1:1/1"]) as url, opened(browser, url) as page:

        def called(module: str, function: str, *args: Any) -> Any:
            words = json.dumps([f"/static/app/flights/{module}.js", function, list(args)])
            return page.evaluate(
                f"async () => {{ const [at, name, given] = {words};"
                " return (await import(at))[name](...given); }"
            )

        yield called


TRACK = {
    "t_s": [0.0, 1.0, 5.0, 6.0],
    "x_m": [0.0, 2.0, 8.0, 9.0],
    "y_m": [0.0, 0.0, 1.0, 1.0],
    "yaw_rad": [3.1, -3.1, 0.0, 0.0],
    "sigma_x_m": [0.1, 0.3, 0.1, 0.1],
}


def test_a_pose_lies_between_its_neighbours_and_turns_the_short_way(call: Called) -> None:
    pose = call("at_time", "poseAt", TRACK, 0.5)
    assert (pose["x_m"], pose["sigma_x_m"]) == (1.0, pytest.approx(0.2))
    assert abs(math.remainder(pose["yaw_rad"] - math.pi, 2 * math.pi)) < 0.01
    assert pose["sigma_y_m"] is None


def test_where_nothing_was_known_there_is_no_pose(call: Called) -> None:
    assert call("at_time", "poseAt", TRACK, -0.1) is None
    assert call("at_time", "poseAt", TRACK, 3.0) is None
    assert call("at_time", "poseAt", TRACK, 60.0) is None
    assert call("at_time", "poseAt", TRACK, 1.2)["x_m"] == 2.0
    assert call("at_time", "poseAt", None, 1.0) is None


@pytest.mark.parametrize(("t", "place"), [(-1, -1), (0, 0), (0.9, 0), (1, 1), (9, 2)])
def test_the_last_that_began_before_a_time_is_found(t: float, place: int, call: Called) -> None:
    assert call("at_time", "lastBefore", [{"t_s": 0}, {"t_s": 1}, {"t_s": 2}], t) == place


def test_the_way_that_is_left_gets_shorter_node_by_node(call: Called) -> None:
    def moment(t_s: float, node: str) -> dict[str, Any]:
        return {"t_s": t_s, "node": node}

    flight = {
        "moments": [moment(0, "A1"), moment(1, "A2"), moment(2, "A3"), moment(3, "A4")],
        "legs": [{"t_s": 0, "via": ["A2", "A3"]}, {"t_s": 2.5, "via": ["A4"]}, {"t_s": None, "via": ["A5"]}],
    }
    assert call("at_time", "wayAt", flight, 0.5) == ["A2", "A3", "A4", "A5"]
    assert call("at_time", "wayAt", flight, 2.1) == ["A3", "A4", "A5"]
    assert call("at_time", "wayAt", flight, 3.1) == ["A4", "A5"]
    assert call("at_time", "wayAt", flight, -1) == []


@pytest.mark.parametrize(
    ("at", "span", "shown"),
    [(0, 0, [0, 100]), (50, 200, [0, 100]), (0, 20, [0, 20]), (100, 20, [80, 100]), (50, 20, [42.5, 62.5])],
)
def test_the_stretch_that_is_shown_holds_its_time_and_stays_in_the_flight(
    at: float, span: float, shown: list[float], call: Called
) -> None:
    assert call("plot_list", "shownSpan", at, span, 0, 100) == shown


def test_a_quiet_curve_does_not_fill_its_plot_with_noise(call: Called) -> None:
    low, high = call("plot_list", "valueRange", {"least": 12, "zero": True}, -0.1, 0.1)
    assert high - low >= 12
    assert low < -0.1
    assert call("plot_list", "valueRange", {"least": 1, "zero": True}, 0, 1.6) == [0, pytest.approx(1.68)]
    assert call("plot_list", "valueRange", {"least": 5}, None, None) == [0, 5]


def row(site: str, started_s: float, **fields: Any) -> dict[str, Any]:
    blank = dict.fromkeys(("drone", "world", "mission", "reason", "verdict", "trouble"), "")
    return {**blank, "site": site, "path": site, "started_s": started_s, "outcome": "completed", "faults": [],
            "running": False, "cross_track_rms_m": None, **fields}  # fmt: skip


def test_the_unknown_comes_last_whichever_way_a_column_is_sorted(call: Called) -> None:
    rows = [row("none", 3), row("bad", 2, cross_track_rms_m=0.2), row("good", 1, cross_track_rms_m=0.1)]
    for way, order in (("up", ["good", "bad", "none"]), ("down", ["bad", "good", "none"])):
        selection = f"sort=cross.{way}"
        assert [one["site"] for one in chosen(call, rows, selection)] == order


@pytest.mark.parametrize(
    ("query", "sites"),
    [
        ("", ["hall B", "hall A"]), ("q=hall", ["hall B", "hall A"]), ("q=LOST+hall", ["hall A"]),
        ("q=nowhere", []), ("show=aborted", ["hall A"]), ("show=good", ["hall B"]),
        ("show=nonsense", ["hall B", "hall A"]),
        ("sort=site.up", ["hall A", "hall B"]), ("sort=nonsense", ["hall B", "hall A"]),
    ],
)  # fmt: skip
def test_rows_are_chosen_by_every_word_and_by_kind(query: str, sites: list[str], call: Called) -> None:
    rows = [
        row("hall A", 1, outcome="aborted", reason="lines lost", verdict="bad"),
        row("hall B", 2, verdict="good"),
    ]
    assert [one["site"] for one in chosen(call, rows, query)] == sites


def chosen(call: Called, rows: list[dict[str, Any]], query: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = call("selection", "selectedBy", rows, query)
    return found


@pytest.mark.parametrize(
    ("key", "a", "b", "text", "better"),
    [
        ("cross", {"cross_track_rms_m": 0.05}, {"cross_track_rms_m": 0.02}, "\u22123.0 cm", True),
        ("cross", {"cross_track_rms_m": 0.05}, {"cross_track_rms_m": 0.0501}, "same", None),
        ("cross", {"cross_track_rms_m": None}, {"cross_track_rms_m": 0.05}, "\u2013", None),
        ("nodes", {"nodes_visited": 8}, {"nodes_visited": 6}, "\u22122", False),
        ("duration", {"duration_s": 60}, {"duration_s": 125}, "+1:05", None),
    ],
)  # fmt: skip
def test_a_difference_says_which_flight_did_better(
    key: str, a: dict[str, Any], b: dict[str, Any], text: str, better: bool | None, call: Called
) -> None:
    assert call("figures", "differenceIn", key, a, b) == {"text": text, "better": better}


@pytest.mark.parametrize(
    ("row", "known", "another"),
    [
        ({"stamp": "b"}, {"listed": "a", "stamp": "a", "row": {"started_s": 10}}, True),
        ({"stamp": "a"}, {"listed": "a", "stamp": "b", "row": {"started_s": 10}}, False),
        ({"stamp": "b"}, {"stamp": "b", "row": None}, False),
        ({"stamp": "b"}, {"listed": "a", "trouble": "gone"}, True),
        ({"stamp": "b", "running": True, "started_s": 11}, {"listed": "a", "row": {"started_s": 10}}, False),
        ({"stamp": "b", "running": True, "started_s": 99}, {"listed": "a", "row": {"started_s": 10}}, True),
        ({"stamp": "b", "running": True, "started_s": 99}, {"listed": "a"}, False),
    ],
)
def test_a_flight_in_the_place_of_the_one_that_was_fetched_is_told_apart(
    call: Called, row: dict[str, Any], known: dict[str, Any], another: bool
) -> None:
    assert call("flights_state", "isAnother", row, known) is another
