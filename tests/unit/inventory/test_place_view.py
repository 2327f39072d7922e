"""What is shown of a place: what counts, what is not booked yet, what was withdrawn."""

from __future__ import annotations

import pytest

from flightd.core.inventory import LocationRecord, LocationState, Observation, Standing
from flightd.core.told_codes import told_codes
from flightd.core.types import CodeRead
from flightd.inventory.place_view import PlaceView, ShownState, place_views, view_of_told


def look(at: int, state: LocationState, *texts: str) -> Observation:
    reads = tuple(CodeRead("QR Code", text, (), True, 1, 1.0) for text in texts)
    return Observation("run", "A-1", at, state, 0.5, reads)


def shown(*looks: tuple[Observation, Standing]) -> PlaceView:
    booked = [seen for seen, standing in looks if standing is Standing.CONFIRMED]
    record = LocationRecord("A-1", "N1", booked[-1] if booked else None)
    (view,) = place_views([record], looks)
    return view


EMPTY, READ = look(1, LocationState.EMPTY), look(2, LocationState.READ, "X")


def test_the_newest_look_that_counts_is_shown() -> None:
    view = shown((EMPTY, Standing.CONFIRMED), (READ, Standing.CONFIRMED))
    assert (view.state, view.texts, view.pending, view.confidence) == (ShownState.READ, ("X",), False, 0.5)


def test_a_newer_look_that_is_not_booked_yet_is_shown_as_such() -> None:
    view = shown((EMPTY, Standing.CONFIRMED), (READ, Standing.PENDING))
    assert (view.state, view.pending) == (ShownState.READ, True)
    view = shown((EMPTY, Standing.PENDING), (READ, Standing.CONFIRMED))
    assert (view.state, view.pending) == (ShownState.READ, False)


def test_what_was_only_withdrawn_is_contradicted_and_counts_for_nothing() -> None:
    view = shown((READ, Standing.WITHDRAWN))
    assert (view.state, view.texts) == (ShownState.CONTRADICTED, ())
    assert shown((EMPTY, Standing.CONFIRMED), (READ, Standing.WITHDRAWN)).state is ShownState.EMPTY
    assert shown().state is ShownState.NOT_VISITED


@pytest.mark.parametrize(
    ("told", "view"),
    [
        (
            {"location": "A-1", "state": "read", "texts": "two words", "standing": "pending"},
            PlaceView("A-1", ShownState.READ, ("two words",), pending=True),
        ),
        (
            {"location": "A-1", "state": "several", "texts": "X Y", "standing": "confirmed"},
            PlaceView("A-1", ShownState.SEVERAL, ("X", "Y")),
        ),
        (
            {"location": "A-1", "state": "several", **told_codes(["LOT 12", "LOT 13", "LOT 12"])},
            PlaceView("A-1", ShownState.SEVERAL, ("LOT 12", "LOT 13")),
        ),
        (
            {"location": "A-1", "state": "read", "texts": "LOT 12", "codes": '["LOT 12'},
            PlaceView("A-1", ShownState.READ, ("LOT 12",)),
        ),
        ({"location": "A-1", "state": "of another version"}, PlaceView("A-1", ShownState.NOT_VISITED)),
        ({}, PlaceView("", ShownState.NOT_VISITED)),
    ],
)  # fmt: skip
def test_what_a_drone_tells_is_shown(told: dict[str, str], view: PlaceView) -> None:
    assert view_of_told(told) == view
