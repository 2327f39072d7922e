"""Labels and markers of known place: one may hang wrong, two that agree may not; none speaks twice."""

from __future__ import annotations

from flightd.config.localisation import LocalisationConfig, LocalisationExpert
from flightd.core.camera_view import FloorReach
from flightd.core.markers import MarkerDictionary
from flightd.core.tracks import MarkerOffset, PadOffset, TrackedLine, TrackSet
from flightd.core.types import GridPose
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.position_fixes import FixBook
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Marker, Pad, Site
from flightd.site.site_file import parse_site

TICK_NS = 20_000_000
HEIGHT_M = 1.2
SURE = LocalisationConfig(expert=LocalisationExpert(carried=1e-6))
"""So that the start node is believed at once, wrongly in these tests."""
RACKS = parse_site(
    """
[site]
name = "alike"
[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.3, 1.3, 1.3, 1.3]
[[rack]]
bay_width_m = 1.3
levels_m = [0.9]
positions = 2
[[pad]]
id = "home"
node = "A3"
""",
    "alike",
)
MARKED = lay_out(
    "marked",
    [Aisle("A", 0.0, 0.0, (1.5,) * 4)],
    [],
    [Pad("home", "A3", 0.5)],
    markers=[Marker(5, MarkerDictionary.ARUCO_4X4_50, 4.8, 0.3)],
)


class Hover:
    """A drone that hangs over a crossing for as long as it is asked to."""

    def __init__(
        self,
        site: Site,
        markers: tuple[MarkerOffset, ...] = (),
        pads: tuple[PadOffset, ...] = (),
        params: LocalisationConfig = SURE,
    ) -> None:
        self.localiser = GridLocaliser(site, "A3", FloorReach(), params)
        self.markers = markers
        self.pads = pads
        self.tick = 0

    def look(self, ticks: int) -> GridPose:
        for _ in range(ticks):
            self.tick += 1
            stamp = self.tick * TICK_NS
            line = TrackedLine(0, 0.0, 0.01, 0.075, stamp, 10)
            seen = TrackSet(
                stamp, stamp, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, (line,), (line,),
                junctions_ns=stamp, markers=self.markers, pads=self.pads,
            )  # fmt: skip
            pose = self.localiser.step(seen, HEIGHT_M)
        return pose


def label_of(node: str, count: int) -> list[tuple[str, float, float]]:
    """Locations that face a node, with their way from a drone over it."""
    here = RACKS.nodes[node]
    near = [place for place in RACKS.locations.values() if place.node == node]
    return [(place.code, place.x_m - here.x_m, place.y_m - here.y_m) for place in near[:count]]


def test_a_label_that_contradicts_makes_doubt_however_often_it_is_read() -> None:
    hover = Hover(RACKS)
    assert hover.look(10).integrity > 0.99
    (label,) = label_of("A4", 1)
    for _ in range(5):
        hover.localiser.sighted(*label)
        pose = hover.look(5)
        assert 0.2 < pose.integrity < 0.8, "one label may hang wrong"


def test_two_labels_that_agree_tell_the_node() -> None:
    hover = Hover(RACKS)
    hover.look(10)
    for label in label_of("A4", 2):
        hover.localiser.sighted(*label)
    pose = hover.look(5)
    assert (pose.node, pose.integrity > 0.99) == ("A4", True)


def test_labels_in_their_places_change_nothing() -> None:
    hover = Hover(RACKS)
    hover.look(10)
    for label in label_of("A3", 4):
        hover.localiser.sighted(*label)
    pose = hover.look(5)
    assert (pose.node, pose.integrity > 0.99) == ("A3", True)


def test_a_marker_of_another_node_makes_doubt_and_one_in_its_place_none() -> None:
    there = Hover(MARKED, (MarkerOffset(5, 0.3, 0.3, 0.2),))
    assert 0.2 < there.look(30).integrity < 0.8
    assert [node for node, _ in there.localiser.rivals()][:2] in (["A3", "A4"], ["A4", "A3"])
    here = Hover(MARKED, (MarkerOffset(5, 1.8, 0.3, 0.2),))
    assert here.look(30).integrity > 0.99


def test_what_is_no_marker_of_the_map_says_nothing() -> None:
    strange = Hover(MARKED, (MarkerOffset(9, 0.3, 0.3, 0.2), MarkerOffset(5, 0.3, 0.3, 0.5)))
    assert strange.look(30).integrity > 0.99


def test_among_nodes_that_look_alike_the_pads_mat_tells_where_a_flight_starts() -> None:
    doubts = LocalisationConfig()
    assert Hover(RACKS, params=doubts).look(50).integrity < 0.95
    on_it = Hover(RACKS, pads=(PadOffset(0.1, -0.05, 0.5),), params=doubts).look(50)
    assert (on_it.node, on_it.integrity > 0.98) == ("A3", True)


def test_a_square_that_is_seen_once_beside_the_mat_says_nothing() -> None:
    book = FixBook(RACKS)
    mat, square = PadOffset(0.0, 0.0, 0.5), PadOffset(1.2, 0.4, 0.6)
    assert book.mat((mat,), 0.0, 0.0) is None
    assert book.mat((square, mat), 0.0, 0.0) is None
    sure = book.mat((square, mat), 0.0, 0.0)
    assert sure is not None
    assert sure[0] == mat
    assert book.mat((square, mat), 0.0, 0.0) is None, "each tells once"


def test_no_mat_of_the_map_says_nothing_and_one_at_another_node_makes_doubt() -> None:
    doubts = LocalisationConfig()
    without = Hover(RACKS, params=doubts).look(50).integrity
    larger = Hover(RACKS, pads=(PadOffset(0.1, 0.0, 0.9),), params=doubts).look(50)
    assert larger.integrity == without
    aside = Hover(RACKS, pads=(PadOffset(1.3, 0.0, 0.5),), params=doubts)
    assert aside.look(50).integrity < without
    assert aside.localiser.rivals()[0][0] == "A2"
