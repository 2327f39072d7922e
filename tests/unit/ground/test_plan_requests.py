"""Plans over the ground link: who may hand one over, when, and what is answered and written down."""

from __future__ import annotations

import itertools

import msgspec
import pytest

from flightd.adapters.ground_link.messages.answers import Accepted, Code, PlanAnswer, Planned, Refused
from flightd.adapters.ground_link.messages.base import VERSION
from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.requests import AskPlan, Order, PlanFlight
from flightd.adapters.ground_link.plan_answers import PlanAnswers
from flightd.adapters.ground_link.protocol import MAX_REQUEST_BYTES, decode_answer, encode
from flightd.app.build import pilot_of
from flightd.core.count_choice import ShelfCount
from flightd.core.planned_flight import MOST_NODES
from flightd.core.types import CommandKind, Phase
from tests.unit.ground.request_handler_rig import CONFIG, OPERATOR, SITE, VIEWER, RequestHandlerRig, S, body


def waiting() -> RequestHandlerRig:
    return RequestHandlerRig(Phase.PREFLIGHT)


def refused(answer: object, code: Code) -> str:
    assert isinstance(answer, Refused), answer
    assert answer.code is code
    assert "\n" not in answer.text
    return answer.text


def test_a_plan_reaches_the_mission_once_says_what_it_is_and_is_written_down() -> None:
    rig = waiting()
    request = body("plan_flight", nodes=["A3", "A1", "A3"])
    answer, again = rig.hand(request), rig.hand(request)
    assert isinstance(answer, Planned)
    assert answer.nodes == ("A3", "A1")
    assert (answer.seconds > 10, answer.batteries, answer.dry, answer.repeated) == (True, 1, False, False)
    assert isinstance(again, Planned)
    assert again.repeated
    (command,) = rig.handler.take_commands()
    assert (command.kind, command.nodes) == (CommandKind.PLAN, ("A3", "A1"))
    assert [(entry.command, entry.node, entry.outcome) for entry in rig.audit] == [
        ("plan", "A3,A1", "accepted"),
        ("plan", "A3,A1,A3", "repeated"),
    ]
    assert decode_answer(encode(answer)) == answer


def test_the_best_order_is_the_one_that_is_flown() -> None:
    rig = waiting()
    answer = rig.plan("A3", "B2", "A1", best_order=True)
    assert isinstance(answer, Planned)
    (command,) = rig.handler.take_commands()
    assert command.nodes == answer.nodes
    assert set(command.nodes) == {"A3", "B2", "A1"}


def test_only_asked_for_it_changes_nothing_and_a_viewer_may() -> None:
    rig = waiting()
    answer = rig.plan("A3", dry=True, peer=VIEWER)
    assert isinstance(answer, Planned)
    assert answer.dry
    assert rig.handler.take_commands() == []
    assert rig.audit == []


@pytest.mark.parametrize(
    ("fields", "code", "why"),
    [
        ({"nodes": ["nowhere"]}, Code.PLAN, "no node nowhere"),
        ({"nodes": ["A1"], "levels": [1]}, Code.PLAN, "level"),
        ({"nodes": ["A1"], "session": "another"}, Code.SESSION, "anew"),
        ({"nodes": ["A1"], "seen_ns": 90 * S}, Code.LATE, "10 s ago"),
        ({"nodes": ["x" * 65]}, Code.MALFORMED, "nodes"),
        ({"nodes": ["A1"] * (MOST_NODES + 1)}, Code.MALFORMED, "nodes"),
        ({"nodes": ["A1"], "levels": [0]}, Code.MALFORMED, "levels"),
    ],
)
def test_a_plan_that_cannot_be_flown_is_refused_in_one_line(
    fields: dict[str, object], code: Code, why: str
) -> None:
    rig = waiting()
    assert why in refused(rig.hand(body("plan_flight", **fields)), code)
    assert rig.handler.take_commands() == []


def test_a_viewer_hands_nothing_over() -> None:
    rig = waiting()
    refused(rig.plan("A1", peer=VIEWER), Code.ROLE)
    assert rig.handler.take_commands() == []
    assert [entry.outcome for entry in rig.audit] == ["role"]


@pytest.mark.parametrize("phase", [Phase.ARMING, Phase.FOLLOW, Phase.SWAP, Phase.DONE])
@pytest.mark.parametrize("dry", [True, False])
def test_nothing_is_planned_while_it_flies(phase: Phase, dry: bool) -> None:
    rig = RequestHandlerRig(phase)
    answer = rig.plan("A1", dry=dry)
    if not (dry and phase is Phase.SWAP):
        refused(answer, Code.PHASE)


def test_planning_takes_few_turns_of_the_tick() -> None:
    rig = waiting()
    answers = [rig.plan("A1", dry=True, peer=VIEWER) for _ in range(6)]
    assert all(isinstance(answer, Planned) for answer in answers[:5])
    refused(answers[5], Code.BUSY)
    rig.now_ns += S
    assert isinstance(rig.plan("A1", dry=True, peer=OPERATOR), Planned)


def test_the_standing_plan_and_what_is_left_of_it_is_told() -> None:
    rig = waiting()
    answer = rig.hand(body("plan"), VIEWER)
    assert isinstance(answer, PlanAnswer)
    assert answer.id == ""
    assert answer.remaining == answer.nodes


def test_a_plan_comes_with_its_nodes_and_only_a_start_names_one() -> None:
    rig = waiting()
    refused(rig.order("plan"), Code.MALFORMED)
    refused(RequestHandlerRig().order("home", plan="plan-0001"), Code.MALFORMED)
    assert isinstance(rig.order("start", plan="plan-0001"), Accepted)
    (command,) = rig.handler.take_commands()
    assert command.plan == "plan-0001"


def test_a_goto_counts_at_its_own_node_alone() -> None:
    rig = RequestHandlerRig()
    told = refused(rig.order("goto", node="A2", counts=[{"node": "A2"}, {"node": "A3"}]), Code.MALFORMED)
    assert told == "the counts of a goto are of its own node, here A2"
    assert isinstance(rig.order("goto", node="A2", counts=[{"node": "A2"}]), Accepted)


def test_the_largest_plan_of_usual_names_fits_into_a_request() -> None:
    nodes = tuple(f"AISLE-12.{i}" for i in range(MOST_NODES))
    levels = tuple(range(1, 10))
    sides = [(NodeCount(one, "left", levels), NodeCount(one, "right", levels)) for one in nodes]
    counts = tuple(itertools.chain.from_iterable(sides))
    request = PlanFlight(version=VERSION, id="x" * 32, nodes=nodes, counts=counts)
    assert len(msgspec.json.encode(request)) < MAX_REQUEST_BYTES / 2


def test_a_plan_over_nodes_and_a_goto_may_end_by_waiting_and_nothing_else() -> None:
    rig = waiting()
    assert isinstance(rig.plan("A2", waits=True), Planned)
    flies = RequestHandlerRig()
    assert isinstance(flies.order("goto", node="A3", waits=True), Accepted)
    commands = (*rig.handler.take_commands(), *flies.handler.take_commands())
    assert [(command.kind, command.waits) for command in commands] == [
        (CommandKind.PLAN, True),
        (CommandKind.GOTO, True),
    ]
    refused(flies.order("pause", waits=True), Code.MALFORMED)
    refused(flies.order("goto", node="A3", waits=True, lands=True), Code.MALFORMED)
    refused(flies.order("home", lands=True), Code.MALFORMED)
    refused(flies.order("goto", node="A3", lands=True), Code.NODE)
    assert isinstance(flies.order("goto", node="A1", lands=True), Accepted)
    refused(rig.plan(waits=True), Code.MALFORMED)


def test_what_is_counted_at_each_node_reaches_the_mission_and_is_told_of_the_plan() -> None:
    rig, flies = waiting(), RequestHandlerRig()
    told = [{"node": "A2", "side": "left", "levels": [1]}, {"node": "A3"}]
    assert isinstance(rig.plan("A2", "A3", counts=told), Planned)
    assert isinstance(flies.order("goto", node="A3", counts=[]), Accepted)
    (plan,), (goto,) = rig.handler.take_commands(), flies.handler.take_commands()
    assert plan.counts == (ShelfCount("A2", "left", (1,)), ShelfCount("A3"))
    assert goto.counts == (), "nothing"
    mission = pilot_of(CONFIG.with_values(mission={"autostart": False}), SITE).mission
    mission.command(plan, rig.now_ns)
    answer = PlanAnswers(mission, "s").standing(AskPlan(version=VERSION, id="request-1"))
    assert answer.counts == (NodeCount("A2", "left", (1,)), NodeCount("A3"))
    refused(flies.order("pause", counts=[]), Code.MALFORMED)
    refused(rig.plan(counts=told), Code.MALFORMED)
    refused(rig.plan(counts=[], dry=True), Code.MALFORMED)
    refused(rig.plan("A2", counts=[{"node": "A2", "side": "up"}]), Code.MALFORMED)
    refused(rig.plan("A2", counts=[{"node": "A2", "levels": [0]}]), Code.MALFORMED)


def test_what_a_client_leaves_out_a_daemon_of_before_need_not_know() -> None:
    order = Order(version=1, id="order-0001", command=CommandKind.GOTO, node="A2")
    assert msgspec.json.decode(msgspec.json.encode(order)).keys() == {
        "op",
        "version",
        "id",
        "command",
        "node",
    }
