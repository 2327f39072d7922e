"""Which nodes a run counts: of a kept mission, of all of a site, of what is worth most."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from flightd.core.errors import InputError
from flightd.fleet.schedule.rolling import NodeCount, run_nodes
from flightd.fleet.traffic.valued_work import PlaceFacts
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.missions.mission_book import Mission, MissionBook
from flightd.ground.schedules.kept import CountAll, CountByValue, CountMission
from flightd.ground.schedules.schedule_book import RunState
from tests.unit.ground.night_shift_rig import FLOOR, NIGHTLY, T0, Facts, Station


def test_a_kept_mission_is_flown_as_it_is_then_and_knows_what_is_left(tmp_path: Path) -> None:
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountMission("mission-1")), rest_s=0.0)
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.cause, run.why) == ("work", "there is no such mission any more")
    MissionBook(tmp_path).keep(Mission("mission-1", "demo", "Two", ("B2", "B1"), (1,)))
    run = station.at("01T22:10").look()
    assert run is not None
    assert (run.nodes, run.levels) == (("B2", "B1"), (1,))
    assert MissionBook(tmp_path).mission("mission-1").plan == run.plan


def test_all_of_a_site_needs_the_ground_store(tmp_path: Path) -> None:
    run = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountAll(7))).at("01T22:00").look()
    assert run is not None
    assert (run.cause, run.why.partition(",")[0]) == ("work", "all of a site is counted by the ground store")


def test_of_all_of_a_site_what_is_asked_for_and_contradicted_goes_first(tmp_path: Path) -> None:
    facts = Facts(PlaceFacts("B6", 5.0, contradicted=True), PlaceFacts("A5", 5.0, asked=True))
    with opened_store(str(tmp_path / "counts.db")) as store:
        kept = msgspec.structs.replace(NIGHTLY, count=CountAll(7))
        run = Station(tmp_path, kept, facts=facts, store=store).at("01T22:00").look()
        assert run is not None
        assert (run.why, run.nodes) == ("", ("A5", "B6", "A1", "A2"))
        kept = msgspec.structs.replace(kept, name="Unread books")
        (tmp_path / "other").mkdir()
        other = Station(tmp_path / "other", kept, store=store).at("01T22:00").look()
        assert other is not None
        assert (other.state, other.nodes) == (RunState.STARTED, ("A1", "A2"))


@pytest.mark.parametrize(
    ("asked", "nodes"),
    [
        (CountByValue(nodes=4), ("A5", "A2", "B6", "A4")),
        (CountByValue(aisles=1), ("A5", "A2", "A1", "A3", "A4", "A6")),
        (CountByValue(), ("A5", "A2", "B6", "A1", "A3", "A4", "A6", "B1", "B2", "B3", "B4", "B5")),
    ],
)
def test_what_is_worth_most_is_counted_exceptions_first(
    tmp_path: Path, asked: CountByValue, nodes: tuple[str, ...]
) -> None:
    old = [PlaceFacts(node.id, 60.0) for node in FLOOR.nodes if node.id not in {"A2", "A4", "A5", "B6"}]
    exceptions = PlaceFacts("B6", None), PlaceFacts("A2", None), PlaceFacts("A5", 5.0, contradicted=True)
    facts = Facts(*old, *exceptions, PlaceFacts("A4", 9e5))
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=asked), facts=facts)
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.state, run.nodes) == (RunState.STARTED, nodes)


def test_what_cannot_be_known_of_value_is_told_and_asked_for_again_after_a_rest(tmp_path: Path) -> None:
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountByValue(nodes=2)))
    for _ in range(3):
        run = station.at("01T22:00").look()
        assert run is not None
        assert (run.state, run.cause, run.why) == (RunState.WAITING, "work", "there is no ground store")
    assert station.facts.asked == 1


def test_how_much_is_worth_most_is_said_once() -> None:
    both = msgspec.structs.replace(NIGHTLY, count=CountByValue(nodes=2, aisles=1))
    with pytest.raises(InputError, match="nodes and aisles are given; leave one out"):
        both.checked()


def test_a_week_of_nights_counts_all_nodes_with_exceptions_first_and_none_gets_older() -> None:
    names, now, week = [f"N{i}" for i in range(20)], T0, timedelta(days=7)
    counted: dict[str, datetime] = {}
    for night in range(21):
        following = [now + timedelta(days=ahead) for ahead in range(1, 30)]
        counts = [NodeCount(name, name == "N13", counted.get(name)) for name in names]
        taken = run_nodes(counts, now, week, following)
        assert taken[0] == "N13"
        assert len(taken) <= 4, "an even share, and the exception"
        counted |= dict.fromkeys(taken, now)
        if night >= 6:
            assert len(counted) == len(names)
            assert min(counted.values()) > now - week
        now += timedelta(days=1)
