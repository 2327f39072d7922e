"""Who may look after a drone, and when; and that it is done once, one after the other."""

from __future__ import annotations

import asyncio
import base64
from dataclasses import dataclass, field
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.maintenance_desk import MOST_WAITING, MaintenanceDesk
from flightd.adapters.ground_link.maintenance_rules import HEARD_S, objection
from flightd.adapters.ground_link.messages.answers import Accepted, Code, Refused
from flightd.adapters.ground_link.messages.base import VERSION, Role
from flightd.adapters.ground_link.messages.maintenance import (
    MOST_PROFILE_BYTES,
    AskDoctor,
    AskSettings,
    FixParameter,
    InstallProfile,
    Maintenance,
    ProposeSettings,
    Restart,
    TakeSettingsBack,
)
from flightd.adapters.ground_link.messages.published import StatusReport, VehicleReport
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import MAX_REQUEST_BYTES, Answer, encode
from flightd.core.errors import InputError
from flightd.core.types import CommandKind, LandedState, Phase
from tests.rigs.event_loops import real
from tests.rigs.possible_commands import possible_in
from tests.unit.ground.request_handler_rig import OPERATOR, VIEWER, RequestHandlerRig, body, report

LOOKS: tuple[Maintenance, ...] = (
    AskDoctor(version=VERSION, id="look-0001"),
    AskSettings(version=VERSION, id="look-0002"),
)
CHANGES: tuple[Maintenance, ...] = (
    FixParameter(version=VERSION, id="change-01", name="GUID_TIMEOUT"),
    ProposeSettings(version=VERSION, id="change-02", base="x", changes={"mission.height_m": 1.5}),
    TakeSettingsBack(version=VERSION, id="change-03", base="x", version_kept=1),
    Restart(version=VERSION, id="change-04"),
    InstallProfile(version=VERSION, id="change-05", base="x", name="hall", content=b"PK", file_hash="0"),
)
STANDS = VehicleReport("STABILIZE", False, False, "on_ground", 0.0, 0.0, 0.9, 12.0, 0.1, 0.1, "")
WAITS = frozenset({CommandKind.START, CommandKind.LAND, CommandKind.STOP})


def status(phase: Phase = Phase.PREFLIGHT, vehicle: VehicleReport | None = STANDS) -> StatusReport:
    return msgspec.structs.replace(report(phase), vehicle=vehicle)


def refusal(request: Maintenance, stands: StatusReport | None, **more: Any) -> Code | None:
    found = objection(
        request, more.get("role", Role.OPERATOR), stands, more.get("possible", WAITS), more.get("now_ns", 1)
    )
    return found and found[0]


@pytest.mark.parametrize("request_", [*LOOKS, *CHANGES])
def test_a_drone_that_stands_disarmed_is_looked_after_by_operators_alone(request_: Maintenance) -> None:
    assert refusal(request_, status()) is None
    assert refusal(request_, status(), role=Role.VIEWER) is Code.ROLE
    assert refusal(request_, None) is Code.UNAVAILABLE
    assert refusal(request_, status(), possible=WAITS | {CommandKind.PAUSE}) is Code.PHASE


@given(
    request_=st.sampled_from([*LOOKS, *CHANGES]),
    phase=st.sampled_from(Phase),
    armed=st.booleans(),
    landed=st.sampled_from([state.value for state in LandedState]),
    heard_s=st.floats(0, 100),
    role=st.sampled_from(Role),
    has_vehicle=st.booleans(),
)
def test_nothing_is_done_of_a_drone_that_may_fly(
    request_: Maintenance,
    phase: Phase,
    armed: bool,
    landed: str,
    heard_s: float,
    role: Role,
    has_vehicle: bool,
) -> None:
    vehicle = msgspec.structs.replace(STANDS, armed=armed, landed=landed, heartbeat_age_s=heard_s)
    stands = status(phase, vehicle if has_vehicle else None)
    if refusal(request_, stands, role=role, possible=possible_in(phase) - {CommandKind.PAUSE}) is None:
        assert role is Role.OPERATOR
        assert phase is Phase.PREFLIGHT
        assert not (has_vehicle and (armed or landed == LandedState.IN_AIR))
        assert request_ in LOOKS or (has_vehicle and heard_s <= HEARD_S)


def test_an_old_status_tells_nothing_about_the_vehicle() -> None:
    late_ns = round((HEARD_S + 1) * 1e9)
    assert refusal(CHANGES[0], status(), now_ns=late_ns) is Code.PHASE
    assert refusal(LOOKS[0], status(), now_ns=late_ns) is None


@pytest.mark.parametrize(
    "fields",
    [
        {"base": "x", "changes": {"a": {"b": 1}}},
        {"base": "x", "changes": {"a": [[1]]}},
        {"base": "x", "changes": {"a" * 81: 1}},
        {"base": "x", "changes": {"a": "b" * 201}},
        {"base": "x", "changes": {"a": [1] * 201}},
        {"base": "x", "changes": {f"k{number}": 1 for number in range(65)}},
        {"base": "x" * 65, "changes": {}},
        {"base": "x", "changes": []},
        {"base": "x", "changes": {}, "person": "p" * 65},
        {"base": "x", "changes": {}, "path": "/etc/passwd"},
        {"changes": {}},
    ],
)
def test_a_malformed_proposal_is_refused(fields: dict[str, Any]) -> None:
    answer = RequestHandlerRig(Phase.PREFLIGHT).hand(body("propose", **fields))
    assert isinstance(answer, Refused)
    assert answer.code is Code.MALFORMED


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "../hall"},
        {"name": "hall.npz"},
        {"name": ".hall"},
        {"name": "h" * 41},
        {"name": ""},
        {"name": "hall\n"},
        {"content": base64.b64encode(bytes(MOST_PROFILE_BYTES + 1)).decode()},
        {"content": "no base64"},
        {"content": 3},
        {"file_hash": "0" * 65},
        {"person": "p" * 65},
        {"path": "/etc/passwd"},
    ],
)
def test_a_malformed_profile_is_refused(wrong: dict[str, Any]) -> None:
    good = {"base": "x", "name": "hall", "content": "UEs=", "file_hash": "0"}
    rig = RequestHandlerRig(Phase.PREFLIGHT)
    assert isinstance(rig.hand(body("install_profile", **good)), InstallProfile)
    answer = rig.hand(body("install_profile", **{**good, **wrong}))
    assert isinstance(answer, Refused)
    assert answer.code is Code.MALFORMED


def test_the_longest_profile_fits_into_a_request() -> None:
    longest = InstallProfile(
        version=VERSION,
        id="i" * 64,
        base="b" * 64,
        name="n" * 40,
        content=bytes(MOST_PROFILE_BYTES),
        file_hash="0" * 64,
        person="p" * 64,
    )
    assert len(encode(longest)) < MAX_REQUEST_BYTES


def test_nothing_is_started_while_the_drone_is_looked_after() -> None:
    rig = RequestHandlerRig(Phase.PREFLIGHT)
    rig.handler.looked_after = lambda: True
    answer = rig.order("start")
    assert isinstance(answer, Refused)
    assert answer.code is Code.BUSY
    assert isinstance(rig.order("stop"), Accepted)


@dataclass
class Slow:
    """Does one thing for as long as it is told to."""

    go: asyncio.Event = field(default_factory=asyncio.Event)
    done: list[str] = field(default_factory=list)

    async def serve(self, request: Maintenance, peer: Peer) -> Answer:
        await self.go.wait()
        if request.id.startswith("bad"):
            raise InputError("no such thing")
        if request.id.startswith("odd"):
            raise KeyError(request.id)
        self.done.append(f"{request.id} {peer.name}")
        return Accepted(request=request.id)


@dataclass
class Desk:
    """The desk with what it sent and wrote down; `refusal` is what stands against it now."""

    maintainer: Slow = field(default_factory=Slow)
    sent: list[Answer] = field(default_factory=list)
    audit: list[AuditEntry] = field(default_factory=list)
    refusal: tuple[Code, str] | None = None

    def __post_init__(self) -> None:
        self.desk = MaintenanceDesk(
            self.maintainer,
            lambda *_: self.refusal,
            lambda _, answer: self.sent.append(answer),
            self.audit.append,
            lambda request, code, text: Refused(request=request.id, code=code, text=text),
        )

    def ask(self, name: str, fix: str = "A", peer: Peer = OPERATOR) -> None:
        self.desk.hand_in([b""], FixParameter(version=VERSION, id=name, name=fix, person="Ann"), peer)

    async def work(self) -> None:
        self.maintainer.go.set()
        running = asyncio.ensure_future(self.desk.run())
        for _ in range(50):
            await asyncio.sleep(0)
        running.cancel()
        await asyncio.wait([running])


def test_what_is_asked_again_is_answered_again_and_done_once() -> None:
    async def asked() -> None:
        rig = Desk()
        for _ in range(3):
            rig.ask("fix-00001")
        await rig.work()
        rig.ask("fix-00001")
        assert rig.maintainer.done == ["fix-00001 ann"]
        assert [type(answer) for answer in rig.sent] == [Accepted, Accepted]
        rig.ask("fix-00001", fix="B")
        assert isinstance(rig.sent[-1], Refused)
        assert rig.sent[-1].code is Code.ID_REUSED
        assert [(entry.command, entry.outcome) for entry in rig.audit] == [("fix", "accepted")]
        assert rig.audit[0].text == '{"name":"A"} by Ann'

    real(asked())


def test_only_so_many_wait_and_errors_are_answers() -> None:
    async def asked() -> None:
        rig = Desk()
        for number in range(MOST_WAITING + 1):
            rig.ask(f"bad-{number:05}")
        assert [getattr(answer, "code", None) for answer in rig.sent] == [Code.BUSY]
        await rig.work()
        assert [getattr(answer, "code", None) for answer in rig.sent[1:]] == [Code.INVALID] * MOST_WAITING
        assert not rig.desk.is_busy
        rig.ask("fix-00009", peer=VIEWER)
        await rig.work()
        assert rig.maintainer.done == ["fix-00009 bob"]

    real(asked())


def test_an_error_of_ours_is_an_answer_too() -> None:
    async def asked() -> None:
        rig = Desk()
        rig.ask("odd-00001")
        rig.ask("fix-00002")
        await rig.work()
        assert [getattr(answer, "code", None) for answer in rig.sent] == [Code.UNAVAILABLE, None]

    real(asked())


def test_a_drone_that_began_to_fly_while_it_waited_is_left_alone() -> None:
    async def asked() -> None:
        rig = Desk()
        rig.ask("fix-00001")
        rig.refusal = Code.PHASE, "it flies"
        await rig.work()
        assert rig.maintainer.done == []
        assert [getattr(answer, "code", None) for answer in rig.sent] == [Code.PHASE]

    real(asked())


def test_what_is_written_down_of_a_profile_is_its_name_and_hash() -> None:
    async def asked() -> None:
        rig = Desk()
        sent = InstallProfile(
            version=VERSION,
            id="send-00001",
            base="x",
            name="hall",
            content=b"PK" * 99,
            file_hash="00ff",
            person="Ann",
        )
        rig.desk.hand_in([b""], sent, OPERATOR)
        await rig.work()
        assert [(entry.command, entry.outcome) for entry in rig.audit] == [("install_profile", "accepted")]
        assert rig.audit[0].text == '{"name":"hall","file_hash":"00ff"} by Ann'

    real(asked())
