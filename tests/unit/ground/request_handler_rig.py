"""A request handler with nothing around it, and the messages to hand in."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import msgspec

from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.messages.base import VERSION, Role
from flightd.adapters.ground_link.messages.maintenance import Maintenance
from flightd.adapters.ground_link.messages.published import LinkReport, StatusReport
from flightd.adapters.ground_link.messages.requests import AskPicture
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import Answer
from flightd.adapters.ground_link.request_handler import RequestHandler
from flightd.app.build import pilot_of
from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.rigs.possible_commands import possible_in

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
OPERATOR = Peer("ann", Role.OPERATOR, b"1", "127.0.0.1")
VIEWER = Peer("bob", Role.VIEWER, b"2", "127.0.0.1")
SESSION = "session-1"
S = 1_000_000_000

_ids = itertools.count()


def report(phase: Phase) -> StatusReport:
    return StatusReport(
        version=VERSION,
        session=SESSION,
        seq=1,
        stamp_ns=1,
        phase=phase,
        reason="",
        node="A1",
        goal="A2",
        nodes_done=0,
        nodes_planned=2,
        height_m=None,
        position=None,
        lines=(),
        lines_age_s=None,
        vehicle=None,
        frames=0,
        frames_dropped=0,
        fps=0.0,
        latency_ms={},
        link=LinkReport(0, 0, 0, 0, 0),
    )


def body(op: str, **fields: Any) -> bytes:
    """A request as a client in any language would write it."""
    return msgspec.json.encode({"version": VERSION, "id": f"request-{next(_ids)}", "op": op, **fields})


class RequestHandlerRig:
    """`hand` gives the handler's answer; what it wrote down is in `audit`."""

    def __init__(self, phase: Phase = Phase.FOLLOW, **more: Any) -> None:
        self.audit: list[AuditEntry] = []
        self.handler = RequestHandler(SITE, SESSION, self.audit.append, **more)
        self.mission = pilot_of(CONFIG, SITE).mission
        self.handler.plan_by(self.mission)
        self.handler.status = report(phase)
        self.handler.possible = possible_in(phase)
        self.now_ns = 100 * S

    def hand(self, request: bytes, peer: Peer = OPERATOR) -> Answer | AskPicture | Maintenance:
        return self.handler.answer(request, peer, self.now_ns)

    def order(self, command: str, peer: Peer = OPERATOR, **fields: Any) -> Answer | AskPicture | Maintenance:
        return self.hand(body("command", command=command, **fields), peer)

    def plan(self, *nodes: str, peer: Peer = OPERATOR, **fields: Any) -> Answer | AskPicture | Maintenance:
        return self.hand(body("plan_flight", nodes=nodes, **fields), peer)
