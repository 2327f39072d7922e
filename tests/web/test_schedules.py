"""Schedules over the station: kept, listed, refused; a run that is due starts a flight on the link, once."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.client import Address
from flightd.config.schema import load_config
from flightd.ground.access.roles import Role
from flightd.ground.messages import LinkPicture, PictureKey
from flightd.ground.schedules.night_shift import StationClock
from flightd.ground.schedules.schedule_book import FILE
from flightd.runtime.within import Within
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until
from tests.web.live_flight import LiveFlight
from tests.web.people_rig import audited, with_people
from tests.web.served import JSON, Station, served

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = replace(load_site(CONFIGS / "site-demo.toml"), unattended_start=True)
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={**BRISK, "autostart": False, "start_countdown_s": 0.0, "dwell_s": 0.2}
)
NOBODY = ("demo", Address("127.0.0.1", 1, 1))
TUESDAYS: Mapping[str, Any] = {
    "site": "demo", "name": " Aisle  A ", "drone": "demo", "count": {"kind": "aisles", "aisles": ["A"]},
    "weekdays": [2], "at": "22:00", "zone": "Europe/Berlin", "late_minutes": 60,
    "quiet": [{"begin": "06:00", "end": "20:00"}],
}  # fmt: skip


class Clock:
    """The time of day at the station, as a test sets it."""

    def __init__(self, at: str) -> None:
        self._was_read = asyncio.Event()
        self.set(at)

    def set(self, at: str) -> None:
        self.now = datetime.fromisoformat(at).replace(tzinfo=UTC)

        self.reads = 0

    @property
    def station(self) -> StationClock:
        return StationClock(self._read, step_s=0.02)

    def _read(self) -> int:
        self.reads += 1
        self._was_read.set()
        return int(self.now.timestamp()) * 10**9

    async def looked_at(self) -> None:
        """The station has looked at its schedules by this time."""
        enough = self.reads + 4
        while self.reads < enough:
            self._was_read.clear()
            await self._was_read.wait()


class Viewer:
    """What is told to who looks on without attending."""

    def __init__(self) -> None:
        self.told: dict[str, Any] = {}
        self._told_more = asyncio.Event()

    def attach(self, wake: Callable[[], object] | None) -> None:
        pass

    def tell(self, drone: str, topic: str, value: Any) -> None:
        del drone
        self.told[topic] = value
        self._told_more.set()

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        pass

    def has_use_for(self, key: PictureKey) -> bool:
        del key
        return False

    async def until(self, seen: Callable[[dict[str, Any]], bool]) -> None:
        """Until it is told so."""
        async with Within(60):
            while not seen(self.told):
                self._told_more.clear()
                await self._told_more.wait()

    @property
    def starts(self) -> int:
        """Starts that the drone took."""
        return sum(one.name == "command" and one.text.startswith("start") for one in self.told["events"])


async def ask(
    station: Station, method: str, way: str = "", by: Mapping[str, str] | None = None, **body: Any
) -> tuple[int, Any]:
    headers = {"Origin": station.origin, **JSON, **(by or {})}
    code, text = await station.ask(method, f"/api/schedules{way}", headers, json.dumps(body).encode())
    return code, json.loads(text)


async def run_is(station: Station, state: str, cause: str = "") -> dict[str, Any]:
    """The newest run of the schedule, once it is there."""
    async with Within(60):
        while True:
            _, told = await ask(station, "GET", "/schedule-1/runs")
            newest: dict[str, Any] = told["runs"][0] if told["runs"] else {"state": "", "cause": ""}
            if newest["state"] == state and cause in {"", newest["cause"]}:
                return newest
            print(told)
            await asyncio.sleep(0.02)


@in_real_time
async def test_schedules_are_kept_with_their_next_runs_and_one_clear_line_for_bad_input(
    tmp_path: Path,
) -> None:
    clock = Clock("2026-10-20T12:00")
    async with served(NOBODY, folder=tmp_path, clock=clock.station) as station:
        code, kept = await ask(station, "PUT", "/schedule-1", **TUESDAYS)
        assert (code, kept["name"]) == (200, "Aisle A")
        _, found = await ask(station, "GET", "?site=demo")
        (listed,) = found["schedules"]
        assert [one["at"] for one in listed["next"]][:2] == ["2026-10-20T20:00:00Z", "2026-10-27T21:00:00Z"]
        assert (await ask(station, "GET", "?site=elsewhere"))[1]["schedules"] == []
        bad: tuple[dict[str, Any], ...] = (
            {"at": "24:00"}, {"at": "22"}, {"zone": "Berlin"}, {"weekdays": [0]}, {"name": " "}, {"x": 1},
            {"count": {"kind": "everything"}}, {"count": {"kind": "aisles", "aisles": []}},
            {"late_minutes": 1}, {"quiet": [{"begin": "21:00", "end": "23:30"}]}, {"first": "soon"},
            {"every_days": 7, "first": "2026-01-05"}, {"count": {"kind": "all", "within_days": 0}},
            {"count": {"kind": "value", "nodes": 0}}, {"count": {"kind": "value", "nodes": 1, "aisles": 1}},
        )  # fmt: skip
        for wrong in bad:
            code, told = await ask(station, "PUT", "/schedule-2", **{**TUESDAYS, "name": "B", **wrong})
            assert code == 400, wrong
            assert "\n" not in told["refused"]
        code, told = await ask(station, "PUT", "/schedule-2", **TUESDAYS)
        assert (code, told["refused"]) == (409, "there is a schedule 'Aisle A' already; give another name")
        refused = {"refused": "an id has 8 to 64 characters"}
        assert await ask(station, "PUT", "/x", **{**TUESDAYS, "name": "B"}) == (400, refused)
        assert (await ask(station, "DELETE", "/schedule-1"))[0] == 200
        assert (await ask(station, "DELETE", "/schedule-1"))[0] == 404
    async with served(NOBODY) as station:
        assert await ask(station, "GET") == (200, {"kept": False, "schedules": [], "troubles": []})
        assert (await ask(station, "PUT", "/schedule-1", **TUESDAYS))[0] == 400


@in_real_time
async def test_an_operator_keeps_schedules_and_a_viewer_only_reads_them(tmp_path: Path) -> None:
    keys = {role: {"Authorization": f"Bearer {key}"} for role, key in with_people(tmp_path / "state").items()}
    async with served(NOBODY, folder=tmp_path, state=tmp_path / "state", login=True) as station:
        assert (await ask(station, "PUT", "/schedule-1", keys[Role.VIEWER], **TUESDAYS))[0] == 403
        assert (await ask(station, "PUT", "/schedule-1", keys[Role.OPERATOR], **TUESDAYS))[0] == 200
        assert (await ask(station, "GET", "", keys[Role.VIEWER]))[0] == 200
        assert (await ask(station, "DELETE", "/schedule-1", keys[Role.VIEWER]))[0] == 403
        assert (await ask(station, "GET"))[0] == 401
    lines = [line for line in audited(tmp_path / "state") if line["target"].startswith("/api/schedules")]
    assert [(line["outcome"], line["role"]) for line in lines] == [
        ("refused", "viewer"), ("accepted", "operator"), ("refused", "viewer"),
    ]  # fmt: skip


@in_real_time
async def test_a_run_that_is_due_starts_one_flight_however_the_clock_jumps_and_the_station_restarts(
    tmp_path: Path,
) -> None:
    clock, state = Clock("2026-10-20T12:00"), tmp_path / "state"
    with LiveFlight(SITE, CONFIG, speed=1.0) as flight:
        status, command = flight.ports
        drone, viewer = ("demo", Address("127.0.0.1", status, command)), Viewer()
        async with served(
            drone, folder=tmp_path, state=state, viewers=[viewer], clock=clock.station
        ) as station:
            assert (await ask(station, "PUT", "/schedule-1", **TUESDAYS))[0] == 200
            await viewer.until(lambda told: "status" in told)
            assert not viewer.told["link"].attends
            clock.set("2026-10-20T20:00")
            run = await run_is(station, "started")
            assert run["nodes"][0].startswith("A")
            await viewer.until(lambda told: told["status"].phase not in {"preflight", "arming"})
            await viewer.until(lambda told: told["link"].attends)
            for jumped in ("2026-10-20T19:30", "2026-10-20T20:10", "2026-10-22T20:00", "2026-10-20T20:05"):
                clock.set(jumped)
                await clock.looked_at()
        again = Viewer()
        async with served(
            drone, folder=tmp_path, state=state, viewers=[again], clock=clock.station
        ) as station:
            await again.until(lambda told: "link" in told and told["link"].attends)
            await clock.looked_at()
            _, told = await ask(station, "GET", "/schedule-1/runs")
            assert [(one["day"], one["state"]) for one in told["runs"]] == [("2026-10-20", "started")]
            assert (again.starts, again.told["status"].plan) == (1, run["plan"])
        starts = [line for line in audited(state) if line["person"] == "schedule Aisle A"]
        assert [(line["outcome"], line["by"], line["id"]) for line in starts] == [
            ("accepted", "schedule", run["plan"])
        ]


@in_real_time
async def test_where_the_site_file_does_not_allow_it_nothing_starts_and_it_is_told_as_missed(
    tmp_path: Path,
) -> None:
    clock, viewer = Clock("2026-10-20T12:00"), Viewer()
    with LiveFlight(replace(SITE, unattended_start=False), CONFIG) as flight:
        status, command = flight.ports
        drone = ("demo", Address("127.0.0.1", status, command))
        async with served(drone, folder=tmp_path, viewers=[viewer], clock=clock.station) as station:
            assert (await ask(station, "PUT", "/schedule-1", **TUESDAYS))[0] == 200
            clock.set("2026-10-20T20:00")
            waits = await run_is(station, "waiting", "rules")
            assert waits["why"] == "the site file of demo does not say unattended_start = true"
            await viewer.until(lambda told: told["link"].attends)
            clock.set("2026-10-20T21:00")
            missed = await run_is(station, "missed")
            assert (missed["cause"], missed["why"]) == ("rules", waits["why"])
            assert flight.phase == "preflight"
            await viewer.until(lambda told: not told["link"].attends)
            await until(lambda: flight.quiet_s == 0.0, 60)
            for _ in range(25):
                await asyncio.sleep(0.02)
                assert flight.quiet_s == 0.0, "nobody is missed who attended a start that did not come"


@in_real_time
async def test_one_that_cannot_be_read_is_told_beside_the_others_and_can_be_deleted(tmp_path: Path) -> None:
    clock = Clock("2026-10-20T12:00")
    async with served(NOBODY, folder=tmp_path, clock=clock.station) as station:
        for number, name in ((1, "Aisle A"), (2, "Damaged")):
            assert (await ask(station, "PUT", f"/schedule-{number}", **{**TUESDAYS, "name": name}))[0] == 200
        with sqlite3.connect(tmp_path / FILE) as file:
            file.execute("UPDATE schedule SET kept = '{}' WHERE id = 'schedule-2'")
        _, listed = await ask(station, "GET")
        assert [one["id"] for one in listed["schedules"]] == ["schedule-1"]
        (trouble,) = listed["troubles"]
        assert (trouble["id"], trouble["name"]) == ("schedule-2", "Damaged")
        assert trouble["why"].startswith("cannot be read: Object missing required field")
        _, calendar = await ask(station, "GET", "/calendar?from=2026-10-20&days=1")
        assert (len(calendar["runs"]), calendar["troubles"]) == (1, [trouble])
        assert (await ask(station, "DELETE", "/schedule-2"))[0] == 200
        assert (await ask(station, "GET"))[1]["troubles"] == []
