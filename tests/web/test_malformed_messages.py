"""Malformed messages by the thousand over real sockets to a station in a process of its own: each one is
refused, nothing escapes, and it serves on.

`FLIGHTD_GROUND_FUZZ` says how many (10000: the whole); from `FLIGHTD_GROUND_FUZZ_FROM` on.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.web.chromium import station
from tests.web.malformed import Malformed, Station, b64, malformed, opening
from tests.web.people_rig import PASSWORD, audited, with_people
from tests.web.stock_rig import counted_store

MESSAGES = int(os.environ.get("FLIGHTD_GROUND_FUZZ", "600"))
FIRST = int(os.environ.get("FLIGHTD_GROUND_FUZZ_FROM", "0"))
_AT_ONCE = 16
_PATIENCE_S = 60.0
CLOSED_AS_REFUSED = {1002, 1003, 1007, 1008, 1009}


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    with_people(tmp_path)
    counted_store(tmp_path / "monday")
    with station(["demo=127.0.0.1:1/1"], folder=tmp_path, state=tmp_path, options=["--login"]) as url:
        yield url


def admitted(url: str) -> Station:
    """The station, and the cookie of somebody who may everything."""
    body = json.dumps({"name": "ada", "password": PASSWORD}).encode()
    headers = {"Origin": url, "Content-Type": "application/json"}
    request = urllib.request.Request(f"{url}/api/session", body, headers)
    with urllib.request.urlopen(request, timeout=_PATIENCE_S) as answer:
        return Station(url.removeprefix("http://"), url, answer.headers["Set-Cookie"].split(";")[0])


@pytest.mark.timeout(60 + MESSAGES)
def test_malformed_messages_are_refused_and_the_station_serves_on(url: str, tmp_path: Path) -> None:
    known = admitted(url)
    refused: dict[str, int] = {}
    wrong: list[tuple[int, str, str, str]] = []

    @in_real_time
    async def send_them() -> None:
        slots = asyncio.Semaphore(_AT_ONCE)

        async def send(number: int) -> None:
            message = malformed(number, known)
            async with slots:
                outcome = await answer_to(message, known)
            if outcome not in ({"refused"} if message.refused else {"refused", "taken"}):
                wrong.append((number, message.kind, outcome, b64(message.data)))
            refused[message.kind] = refused.get(message.kind, 0) + (outcome == "refused")

        async with asyncio.TaskGroup() as tasks:
            for number in range(FIRST, FIRST + MESSAGES):
                tasks.create_task(send(number))

    send_them()
    assert wrong == []
    assert sum(refused.values()) > 0.9 * MESSAGES
    assert len(refused) > 25, "every kind was sent"
    with urllib.request.urlopen(url, timeout=_PATIENCE_S) as page:
        assert page.status == 200
    assert admitted(url).cookie != known.cookie
    accepted = {(line["act"], line["person"]) for line in audited(tmp_path) if line["outcome"] == "accepted"}
    assert accepted == {("sign in", "ada")}, "no malformed message has done anything"


async def answer_to(message: Malformed, known: Station) -> str:
    """`refused`, `taken`, or `escaped` where the station itself went wrong."""
    host, _, port = known.host.partition(":")
    async with Within(_PATIENCE_S):
        reader, writer = await asyncio.open_connection(host, int(port))
        try:
            if message.over_socket:
                writer.write(opening(known))
                head = await reader.readuntil(b"\r\n\r\n")
                assert b" 101 " in head, head
            with contextlib.suppress(ConnectionError):
                writer.write(message.data)
                writer.write_eof()
                await writer.drain()
            heard = b""
            with contextlib.suppress(ConnectionError):
                while part := await reader.read(65536):
                    heard += part
        finally:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
    if b"Traceback" in heard:
        return "escaped"
    return closed(heard) if message.over_socket else answered(heard)


def answered(heard: bytes) -> str:
    """What the answers to a request say; one that gets none was hung up on."""
    codes = [int(code) for code in re.findall(rb"HTTP/1\.1 (\d{3}) ", heard)]
    if any(code >= 500 for code in codes):
        return "escaped"
    return "taken" if any(code < 400 for code in codes) else "refused"


def closed(heard: bytes) -> str:
    """What the station's frames say at last: its own close, or the mere end of the connection."""
    while len(heard) >= 2:
        opcode, length, at = heard[0] & 15, heard[1] & 127, 2
        if length >= 126:
            width = 2 if length == 126 else 8
            length, at = int.from_bytes(heard[2 : 2 + width], "big"), 2 + width
        if opcode == 8:
            code = int.from_bytes(heard[at : at + 2], "big")
            if code in {1011, 1000}:
                return "escaped" if code == 1011 else "taken"
            return "refused" if code in CLOSED_AS_REFUSED else f"closed with {code}"
        heard = heard[at + length :]
    return "refused"
