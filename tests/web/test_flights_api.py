"""What the station answers about flights: list, playback, curves, pictures, reports; and what it does not."""

from __future__ import annotations

import asyncio
import errno
import json
import os
import shutil
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.ground.flights import flight_index
from flightd.ground.flights.flight_index import FlightIndex
from flightd.ground.flights.flight_view import read_view
from flightd.ground.flights.flights import Flights
from flightd.ground.reading_process import MOST_WAITING, ReadingProcess
from flightd.runtime.within import Within
from flightd.vision.jpeg import jpeg_size
from tests.replay.synthetic_flight import write_flight
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until
from tests.web.served import Station, served

MANY = 60


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight with its summary, one without, and what is no log."""
    root = tmp_path_factory.mktemp("flights")
    (root / "judged").mkdir()
    write_flight(root / "judged")
    (root / "alone").mkdir()
    shutil.copy(root / "judged" / "flight.mcap", root / "alone" / "flight.mcap")
    (root / "odd.mcap").write_bytes(b"no log")
    return root


async def listed(station: Station, most_s: float = 60.0) -> dict[str, dict[str, Any]]:
    """Every row by its path, once all were read."""
    async with Within(most_s):
        while True:
            code, text = await station.ask("GET", "/api/flights")
            assert code == 200
            told = json.loads(text)
            if told["looked"] and not told["unread"]:
                return {row["path"]: row for row in told["rows"]}
            await asyncio.sleep(0.1)


async def asked(station: Station, path: str) -> Any:
    code, text = await station.ask("GET", path)
    assert code == 200, text
    return json.loads(text)


@in_real_time
async def test_a_flight_is_listed_played_and_plotted(folder: Path) -> None:
    async with served(folder=folder) as station:
        rows = await listed(station)
        assert rows.keys() == {"judged/flight.mcap", "alone/flight.mcap", "odd.mcap"}
        flight = rows["judged/flight.mcap"]["id"]
        told = await asked(station, f"/api/flights/{flight}")
        assert told["row"]["nodes_visited"] == 12
        played = told["flight"]
        assert played["floor"]["name"] == "demo"
        assert {moment["phase"] for moment in played["moments"]} >= {
            "take_off",
            "follow",
            "hover",
            "land",
            "done",
        }
        assert len(played["track"]["t_s"]) == len(played["track"]["x_m"]) > 1000
        assert played["truth"]["t_s"]
        series = await asked(station, f"/api/flights/{flight}/series?from=10&to=20&stretches=50")
        assert series["from_s"] == pytest.approx(10.05)
        assert {len(curve) for curve in series["curves"].values()} == {100}
        last_s = series["from_s"] + 99 * series["step_s"]
        assert last_s == pytest.approx(19.95, abs=0.01)
        whole = await asked(station, f"/api/flights/{flight}/series")
        assert len(whole["curves"]["height_m"]) == 1800


@in_real_time
async def test_whoever_knows_the_list_is_not_sent_it_again(folder: Path) -> None:
    async with served(folder=folder) as station:
        await listed(station)
        version = (await asked(station, "/api/flights"))["version"]
        assert (await asked(station, f"/api/flights?known={version}"))["rows"] is None
        for other in ("", "x", "-1", "9" * 6000):
            assert len((await asked(station, f"/api/flights?known={other}"))["rows"]) == 3


@in_real_time
async def test_a_new_flight_appears_in_the_list(folder: Path, tmp_path: Path) -> None:
    async with served(folder=tmp_path) as station:
        assert await listed(station) == {}
        shutil.copytree(folder / "judged", tmp_path / "new")
        deadline_s = asyncio.get_running_loop().time() + 60
        rows = await listed(station)
        while "new/flight.mcap" not in rows and asyncio.get_running_loop().time() < deadline_s:
            await asyncio.sleep(0.2)
            rows = await listed(station)
        assert rows["new/flight.mcap"]["outcome"] == "completed"


@in_real_time
async def test_a_flight_is_found_by_its_id_before_the_list_was_asked_for(folder: Path) -> None:
    async with served(folder=folder) as station:
        flight = (await listed(station))["alone/flight.mcap"]["id"]
    async with served(folder=folder) as station:
        told = await asked(station, f"/api/flights/{flight}")
        assert told["flight"]["estimated"]["cross_track_rms_m"] > 0


@in_real_time
async def test_pictures_come_one_by_one_behind_their_heads(folder: Path) -> None:
    async with served(folder=folder) as station:
        flight = (await listed(station))["judged/flight.mcap"]["id"]
        pictures = (await asked(station, f"/api/flights/{flight}"))["flight"]["pictures"]
        path, host = f"/api/flights/{flight}/pictures/4", f"{station.where.host}:{station.where.port}"
        said = await station.say(f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
        body = said.partition(b"\r\n\r\n")[2]
        length = int.from_bytes(body[:4], "big")
        head = json.loads(body[4 : 4 + length])
        assert head["seq"] == pictures[4]["seq"]
        assert len(head["lines"]) in {1, 2}
        assert body[4 + length :].startswith(b"\xff\xd8")
        small = f"GET /api/flights/{flight}/thumbnail HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        thumbnail = (await station.say(small.encode())).partition(b"\r\n\r\n")[2]
        assert (jpeg_size(thumbnail) or (0,))[0] == 160
        assert len(thumbnail) < 10_000
        for other in (str(len(pictures)), "-1", "x", "9" * 6000):
            assert (await station.ask("GET", f"/api/flights/{flight}/pictures/{other}"))[0] == 404


@in_real_time
async def test_a_flight_that_is_written_anew_is_told_apart_from_the_old_one(
    folder: Path, tmp_path: Path
) -> None:
    log = Path(shutil.copytree(folder / "alone", tmp_path / "alone")) / "flight.mcap"
    async with served(folder=tmp_path) as station:
        row = (await listed(station))["alone/flight.mcap"]
        told = await asked(station, f"/api/flights/{row['id']}")
        stamp, path = told["stamp"], f"/api/flights/{row['id']}/pictures/4"
        assert row["stamp"] == told["row"]["stamp"] == stamp
        assert "max-age" in await head_of(station, f"{path}?stamp={stamp}")
        head = await head_of(station, path)
        assert "private, no-cache" in head
        tag = next(line for line in head.splitlines() if line.lower().startswith("etag")).split(" ")[1]
        assert (await head_of(station, path, f"If-None-Match: {tag}")).startswith("HTTP/1.1 304")
        os.utime(log, (1e9, 1e9))
        async with Within(60):
            while (await listed(station))["alone/flight.mcap"]["stamp"] == stamp:  # noqa: ASYNC110
                await asyncio.sleep(0.2)
        assert (await asked(station, f"/api/flights/{row['id']}"))["stamp"] != stamp
        assert (await head_of(station, path, f"If-None-Match: {tag}")).startswith("HTTP/1.1 200")
        code, text = await station.ask("GET", f"{path}?stamp={stamp}")
        assert (code, json.loads(text)["refused"]) == (409, "the flight was written anew; open it again")


async def head_of(station: Station, path: str, *lines: str) -> str:
    host = f"{station.where.host}:{station.where.port}"
    words = (f"GET {path} HTTP/1.1", f"Host: {host}", *lines, "Connection: close", "", "")
    return (await station.say("\r\n".join(words).encode())).partition(b"\r\n\r\n")[0].decode()


class _CountingReader(ReadingProcess):
    """Reads here, and counts how often a whole log is read."""

    views = 0

    async def run(self, function: Any, within_s: float, *args: Any, **named: Any) -> Any:
        _CountingReader.views += function is read_view
        return function(*args, **named)


@in_real_time
async def test_a_log_that_is_being_recorded_is_not_read_anew_for_each_curve_and_picture(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_index, "_FRESH_S", 0.05)
    whole = (folder / "alone" / "flight.mcap").read_bytes()
    log, size = tmp_path / "flight.mcap", len(whole) // 2
    log.write_bytes(whole[:size])
    flights = Flights(tmp_path, _CountingReader)
    assert flights.index is not None
    _CountingReader.views = 0
    running = asyncio.ensure_future(flights.run())
    try:
        (row,) = await rows_of(flights.index, lambda row: row["running"])
        stamp = json.loads(await flights.head(row["id"]))["stamp"]
        for grown in (1000, 2000):
            log.write_bytes(whole[: size + grown])
            (row,) = await rows_of(flights.index, lambda row: row["bytes"] == size + grown)  # noqa: B023
            assert await flights.series(row["id"], 0.0, 5.0, 10)
            assert (await flights.picture(row["id"], 1, stamp)).content
        assert _CountingReader.views == 1
        assert json.loads(await flights.head(row["id"]))["stamp"] != stamp, "who opens it sees it as it is"
        log.write_bytes(whole)
        (row,) = await rows_of(flights.index, lambda row: not row["running"])
        assert await flights.series(row["id"], 0.0, 5.0, 10)
        assert _CountingReader.views == 3, "once more when it is whole"
    finally:
        running.cancel()
        await asyncio.wait([running])


async def rows_of(index: FlightIndex, that: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    def rows() -> list[dict[str, Any]]:
        return list(json.loads(index.listing())["rows"])

    await until(lambda: bool(rows()) and all(map(that, rows())))
    return rows()


OTHER_WAYS = (
    "/api/flights/../../etc/passwd", "/api/flights/..%2f..%2fetc%2fpasswd", "/api/flights/%2e%2e",
    "/api/flights/judged%2fflight.mcap", "/api/flights/0123456789abcdef", "/api/flights/%00",
    "/api/flights/x/report", "/api/flights/x/pictures/0", "/api/flights/x/pictures/-1",
    "/api/flights/x/series", "/static/../application.py", "/static/..%2fapplication.py",
    "/api/guide/pictures/../pages.py", "/api/guide/pictures/..%2fpages.py", "/api/guide/pages/..%2fpages",
)  # fmt: skip


@in_real_time
async def test_there_is_no_other_way_into_the_folder_or_out_of_it(folder: Path) -> None:
    async with served(folder=folder) as station:
        await listed(station)
        for path in OTHER_WAYS:
            code, text = await station.ask("GET", path)
            assert (code, "root:" in text, str(folder) in text) == (404, False, False), path


NO_STRETCHES = (
    "from=x", "to=", "from=9&to=3", "from=nan", "to=nan", "from=1e9", "stretches=0", "stretches=1e9",
    "stretches=2.5", "stretches=nan", "stretches=inf",
)  # fmt: skip


@in_real_time
async def test_a_stretch_that_is_none_is_refused(folder: Path) -> None:
    async with served(folder=folder) as station:
        flight = (await listed(station))["judged/flight.mcap"]["id"]
        for query in NO_STRETCHES:
            code, text = await station.ask("GET", f"/api/flights/{flight}/series?{query}")
            assert code == 404, query
            assert json.loads(text)["refused"]


@in_real_time
async def test_a_log_that_cannot_be_played_says_why(folder: Path) -> None:
    async with served(folder=folder) as station:
        odd = (await listed(station))["odd.mcap"]
        code, text = await station.ask("GET", f"/api/flights/{odd['id']}")
        assert (code, json.loads(text)) == (404, {"refused": odd["trouble"]})


@in_real_time
async def test_a_report_is_made_where_there_is_none_and_runs_as_nobodys_page(folder: Path) -> None:
    async with served(folder=folder) as station:
        flight = (await listed(station))["alone/flight.mcap"]["id"]
        head, page = await station.answer("GET", f"/api/flights/{flight}/report")
        assert head.startswith("HTTP/1.1 200")
        assert "Flight report" in page
        policy = next(
            line for line in head.splitlines() if line.lower().startswith("content-security-policy")
        )
        assert "sandbox allow-scripts;" in policy
        assert "default-src 'none'" in policy
        assert "connect-src" not in policy
        assert "allow-same-origin" not in policy
        assert not (folder / "alone" / "report.html").exists(), "the folder is only read"


@in_real_time
async def test_a_report_that_lies_there_is_shown_unless_the_log_is_newer(
    folder: Path, tmp_path: Path
) -> None:
    log = Path(shutil.copytree(folder / "alone", tmp_path / "alone")) / "flight.mcap"
    report = log.with_name("report.html")
    report.write_text("<title>the one that lies there</title>")
    async with served(folder=tmp_path) as station:
        flight = (await listed(station))["alone/flight.mcap"]["id"]
        assert "the one that lies there" in (await station.answer("GET", f"/api/flights/{flight}/report"))[1]
        later = time.time() + 60
        os.utime(log, (later, later))
        async with Within(60):
            while (
                "the one that lies there" in (await station.answer("GET", f"/api/flights/{flight}/report"))[1]
            ):
                await listed(station)
                await asyncio.sleep(0.5)


@in_real_time
async def test_foreign_pages_and_names_are_refused_as_everywhere(folder: Path) -> None:
    async with served(folder=folder) as station:
        for path in ("/api/flights", "/api/guide", "/api/flights/x/report"):
            assert (await station.ask("GET", path, {"Host": "evil.example"}))[0] == 403
            assert (await station.ask("GET", path, {"Origin": "http://evil.example"}))[0] == 403
            assert (await station.ask("GET", path, {"Origin": "null"}))[0] == 403, "what a report would send"
            assert (await station.ask("POST", path, {"Origin": station.origin}))[0] == 405


@in_real_time
async def test_a_station_without_a_folder_says_so() -> None:
    async with served() as station:
        assert await asked(station, "/api/flights") == {"folder": False}
        assert (await station.ask("GET", "/api/flights/0123456789abcdef"))[0] == 404


@in_real_time
async def test_many_logs_do_not_hold_up_the_loop(folder: Path, tmp_path: Path) -> None:
    for number in range(MANY):
        (tmp_path / f"{number:04}").mkdir()
        os.link(folder / "alone" / "flight.mcap", tmp_path / f"{number:04}" / "flight.mcap")
    async with served(folder=tmp_path) as station:
        await station.ask("GET", "/api/flights")
        held_s = []
        loop = asyncio.get_running_loop()
        async with Within(240):
            while True:
                began_s = loop.time()
                await asyncio.sleep(0.01)
                held_s.append(loop.time() - began_s - 0.01)
                if len(held_s) % 20:
                    continue  # it is listening that is measured, not asking
                told = json.loads((await station.ask("GET", "/api/flights?known=0"))[1])
                if told["rows"] is not None and len(told["rows"]) == MANY and not told["unread"]:
                    break
        assert sorted(held_s)[len(held_s) // 2] < 0.05
        assert {row["outcome"] for row in told["rows"]} == {"completed"}


@in_real_time
async def test_a_job_that_kills_or_blocks_its_process_costs_that_job_only() -> None:
    reading = ReadingProcess()
    try:
        assert await reading.run(abs, 60.0, -3) == 3
        with pytest.raises(TransientError, match="failed"):
            await reading.run(os._exit, 60.0, 1)
        assert await reading.run(abs, 60.0, -4) == 4
        with pytest.raises(TransientError, match="longer than"):
            await reading.run(_slept, 0.2, 60.0)
        assert await reading.run(abs, 60.0, -5) == 5
        with pytest.raises(UnavailableError, match="too large"):
            await reading.run(bytes, 60.0, 8 << 30)
        with pytest.raises(InputError, match="cannot open"):
            await reading.run(_opened, 60.0, "/gone.mcap")
    finally:
        reading.close()


def _opened(path: str) -> None:
    raise InputError("cannot open the flight log", file=path)


class _FallibleReader:
    """Reads here; one log costs it its life, whatever is read with it."""

    def __init__(self, deadly: str) -> None:
        self._deadly = deadly
        self.deaths = 0

    async def run(self, function: Any, within_s: float, *args: Any) -> Any:
        if any(self._deadly == log.relative for logs in args if isinstance(logs, tuple) for log in logs):
            self.deaths += 1
            raise TransientError("the process that reads logs failed")
        return function(*args)


@in_real_time
async def test_a_log_that_kills_its_reader_costs_no_other_log_its_row(folder: Path) -> None:
    reader = _FallibleReader("alone/flight.mcap")
    index = FlightIndex(folder, reader)
    running = asyncio.ensure_future(index.run())
    try:
        await until(lambda: json.loads(index.listing())["looked"])
        told = json.loads(index.listing())
    finally:
        running.cancel()
        await asyncio.wait([running])
    rows = {row["path"]: row for row in told["rows"]}
    assert rows["alone/flight.mcap"]["trouble"] == "the process that reads logs failed"
    assert rows["judged/flight.mcap"]["outcome"] == "completed"
    assert reader.deaths == 2, "with the others, and alone"


class _OddReader:
    """Fails as a system without file descriptors does, then reads here."""

    def __init__(self) -> None:
        self.failures = 1

    async def run(self, function: Any, within_s: float, *args: Any) -> Any:
        if self.failures:
            self.failures -= 1
            raise OSError(errno.EMFILE, "Too many open files")
        return function(*args)


@in_real_time
async def test_an_error_that_nobody_thought_of_ends_no_list(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(flight_index, "_FRESH_S", 0.05)
    index = FlightIndex(folder, _OddReader())
    running = asyncio.ensure_future(index.run())
    try:
        await until(lambda: json.loads(index.listing())["looked"] or running.done())
        told = json.loads(index.listing())
        assert "Too many open files" in told["trouble"]
        assert "the list of flights failed" in caplog.text
        await until(lambda: len(json.loads(index.listing())["rows"]) == 3)
        assert json.loads(index.listing())["trouble"] == ""
    finally:
        running.cancel()
        await asyncio.wait([running])


@in_real_time
async def test_the_list_has_another_version_only_for_what_is_new(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_index, "_FRESH_S", 0.02)
    shutil.copy(folder / "alone" / "flight.mcap", tmp_path / "a.mcap")
    reader = _OddReader()
    reader.failures = 0
    index = FlightIndex(tmp_path, reader)
    running = asyncio.ensure_future(index.run())
    try:
        await until(lambda: json.loads(index.listing())["looked"])
        version = json.loads(index.listing())["version"]
        for _ in range(3):
            assert await index.log("nowhere") is None
            await asyncio.sleep(0.05)
        assert json.loads(index.listing(version)) == {"version": version, "unread": 0, "rows": None}
        shutil.copy(folder / "alone" / "flight.mcap", tmp_path / "b.mcap")
        await until(lambda: len(json.loads(index.listing())["rows"]) == 2)
        assert json.loads(index.listing())["version"] > version
    finally:
        running.cancel()
        await asyncio.wait([running])


@in_real_time
async def test_a_process_that_cannot_be_started_is_told_and_started_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def none_left() -> None:
        raise OSError(errno.EMFILE, "Too many open files")

    reading = ReadingProcess()
    try:
        with monkeypatch.context() as patched:
            patched.setattr(socket, "socketpair", none_left)
            with pytest.raises(TransientError, match="does not start: Too many open files"):
                await reading.run(abs, 60.0, -1)
        assert await reading.run(abs, 60.0, -2) == 2
    finally:
        reading.close()


@in_real_time
async def test_more_jobs_than_may_wait_are_refused_and_a_cancelled_one_gives_no_answer_to_the_next() -> None:
    reading = ReadingProcess()
    try:
        slow = [asyncio.ensure_future(reading.run(_slept, 60.0, 0.001)) for _ in range(MOST_WAITING)]
        await asyncio.sleep(0)
        with pytest.raises(UnavailableError, match="too many"):
            await reading.run(abs, 60.0, -1)
        await asyncio.gather(*slow)
        hanging = asyncio.ensure_future(reading.run(_slept, 60.0, 0.5))
        await asyncio.sleep(0.2)
        hanging.cancel()
        with pytest.raises(asyncio.CancelledError):
            await hanging
        assert await reading.run(abs, 60.0, -6) == 6
    finally:
        reading.close()


def _slept(seconds: float) -> str:
    threading.Event().wait(seconds)
    return "slept"
