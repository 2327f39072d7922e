"""[[marker]] tables: read, written back, and refused with a useful line."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.core.markers import MarkerDictionary, MarkerSet
from flightd.site.floor_plan_svg import draw_site
from flightd.site.site import Marker
from flightd.site.site_file import parse_site, site_toml

AISLE = """
[site]
name = "marked"
[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.5, 1.5]
[[pad]]
id = "home"
node = "A1"
"""
MARKER = """
[[marker]]
id = 7
dictionary = "4x4_50"
x_m = 1.8
y_m = 0.3
yaw_deg = 30.0
"""


def test_a_marker_reads_as_written_and_says_what_to_look_for() -> None:
    site = parse_site(AISLE + MARKER, "marked.toml")
    assert site.markers == (Marker(7, MarkerDictionary.ARUCO_4X4_50, 1.8, 0.3, 0.2, math.radians(30)),)
    assert site.marker_set == MarkerSet(MarkerDictionary.ARUCO_4X4_50, (7,))
    assert parse_site(AISLE, "bare.toml").marker_set is None
    assert draw_site(site).count('class="marker"') == 1


@settings(max_examples=50)
@given(
    st.sampled_from(MarkerDictionary),
    st.lists(st.integers(0, 29), unique=True, max_size=3),
    st.floats(-180, 180),
    st.floats(0.03, 0.2),
)
def test_markers_written_read_back_the_same(
    kind: MarkerDictionary, ids: list[int], yaw_deg: float, size_m: float
) -> None:
    table = '\n[[marker]]\nid = {}\ndictionary = "{}"\nx_m = 0.75\ny_m = 0.3\nsize_m = {!r}\nyaw_deg = {!r}\n'
    text = AISLE + "".join(table.format(number, kind, size_m, yaw_deg) for number in ids)
    site = parse_site(text, "x.toml")
    assert len(site.markers) == len(ids)
    assert parse_site(site_toml(site), "x.toml") == site


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("id = 7", "id = 50", "marker[0] (50).id: 4x4_50 has no number 50; take one of 0 to 49"),
        ("y_m = 0.3", "y_m = 0.1", "marker[0] (7): lies on a painted line"),
        ("x_m = 1.8", "x_m = 1.6", "marker[0] (7): lies on a painted line"),
        ('"4x4_50"', '"7x7"', "marker[0].dictionary: Input should be '4x4_50', "),
        ("yaw_deg = 30.0", "size_m = 0.0", "marker[0].size_m: Input should be greater"),
        ("yaw_deg = 30.0", MARKER, "marker[1] (7).id: 7 lies elsewhere already"),
        ("yaw_deg = 30.0", MARKER.replace("4x4_50", "5x5_100"), "marker[1] (7).dictionary: 5x5_100 beside"),
    ],
)
def test_a_marker_that_does_not_fit_is_one_line_with_its_remedy(old: str, new: str, words: str) -> None:
    assert old in MARKER
    with pytest.raises(InputError) as refused:
        parse_site(AISLE + MARKER.replace(old, new, 1), "marked.toml")
    text = str(refused.value)
    assert text.startswith("marked.toml: ")
    assert words in text
    assert "\n" not in text
