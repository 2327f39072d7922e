"""Missions over the station: kept, checked and estimated by the drone, flown by it, and what is left."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.config.schema import load_config
from flightd.core.errors import InputError, RunError
from flightd.ground.access.roles import Role
from flightd.ground.missions.mission_book import FILE, Mission, MissionBook
from flightd.runtime.within import Within
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.rigs.event_loops import in_real_time
from tests.web.live_flight import LiveFlight
from tests.web.people_rig import audited, with_people
from tests.web.served import JSON, Station, served, told
from tests.web.stock_rig import RACKS, counted_store, flown_log

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={**BRISK, "autostart": False, "start_countdown_s": 0.0, "dwell_s": 0.2}
)
NOBODY = ("demo", Address("127.0.0.1", 1, 1))
ONE = Mission("mission-1", "demo", "Aisle A", ("A1", "A2"), (1,))


async def ask(
    station: Station, method: str, way: str, by: Mapping[str, str] | None = None, /, **body: Any
) -> tuple[int, Any]:
    headers = {"Origin": station.origin, **JSON, **(by or {})}
    code, text = await station.ask(method, f"/api/missions{way}", headers, json.dumps(body).encode())
    return code, json.loads(text)


def test_a_mission_is_kept_renamed_changed_and_deleted(tmp_path: Path) -> None:
    book = MissionBook(tmp_path)
    assert book.missions("demo") == []
    book.keep(ONE)
    assert book.missions("demo") == [ONE]
    assert book.missions("elsewhere") == []
    book.keep(replace(ONE, name="Renamed"))
    assert [mission.name for mission in MissionBook(tmp_path).missions("demo")] == ["Renamed"]
    book.delete(ONE.id)
    assert book.missions("demo") == []
    with pytest.raises(InputError, match="no such mission"):
        book.delete(ONE.id)


def test_two_missions_of_a_site_never_have_one_name(tmp_path: Path) -> None:
    book = MissionBook(tmp_path)
    book.keep(ONE)
    with pytest.raises(RunError, match="already"):
        book.keep(replace(ONE, id="mission-2"))
    book.keep(replace(ONE, id="mission-2", site="elsewhere"))
    assert len(book.missions("demo")) == 1


def test_what_is_left_is_that_of_the_newest_flight_and_of_the_nodes_that_were_flown(tmp_path: Path) -> None:
    book = MissionBook(tmp_path)
    book.keep(ONE)
    book.handed_over(ONE.id, "plan-0001", ONE.nodes, 5)
    book.left("plan-0001", ["A2"])
    book.left("plan-of-nobody", [])
    (flown,) = book.missions("demo")
    assert (flown.remaining, flown.flown_ns, flown.plan) == (("A2",), 5, "plan-0001")
    book.handed_over(ONE.id, "plan-0002", ["A2"], 6)
    book.left("plan-0001", ["A1", "A2"])
    assert book.missions("demo")[0].remaining == ("A2",), "an old flight says nothing of the new one"
    book.left("plan-0002", [])
    assert book.missions("demo")[0].remaining == (), "the rest is flown"
    book.handed_over(ONE.id, "plan-0003", ["A2"], 7)
    assert book.keep(replace(ONE, name="Renamed")).remaining == ("A2",)
    assert book.keep(replace(ONE, nodes=("A3",))).remaining == ()


def test_a_file_of_another_program_is_refused_and_left_alone(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / FILE) as other:
        other.execute("CREATE TABLE theirs (a)")
    before = (tmp_path / FILE).read_bytes()
    with pytest.raises(InputError, match="not the missions"):
        MissionBook(tmp_path).missions("demo")
    assert (tmp_path / FILE).read_bytes() == before


@in_real_time
async def test_missions_are_kept_over_http_with_one_clear_line_for_bad_input(tmp_path: Path) -> None:
    good = {"site": "demo", "name": " Aisle  A ", "nodes": ["A1", "A2", "A1"], "levels": [1]}
    async with served(NOBODY, folder=tmp_path) as station:
        code, kept = await ask(station, "PUT", "/mission-1", **good)
        assert (code, kept["name"], kept["nodes"]) == (200, "Aisle A", ["A1", "A2"])
        code, found = await ask(station, "GET", "?site=demo")
        assert [mission["id"] for mission in found["missions"]] == ["mission-1"]
        bad: tuple[dict[str, Any], ...] = (
            {"nodes": []}, {"name": ""}, {"name": "  "}, {"levels": [0]}, {"site": ""}, {"x": 1},
            {"nodes": ["n"] * 501}, {"nodes": [1]}, {"name": "n" * 81},
         )  # fmt: skip
        for wrong in bad:
            code, said = await ask(station, "PUT", "/mission-2", **{**good, **wrong})
            assert code == 400, wrong
            assert "\n" not in said["refused"]
        assert (await ask(station, "PUT", "/mission-2", **good))[0] == 409
        refused = {"refused": "an id has 8 to 64 characters"}
        assert await ask(station, "PUT", "/x", **good) == (400, refused)
        code, _ = await station.ask("PUT", "/api/missions/mission-3", JSON, json.dumps(good).encode())
        assert code == 403, "a page of another origin changes nothing"
        assert (await ask(station, "DELETE", "/mission-1"))[0] == 200
        assert (await ask(station, "DELETE", "/mission-1"))[0] == 404
        assert (await ask(station, "GET", "/estimate?drone=nobody&node=A1"))[0] == 404
        assert (await ask(station, "GET", "/estimate?drone=demo&node=A1"))[0] == 503


@in_real_time
async def test_without_a_folder_missions_are_not_kept_and_it_says_how(tmp_path: Path) -> None:
    async with served(NOBODY) as station:
        assert (await ask(station, "GET", "?site=demo"))[1] == {"kept": False, "missions": []}
        code, said = await ask(station, "PUT", "/mission-1", site="demo", name="A", nodes=["A1"])
        assert code == 400
        assert "--folder" in said["refused"]


@in_real_time
async def test_places_to_count_again_are_told_with_what_sees_them_and_the_site_they_are_of(
    tmp_path: Path,
) -> None:
    counted_store(tmp_path / "monday")
    asked = {"store": "monday", "places": ["AL-01-2-1", "AL-02-1-1", "AL-01-2-1", "nowhere"]}
    async with served(NOBODY, folder=tmp_path) as station:
        code, found = await ask(station, "POST", "/recount", **asked)
        assert (code, found) == (
            200, {"site": "", "nodes": ["A1"], "levels": [1, 2], "without": ["nowhere"]}
        )  # fmt: skip
        flown_log(tmp_path / "monday" / "flight.mcap", RACKS)
        assert (await ask(station, "POST", "/recount", **asked))[1]["site"] == RACKS.name
        bad: tuple[dict[str, Any], ...] = (
            {"places": []}, {"store": "none"}, {"places": ["A"] * 20_001}, {"more": 1}
        )  # fmt: skip
        for wrong in bad:
            code, said = await ask(station, "POST", "/recount", **{**asked, **wrong})
            assert code == 400, wrong
            assert "\n" not in said["refused"]


@in_real_time
async def test_a_viewer_looks_on_and_what_an_operator_changes_is_written_down(tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    good = {"site": "demo", "name": "Aisle A", "nodes": ["A1"]}
    handed = {"id": "plan-0001", "drone": "demo", "nodes": ["A1", "A2"]}
    async with served(NOBODY, folder=tmp_path, state=tmp_path, login=True) as station:
        for role, statuses in ((Role.VIEWER, (403, 403, 403)), (Role.OPERATOR, (200, 200, 503))):
            by = {"Authorization": f"Bearer {keys[role]}"}
            codes = [
                (await ask(station, method, way, by, **body))[0]
                for method, way, body in (
                    ("PUT", "/mission-1", good), ("DELETE", "/mission-1", {}), ("POST", "/fly", handed)
                )
            ]  # fmt: skip
            assert tuple(codes) == statuses, role
            assert (await ask(station, "GET", "?site=demo", by))[0] == 200
    lines = [(line["person"], line["act"], line["outcome"], line["text"]) for line in audited(tmp_path)]
    assert [line[:3] for line in lines[:3]] == [
        ("program-viewer", act, "refused") for act in ("PUT", "DELETE", "POST")
    ]
    assert lines[3:] == [
        ("program-operator", "PUT", "accepted", "Aisle A of demo; HTTP 200"),
        ("program-operator", "DELETE", "accepted", "HTTP 200"),
        ("program-operator", "POST", "refused", "plan plan-0001 for demo: A1, A2; HTTP 503"),
    ]


async def heard(station: Station, method: str, way: str, **body: Any) -> tuple[int, Any]:
    """What the drone answers; asked again while a slow machine lets it say nothing."""
    async with Within(60):
        while (said := await ask(station, method, way, **body))[0] == 503:
            pass
    return said


async def remaining_is(station: Station, site: str, nodes: list[str]) -> None:
    """Wait until the kept mission says that this is left of it."""
    for _ in range(600):
        left = (await ask(station, "GET", f"?site={site}"))[1]["missions"][0]["remaining"]
        if left == nodes:
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"{left} is left")


@in_real_time
async def test_a_mission_goes_from_the_station_to_a_drone_that_flies_it_and_what_a_cut_leaves_is_kept(
    tmp_path: Path,
) -> None:
    nodes = ["A2", "A3", "B3"]  # the last one far away: the landing has to be heard before it
    with LiveFlight(SITE, CONFIG, speed=1.0) as flight:
        status, command = flight.ports
        address = Address("127.0.0.1", status, command)
        async with served(("demo", address), folder=tmp_path) as station, station.page() as page:
            welcome = await told(page, "welcome", within_s=60)
            site, session = welcome["floor"]["name"], welcome["session"]
            await ask(station, "PUT", "/mission-1", site=site, name="Three", nodes=nodes)
            query = urlencode([("drone", "demo"), ("best", "1"), *(("node", node) for node in nodes)])
            code, best = await heard(station, "GET", f"/estimate?{query}")
            assert (code, sorted(best["nodes"]), best["batteries"]) == (200, sorted(nodes), 1)
            assert best["seconds"] > 10
            code, said = await heard(station, "GET", "/estimate?drone=demo&node=A2&node=nowhere")
            assert (code, said["refused"]) == (404, f"no node nowhere on site {site}")

            given = {"drone": "demo", "nodes": nodes, "mission": "mission-1", "session": session}
            nowhere = {**given, "id": "plan-0001", "nodes": ["nowhere"]}
            code, said = await heard(station, "POST", "/fly", **nowhere)
            assert (code, "no node nowhere" in said["refused"]) == (400, True)
            code, taken = await heard(station, "POST", "/fly", id="plan-0001", **given)
            assert (code, taken["nodes"]) == (200, nodes)
            while (plan := await told(page, "plan", within_s=60))["id"] != "plan-0001":
                pass
            assert plan["remaining"] == nodes
            stands_ns = (await told(page, "status", within_s=60))["stamp_ns"]
            while (seen := await told(page, "status", within_s=60))["stamp_ns"] < stands_ns + 500_000_000:
                pass
            assert seen["phase"] == "preflight", "handing a plan over starts nothing"

            code, text = await station.act("demo", id="start-0001", command="start", plan="plan-0001")
            assert code == 200, text
            flight.pace(8.0)
            while (plan := await told(page, "plan", within_s=60))["visited"] != ["A2", "A3"]:
                assert plan["visited"] in ([], ["A2"])
                if plan["visited"]:
                    flight.pace(2.0)
            assert (await heard(station, "POST", "/fly", id="plan-0002", **given))[0] == 409
            await station.act("demo", id="land-00001", command="land")
            while (await told(page, "status", within_s=60))["phase"] not in {"aborted", "done"}:
                pass
            await remaining_is(station, site, ["B3"])
