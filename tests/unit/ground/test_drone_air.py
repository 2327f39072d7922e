"""What is known of a drone that traffic does not fly: it only grows, until the drone is proved to rest."""

from __future__ import annotations

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.published import Position, StatusReport
from flightd.core.types import Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.ground.fleet.drone_air import DroneAir
from flightd.ground.fleet.fleet_floor import FleetFloor
from tests.rigs.paper_drones import PADS, PaperDrone, hall

FLOOR = FleetFloor({name: floor_status(hall(name)) for name in PADS}, PADS, CellSize())
PAD = FLOOR.pad("b")
GROUND = PaperDrone("b", hall("b"), lambda *_: None).status
B2, B3, A3 = (FLOOR.lanes.over(node) for node in ("B2", "B3", "A3"))


def told(
    phase: Phase, node: str = "", *, session: str = "b 1", armed: bool = True, off_m: float = 0.0
) -> StatusReport:
    """As a drone over a node tells it, without one as one that knows no place."""
    assert GROUND.vehicle is not None
    vehicle = msgspec.structs.replace(GROUND.vehicle, armed=armed)
    at = None
    if node:
        vertex = FLOOR.lanes.vertices[FLOOR.lanes.over(node)]
        at = Position(vertex.x_m + off_m, vertex.y_m, 0.0, 0.0, 1.0, 0.02, 0.02)
    return msgspec.structs.replace(GROUND, session=session, phase=phase, vehicle=vehicle, position=at)


def seen(*statuses: StatusReport) -> DroneAir:
    """First on the ground, then this."""
    air = DroneAir("b", FLOOR)
    for status in (GROUND, *statuses):
        air.see(status, stands_on="B1" if status.session == GROUND.session else None, ordered=False)
        air.close([], 0.0)
    return air


DOWN = told(Phase.DONE, armed=False)


@pytest.mark.parametrize(
    ("statuses", "rests", "astray"),
    [
        ((), True, False),
        ((told(Phase.PREFLIGHT, armed=False, session="b 2"),), True, False),
        ((told(Phase.FOLLOW, "B3"), told(Phase.LAND, "B1"), DOWN), True, False),
        ((told(Phase.FOLLOW, "B3"), DOWN), False, True),
        ((told(Phase.LAND), DOWN), False, True),
        ((told(Phase.LAND, "B1"), told(Phase.ABORTED, armed=False)), False, True),
        ((told(Phase.LAND, "B1"), told(Phase.PREFLIGHT, armed=False, session="b 2")), False, True),
        ((told(Phase.LAND, "B3"), told(Phase.RECOVER, "B1", session="b 2"), DOWN), False, True),
        ((told(Phase.FOLLOW, "B3", session="b 2"), told(Phase.LAND, "B1", session="b 2")), False, False),
    ],
)
def test_only_the_end_of_a_flight_that_was_seen_over_its_pad_proves_that_it_rests(
    statuses: tuple[StatusReport, ...], rests: bool, astray: bool
) -> None:
    air = seen(*statuses)
    assert (air.rests, air.is_astray, air.closed == frozenset()) == (rests, astray, rests)
    air.give_back()
    assert not air.is_astray


def test_air_grows_from_where_it_was_seen_last_and_over_all_that_it_was_released_to() -> None:
    air = seen(told(Phase.FOLLOW, "B2", off_m=0.8))
    lane = FLOOR.around((0.8 + FLOOR.lanes.vertices[B2].x_m, FLOOR.lanes.vertices[B2].y_m))
    assert lane
    assert lane <= air.closed, "the lane in hand"
    air.see(told(Phase.FOLLOW), stands_on="B1", ordered=True)
    air.close([["A3"]], 3.0)
    assert {A3, B2, PAD} | lane <= air.closed
    air.see(told(Phase.FOLLOW, "B1"), stands_on="B1", ordered=False)
    air.close([], 0.0)
    assert (A3 in air.closed, air.doubt_m) == (True, 3.0), "until it rests"
    air.give_back()
    assert (air.closed, air.doubt_m) == (frozenset(), 0.0)


def test_who_holds_beside_a_crossing_is_not_on_the_line_across() -> None:
    b2 = FLOOR.lanes.vertices[B2]
    lane = FLOOR.around((b2.x_m + 0.8, b2.y_m))
    assert len(lane) == 1
    assert [FLOOR.around((b2.x_m + 0.39, b2.y_m + off_m)) for off_m in (-0.12, 0.12)] == [lane, lane]


def test_who_holds_and_knows_his_place_again_is_beside_his_air_no_more() -> None:
    air = seen(told(Phase.HOLD, "B2"))
    closed = air.closed
    air.close([], 3.0, holds=False)
    assert air.doubt_m == 3.0
    air.see(told(Phase.HOLD, "B2"), stands_on="B1", ordered=False)
    air.close([], 0.0, holds=True)
    assert (air.doubt_m, closed <= air.closed) == (0.0, True)
    air.close([], 3.0)
    air.see(told(Phase.HOLD, "B2", session="b 2"), stands_on=None, ordered=False)
    air.close([], 0.0, holds=True)
    assert air.doubt_m == 3.0, "it began in flight"


def test_a_position_of_a_session_that_began_in_the_air_is_not_believed() -> None:
    air = seen(told(Phase.HOVER, "B3"), told(Phase.RECOVER, "B1", session="b 2"))
    assert (air.place, air.is_believed, B3 in air.closed) == (B3, False, True)
    air.give_back()
    assert B3 in air.closed, "he cannot know where it is, either"


def test_who_is_silent_with_an_order_may_have_flown() -> None:
    air = seen()
    air.see(GROUND, stands_on="B1", ordered=True)
    air.close([["B3"]], 0.0)
    assert B3 in air.closed
    air.see(told(Phase.PREFLIGHT, armed=False, session="b 2"), stands_on=None, ordered=False)
    assert air.is_astray

    air = seen()
    air.see(GROUND, stands_on="B1", ordered=True)
    air.see(GROUND, stands_on="B1", ordered=False)
    assert air.rests, "in the same session, never armed"


def test_who_is_given_back_before_it_tells_on_which_pad_it_came_down_is_asked_first() -> None:
    docked = FleetFloor({name: floor_status(hall(name, docks=("A5",))) for name in PADS}, PADS, CellSize())
    dock = docked.stand("b", "A5")
    assert dock != docked.pad("b")
    air = DroneAir("b", docked)
    steps = [(GROUND, "B1"), (told(Phase.LAND), "B1"), (told(Phase.PREFLIGHT, armed=False), None)]
    for status, stands_on in steps:
        air.see(status, stands_on=stands_on, ordered=False)
        air.close([], 0.0, pads=[dock])
    air.give_back()
    assert (air.rests, dock in air.closed) == (False, True)
    air.see(told(Phase.PREFLIGHT, armed=False), stands_on="A5", ordered=False)
    assert (air.rests, air.stand, air.place) == (True, dock, dock)
