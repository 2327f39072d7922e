"""Which of the lines held may still be held against the map."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from flightd.tracking.held_lines import HeldLine, awaits_survey, unsurveyed


@st.composite
def held_lines(draw: st.DrawFn) -> list[HeldLine]:
    """Up to five lines and features; only a line that is sure was ever held against the map."""
    held: list[HeldLine] = []
    for number in range(draw(st.integers(0, 5))):
        line = HeldLine(number, draw(st.integers(0, 1)), 0.05, 0, -1.0, 1.0, 0.0, 0.0)
        line.hits, line.feature = draw(st.integers(1, 4)), draw(st.none() | st.just(number))
        line.surveyed = line.is_sure and line.feature is None and draw(st.booleans())
        held.append(line)
    return held


@given(held_lines(), st.integers(0, 1))
def test_a_survey_is_awaited_exactly_where_a_map_of_all_lines_would_tell_something(
    held: list[HeldLine], axis: int
) -> None:
    """Else where they lie on the map need not be looked up, sixty times a second."""
    mapped = {line.id for line in held if line.feature is None}
    assert awaits_survey(held, axis) == bool(list(unsurveyed(held, axis, mapped, float)))
