"""Missions over the station: kept, checked and estimated by the drone, flown by it, and what is left."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.config.schema import load_config
from flightd.core.errors import InputError, RunError
from flightd.core.types import Phase
from flightd.ground.missions.mission_book import FILE, Mission, MissionBook
from flightd.site.site_file import load_site
from tests.rigs.event_loops import in_real_time
from tests.web.live_flight import LiveFlight
from tests.web.served import JSON, Station, served, told

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={"autostart": False, "start_countdown_s": 0.0, "dwell_s": 0.2}
)
NOBODY = ("demo", Address("127.0.0.1", 1, 1))
ONE = Mission("mission-1", "demo", "Aisle A", ("A1", "A2"), (1,))


async def ask(station: Station, method: str, way: str, **body: Any) -> tuple[int, Any]:
    headers = {"Origin": station.origin, **JSON}
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
        assert (await ask(station, "PUT", "/x", **good))[0] == 400
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
async def test_a_mission_goes_from_the_station_to_a_drone_that_flies_it_and_the_rest_after_a_cut(
    tmp_path: Path,
) -> None:
    nodes = ["A2", "A4", "A3"]
    with LiveFlight(SITE, CONFIG, speed=6.0) as flight:
        status, command = flight.ports
        address = Address("127.0.0.1", status, command)
        async with served(("demo", address), folder=tmp_path) as station, station.page() as page:
            welcome = await told(page, "welcome")
            site, session = welcome["floor"]["name"], welcome["session"]
            await ask(station, "PUT", "/mission-1", site=site, name="Three", nodes=nodes)
            query = urlencode([("drone", "demo"), ("best", "1"), *(("node", node) for node in nodes)])
            code, best = await ask(station, "GET", f"/estimate?{query}")
            assert code == 200
            assert sorted(best["nodes"]) == sorted(nodes)
            assert best["seconds"] > 10
            assert best["batteries"] == 1
            code, said = await ask(station, "GET", "/estimate?drone=demo&node=A2&node=nowhere")
            assert (code, said["refused"]) == (404, f"no node nowhere on site {site}")

            given = {"drone": "demo", "nodes": nodes, "mission": "mission-1", "session": session}
            code, said = await ask(station, "POST", "/fly", id="plan-0001", **{**given, "nodes": ["nowhere"]})
            assert (code, "no node nowhere" in said["refused"]) == (400, True)
            code, taken = await ask(station, "POST", "/fly", id="plan-0001", **given)
            assert (code, taken["nodes"]) == (200, nodes)
            while (plan := await told(page, "plan"))["id"] != "plan-0001":
                pass
            assert plan["remaining"] == nodes
            await asyncio.sleep(1.0)
            assert flight.phase is Phase.PREFLIGHT, "handing a plan over starts nothing"

            code, text = await station.act("demo", id="start-0001", command="start", plan="plan-0001")
            assert code == 200, text
            while (plan := await told(page, "plan", within_s=60))["visited"] != ["A2", "A4"]:
                assert plan["visited"] in ([], ["A2"])
            assert (await ask(station, "POST", "/fly", id="plan-0002", **given))[0] == 409
            await station.act("demo", id="land-00001", command="land")
            while (await told(page, "status", within_s=60))["phase"] not in {"aborted", "done"}:
                pass
            await asyncio.sleep(0.3)
            (kept,) = (await ask(station, "GET", f"?site={site}"))[1]["missions"]
            assert kept["remaining"] == ["A3"]
    with LiveFlight(SITE, CONFIG, speed=6.0) as flight:
        status, command = flight.ports
        address = Address("127.0.0.1", status, command)
        async with served(("demo", address), folder=tmp_path) as station, station.page() as page:
            await told(page, "welcome")
            rest = {"drone": "demo", "nodes": kept["remaining"], "mission": "mission-1"}
            assert (await ask(station, "POST", "/fly", id="plan-0003", **rest))[0] == 200
            await station.act("demo", id="start-0002", command="start", plan="plan-0003")
            while (await told(page, "plan", within_s=60))["visited"] != ["A3"]:
                pass
            await asyncio.sleep(0.3)
            (kept,) = (await ask(station, "GET", f"?site={site}"))[1]["missions"]
            assert kept["remaining"] == []
