"""What views in passing decide together, and what they leave for a stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.scan import ScanConfig
from flightd.core.inventory import LocationState, PlaceFill
from flightd.core.scanning import (
    Finding,
    Light,
    Occupancy,
    PictureWorth,
    PlaceLook,
)
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.mission.scan.code_votes import SeenRead
from flightd.mission.scan.location_votes import LocationVotes
from flightd.mission.scan.sweep_votes import SweepVotes, Undecided
from tests.unit.mission.shelves import pose, read

CODE = "AL-02-1-1"
PARAMS = ScanConfig()
QUAD = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
GOODS, EMPTY, UNSURE = Occupancy.GOODS, Occupancy.EMPTY, Occupancy.UNSURE


def placed(text: str, x_m: float = 1.0, *, sure: bool = True) -> PlacedRead:
    return PlacedRead(read(text, sure=sure), CODE, CODE, x_m, 0.9, 0.06, 0.999)


def verdict(
    views: Sequence[Sequence[PlacedRead]],
    seen: Sequence[Occupancy] = (GOODS,) * 6,
    *,
    step_deg: float = 8.0,
    light: Light = Light.FAIR,
    share: float = 1.0,
    doubtful: Sequence[str] = (),
    others: Sequence[str] = (),
) -> Finding | Undecided:
    votes = SweepVotes(CODE, "A2", PARAMS, 1.0)
    for seq, (reads, occupancy) in enumerate(zip(views, seen, strict=False)):
        look = PlaceLook(CODE, QUAD, share, occupancy, f"picture {seq}", light, code=bool(reads))
        bearing = math.radians(step_deg * (seq - 2))
        here = pose(seq * 250_000_000)
        votes.add(seq, here, look, reads, bearing_rad=bearing, doubtful=doubtful)
    return votes.verdict(others)


def state(found: Finding | Undecided) -> LocationState | Undecided:
    return found.state if isinstance(found, Finding) else found


Told: TypeAlias = Callable[..., tuple[str, list[str], list[tuple[str, int]]]]


def stopped(
    views: Sequence[Sequence[PlacedRead]], others: Sequence[str] = (), passed: Sequence[SeenRead] = ()
) -> tuple[str, list[str], list[tuple[str, int]]]:
    """What a stop before the place tells: its state, its codes, and what stayed undecided."""
    votes = LocationVotes(CODE, "A2", PARAMS.pictures, passed)
    for seq, reads in enumerate(views):
        votes.add(seq, pose(seq), PlaceLook(CODE, QUAD, 1.0, GOODS, code=bool(reads)), reads)
    return told_by(votes.finding(True, others))


def passed(
    views: Sequence[Sequence[PlacedRead]], others: Sequence[str] = ()
) -> tuple[str, list[str], list[tuple[str, int]]]:
    """The same of a flight past it."""
    return told_by(verdict(views, others=others))


def told_by(found: Finding | Undecided | None) -> tuple[str, list[str], list[tuple[str, int]]]:
    assert isinstance(found, Finding)
    codes = sorted(read.text for read in found.reads)
    return found.state.value, codes, [(code.text, code.looks) for code in found.undecided]


@pytest.mark.parametrize(
    ("sure", "occupancy", "told"),
    [
        (True, EMPTY, ("unreadable", [("PALLET 9", 1)])),
        (True, GOODS, ("unreadable", [("PALLET 9", 1)])),
        (False, EMPTY, ("empty", [])),
        (False, GOODS, ("unreadable", [])),
    ],
)
def test_where_a_code_was_surely_read_in_passing_no_stop_tells_an_empty_place(
    sure: bool, occupancy: Occupancy, told: tuple[str, list[tuple[str, int]]]
) -> None:
    votes = LocationVotes(CODE, "A2", PARAMS.pictures, [(placed("PALLET 9", sure=sure), 1)])
    fill = PlaceFill(0.0) if occupancy is EMPTY else None
    for seq in range(4):
        votes.add(seq, pose(seq), PlaceLook(CODE, QUAD, 1.0, occupancy, fill=fill), ())
    state_told, codes, undecided = told_by(votes.finding(True))
    assert ((state_told, undecided), codes) == (told, [])


UNSURE_READ = read("109481000094", sure=False)
NOTHING_AT_ALL: Sequence[Sequence[PlacedRead]] = ((),) * 8
NOTHING: Sequence[Sequence[PlacedRead]] = ((),) * 6


def test_reads_of_several_views_are_merged() -> None:
    one = [placed("P1")]
    found = verdict([(), one, (), one, (), ()])
    assert isinstance(found, Finding)
    assert (found.state, [r.text for r in found.reads], found.reads[0].agreeing) == (
        LocationState.READ, ["P1"], 2,
    )  # fmt: skip
    assert found.evidence in {"picture 1", "picture 3"}


def test_a_picture_of_the_place_is_kept_until_there_is_one_that_is_worth_more() -> None:
    votes = SweepVotes(CODE, "A2", PARAMS, 0.8)
    assert votes.kept < PictureWorth(False, False, 0.0)

    def kept(seq: int, share: float, reads: Sequence[PlacedRead], light: Light = Light.FAIR) -> PictureWorth:
        look = PlaceLook(CODE, QUAD, share, GOODS, f"picture {seq}", light, code=bool(reads))
        votes.add(seq, pose(seq), look, reads, bearing_rad=0.0)
        return votes.kept

    part = PictureWorth(False, True, 0.4)
    assert kept(1, 0.4, ()) == part
    assert kept(2, 0.6, (), Light.BURNT) == part
    assert kept(3, 0.6, [placed("P1")]) == PictureWorth(True, True, 0.6)
    assert kept(4, 0.8, ()) == PictureWorth(True, True, 0.6)
    assert kept(5, 0.8, [placed("P1")]) == PictureWorth(True, True, 1.0)  # no picture of this leg shows more
    found = votes.verdict()
    assert isinstance(found, Finding)
    assert found.evidence == "picture 5"


def test_what_one_view_alone_gives_is_visited_again() -> None:
    assert verdict([(), [placed("P1")], (), ()]) is Undecided.ONCE
    assert verdict([(), [placed("P1", sure=False)], (), ()]) is Undecided.ONCE


def test_several_looks_at_one_picture_are_one_view() -> None:
    """Scaled and turned, one picture says what it says again."""
    often = replace(placed("P1", sure=False), read=replace(read("P1", sure=False), agreeing=3))
    assert verdict([(), [often], (), ()]) is Undecided.ONCE
    assert stopped([(), [often], (), ()]) == ("unreadable", [], [("P1", 1)])
    sure = replace(often, read=replace(often.read, sure=True))
    assert verdict([(), [sure], (), ()]) is Undecided.ONCE
    for found in (verdict([(), [often], [often], ()]), verdict([(), [sure], [sure], ()])):
        assert isinstance(found, Finding)
        assert [(read.text, read.agreeing) for read in found.reads] == [("P1", 2)]
    assert stopped([(), [often], [often], ()]) == ("read", ["P1"], [])


def test_a_stop_looks_on_while_one_picture_alone_gives_a_code() -> None:
    often = replace(placed("P1"), read=replace(read("P1"), agreeing=3))
    votes = LocationVotes(CODE, "A2", PARAMS.pictures)
    for seq, reads in enumerate([[often], [], [], [], []]):
        votes.add(seq, pose(seq), PlaceLook(CODE, QUAD, 1.0, GOODS, code=bool(reads)), reads)
        assert votes.finding(final=False) is None
    found = votes.finding(final=True)
    assert found is not None
    assert (found.state, found.reads[0].agreeing) == (LocationState.READ, 1), "a checksum vouches for it"


def test_two_codes_are_two_labels_only_where_a_view_shows_both() -> None:
    one, two = placed("P1", 0.9), placed("P2", 1.2)
    assert state(verdict([[one, two], [one], [two], [one, two]])) is LocationState.SEVERAL
    assert verdict([[one], [one], [two], [two]]) is Undecided.APART


def test_one_label_read_differently_decides_nothing() -> None:
    one, two = [placed("P1")], [placed("P2")]
    assert verdict([one, one, two, two, (), ()]) is Undecided.TORN
    assert stopped([one, one, one, two, two, ()]) == ("unreadable", [], [("P1", 3), ("P2", 2)])


def test_half_a_code_at_the_pictures_edge_does_not_make_another_of_its_label() -> None:
    """Cut off, an EAN-13 is read as a UPC-E whose check digit nothing vouches for."""
    whole = [placed("4094819312344")]
    half = [replace(placed("109481000094", sure=False), read=replace(UNSURE_READ, agreeing=2))]
    found = verdict([whole, whole, whole, half])
    assert isinstance(found, Finding)
    assert [read.text for read in found.reads] == ["4094819312344"]
    assert verdict([whole, whole, half]) is Undecided.TORN, "too few to overrule it"
    assert verdict([whole, whole, whole, half, half]) is Undecided.TORN, "more than a slip"
    beside = [replace(half[0], x_m=1.2)]
    assert verdict([whole, whole, whole, beside]) is Undecided.ONCE
    assert verdict([whole, whole, whole, [placed("P2")]]) is Undecided.TORN, "vouched for, too"


@pytest.mark.parametrize("told", [stopped, passed])
def test_a_second_label_that_stays_in_doubt_is_told_beside_the_code(told: Told) -> None:
    label, second = placed("4094819312344"), placed("070429", 1.3, sure=False)
    part = replace(second, read=replace(UNSURE_READ, agreeing=3, whole=False))
    assert told([[label]] * 4) == ("read", ["4094819312344"], [])
    assert told([[label], [label, second], [label], [label]]) == (
        "read", ["4094819312344"], [("070429", 1)],
    )  # fmt: skip
    other = placed("070428", 1.3, sure=False)
    torn = [[label, second], [label, other, part], [label, part], [label]]
    assert told(torn) == (
        "read", ["4094819312344"], [("109481000094", 2), ("070429", 1), ("070428", 1)],
    )  # fmt: skip


def test_a_second_label_that_one_view_gives_in_passing_is_told_where_the_stop_does_not_see_it() -> None:
    label, second = placed("P1"), placed("P2", 1.3)
    views = [[label, second], [label], [label], [label]]
    assert verdict(views) is Undecided.ONCE
    votes = SweepVotes(CODE, "A2", PARAMS, 1.0)
    for seq, reads in enumerate(views):
        votes.add(seq, pose(seq), PlaceLook(CODE, QUAD, 1.0, GOODS), reads, bearing_rad=0.0)

    def then(*reads: PlacedRead) -> tuple[str, list[str], list[tuple[str, int]]]:
        return stopped([reads] * 4, passed=votes.reads)

    assert then(label) == ("read", ["P1"], [("P2", 1)])
    assert then(label, second) == ("several", ["P1", "P2"], [])
    assert then(second) == ("read", ["P2"], [("P1", 4)])
    assert then(placed("P3")) == ("read", ["P3"], [("P2", 1)]), "one label, read otherwise in passing"


@pytest.mark.parametrize("told", [stopped, passed])
def test_no_misread_of_a_label_that_was_read_nor_the_places_own_or_a_neighbours_is_told(told: Told) -> None:
    label = placed("4094819312344")

    def with_once(*doubtful: PlacedRead, others: Sequence[str] = ()) -> list[tuple[str, int]]:
        return told([[label], [label, *doubtful], [label], [label]], others)[2]

    misread = placed("109481000094", 1.02, sure=False)
    assert with_once(misread) == []
    assert with_once(replace(misread, height_m=1.1)) == [("109481000094", 1)]
    beside = replace(misread, x_m=1.05)
    assert with_once(beside) == [("109481000094", 1)]
    assert with_once(replace(beside, read=replace(UNSURE_READ, whole=False))) == [], "half of it"
    assert with_once(placed("948193", 1.3, sure=False)) == [], "a part of the code, on its second copy"
    assert with_once(placed("02-1-1", 1.3, sure=False)) == [], "a part of the location's label"
    assert with_once(placed("070429", 1.3, sure=False), others=["070429"]) == []


def test_what_may_be_a_part_of_a_longer_code_is_left_for_a_stop_and_is_unreadable_there() -> None:
    part = replace(placed("109481000094", sure=False), read=replace(UNSURE_READ, agreeing=3, whole=False))
    assert verdict([[part]] * 6) is Undecided.PART
    stop = LocationVotes(CODE, "A2", PARAMS.pictures)
    for seq in range(6):
        stop.add(seq, pose(seq), PlaceLook(CODE, QUAD, 1.0, GOODS, f"picture {seq}"), [part])
        assert stop.finding(final=False) is None
    found = stop.finding(final=True)
    assert found is not None
    assert (found.state, found.reads) == (LocationState.UNREADABLE, ())


def test_a_neighbours_goods_in_a_cut_off_view_leave_an_empty_place_empty() -> None:
    def seen(*views: tuple[float, Occupancy]) -> LocationState | Undecided:
        votes = SweepVotes(CODE, "A2", PARAMS, 1.0)
        for seq, (share, occupancy) in enumerate(views):
            look = PlaceLook(CODE, QUAD, share, occupancy, f"picture {seq}")
            votes.add(seq, pose(seq * 250_000_000), look, (), bearing_rad=math.radians(8.0 * seq))
        return state(votes.verdict())

    empty, unsure = (0.95, EMPTY), (1.0, UNSURE)
    assert seen((0.7, GOODS), empty, unsure, empty, empty, empty) is LocationState.EMPTY
    assert seen((0.7, GOODS), empty, unsure, empty, empty) is Undecided.UNSURE
    assert seen((0.95, GOODS), empty, unsure, empty, empty, empty) is Undecided.UNSURE


def test_empty_takes_as_many_views_as_at_a_stop() -> None:
    assert state(verdict(NOTHING, [UNSURE, EMPTY, EMPTY, EMPTY, UNSURE])) is LocationState.EMPTY
    assert not isinstance(verdict(NOTHING, [EMPTY, EMPTY]), Finding)
    assert not isinstance(verdict(NOTHING, [EMPTY, EMPTY, EMPTY, GOODS]), Finding)


def test_no_place_is_empty_in_which_most_views_see_goods_beside_its_middle() -> None:
    def seen(*views: tuple[Occupancy, float | None]) -> LocationState | Undecided:
        votes = SweepVotes(CODE, "A2", PARAMS, 1.0)
        stop = LocationVotes(CODE, "A2", PARAMS.pictures)
        for seq, (occupancy, share) in enumerate(views):
            look = PlaceLook(CODE, QUAD, 1.0, occupancy, f"picture {seq}", fill=PlaceFill(share))
            votes.add(seq, pose(seq * 250_000_000), look, (), bearing_rad=math.radians(8.0 * seq))
            stop.add(seq, pose(seq * 250_000_000), look, ())
        told = stop.finding(final=True)
        is_empty = told is not None and told.state is LocationState.EMPTY
        found = state(votes.verdict())
        assert is_empty == (found is LocationState.EMPTY)
        return found

    clear, aside, unknown = (EMPTY, 0.0), (UNSURE, 0.2), (UNSURE, None)
    assert seen(clear, clear, clear, aside, aside, unknown) is LocationState.EMPTY
    assert seen(aside, aside, clear, clear, clear, aside, aside) is Undecided.UNSURE


def test_unreadable_takes_goods_enough_views_angles_and_light() -> None:
    assert state(verdict(NOTHING)) is LocationState.UNREADABLE
    assert state(verdict(NOTHING, (Occupancy.COVERED,) * 6)) is LocationState.OCCLUDED
    assert verdict(NOTHING, (GOODS,) * 3) is Undecided.UNSEEN
    assert verdict(NOTHING, step_deg=1.0) is Undecided.UNSEEN
    assert verdict(NOTHING, share=0.7) is Undecided.UNSEEN
    assert verdict(NOTHING, light=Light.BURNT) is Undecided.LIGHT
    assert verdict(NOTHING, (UNSURE,) * 6, step_deg=3.0) is Undecided.UNSURE
    assert state(verdict(NOTHING, (UNSURE,) * 6)) is LocationState.UNREADABLE


def test_what_looked_empty_to_some_views_is_not_said_to_be_unreadable() -> None:
    unsure = (UNSURE,) * 8
    assert state(verdict(NOTHING_AT_ALL, unsure)) is LocationState.UNREADABLE
    for empty in (1, 2):
        seen = (*unsure[empty:], *(EMPTY,) * empty)
        assert state(verdict(NOTHING_AT_ALL, seen)) is Undecided.UNSURE


def state_at_stop(seen: Sequence[Occupancy], burnt: int) -> LocationState | None:
    """By looks of which one is burnt out, from where no deck would show."""
    stop = LocationVotes(CODE, "A2", PARAMS.pictures)
    for seq, occupancy in enumerate(seen):
        light = Light.BURNT if seq == burnt else Light.FAIR
        look = PlaceLook(CODE, QUAD, 1.0, occupancy, f"picture {seq}", light, deck=False)
        stop.add(seq, pose(seq * 250_000_000), look, ())
    told = stop.finding(final=True)
    return None if told is None else told.state


def test_from_where_no_deck_would_show_nothing_is_said_to_be_empty_or_unreadable_for_want_of_one() -> None:
    def seen(*views: tuple[Occupancy, bool]) -> tuple[LocationState | Undecided, LocationState | None]:
        votes, stop = SweepVotes(CODE, "A2", PARAMS, 1.0), LocationVotes(CODE, "A2", PARAMS.pictures)
        for seq, (occupancy, deck) in enumerate(views):
            look = PlaceLook(CODE, QUAD, 1.0, occupancy, f"picture {seq}", deck=deck)
            votes.add(seq, pose(seq * 250_000_000), look, (), bearing_rad=math.radians(8.0 * seq))
            stop.add(seq, pose(seq * 250_000_000), look, ())
        told = stop.finding(final=True)
        return state(votes.verdict()), None if told is None else told.state

    low, hidden, empty = (UNSURE, False), (UNSURE, True), (EMPTY, True)
    assert seen(*[hidden] * 8)[0] is LocationState.UNREADABLE
    assert seen(*[low] * 8)[0] is Undecided.UNSURE
    assert seen(empty, low, empty, low, low, empty) == (LocationState.EMPTY, LocationState.EMPTY)
    assert seen(low, empty, low, empty)[1] is LocationState.EMPTY
    assert seen(empty, hidden, empty, low, hidden, empty)[1] is LocationState.UNREADABLE
    assert seen(low, (GOODS, False), empty, empty, empty)[1] is LocationState.UNREADABLE
    assert state_at_stop([EMPTY, GOODS, EMPTY, EMPTY], burnt=1) is LocationState.UNREADABLE


def test_a_code_that_may_be_a_neighbours_leaves_no_place_without_a_code() -> None:
    assert verdict(NOTHING, doubtful=["P1"]) is Undecided.NOBODYS
    assert state(verdict(NOTHING, doubtful=["P1"], others=["P1"])) is LocationState.UNREADABLE


LABELS = st.sampled_from(["", "P1", "P2"])


@given(
    st.lists(st.tuples(LABELS, LABELS, st.sampled_from(Occupancy), st.booleans()), max_size=10),
    st.floats(0.0, 12.0),
)
def test_nothing_is_decided_against_what_any_view_shows(
    views: list[tuple[str, str, Occupancy, bool]], step_deg: float
) -> None:
    reads = [
        [placed(text, x_m, sure=sure) for text, x_m in ((left, 0.9), (right, 1.2)) if text]
        for left, right, _, sure in views
    ]
    found = verdict(reads, [seen for _, _, seen, _ in views], step_deg=step_deg)
    if not isinstance(found, Finding):
        return
    given_by = {text: sum(text in {left, right} for left, right, *_ in views) for text in ("P1", "P2")}
    for code in found.reads:
        assert given_by[code.text] >= 2
    if found.state is LocationState.EMPTY:
        assert not any(given_by.values())
        assert sum(seen is EMPTY for _, _, seen, _ in views) >= PARAMS.pictures
        assert not any(seen in {GOODS, Occupancy.COVERED} for _, _, seen, _ in views)
    if found.state in {LocationState.UNREADABLE, LocationState.OCCLUDED}:
        assert not any(given_by.values())
        assert len(views) >= PARAMS.sweep.unread_views
