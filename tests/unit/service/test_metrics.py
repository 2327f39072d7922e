"""The metrics as Prometheus would scrape them, over a real socket."""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import math
import threading
from collections.abc import Awaitable, Callable

import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families
from pydantic import ValidationError

from flightd.adapters.metrics.metrics import MetricsBook
from flightd.adapters.metrics.server import MetricsServer
from flightd.config.metrics import MetricsConfig
from flightd.core.errors import UnavailableError
from flightd.core.types import Event, EventLevel, Phase
from tests.rigs.event_loops import real
from tests.unit.service.vitals import START_NS, vitals


def scraped(book: MetricsBook) -> dict[tuple[str, str], float]:
    """(name, label values in the order of the labels' names) -> value, through the reference parser."""
    return {
        (sample.name, ",".join(value for _, value in sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(generate_latest(book.registry).decode())
        for sample in family.samples
    }


def test_what_the_daemon_tells_can_be_scraped() -> None:
    book = MetricsBook()
    stages = ({"detection": 8.0, "total": 71.0}, {"detection": 9.0, "total": 250.0})
    book.tell(
        vitals(late_s=(0.0001, 0.03, -0.001), latencies_ms=stages, dropped={"camera": 3, "recorder": 7})
    )
    book.event(Event(1, EventLevel.WARNING, "phase", "..."))
    found = scraped(book)
    assert found["flightd_stage_seconds_count", "total"] == 2
    assert found["flightd_stage_seconds_sum", "total"] == pytest.approx(0.321)
    assert found["flightd_stage_seconds_bucket", "0.08,total"] == 1
    assert found["flightd_tick_late_seconds_count", ""] == 3
    assert found["flightd_tick_late_seconds_bucket", "0.02"] == 2
    assert found["flightd_phase", Phase.FOLLOW.value] == 1
    assert sum(value for (name, _), value in found.items() if name == "flightd_phase") == 1
    assert found["flightd_dropped_total", "camera"] == 3
    assert found["flightd_dropped_total", "recorder"] == 7
    assert found["flightd_events_total", "warning,phase"] == 1
    assert found["flightd_battery_ratio", ""] == pytest.approx(0.81)
    assert found["flightd_frames_total", ""] == 300


def test_before_the_first_tick_and_without_a_vehicle_it_can_be_scraped_too() -> None:
    book = MetricsBook()
    assert ("flightd_frames_total", "") not in scraped(book)
    book.tell(vitals(heard_ns=None))
    assert scraped(book)["flightd_armed", ""] == 0


def test_a_number_that_is_none_is_told_as_such() -> None:
    book = MetricsBook()
    told = vitals(START_NS)
    object.__setattr__(told.output.pose, "height_m", math.inf)
    book.tell(told)
    assert math.isnan(scraped(book)["flightd_height_meters", ""])


def serve(test: Callable[[MetricsServer], Awaitable[None]], patience_s: float = 5.0) -> None:
    async def main() -> None:
        server = MetricsServer(("127.0.0.1", 0), MetricsBook().registry, patience_s)
        await server.open()
        try:
            await test(server)
        finally:
            await server.close()
        assert asyncio.all_tasks() == {asyncio.current_task()}, "no task is left behind"
        assert "metrics" not in {thread.name for thread in threading.enumerate()}, "nor a thread"
        with pytest.raises(ConnectionRefusedError):
            await ask(server, b"GET /metrics HTTP/1.1\r\n\r\n")

    real(main())


async def ask(server: MetricsServer, request: bytes) -> bytes:
    """The answer, empty where the connection is ended instead."""
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    try:
        writer.write(request)
        return await reader.read()
    except ConnectionResetError:
        return b""
    finally:
        writer.close()
        with contextlib.suppress(ConnectionResetError):
            await writer.wait_closed()


def test_a_scrape_over_http() -> None:
    async def test(server: MetricsServer) -> None:
        answer = await ask(server, b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n")
        head, _, body = answer.partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.0 200 OK")
        assert b"Content-Type: text/plain; version=0.0.4" in head
        assert f"Content-Length: {len(body)}".encode() in head
        assert any(family.name == "flightd_phase" for family in text_string_to_metric_families(body.decode()))

    serve(test)


def test_a_scrape_as_prometheus_asks_for_it_is_packed() -> None:
    async def test(server: MetricsServer) -> None:
        answer = await ask(server, b"GET /metrics HTTP/1.1\r\nHost: x\r\nAccept-Encoding: gzip\r\n\r\n")
        head, _, body = answer.partition(b"\r\n\r\n")
        assert b"Content-Encoding: gzip" in head
        assert b"flightd_info" in gzip.decompress(body)

    serve(test)


def test_a_scrape_of_one_metric() -> None:
    async def test(server: MetricsServer) -> None:
        answer = await ask(server, b"GET /metrics?name[]=flightd_armed HTTP/1.1\r\n\r\n")
        names = {line.split()[0] for line in answer.decode().splitlines() if line.startswith("flightd")}
        assert names == {"flightd_armed"}

    serve(test)


@pytest.mark.parametrize(
    ("request_line", "status"),
    [(b"POST /metrics HTTP/1.1", b"405 Method"), (b"GET /a b HTTP/1.1", b"400")],
)
def test_anything_else_is_answered_too(request_line: bytes, status: bytes) -> None:
    async def test(server: MetricsServer) -> None:
        assert status in await ask(server, request_line + b"\r\n\r\n")

    serve(test)


def test_clients_that_only_hold_the_line_do_not_fill_the_server_for_ever() -> None:
    async def test(server: MetricsServer) -> None:
        idle = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(8)]
        while await ask(server, b"GET /metrics HTTP/1.1\r\n\r\n"):
            pass  # until the last of the eight is taken in, who are the most
        for _, writer in idle:
            writer.close()
            await writer.wait_closed()
        while not await ask(server, b"GET /metrics HTTP/1.1\r\n\r\n"):
            pass
        flood = await ask(server, b"x" * 100_000)
        assert b"flightd_info" not in flood

    serve(test, patience_s=60.0)


def test_a_client_that_says_nothing_is_hung_up_on_without_a_word_in_the_journal(
    capfd: pytest.CaptureFixture[str],
) -> None:
    async def test(server: MetricsServer) -> None:
        assert await ask(server, b"") == b""
        assert await ask(server, b"GET /metrics HTTP/1.1\r\n\r\n")

    serve(test, patience_s=0.05)
    assert capfd.readouterr().err == ""


def test_a_port_that_is_taken_is_named() -> None:
    async def test(server: MetricsServer) -> None:
        with pytest.raises(UnavailableError, match=f"metrics.listen 127.0.0.1:{server.port}"):
            await MetricsServer(("127.0.0.1", server.port), MetricsBook().registry).open()

    serve(test)


@pytest.mark.parametrize(
    "listen", ["9469", "127.0.0.1", "127.0.0.1:x", "127.0.0.1:99999", ":9469", "0.0.0.0:9469"]
)
def test_an_address_that_is_none_or_beyond_this_machine_is_refused(listen: str) -> None:
    with pytest.raises(ValidationError, match="metrics"):
        MetricsConfig(listen=listen)


@pytest.mark.parametrize(
    ("listen", "address"), [("127.0.0.1:9469", ("127.0.0.1", 9469)), ("[::1]:1", ("::1", 1))]
)
def test_an_address_is_read(listen: str, address: tuple[str, int]) -> None:
    assert MetricsConfig(listen=listen).address == address
