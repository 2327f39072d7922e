"""Scanning a node: one state for each location, re-takes, time-outs; and what is booked, and when."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from flightd.app.flight_orders import nodes_to_count
from flightd.core.inventory import LocationState, UndecidedCode
from flightd.core.scanning import CountedPlace, Light, Occupancy
from flightd.core.types import CodeRead
from flightd.mission.scan.scanner import Scanner
from flightd.mission.scan.views import View
from flightd.site.racks import code_form
from flightd.site.ways import KeepOut
from tests.unit.mission.hover import (
    ASIDE_PER_HEIGHT,
    EXPERT,
    GOODS,
    LOCATIONS,
    PARAMS,
    STEP_NS,
    Hover,
    planner,
)
from tests.unit.mission.shelves import SIGHT, SITE, picture, pose, read


def test_every_state_is_told_and_each_location_has_exactly_one() -> None:
    hover = Hover()
    one, two, three, four, five, *rest = LOCATIONS
    show = GOODS | {two: Occupancy.EMPTY, three: Occupancy.COVERED, five: Occupancy.UNSURE}
    hover.run(show, {one: ("P1",), four: ("P1", "P2")} | {code: (f"{code} P",) for code in rest})
    states = {code: finding.state for code, finding in hover.found.items()}
    assert states == {
        one: LocationState.READ,
        two: LocationState.EMPTY,
        three: LocationState.OCCLUDED,
        four: LocationState.SEVERAL,
        five: LocationState.UNREADABLE,
    } | dict.fromkeys(rest, LocationState.READ)
    assert [r.text for r in hover.found[one].reads] == ["P1"]
    assert hover.found[one].evidence.endswith(one)


def test_the_best_picture_of_each_place_is_named_until_its_finding_has_gone_out() -> None:
    hover = Hover()
    hover.at_view()
    one = LOCATIONS[0]
    hover.look({one: Occupancy.GOODS})
    hover.look({one: Occupancy.UNSURE}, share=0.7)
    assert hover.scanner.evidence - {""} == {f"1:{one}"}
    for _ in range(4):
        hover.look({one: Occupancy.GOODS}, {one: ("P1",)})
    assert hover.found[one].evidence
    assert not hover.scanner.evidence - {""}


def test_what_no_picture_showed_is_not_visited() -> None:
    hover = Hover()
    hover.run({}, {})
    assert not hover.found
    assert hover.scanner.wants("A2")


def test_one_read_without_a_checksum_is_never_believed() -> None:
    hover = Hover()
    code = LOCATIONS[0]
    hover.at_view()
    here = pose(hover.now_ns + 1)
    guess = replace(hover.code(here, code, "GUESS"), sure=False)
    hover.scanner.take(picture(1, (guess,), {code: Occupancy.GOODS}, hover.now_ns + 1), here)
    hover.run(GOODS, {})
    assert hover.found[code].state is LocationState.UNREADABLE


def test_what_one_look_gives_beside_a_code_is_told_unless_it_is_a_neighbours() -> None:
    hover = Hover()
    one, two, three = LOCATIONS[:3]
    hover.at_view()
    here = pose(hover.now_ns + 1)

    def guess(code: str, text: str) -> CodeRead:
        return replace(hover.code(here, code, text), sure=False)

    reads = guess(one, "GUESS 2"), guess(three, "P2"), hover.code(here, two, "P2")
    shown = dict.fromkeys((one, two, three), Occupancy.GOODS)
    hover.scanner.take(picture(1, reads, shown, hover.now_ns + 1), here)
    labels: dict[str, tuple[str, ...]] = {code: (f"{code} P",) for code in LOCATIONS}
    hover.run(GOODS, labels | {two: ("P2",)})
    states = {finding.state for finding in hover.found.values()}
    assert states == {LocationState.READ}
    told = {code: found.undecided for code, found in hover.found.items() if found.undecided}
    assert told == {one: (UndecidedCode("QR Code", "GUESS 2", 1),)}


def test_two_texts_of_one_label_cancel_each_other() -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    code = LOCATIONS[0]
    hover.at_view()
    for text in ("ONE", "ONE", "TWO", "TWO"):
        hover.seq += 1
        hover.now_ns += STEP_NS
        here = pose(hover.now_ns)
        label = replace(hover.code(here, code, "same place"), text=text)
        hover.scanner.take(picture(hover.seq, (label,), {code: Occupancy.GOODS}, hover.now_ns), here)
    hover.run(GOODS, {})
    assert hover.found[code].state is LocationState.UNREADABLE


def test_the_undecided_is_looked_at_again_from_nearer_and_then_given_up() -> None:
    hover = Hover()
    hover.run(GOODS, {code: (code + " P",) for code in LOCATIONS[1:]})
    first, *again = [view for view in hover.views if LOCATIONS[0] in view.locations]
    assert first.retake == 0
    assert [view.retake for view in again] == [1, 2]
    assert all(view.locations == (LOCATIONS[0],) for view in again)
    assert abs(again[0].y_m) > 0.1, "nearer"
    assert all(abs(SITE.locations[LOCATIONS[0]].y_m - view.y_m) >= PARAMS.clearance_m for view in again)
    assert hover.found[LOCATIONS[0]].state is LocationState.UNREADABLE


def test_a_view_without_pictures_times_out() -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    hover.at_view()
    assert not hover.scanner.step(hover.now_ns + round(0.9 * PARAMS.view_s * 1e9))
    assert hover.scanner.step(hover.now_ns + round(1.1 * PARAMS.view_s * 1e9))


def test_pictures_exposed_on_the_way_tell_nothing() -> None:
    hover = Hover()
    view = hover.at_view()
    before = pose(hover.now_ns - 1)
    assert hover.scanner.places(before) == ()
    for seq in range(5):
        shown = dict.fromkeys(view.locations, Occupancy.EMPTY)
        hover.scanner.take(picture(seq, (), shown, hover.now_ns - 1), before)
    hover.gather()
    assert not hover.found


def test_no_height_of_a_side_is_flown_twice() -> None:
    views = Hover().planner.views("A2", frozenset(LOCATIONS), 1.0, -math.pi / 2)
    heights = [(view.side, view.height_m) for view in views]
    assert len(heights) == len(set(heights))
    assert [view.height_m for view in views] == sorted(view.height_m for view in views[:2]) + sorted(
        (view.height_m for view in views[2:]), reverse=True
    )


def counted_at(scanner: Scanner, node: str = "A2") -> None:
    """Count everything of a node as empty."""
    scanner.arrive(node, 1.0, -math.pi / 2)
    now_ns = 10**9
    while (view := scanner.view) is not None:
        scanner.begin(now_ns)
        over = False
        while not over:
            now_ns += STEP_NS
            here = pose(now_ns, x_m=view.x_m, height_m=view.height_m, yaw_rad=view.yaw_rad)
            shown = dict.fromkeys(view.locations, Occupancy.EMPTY)
            scanner.take(picture(now_ns // STEP_NS, (), shown, now_ns), here)
            over = scanner.step(now_ns)
    scanner.leave()


def test_findings_stay_pending_until_two_more_nodes_are_reached_without_a_doubt() -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    counted_at(scanner)
    found, settled = scanner.drain()
    assert {f.location for f in found} == set(LOCATIONS)
    assert settled == ()
    scanner.reached("A3", certain=True)
    scanner.reached("A4", certain=False)
    assert scanner.drain() == ((), ())
    scanner.reached("A4", certain=True)
    (proof,) = scanner.drain()[1]
    assert proof.confirmed
    assert set(proof.locations) == set(LOCATIONS)


def test_coming_home_proves_everything() -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    counted_at(scanner)
    scanner.home(certain=True)
    assert [s.confirmed for s in scanner.drain()[1]] == [True]


def test_a_contradicting_location_label_withdraws_what_is_pending() -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    counted_at(scanner)
    scanner.drain()
    scanner.arrive("A3", 1.0, -math.pi / 2)
    scanner.begin(10**9)
    wrong = next(p.code for p in SITE.locations.values() if p.node == "A1")
    here = pose(10**9 + STEP_NS, x_m=2.6)
    scanner.take(picture(1, (read(wrong),), {}, here.stamp_ns), here)
    (withdrawn,) = scanner.drain()[1]
    assert not withdrawn.confirmed
    assert set(withdrawn.locations) == set(LOCATIONS)
    assert [event.name for event in scanner.drain_events()] == ["map_contradiction"]
    assert not scanner.wants("A3"), "nothing is assigned while the place is in doubt"
    scanner.trust()
    assert scanner.wants("A2"), "the withdrawn is left to count"


@pytest.mark.parametrize("moved", [True, False])
def test_a_label_that_told_a_wrong_place_is_heeded_again_and_one_that_hangs_wrong_is_not(moved: bool) -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    wrong = next(p.code for p in SITE.locations.values() if p.node == "A1")

    def doubted_at(now_ns: int) -> bool:
        scanner.arrive("A3", 1.0, -math.pi / 2)
        scanner.begin(now_ns)
        here = pose(now_ns + STEP_NS, x_m=2.6)
        scanner.take(picture(1, (read(wrong),), {}, here.stamp_ns), here)
        return scanner.doubted

    assert doubted_at(10**9)
    if moved:
        scanner.withdraw(2 * 10**9, "the position was 1.30 m off")
    scanner.trust(moved=moved)
    assert not scanner.doubted
    assert doubted_at(3 * 10**9) is moved


def test_a_code_that_may_be_its_own_is_no_empty_place() -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    code = LOCATIONS[0]
    hover.at_view()
    border = hover.assigner.cells[code].x0_m
    for _ in range(5):
        hover.seq += 1
        hover.now_ns += STEP_NS
        here = pose(hover.now_ns)
        x = (border + 0.02 - here.x_m) / 1.2 * SIGHT.lens.fx_px
        stray = read("PALLET", x, 0.0)
        hover.scanner.take(picture(hover.seq, (stray,), {code: Occupancy.EMPTY}, hover.now_ns), here)
    hover.run({code: Occupancy.EMPTY}, {})
    assert hover.found[code].state is LocationState.UNREADABLE


def test_an_agreeing_location_label_proves_its_node_at_once() -> None:
    hover = Hover()
    hover.at_view()
    one = LOCATIONS[0]
    for _ in range(3):
        hover.look(GOODS, {one: ("P1",)})
    right = SITE.locations[one]
    here = pose(hover.now_ns + 1)
    x = (right.x_m - here.x_m) / 1.2 * SIGHT.lens.fx_px
    hover.scanner.take(picture(99, (read(one, x, 0.0),), {}, here.stamp_ns), here)
    assert [(s.confirmed, s.locations) for s in hover.scanner.drain()[1]] == [(True, (one,))]


def test_a_count_that_goes_on_visits_only_what_is_left() -> None:
    counted = {place.code for place in SITE.locations.values() if place.node != "A3"}
    assert nodes_to_count(SITE, ("A1", "A2", "A3", "A4"), counted) == ("A3",)
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    scanner.go_on_with(map(CountedPlace, counted))
    assert not scanner.wants("A2")
    assert scanner.wants("A3")


@pytest.mark.parametrize("offset_m", [-0.3, 0.0, 0.3])
def test_a_re_take_at_the_end_of_an_aisle_stays_over_its_line(offset_m: float) -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    scanner.arrive("A1", 1.0, -math.pi / 2)
    view = scanner.view
    assert view is not None
    shifted = planner(SITE).retake(replace(view, x_m=view.x_m + offset_m), view.locations)
    assert shifted is not None
    assert shifted.x_m >= SITE.nodes["A1"].x_m


def test_re_takes_stay_clear_of_keep_outs() -> None:
    node = SITE.nodes["A2"]

    def retakes(*areas: KeepOut) -> list[View]:
        site = replace(SITE, keep_outs=areas)
        scanner = Scanner(site, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
        scanner.arrive("A2", 1.0, -math.pi / 2)
        found, view = [], scanner.view
        while view is not None and (view := planner(site).retake(view, view.locations)) is not None:
            found.append(view)
        return found

    free = retakes()
    (nearer, *_) = free
    assert abs(nearer.x_m - node.x_m) > 0.1
    assert abs(nearer.y_m - node.y_m) > 0.1
    beside = KeepOut(node.x_m + 0.65, -9.0, node.x_m + 0.75, 9.0, 0.0, 3.0)
    before = KeepOut(-9.0, -0.75, 9.0, -0.65, 0.0, 3.0)
    for area in (beside, before):
        assert (
            not replace(SITE, keep_outs=(area,)).between(0.0, 9.0).is_closed(SITE.edges[0]) or area is beside
        )
        views = retakes(area)
        assert views
        assert all(not area.touches(v.x_m, v.y_m, node.x_m, node.y_m) for v in views)
    assert retakes(beside, before, replace(beside, x0_m=node.x_m - 0.75, x1_m=node.x_m - 0.65)) != free
    assert retakes(replace(beside, from_m=5.0, to_m=6.0)) == free, "far above, it is in nobody's way"


def test_a_location_label_is_told_to_the_localiser_with_its_way_from_the_drone() -> None:
    hover = Hover()
    view = hover.at_view()
    label = SITE.locations[view.locations[0]]
    here = pose(hover.now_ns + 1)
    x = (label.x_m - here.x_m) / 1.2 * SIGHT.lens.fx_px
    hover.scanner.take(picture(1, (read(label.code, x, 0.0),), {}, here.stamp_ns), here)
    (sighting,) = hover.scanner.drain_sightings()
    assert sighting.location == label.code
    assert sighting.dx_m == pytest.approx(label.x_m - here.x_m, abs=0.01)
    assert sighting.dy_m == pytest.approx(label.y_m - here.y_m, abs=0.01)


def test_a_doubt_alone_keeps_what_is_pending_but_proves_nothing_meanwhile() -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    counted_at(scanner)
    scanner.drain()
    scanner.doubt()
    for node in ("A3", "A4"):
        scanner.reached(node, certain=True)
    scanner.home(certain=True)
    assert scanner.drain() == ((), ())
    scanner.trust()
    scanner.home(certain=True)
    assert [set(s.locations) for s in scanner.drain()[1] if s.confirmed] == [set(LOCATIONS)]
    assert scanner.take_due() == ()


def test_a_node_whose_findings_were_withdrawn_is_due_again_but_not_for_ever() -> None:
    scanner = Scanner(SITE, SIGHT, PARAMS, aside_per_height=ASIDE_PER_HEIGHT)
    due = []
    for _ in range(EXPERT.revisits + 1):
        counted_at(scanner)
        scanner.doubt()
        scanner.withdraw(1, "elsewhere")
        scanner.trust()
        due.append(scanner.take_due())
        assert scanner.wants("A2")
    assert due == [("A2",)] * EXPERT.revisits + [()]


@pytest.mark.parametrize(("pictures", "state"), [(1, LocationState.UNREADABLE), (2, LocationState.EMPTY)])
def test_one_picture_never_makes_a_place_empty(pictures: int, state: LocationState) -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    view = hover.at_view()
    code = view.locations[0]
    for _ in range(pictures):
        hover.look({code: Occupancy.EMPTY})
    hover.now_ns += round(PARAMS.view_s * 1e9)
    assert hover.scanner.step(hover.now_ns)
    hover.gather()
    assert hover.found[code].state is state


def test_a_location_label_that_the_map_lacks_is_no_stock() -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    code = LOCATIONS[0]
    hover.run(GOODS, {code: ("AL-77-1-2",)})
    assert hover.found[code].state is LocationState.UNREADABLE
    assert [event.name for event in hover.scanner.drain_events()] == ["unknown_location"]


def test_codes_of_goods_do_not_look_like_locations() -> None:
    form = code_form(SITE.racks)
    assert all(form.fullmatch(code) for code in SITE.locations)
    assert not any(form.fullmatch(text) for text in ("4006381333931", "PALLET AL-01-1-1", "AL-01-1", "LOT-7"))
    numbers = [replace(rack, pattern="{bay:02}{level}{position}") for rack in SITE.racks]
    assert not code_form(numbers).fullmatch("0711"), "any number would look like it"


def too_bright(wanted: float) -> tuple[float, Light]:
    """A camera that burns out all labels unless it is asked for less light."""
    return wanted, Light.BURNT if wanted > 0.6 else Light.FAIR


def too_dark(wanted: float) -> tuple[float, Light]:
    return wanted, Light.FAIR if wanted > 1.6 else Light.DIM


@pytest.mark.parametrize(("camera", "part"), [(too_bright, EXPERT.darker), (too_dark, EXPERT.brighter)])
def test_what_is_lit_wrongly_is_looked_at_from_the_same_place_with_another_exposure(
    camera: Callable[[float], tuple[float, Light]], part: float
) -> None:
    hover = Hover()
    codes = hover.planner.locations("A2")
    hover.lit(camera, {code: (f"P-{code}",) for code in codes})
    assert {hover.found[code].state for code in codes} == {LocationState.READ}
    relit = [view for view in hover.views if view.exposure != 1.0]
    assert {view.exposure for view in relit} == {part}
    usual = {(view.x_m, view.y_m, view.height_m) for view in hover.views if view.exposure == 1.0}
    assert {(view.x_m, view.y_m, view.height_m) for view in relit} == usual
    assert hover.scanner.exposure[0] == 1.0
    assert not hover.scanner.drain_events()


def test_pictures_of_another_exposure_than_the_wanted_one_tell_nothing() -> None:
    hover = Hover()
    view = hover.at_view()
    code = view.locations[0]
    here = pose(hover.now_ns + 1, x_m=view.x_m, y_m=view.y_m, height_m=view.height_m)
    for seq in range(1, 6):
        empty = dict.fromkeys(view.locations, Occupancy.EMPTY)
        hover.scanner.take(picture(seq, (), empty, hover.now_ns + seq, exposure=0.4), here)
    hover.gather()
    assert code not in hover.found


def test_a_camera_that_does_not_follow_is_told_once_and_not_asked_again() -> None:
    hover = Hover()
    hover.lit(lambda _: (1.0, Light.BURNT), {})
    assert [event.name for event in hover.scanner.drain_events()] == ["exposure_fixed"]
    assert sum(view.exposure != 1.0 for view in hover.views) == 1
    assert {finding.state for finding in hover.found.values()} == {LocationState.UNREADABLE}


def test_a_place_is_empty_after_looks_in_a_row_unless_goods_were_ever_seen() -> None:
    for before, state in (
        (Occupancy.UNSURE, LocationState.EMPTY),
        (Occupancy.GOODS, LocationState.UNREADABLE),
    ):
        hover = Hover()
        hover.at_view()
        codes = hover.planner.locations("A2")
        hover.look(dict.fromkeys(codes, before))
        hover.run(dict.fromkeys(codes, Occupancy.EMPTY), {})
        first = hover.views[0].locations
        assert {hover.found[code].state for code in first} == {state}


def test_a_single_doubtful_look_leaves_a_place_empty_that_no_picture_shows_whole() -> None:
    hover = Hover(PARAMS.with_values(retakes=0))
    codes = hover.planner.locations("A2")
    while hover.scanner.view is not None:
        hover.at_view()
        over = False
        while not over:
            seen = Occupancy.UNSURE if hover.seq % 5 == 4 else Occupancy.EMPTY
            over = hover.look(dict.fromkeys(codes, seen), share=0.7)
    assert {hover.found[code].state for code in codes} == {LocationState.EMPTY}


def test_an_empty_place_that_is_burnt_out_is_empty_by_the_exposure_that_shows_it() -> None:
    hover = Hover()
    while (view := hover.scanner.view) is not None:
        hover.at_view()
        over = False
        while not over:
            hover.now_ns, hover.seq = hover.now_ns + STEP_NS, hover.seq + 1
            burnt = hover.scanner.exposure[0] == 1.0
            seen = Occupancy.GOODS if burnt else Occupancy.EMPTY
            light = Light.BURNT if burnt else Light.FAIR
            places = dict.fromkeys(view.locations, seen)
            shown = picture(hover.seq, (), places, hover.now_ns, hover.scanner.exposure[0], light)
            here = pose(hover.now_ns, x_m=view.x_m, y_m=view.y_m, height_m=view.height_m)
            hover.scanner.take(shown, here)
            over = hover.scanner.step(hover.now_ns)
            hover.gather()
    assert {finding.state for finding in hover.found.values()} == {LocationState.EMPTY}
