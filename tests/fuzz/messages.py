"""Fuzz what comes over the ground link, at the daemon's request handler and at the client: `python -m
tests.fuzz.messages COUNT`."""

from __future__ import annotations

import contextlib
import itertools
import tomllib
from pathlib import Path

from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.messages.answers import Accepted, Planned, Refused
from flightd.adapters.ground_link.messages.base import VERSION, Role
from flightd.adapters.ground_link.messages.maintenance import Maintenance, ProposeSettings
from flightd.adapters.ground_link.messages.requests import AskPicture
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import (
    DECODE_ERRORS,
    decode_answer,
    decode_event,
    decode_status,
    encode,
)
from flightd.adapters.ground_link.request_handler import RequestHandler
from flightd.app.build import pilot_of
from flightd.config.edited_text import edited
from flightd.config.remote_change import checked
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.types import CommandKind
from flightd.site.site_file import load_site
from tests.fuzz.drive import Target, main
from tests.fuzz.mutate import spoil_text

_CONFIGS = Path(__file__).parents[2] / "configs"
_OPERATOR, _VIEWER = Peer("ann", Role.OPERATOR, b"1"), Peer("bob", Role.VIEWER, b"2")


def target(folder: Path) -> Target:
    del folder  # no files here
    audit: list[AuditEntry] = []
    site = load_site(_CONFIGS / "site-demo.toml")
    handler = RequestHandler(site, "session", audit.append)
    handler.plan_by(pilot_of(load_config(_CONFIGS / "sim.toml"), site).mission)
    config = (_CONFIGS / "sim.toml").read_text()
    clock = itertools.count(10**12, 200_000_000)

    def attempt(data: bytes) -> bool:
        answer = handler.answer(data, _OPERATOR, next(clock))
        handler.take_commands()
        viewed = handler.answer(data, _VIEWER, next(clock))
        dry = isinstance(viewed, Planned) and viewed.dry
        assert dry or not isinstance(viewed, Accepted | Planned), "a viewer's order was accepted"
        assert not handler.take_commands(), "a viewer's order reached the flight"
        audit.clear()
        if isinstance(answer, Maintenance):
            assert handler.maintenance_objection(answer, _VIEWER, next(clock)) is not None
            if isinstance(answer, ProposeSettings):
                with contextlib.suppress(InputError):
                    edited(config, answer.changes)
                    checked(tomllib.loads(config), answer.changes, _CONFIGS / "sim.toml")
        elif not isinstance(answer, AskPicture):
            assert decode_answer(encode(answer)) == answer
        for decode in (decode_answer, decode_status, decode_event):
            with contextlib.suppress(*DECODE_ERRORS):
                decode(data)
        return isinstance(answer, Refused)

    head = b'{"version": %d, "id": "request-1", "op": ' % VERSION
    orders = [head + b'"command", "command": "%s"}' % kind.encode() for kind in CommandKind]
    seeds = (
        *orders,
        head + b'"command", "command": "goto", "node": "A2", "session": "session"}',
        *(head + b'"%s"}' % op for op in (b"hello", b"status", b"picture", b"inventory", b"attend")),
        head + b'"attend", "leave": true}',
        *(head + b'"%s"}' % op for op in (b"doctor", b"settings", b"restart")),
        head + b'"fix", "name": "GUID_TIMEOUT", "person": "ann"}',
        head + b'"take_back", "base": "0123456789abcdef", "version_kept": 3}',
        head + b'"propose", "base": "0123456789abcdef", "changes": {"mission.height_m": 1.5, '
        b'"mission.nodes": ["A1"], "scan.pictures": null, "control.yaw.kp": 2, "vehicle.name": "seven"}}',
        head + b'"install_profile", "base": "0123456789abcdef", "name": "hall", "content": "UEsDBA==", '
        b'"file_hash": "00", "person": "ann"}',
        head + b'"plan"}',
        head + b'"plan_flight", "nodes": ["A2", "A1"], "levels": [1], "best_order": true}',
        head + b'"plan_flight", "nodes": ["A2"], "dry": true}',
        head + b'"command", "command": "start", "plan": "plan-0001"}',
        encode(Accepted(request="request-1")),
        b'{"version": 1, "session": "s", "seq": 1, "stamp_ns": 1, "level": "info", "name": "a", "text": "b"}',
    )
    return Target("messages", seeds, spoil_text, attempt)


if __name__ == "__main__":
    main(target)
