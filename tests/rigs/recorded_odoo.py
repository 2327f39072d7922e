"""An Odoo that answers as `recorded_odoo.json` says, over HTTP, and stays away where nothing is written.

Pairs go through the scenes of the file: a question is answered as of the newest scene that has it, and an
answer may begin the next one, as a booking does.
"""

from __future__ import annotations

import contextlib
import http.server
import json
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

RECORDED = Path(__file__).with_suffix(".json")
KEY = "6578616d706c65206a736f6e20617069206b6579"
"""As the documentation has one."""
_CHANGES = ("write", "create", "action_apply_inventory", "action_clear_inventory_quantity")


@dataclass(frozen=True)
class Answer:
    """`body` as JSON, or as it is where it is text.  `cut`: it ends half-way; `silent`: none comes."""

    status: int = 200
    body: Any = None
    headers: dict[str, str] = field(default_factory=dict)
    cut: bool = False
    silent: bool = False


class RecordedOdoo:
    """`asked` has every question by model and method; `instead` answers those of a method
    otherwise, or of a method and the last field that is asked for, `METHOD:FIELD`."""

    def __init__(self) -> None:
        told = json.loads(RECORDED.read_text(encoding="utf-8"))
        self._scenes: list[str] = told["scenes"]
        self._pairs: list[dict[str, Any]] = told["pairs"]
        self._bad: dict[str, Any] = told["refusals"]
        self._scene = 0
        self._lock = threading.Lock()
        self.ended = threading.Event()
        self.url = ""
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.unrecorded: list[str] = []
        self.instead: dict[str, Answer] = {}

    @property
    def changes(self) -> list[tuple[str, dict[str, Any]]]:
        """The questions that change something."""
        return [one for one in self.asked if one[0].partition("/")[2] in _CHANGES]

    def refusal(self, name: str) -> Answer:
        """One of the file's."""
        told = self._bad[name]
        return Answer(told["status"], told["body"], told.get("headers", {}))

    def recorded(self, method: str) -> Any:
        """The body of the first answer to a method of a model."""
        return next(pair["answer"] for pair in self._pairs if pair["ask"] == method)

    def answer(self, path: str, headers: Any, body: bytes) -> Answer:
        with self._lock:
            return self._answer(path, headers, body)

    def _answer(self, path: str, headers: Any, body: bytes) -> Answer:
        if headers.get("Authorization") != f"bearer {KEY}":
            return self.refusal("a key that Odoo does not know")
        if not path.startswith("/json/2/") or headers.get_content_type() != "application/json":
            return self.refusal("no JSON-2 API")
        asked, given = path.removeprefix("/json/2/"), json.loads(body)
        self.asked.append((asked, given))
        last = f"{asked}:{given.get('fields', [''])[-1]}"
        if last in self.instead or asked in self.instead:
            return self.instead.get(last) or self.instead[asked]
        known = [pair for pair in self._pairs if (pair["ask"], pair["given"]) == (asked, given)]
        known = [pair for pair in known if self._scenes.index(pair["from"]) <= self._scene]
        if not known:
            self.unrecorded.append(f"{self._scenes[self._scene]}: {asked} {json.dumps(given)}")
            return self.refusal("a method that Odoo does not know")
        pair = max(known, key=lambda one: self._scenes.index(one["from"]))
        if "then" in pair:
            self._scene = self._scenes.index(pair["then"])
        return Answer(200, pair["answer"])


@contextlib.contextmanager
def recorded_odoo() -> Iterator[RecordedOdoo]:
    """It listens meanwhile at its `url`."""
    odoo = RecordedOdoo()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            asked = self.rfile.read(int(self.headers["Content-Length"]))
            _send(self, odoo.answer(self.path, self.headers, asked), odoo.ended)

        def log_message(self, *_: object) -> None:
            """Nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    odoo.url = f"http://127.0.0.1:{server.server_port}"
    serving = threading.Thread(target=server.serve_forever, args=(0.01,))
    serving.start()
    try:
        yield odoo
    finally:
        odoo.ended.set()
        server.shutdown()
        serving.join()
        server.server_close()


def _send(handler: http.server.BaseHTTPRequestHandler, answer: Answer, ended: threading.Event) -> None:
    if answer.silent:
        ended.wait(60)
        return
    is_text = isinstance(answer.body, str)
    data = answer.body.encode() if is_text else json.dumps(answer.body).encode()
    kind = "text/html; charset=utf-8" if is_text else "application/json; charset=utf-8"
    handler.send_response(answer.status)
    for name, value in {"Content-Type": kind, "Content-Length": str(len(data)), **answer.headers}.items():
        handler.send_header(name, value)
    handler.end_headers()
    with contextlib.suppress(ConnectionError):
        handler.wfile.write(data[: len(data) // 2] if answer.cut else data)
