"""What the request handler answers, does and writes down."""

from __future__ import annotations

import json
import random

import msgspec
import pytest

from flightd.adapters.ground_link.messages.answers import (
    Accepted,
    Code,
    InventoryAnswer,
    Planned,
    Refused,
    StatusAnswer,
    Welcome,
)
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.requests import AskPicture
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import decode_answer, encode
from flightd.core.types import CommandKind, Phase
from tests.rigs.possible_commands import possible_in
from tests.unit.ground.request_handler_rig import OPERATOR, SESSION, SITE, VIEWER, RequestHandlerRig, S, body

OVER = (Phase.DONE, Phase.ABORTED, Phase.PILOT)


def refusal(answer: object) -> Code:
    assert isinstance(answer, Refused), answer
    assert answer.text
    return answer.code


def test_an_operators_command_reaches_the_flight_once_and_is_written_down() -> None:
    rig = RequestHandlerRig()
    assert isinstance(rig.order("goto", node="A3"), Accepted)
    (command,) = rig.handler.take_commands()
    assert (command.kind, command.node) == (CommandKind.GOTO, "A3")
    assert rig.handler.take_commands() == []
    assert (rig.audit[0].client, rig.audit[0].command, rig.audit[0].outcome) == ("ann", "goto", "accepted")


def test_a_command_sent_again_is_answered_again_but_not_done_again() -> None:
    rig = RequestHandlerRig()
    request = body("command", command="home")
    first, second = rig.hand(request), rig.hand(request)
    assert isinstance(first, Accepted)
    assert isinstance(second, Accepted)
    assert (first.repeated, second.repeated) == (False, True)
    assert len(rig.handler.take_commands()) == 1
    assert [entry.outcome for entry in rig.audit] == ["accepted", "repeated"]


def test_an_id_names_one_command_of_one_client() -> None:
    rig = RequestHandlerRig()
    rig.order("pause", id="same-id-1")
    assert refusal(rig.order("land", id="same-id-1")) is Code.ID_REUSED
    other = Peer("eve", Role.OPERATOR)
    assert isinstance(rig.order("land", other, id="same-id-1"), Accepted)
    assert [command.kind for command in rig.handler.take_commands()] == [CommandKind.PAUSE, CommandKind.LAND]


def test_a_refused_command_may_be_tried_again_with_its_id() -> None:
    rig = RequestHandlerRig(Phase.LAND)
    request = body("command", command="pause")
    assert refusal(rig.hand(request)) is Code.PHASE
    flying = RequestHandlerRig(Phase.FOLLOW).handler
    rig.handler.status, rig.handler.possible = flying.status, flying.possible
    assert isinstance(rig.hand(request), Accepted)


@pytest.mark.parametrize("kind", list(CommandKind))
def test_a_viewer_commands_nothing_and_the_attempt_is_written_down(kind: CommandKind) -> None:
    rig = RequestHandlerRig(Phase.FOLLOW)
    assert refusal(rig.order(kind, VIEWER, node="A2" if kind is CommandKind.GOTO else "")) is Code.ROLE
    assert refusal(rig.hand(body("attend"), VIEWER)) is Code.ROLE
    assert rig.handler.take_commands() == []
    assert [entry.outcome for entry in rig.audit] == ["role"]


@pytest.mark.parametrize("kind", list(CommandKind))
def test_a_start_is_taken_back_by_whoever_looks_on(kind: CommandKind) -> None:
    rig = RequestHandlerRig(Phase.ARMING)
    answer = rig.order(kind, VIEWER, node="A2" if kind is CommandKind.GOTO else "")
    if kind is CommandKind.PAUSE:
        assert isinstance(answer, Accepted)
        assert [command.kind for command in rig.handler.take_commands()] == [CommandKind.PAUSE]
    else:
        assert refusal(answer) is Code.ROLE


@pytest.mark.parametrize("phase", list(Phase))
@pytest.mark.parametrize("kind", list(CommandKind))
def test_every_command_in_every_phase_is_accepted_or_refused_by_the_table(
    kind: CommandKind, phase: Phase
) -> None:
    rig = RequestHandlerRig(phase)
    if kind is CommandKind.PLAN:
        answer = rig.plan("A2")
    else:
        answer = rig.order(kind, node="A2" if kind is CommandKind.GOTO else "")
    if kind in possible_in(phase):
        assert isinstance(answer, Accepted | Planned)
    else:
        assert refusal(answer) is Code.PHASE
        assert rig.handler.take_commands() == []


@pytest.mark.parametrize("phase", [p for p in Phase if p not in OVER])
def test_land_and_stop_are_possible_until_it_is_over(phase: Phase) -> None:
    assert CommandKind.LAND in possible_in(phase)
    assert CommandKind.STOP in possible_in(phase)


def test_what_is_wrong_with_a_command_is_named() -> None:
    rig = RequestHandlerRig()
    assert refusal(rig.order("goto", node="Z9")) is Code.NODE
    assert refusal(rig.order("goto")) is Code.MALFORMED
    assert refusal(rig.order("land", node="A1")) is Code.MALFORMED
    assert refusal(rig.order("fly")) is Code.MALFORMED
    assert refusal(rig.order("pause", id="short")) is Code.MALFORMED
    assert refusal(rig.order("pause", colour="red")) is Code.MALFORMED
    assert refusal(rig.order("pause", session="another run")) is Code.SESSION
    assert isinstance(rig.order("pause", session=SESSION), Accepted)
    assert rig.handler.refused == 7


@pytest.mark.parametrize(
    ("command", "age_s", "code"),
    [
        ("pause", 60.0, None),
        ("land", 60.0, None),
        ("stop", 60.0, None),
        ("home", 60.0, Code.LATE),
        ("home", 1.0, None),
    ],
)
def test_an_order_by_an_old_status_is_refused_unless_it_makes_the_flight_safer(
    command: str, age_s: float, code: Code | None
) -> None:
    rig = RequestHandlerRig(Phase.FOLLOW)
    rig.now_ns = 100 * S
    answer = rig.order(command, seen_ns=rig.now_ns - round(age_s * S))
    assert refusal(answer) is code if code else isinstance(answer, Accepted)


@pytest.mark.parametrize("version", [0, 2, -1, 10**12])
def test_a_client_of_another_version_is_told_both_versions_whatever_else_it_says(version: int) -> None:
    rig = RequestHandlerRig()
    answer = rig.hand(json.dumps({"version": version, "id": "x", "op": "teleport", "to": []}).encode())
    assert refusal(answer) is Code.VERSION
    assert isinstance(answer, Refused)
    assert "speaks version 1" in answer.text
    assert (f"version {version}" if version else "no version") in answer.text
    assert answer.request == "x"


def test_a_client_without_a_version_is_told_so() -> None:
    assert refusal(RequestHandlerRig().hand(b'{"cmd": "land"}')) is Code.VERSION


def test_too_many_commands_are_held_back_but_never_land_and_stop() -> None:
    rig = RequestHandlerRig()
    answers = [rig.order("pause") for _ in range(25)]
    assert sum(isinstance(answer, Accepted) for answer in answers) == 20
    assert refusal(answers[-1]) is Code.BUSY
    assert all(isinstance(rig.order("stop"), Accepted) for _ in range(50))
    kinds = [command.kind for command in rig.handler.take_commands()]
    assert kinds.count(CommandKind.STOP) == 1, "one stop at a tick is enough"
    rig.now_ns += 2 * S
    assert isinstance(rig.order("pause"), Accepted)


def test_hello_tells_who_one_is_and_where_it_flies() -> None:
    answer = RequestHandlerRig(picture_fps=2.0).hand(body("hello", client="test"), VIEWER)
    assert isinstance(answer, Welcome)
    assert (answer.role, answer.client, answer.session) == (Role.VIEWER, "bob", SESSION)
    assert {node.id for node in answer.floor.nodes} == set(SITE.nodes)
    assert answer.floor.home == SITE.home.node
    assert decode_answer(encode(answer)) == answer


def test_status_pictures_and_inventory_are_answered_as_far_as_they_are_there() -> None:
    rig = RequestHandlerRig()
    status = rig.hand(body("status"), VIEWER)
    assert isinstance(status, StatusAnswer)
    assert status.status is not None
    assert status.status.phase is Phase.FOLLOW
    assert refusal(rig.hand(body("picture"))) is Code.UNAVAILABLE
    assert refusal(rig.hand(body("inventory"))) is Code.UNAVAILABLE
    rich = RequestHandlerRig(picture_fps=1.0, inventory=lambda: [{"place": "A-1-1", "code": "123"}])
    assert isinstance(rich.hand(body("picture")), AskPicture)
    counted = rich.hand(body("inventory"))
    assert isinstance(counted, InventoryAnswer)
    assert counted.places == ({"place": "A-1-1", "code": "123"},)


def test_silence_counts_only_while_somebody_attends() -> None:
    rig = RequestHandlerRig()
    rig.now_ns += 100 * S
    assert rig.handler.silent_ns(rig.now_ns) == 0
    rig.hand(body("attend"))
    rig.now_ns += 7 * S
    assert rig.handler.silent_ns(rig.now_ns) == 7 * S
    rig.hand(body("attend"))
    assert rig.handler.silent_ns(rig.now_ns) == 0
    rig.hand(body("attend", leave=True))
    rig.now_ns += 100 * S
    assert rig.handler.silent_ns(rig.now_ns) == 0


def test_who_takes_over_and_leaves_does_not_leave_the_lost_one_behind() -> None:
    rig = RequestHandlerRig()
    again = Peer("ann", Role.OPERATOR, b"another connection")
    rig.hand(body("attend"))
    rig.now_ns += 10 * S
    rig.hand(body("attend"), again)
    assert rig.handler.attending(rig.now_ns) == 1
    rig.hand(body("attend", leave=True), again)
    rig.now_ns += 10 * S
    assert rig.handler.silent_ns(rig.now_ns) == 0


def test_memory_is_bounded_whatever_comes() -> None:
    rig = RequestHandlerRig()
    orders = [body("command", command="pause") for _ in range(3000)]
    for i, order in enumerate(orders):
        rig.now_ns += S // 10
        rig.hand(order, Peer("ann", Role.OPERATOR, str(i).encode()))
        rig.hand(body("attend"), Peer(f"c{i}", Role.OPERATOR, str(i).encode()))
        if i % 5 == 0:
            assert len(rig.handler.take_commands()) <= 32
    assert rig.handler.attending(0) <= 64, "all that ever attended and are still known"
    rig.handler.take_commands()
    rig.now_ns += 10 * S
    known = [rig.hand(order) for order in (orders[0], orders[-1])]
    assert [answer.repeated for answer in known if isinstance(answer, Accepted)] == [False, True]


def _mutated(random_: random.Random, seeds: list[bytes]) -> bytes:
    data = bytearray(random_.choice(seeds))
    for _ in range(random_.randrange(1, 6)):
        if not data:
            break
        at = random_.randrange(len(data))
        match random_.randrange(6):
            case 0:
                data[at] = random_.randrange(256)
            case 1:
                del data[at : at + random_.randrange(1, 12)]
            case 2:
                data[at:at] = random_.randbytes(random_.randrange(1, 6))
            case 3:
                data[at:at] = random_.choice([b'"', b"{", b"[", b"\\u", b"-1e999", b"null", b"9" * 40, b","])
            case 4:
                piece = data[at : at + random_.randrange(1, 30)]
                data[at:at] = piece * random_.randrange(1, 4)
            case _:
                data = data[:at]
    return bytes(data)


def test_twenty_thousand_damaged_requests_raise_nothing_and_let_none_in() -> None:
    """Damage may leave a whole request behind, but only one that its sender may make."""
    random_ = random.Random(20)
    rig = RequestHandlerRig(picture_fps=1.0)
    seeds = [
        body("hello", client="fuzz"),
        body("command", command="goto", node="A2", session=SESSION),
        body("command", command="stop"),
        body("attend", leave=True),
        body("picture"),
        b"[" * 5000,
        b'{"version":1,"id":"' + b"x" * 4000,
        msgspec.msgpack.encode({"version": 1}),
        b"",
    ]
    answered = 0
    for i in range(20_000):
        rig.now_ns += 10_000_000
        request = _mutated(random_, seeds) if i % 4 else random_.randbytes(random_.randrange(200))
        answer = rig.hand(request, VIEWER)
        if not isinstance(answer, AskPicture):
            answered += bool(encode(answer))
    assert rig.handler.take_commands() == []
    assert rig.handler.refused > 15_000
    assert answered > 15_000
    assert isinstance(rig.order("land"), Accepted), "and it works on"


def test_the_operators_own_damaged_requests_become_known_commands_or_none() -> None:
    random_ = random.Random(21)
    rig = RequestHandlerRig()
    seeds = [body("command", command="goto", node="A2"), body("command", command="home")]
    for _ in range(4000):
        rig.now_ns += 10**8
        rig.hand(_mutated(random_, seeds), OPERATOR)
        for command in rig.handler.take_commands():
            assert (command.node in SITE.nodes) if command.kind is CommandKind.GOTO else command.node == ""
