"""How far a band really goes: followed beyond the span that its colour showed, by its own contrast.

Where the light falls off, or a bright floor leaves white paint little above it, the colour of the paint is
lost before the paint ends.  A line that seems to end where it does not is evidence for another place.  All
ends of a frame's bands are looked at together: arrays are (end, station, ...).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flightd.core.types import Image
from flightd.vision.lines.band import Array, Band
from flightd.vision.lines.edge_refinement import Floats
from flightd.vision.lines.undistortion import Plane

_INSIDE, _BESIDE = (-0.2, 0.0, 0.2), (-0.85, -0.65, 0.65, 0.85)
"""Where paint and floor are looked at, in widths from the centre line."""
_ACROSS = np.array([*_INSIDE, *_BESIDE])
_MARGIN_PX = np.array([0.0, 0.0, 0.0, -2.0, -2.0, 2.0, 2.0])
"""The floor is looked at so much further out: an edge is not sharp."""
_SIDES = np.array(
    [[1 / 3, 1 / 3, 1 / 3, -0.5, -0.5, 0, 0], [1 / 3, 1 / 3, 1 / 3, 0, 0, -0.5, -0.5]], np.float32
)
"""What the paint has over the floor on its one side, and on its other."""
_KNOWN, _AHEAD = 12, 24
"""Stations on the last part of the span, and between its end and the border."""
_KNOWN_PACE = 0.5
"""Between the former, in widths."""
_LEAST_CONTRAST = 8.0
_SHARE = (0.5, 1.7)
"""Paint goes on where its contrast to either side is between these parts of what it was."""
_GAP_WIDTHS = 2.0
"""What crosses or covers it may be so long."""
_FEWEST = 2
_OPEN_PX = 6.0
"""A span that ends nearer to the border than this is cut by it."""


@dataclass(frozen=True, slots=True)
class _End:
    """The end of a band's span at `u`, and the picture's border beyond it."""

    band: Band
    u: float
    border: float


def lengthen(bgr: Image, bands: list[Band], plane: Plane) -> list[Band]:
    """The bands, each with its span as far as its paint can be followed to either side."""
    ends = [end for band in bands for end in _open_ends(band, plane)]
    if not ends:
        return bands
    reached = dict(zip(((id(end.band), end.u) for end in ends), _followed(bgr, ends, plane), strict=True))
    return [
        _respanned(band, reached.get((id(band), band.u0), band.u0), reached.get((id(band), band.u1), band.u1))
        for band in bands
    ]


def _open_ends(band: Band, plane: Plane) -> list[_End]:
    """Those that the border does not cut."""
    first, last = band.run(plane.width_px, plane.height_px)
    ends = []
    if band.u0 - first > _OPEN_PX:
        ends.append(_End(band, band.u0, first))
    if last - band.u1 > _OPEN_PX:
        ends.append(_End(band, band.u1, last))
    return ends


def _respanned(band: Band, u0: float, u1: float) -> Band:
    if (u0, u1) == (band.u0, band.u1):
        return band
    known = (band.u1 - band.u0) / (u1 - u0)
    support, clear = (share * known + (1.0 - known) for share in (band.support, band.clear))
    return replace(band, u0=u0, u1=u1, support=support, clear=clear)


def _followed(bgr: Image, ends: list[_End], plane: Plane) -> list[float]:
    """Where the paint of each band ends on the way from the end of its span to the border."""
    over = _contrasts(bgr, ends, plane)
    colour = np.sort(over[:, :_KNOWN, 0] + over[:, :_KNOWN, 1], axis=1)[:, _KNOWN // 2] / 2
    contrast = np.sqrt((colour * colour).sum(axis=1))
    unit = colour / np.maximum(contrast * contrast, 1e-6)[:, None]
    each = (over[:, _KNOWN:] @ unit[:, None, :, None])[..., 0]
    painted = ((each > _SHARE[0]) & (each < _SHARE[1])).all(axis=2)
    painted[contrast < _LEAST_CONTRAST] = False
    return [_end_of(end, marks.tobytes()) for end, marks in zip(ends, painted, strict=True)]


def _end_of(end: _End, marks: bytes) -> float:
    """The same for one end; `marks` says of each station ahead whether it is painted."""
    pace = (end.border - end.u) / _AHEAD
    gap = max(int(_GAP_WIDTHS * end.band.width_px * end.band.cosine / abs(pace)), 1)
    hidden = marks.find(bytes(gap + 1))
    marks = marks[:hidden] if hidden >= 0 else marks
    count = marks.rfind(1) + 1
    return end.u + pace * count if marks.count(1) >= _FEWEST else end.u


def _contrasts(bgr: Image, ends: list[_End], plane: Plane) -> Floats:
    """(E, S, 2, 3) colours BGR of the paint less those of the floor on its two sides, at the stations."""
    count, stations = len(ends), _KNOWN + _AHEAD
    known, ahead = np.arange(-_KNOWN, 0) + 0.5, np.arange(_AHEAD) + 0.5
    rows = []
    for end in ends:
        band, way = end.band, 1.0 if end.border > end.u else -1.0
        back = min(_KNOWN_PACE * band.width_px * band.cosine, (band.u1 - band.u0) / _KNOWN) * way
        rows.append((end.u, back, (end.border - end.u) / _AHEAD, band.centre.a, band.centre.b))
    begin, back_u, ahead_u, a, b = np.array(rows).T[..., None]
    u: Array = begin + np.concatenate((back_u * known, ahead_u * ahead), axis=1)
    widths = np.array([[end.band.width_px / end.band.cosine] for end in ends])
    v = (a + b * u)[..., None] + (widths * _ACROSS + _MARGIN_PX)[:, None]
    along = np.broadcast_to(u[..., None], v.shape)
    steep = np.array([end.band.steep for end in ends])[:, None, None]
    x, y = plane.raw(np.where(steep, v, along), np.where(steep, along, v))
    column = np.clip(x + plane.width_px / 2, 0, plane.width_px - 1).astype(np.intp)
    row = np.clip(y + plane.height_px / 2, 0, plane.height_px - 1).astype(np.intp)
    pixels = bgr.reshape(-1, 3).take(row * plane.width_px + column, axis=0).astype(np.float32)
    return np.asarray(_SIDES @ pixels.reshape(count, stations, 7, 3), np.float32)
