"""Whoever asked to be told is told of what is in the store: in order, signed, again until he has it."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import hmac
import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationState, Observation, Standing
from flightd.core.types import CodeRead
from flightd.ground.ground_store import events, migrations, webhooks
from flightd.ground.ground_store.batch import Batch, SentDecision, SentLook
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.ground_store.station_target import StationTarget
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.ground_store.webhooks import Webhook
from tests.rigs.event_loops import in_real_time

_SECRET = "a secret of the hall"
_BEGIN = 1_760_000_000_000_000_000


class Receiver:
    """Takes what is signed, and refuses when it is told to."""

    def __init__(self) -> None:
        self.heard: list[dict[str, Any]] = []
        self.refusals = 0
        self.url = ""

    @contextmanager
    def listening(self) -> Iterator[None]:
        own = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                stamped = self.headers["Flightd-Time"].encode("ascii") + b"." + body
                good = hmac.new(_SECRET.encode(), stamped, hashlib.sha256).hexdigest()
                refused = own.refusals > 0 or self.headers["Flightd-Signature"] != good
                own.refusals -= refused
                if not refused:
                    own.heard.append(json.loads(body))
                self.send_response(503 if refused else 204)
                self.end_headers()

            def log_message(self, *_: object) -> None: ...

        with HTTPServer(("127.0.0.1", 0), Handler) as server:
            self.url = f"http://127.0.0.1:{server.server_port}/hook"
            thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
            thread.start()
            try:
                yield
            finally:
                server.shutdown()
                thread.join()


def counted(run: int, *texts: str) -> Batch:
    """One place, once a run."""
    reads = tuple(CodeRead("QR Code", text, (), True, 3, 1.0) for text in texts)
    state = LocationState.READ if reads else LocationState.EMPTY
    seen = Observation(f"run {run}", "A-1", _BEGIN + run, state, 0.9, reads)
    return Batch("hall 3", "north", looks=(SentLook(seen, Standing.CONFIRMED),))


def test_everything_is_told_in_order_and_again_until_it_is_taken(store: GroundStore) -> None:
    receiver = Receiver()
    with receiver.listening():
        hook = Webhook(receiver.url, _SECRET)
        store.take(counted(1, "before anybody asked"))
        assert not hook.tell(store)
        for batch in (counted(2), counted(2), counted(3)):
            store.take(batch)
        decided = SentDecision("decision-1", "A-1", _BEGIN, 0, "put_right", "ann", "")
        for _ in range(2):
            store.take(Batch("hall 3", "station", decisions=(decided,)))
        receiver.refusals = 2
        for _ in range(2):
            with pytest.raises(UnavailableError, match="answers HTTP 503"):
                hook.tell(store)
        assert not hook.tell(store)
        told = [(one["event"], one.get("run", one.get("who")), one.get("change")) for one in receiver.heard]
        assert told == [
            ("run.new", "run 2", None), ("difference.found", "run 2", "gone"), ("run.new", "run 3", None),
            ("place.decided", "ann", None),
        ]  # fmt: skip
        assert [one["site"] for one in receiver.heard] == ["hall 3"] * 4
        assert sorted({one["id"] for one in receiver.heard}) == [one["id"] for one in receiver.heard]
        (withdrawn,) = counted(2).looks
        store.take(Batch("hall 3", "north", looks=(replace(withdrawn, standing=Standing.WITHDRAWN),)))
        hook.tell(store)
        assert [(one["event"], one["run"]) for one in receiver.heard[4:]] == [
            ("difference.found", "run 3"), ("difference.gone", "run 2"),
        ]  # fmt: skip


def test_what_nobody_takes_is_bounded_and_counted(
    store: GroundStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "MOST_EVENTS", 5)
    receiver = Receiver()
    with receiver.listening():
        hook = Webhook(receiver.url, _SECRET)
        hook.tell(store)
        for run in range(12):
            store.take(counted(run, "PAL-1"))
        hook.tell(store)
    assert [one["run"] for one in receiver.heard] == [f"run {run}" for run in range(7, 12)]
    assert {one["dropped"] for one in receiver.heard} == {7}


@pytest.mark.parametrize(
    ("url", "secret", "why"),
    [
        ("http://wms.hall/hook", _SECRET, "others could read it; give https://"),
        ("wms.hall", _SECRET, "not an address"),
        ("https://wms.hall:abc/hook", _SECRET, "not an address: Port could not be cast to integer value"),
        ("https://wms.hall/our hook", _SECRET, "not an address: .*%XX there; give https://HOST/PATH"),
        ("https://[wms.hall/hook", _SECRET, "not an address: Invalid IPv6 URL"),
        ("https://wms..hall/hook", _SECRET, "not an address: its host is no name"),
        ("https://ann:secret@wms.hall/hook", _SECRET, "no name and password belong into it"),
        ("https://wms.hall/hook", "short", "a secret of 16 characters or more"),
    ],
)
def test_a_hook_that_others_could_read_or_forge_is_refused(url: str, secret: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        Webhook(url, secret)


@contextmanager
def saying(answer: bytes) -> Iterator[int]:
    """The port of something else than a web server."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            with contextlib.suppress(OSError):
                while True:
                    client, _ = listening.accept()
                    with client:
                        client.recv(65_536)
                        client.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            listening.shutdown(socket.SHUT_RDWR)
            thread.join()


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (b"SSH-2.0-OpenSSH_9.2\r\n", "it answers no HTTP"),
        (b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 200, "it answers no HTTP"),
        (b"", "Remote end closed connection|reset by peer"),
    ],
)
def test_what_answers_no_http_is_one_line(tmp_path: Path, answer: bytes, why: str) -> None:
    with saying(answer) as port, opened_store(str(tmp_path / "store.db")) as store:
        hook = Webhook(f"http://127.0.0.1:{port}/hook", _SECRET)
        hook.tell(store)
        store.take(counted(1))
        with pytest.raises(UnavailableError, match=why):
            hook.tell(store)
        with pytest.raises(UnavailableError, match=why):
            StationTarget(f"http://127.0.0.1:{port}", "key").take(counted(1))


def test_an_answer_that_breaks_off_is_one_line(tmp_path: Path) -> None:
    with saying(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n99\r\n{") as port:
        station = StationTarget(f"http://127.0.0.1:{port}/", "key")
        with pytest.raises(UnavailableError, match=f":{port}: the station cannot be had: .*broke off"):
            station.standings([])
    with pytest.raises(InputError, match="--store https://hall:abc: not a station: Port could not be cast"):
        StationTarget("https://hall:abc", "key")


@in_real_time
async def test_no_failure_of_a_hook_ends_the_station(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(webhooks, "_FIRST_S", 0.001)
    hook, asked = Webhook("http://127.0.0.1:9/hook", _SECRET), asyncio.Event()
    loop = asyncio.get_running_loop()
    failures: list[Exception] = [OverflowError("too large"), OverflowError("too large"), ValueError("odd")]

    def tell(_: GroundStore) -> bool:
        if failures:
            raise failures.pop(0)
        loop.call_soon_threadsafe(asked.set)
        return False

    monkeypatch.setattr(hook, "tell", tell)
    with opened_store(str(tmp_path / "store.db")) as store:
        running, heard = asyncio.create_task(hook.run(store)), asyncio.create_task(asked.wait())
        done, _ = await asyncio.wait({running, heard}, return_when=asyncio.FIRST_COMPLETED)
        assert done == {heard}
        running.cancel()
        await asyncio.wait({running})
    told = [record.getMessage().partition("hook: ")[2] for record in caplog.records]
    assert told == ["failed: OverflowError('too large')", "failed: ValueError('odd')"]


def test_a_store_from_before_webhooks_is_brought_up_to_date(
    engine: Callable[[], Engine], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = migrations._files  # noqa: SLF001
    with monkeypatch.context() as before:
        before.setattr(migrations, "_files", lambda kind: known(kind)[:1])
        GroundStore(engine(), FolderEvidence(tmp_path)).close()
    with GroundStore(engine(), FolderEvidence(tmp_path)) as store:
        assert store.waiting_events("https://wms.hall", 5) == ([], 0)
        assert store.take(counted(1, "PAL-1")).new == 1
        assert [one.kind for one in store.waiting_events("https://wms.hall", 5)[0]] == ["run.new"]
