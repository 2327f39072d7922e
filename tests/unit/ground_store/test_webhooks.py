"""Whoever asked to be told is told of what is in the store: in order, signed, again until he has it."""

from __future__ import annotations

import hashlib
import hmac
import json
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
from flightd.ground.ground_store import events, migrations
from flightd.ground.ground_store.batch import Batch, SentDecision, SentLook
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.ground_store.webhooks import Webhook

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
        ("https://wms.hall/hook", "short", "a secret of 16 characters or more"),
    ],
)
def test_a_hook_that_others_could_read_or_forge_is_refused(url: str, secret: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        Webhook(url, secret)


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
