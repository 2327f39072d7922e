"""Where the charge pads really lie: what the down camera sees of them, held against the map.

A mat may have been pushed off the node that the map puts it on, and a pad at the end of a line is where that
end really is.  Both are seen only from some height upwards; what was found there is kept for the rest of the
descent, which the lines guide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from flightd.core.tracks import TrackSet
from flightd.core.types import GridPose
from flightd.site.painted_lines import nearest_end
from flightd.site.site import PAD_REACH_M, PadSign, Site

_SIZE_SHARE = 0.3
_LEAST_SEEN = 4
_GAIN = 0.06
"""Weight of the newest sight once enough have been seen: some half a second."""


_ANCHOR_NS = 300_000_000
_G, _H = 0.5, 0.15


@dataclass(frozen=True, slots=True)
class _Anchor:
    """Position and velocity held against a pad that is believed to be in its place."""

    seen_ns: int
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float


@dataclass(slots=True)
class _Found:
    x_m: float = 0.0
    y_m: float = 0.0
    count: int = 0

    def add(self, x_m: float, y_m: float) -> None:
        self.count += 1
        gain = max(1.0 / self.count, _GAIN)
        self.x_m += gain * (x_m - self.x_m)
        self.y_m += gain * (y_m - self.y_m)


class PadFinder:
    """Call `step` at each tick; `centre` says where a pad is."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._mats = [(pad, site.pad_centre(pad)) for pad in site.pads if pad.sign is PadSign.MAT]
        by_end = [pad for pad in site.pads if pad.sign is PadSign.LINE_END]
        ends = ((pad, nearest_end(site, *site.pad_centre(pad), PAD_REACH_M)) for pad in by_end)
        self._ends = [(pad, end) for pad, end in ends if end is not None]
        self._ends_ns = 0
        self._found: dict[str, _Found] = {}
        self._taken_ns = 0
        self._anchor: _Anchor | None = None

    def step(self, tracks: TrackSet, pose: GridPose) -> None:
        """Take the pads and line ends of the newest frame, once."""
        if tracks.junctions_ns != self._ends_ns:
            self._ends_ns = tracks.junctions_ns
            self._take_ends(tracks, pose)
        if tracks.pads_ns == self._taken_ns:
            return
        self._taken_ns = tracks.pads_ns
        held = []
        for sight in tracks.pads:
            x_m, y_m = pose.x_m + sight.x_m, pose.y_m + sight.y_m
            for pad, at in self._mats:
                off_m = math.hypot(x_m - at[0], y_m - at[1])
                fits = abs(sight.side_m - pad.size_m) < _SIZE_SHARE * pad.size_m
                if fits and off_m < PAD_REACH_M:
                    held.append((off_m, at[0] - sight.x_m, at[1] - sight.y_m))
                    self._found.setdefault(pad.node, _Found()).add(x_m, y_m)
                    break
        if held:  # of several in a frame the nearest to the map's
            _, at_x, at_y = min(held)
            self._hold(at_x, at_y, tracks.pads_ns)

    def _take_ends(self, tracks: TrackSet, pose: GridPose) -> None:
        """The places of pads by the line ends that are seen where the map has theirs.  Of several in a frame
        the nearest to the map's counts: worn paint has ends, too."""
        for pad, (end_x, end_y, arms) in self._ends:
            offs = [
                (pose.x_m + seen.dx_m - end_x, pose.y_m + seen.dy_m - end_y)
                for seen in tracks.junctions
                if seen.arms == arms
            ]
            off = min(offs, key=lambda off: math.hypot(*off), default=(math.inf, math.inf))
            if math.hypot(*off) < PAD_REACH_M:
                centre_x, centre_y = self._site.pad_centre(pad)
                self._found.setdefault(pad.node, _Found()).add(centre_x + off[0], centre_y + off[1])

    def centre(self, node: str) -> tuple[float, float] | None:
        """Centre of the pad on `node`: as seen, else as on the map; None without a pad there."""
        found = self._found.get(node)
        if found is not None and found.count >= _LEAST_SEEN:
            return found.x_m, found.y_m
        return next((self._site.pad_centre(pad) for pad in self._site.pads if pad.node == node), None)

    def over(self, pose: GridPose, by_lines: tuple[bool, bool]) -> GridPose | None:
        """The pose with x and y by the pad in sight where they are not known `by_lines` yet: it is believed
        to lie where the map has it.  For a start without a line in view; None when nothing is to be added."""
        a = self._anchor
        if all(by_lines) or a is None or pose.stamp_ns - a.seen_ns > _ANCHOR_NS:
            return None
        if not by_lines[0]:
            pose = replace(pose, x_m=a.x_m, vx_mps=a.vx_mps)
        return pose if by_lines[1] else replace(pose, y_m=a.y_m, vy_mps=a.vy_mps)

    def _hold(self, x_m: float, y_m: float, stamp_ns: int) -> None:
        """Take the position over a pad, filtered with its velocity (g-h filter)."""
        a = self._anchor
        if a is None or stamp_ns - a.seen_ns > _ANCHOR_NS:
            self._anchor = _Anchor(stamp_ns, x_m, y_m, 0.0, 0.0)
            return
        dt_s = (stamp_ns - a.seen_ns) * 1e-9
        off_x, off_y = x_m - a.x_m - a.vx_mps * dt_s, y_m - a.y_m - a.vy_mps * dt_s
        self._anchor = _Anchor(
            stamp_ns,
            x_m - (1.0 - _G) * off_x,
            y_m - (1.0 - _G) * off_y,
            a.vx_mps + _H * off_x / dt_s,
            a.vy_mps + _H * off_y / dt_s,
        )
