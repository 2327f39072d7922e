"""Whatever strangers send to the station: it is refused, nothing escapes, and the next page is served."""

from __future__ import annotations

import asyncio
import json
import logging
import random
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.core.errors import InputError
from flightd.ground.messages import read_act, read_page_message
from tests.fuzz.mutate import spoil_bytes, spoil_text
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.web.served import JSON, Station, ending, served, told
from tests.web.stock_rig import counted_store

NOBODY = ("demo", Address("127.0.0.1", 1, 1))
REQUESTS, ACTS, MESSAGES = 300, 200, 150
_AT_ONCE = 20
BOOKS = "place;code\nAL-01-1-1;340123450002439853\n"
PAGE_WORDS = (
    '{"say":"want","pictures":[{"drone":"demo","camera":"down"}]}',
    '{"say":"drawn"}',
    '{"say":"echo","number":1.5}',
    '{"say":"act","number":1,"drone":"nobody","act":{"id":"12345678","command":"stop"}}',
)  # fmt: skip
MARKS = '{"regions":[{"paint":true,"box":[1,2,30,40]},{"paint":false,"stroke":[[1,2],[3,4]],"width":9}]}'
PROPOSAL = '{"base":"0123456789abcdef","changes":{"mission.height_m":1.5,"scan.pictures":null}}'
ACT_WORDS = ('{"id":"12345678","command":"goto","node":"A4"}', '{"id":"12345678","command":"stop"}')


def requests(station: Station, draw: random.Random) -> list[bytes]:
    """What might be a request, and is none of ours."""
    host = f"{station.where.host}:{station.where.port}"
    whole = [
        f"GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n",
        f"GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n",
        f"POST /drones/demo/acts HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(ACT_WORDS[0])}\r\n\r\n{ACT_WORDS[0]}",
        f"GET /api/stock/find?store=monday&text=%2800%29340123450002439853 HTTP/1.1\r\nHost: {host}\r\n"
        "Connection: close\r\n\r\n",
        f"POST /api/stock/compare?store=monday&place=0&code=1&quantity=&heading=yes HTTP/1.1\r\n"
        f"Host: {host}\r\nOrigin: {station.origin}\r\nContent-Type: application/octet-stream\r\n"
        f"Content-Length: {len(BOOKS)}\r\nConnection: close\r\n\r\n{BOOKS}",
        f"PUT /api/studio/sets/hall/pictures/a.jpg HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(MARKS)}\r\n\r\n{MARKS}",
        f"GET /api/doctor/demo/report HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n",
        *(
            f"POST /api/doctor/demo/{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(PROPOSAL)}\r\n\r\n{PROPOSAL}"
            for path in ("settings", "check")
        ),
    ]
    corpus = [request.encode() for request in whole]
    made = [spoil_bytes(draw, corpus) for _ in range(REQUESTS)]
    return [*made, b"\x00" * 4096, b"\x16\x03\x01\x02\x00", b"A" * 200_000, b"GET / HTTP/9.9\r\n\r\n"]


@in_real_time
async def test_malformed_requests_are_refused_and_the_next_page_is_served(
    caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    draw = random.Random(1)
    counted_store(tmp_path / "monday")
    async with served(NOBODY, folder=tmp_path) as station:
        made = requests(station, draw)
        for first in range(0, len(made), _AT_ONCE):
            answers = await asyncio.gather(
                *(station.say(data, 0.3) for data in made[first : first + _AT_ONCE])
            )
            for answer in answers:
                assert b"Traceback" not in answer
                assert not answer.startswith(b"HTTP/1.1 500"), answer
        async with station.page() as page:
            assert (await told(page, "station", ""))["browsers"] == 1
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []


@in_real_time
async def test_malformed_acts_never_reach_the_flight() -> None:
    draw = random.Random(2)
    async with serving(local()) as link, served(("demo", address_of(link))) as station, telling(link):
        headers = {"Origin": station.origin, **JSON}
        for _ in range(ACTS // _AT_ONCE):
            bodies = [broken(read_act, ACT_WORDS, draw) for _ in range(_AT_ONCE)]
            answers = await asyncio.gather(
                *(station.ask("POST", "/drones/demo/acts", headers, body) for body in bodies)
            )
            for code, text in answers:
                assert code == 400, text
                assert json.loads(text)["refused"]
        assert link.take_commands() == []
        assert (await station.act("demo", id="12345678", command="pause"))[0] == 200


@in_real_time
async def test_malformed_words_end_that_page_and_no_other(caplog: pytest.LogCaptureFixture) -> None:
    draw = random.Random(3)
    async with served(NOBODY) as station, station.page() as good:
        await told(good, "station", "")
        for _ in range(MESSAGES):
            words = broken(read_page_message, PAGE_WORDS, draw)
            async with station.page() as page:
                await page.send(words.decode() if _is_text(words) and draw.random() < 0.7 else words)
                assert await ending(page) in {1007, 1008, 1009}
        await good.send(PAGE_WORDS[2])
        assert (await told(good, "echo", ""))["number"] == 1.5
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []


def broken(read: Callable[[bytes], object], words: Sequence[str], draw: random.Random) -> bytes:
    """Words that are none of ours any more."""
    corpus = [word.encode() for word in words]
    while True:
        made = spoil_text(draw, corpus)
        try:
            read(made)
        except InputError:
            return made


def _is_text(words: bytes) -> bool:
    try:
        return bool(words.decode())
    except UnicodeDecodeError:
        return False
