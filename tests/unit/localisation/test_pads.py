"""Where a pad lies that is found by the end of a painted line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flightd.core.tracks import FloorJunction, PadOffset, TrackSet
from flightd.core.types import GridPose
from flightd.localisation.pad_finder import PadFinder
from flightd.site.painted_lines import nearest_end
from flightd.site.site import PadSign
from flightd.site.site_file import load_site

DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
SITE = replace(DEMO, pads=(replace(DEMO.home, sign=PadSign.LINE_END, offset_m=(-0.4, 0.0)),))


@pytest.mark.parametrize("first", [False, True])
def test_an_end_in_worn_paint_beside_the_true_one_does_not_move_the_pad(first: bool) -> None:
    end = nearest_end(SITE, *SITE.pad_centre(SITE.home), 0.5)
    assert end is not None
    x_m, y_m, arms = end
    true, worn = FloorJunction(x_m + 0.05, y_m, arms), FloorJunction(x_m + 0.3, y_m, arms)
    other_way = FloorJunction(x_m + 0.2, y_m, 5 - arms)
    finder = PadFinder(SITE)
    here = GridPose(0, "A1", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, (0.0,) * 9, 1.0)
    for stamp_ns in range(1, 20):
        ends = (worn, other_way, true) if first else (true, other_way, worn)
        tracks = TrackSet(
            stamp_ns, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (), (), junctions=ends, junctions_ns=stamp_ns
        )
        finder.step(tracks, here)
    pad = SITE.pad_centre(SITE.home)
    assert finder.centre("A1") == pytest.approx((pad[0] + 0.05, pad[1]), abs=1e-6)


MATS = replace(
    DEMO,
    pads=tuple(
        replace(DEMO.home, node=node, sign=PadSign.MAT, offset_m=(0.0, 0.0))
        for node in (DEMO.home.node, "A2")
    ),
)


def test_of_two_mats_in_one_picture_the_position_is_held_over_the_one_nearest_to_the_map() -> None:
    finder = PadFinder(MATS)
    at = [MATS.pad_centre(pad) for pad in MATS.pads]
    here = GridPose(0, "A1", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, (0.0,) * 9, 1.0)
    sights = (
        PadOffset(at[0][0] + 0.2, at[0][1], MATS.pads[0].size_m),
        PadOffset(at[1][0] + 0.05, at[1][1], MATS.pads[1].size_m),
    )
    for stamp_ns in (33_000_000, 66_000_000, 99_000_000):
        seen = TrackSet(stamp_ns, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (), (), pads=sights, pads_ns=stamp_ns)
        finder.step(seen, here)
    pose = finder.over(replace(here, stamp_ns=99_000_000), (False, False))
    assert pose is not None
    assert (pose.x_m, pose.y_m) == pytest.approx((-0.05, 0.0))
    assert (pose.vx_mps, pose.vy_mps) == pytest.approx((0.0, 0.0))
