"""Places that no picture came of: told, looked at again, and told at the end where they stay so."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flightd.config.sweep import ScanMode
from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, CodeSet, Occupancy
from flightd.core.types import Phase
from tests.unit.mission.hover import GOODS, LOCATIONS, PARAMS, Hover
from tests.unit.mission.test_sweep_flight import PLACES, Sweep, config

REVISITS = PARAMS.expert.revisits
AT_A2 = {code for code in PLACES if code.split("-")[1] == "02"}


def without_pictures(gone: Callable[[Sweep], bool]) -> Sweep:
    """A count by stops whose front camera gives no picture while it is `gone`."""
    flight = Sweep(config().with_values(scan={"mode": ScanMode.STOP}))
    take = flight.scanner.take

    def give(codes: CodeSet, pose: BodyPose) -> None:
        if not gone(flight):
            take(codes, pose)

    flight.scanner.take = give  # type: ignore[method-assign]
    return flight


def test_a_node_at_which_the_front_camera_was_gone_is_visited_again() -> None:
    flight = without_pictures(
        lambda flight: flight.mission.goal.node == "A2" and "A2" not in flight.said("visited")
    )
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.said("unanswered") == [f"{len(AT_A2)} places at A2 have no answer: no picture came"]
    assert flight.said("recount") == ["A2 to visit again"]
    assert flight.states == dict.fromkeys(PLACES, LocationState.READ)
    flight.down()
    assert flight.phase is Phase.DONE
    flight.events += flight.mission.drain_events()
    assert len(flight.said("unanswered")) == 1, "all have one by now"


def test_what_stays_without_an_answer_is_told_at_the_end() -> None:
    flight = without_pictures(lambda flight: flight.mission.goal.node == "A2")
    flight.fly(900.0)
    flight.down()
    flight.events += flight.mission.drain_events()
    assert flight.phase is Phase.DONE
    at_node = f"{len(AT_A2)} places at A2 have no answer: no picture came"
    at_end = f"{len(AT_A2)} places that were to be counted have no answer, at A2"
    assert flight.said("unanswered") == [at_node] * (1 + REVISITS) + [at_end]
    assert len(flight.said("recount")) == REVISITS
    assert set(flight.states) == set(PLACES) - AT_A2


@pytest.mark.parametrize("shown", [1, 0])
def test_what_no_picture_shows_is_told_and_not_looked_for_again(shown: int) -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    hover.run(dict.fromkeys(LOCATIONS[:shown], Occupancy.UNSURE), {})
    (event,) = hover.scanner.drain_events()
    left = len(LOCATIONS) - shown
    assert (event.name, event.text) == (
        "unanswered", f"{left} places at A2 have no answer: no picture showed them",
    )  # fmt: skip
    assert hover.scanner.take_due() == ()


def test_a_scan_that_answers_everything_has_nothing_to_tell() -> None:
    hover = Hover()
    hover.run(GOODS, {code: (f"{code} P",) for code in LOCATIONS})
    hover.scanner.home(certain=True)
    hover.scanner.end(hover.now_ns)
    assert hover.scanner.drain_events() == []
    assert hover.scanner.take_due() == ()
