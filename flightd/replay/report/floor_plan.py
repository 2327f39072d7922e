"""The floor plan: what is painted and built, where the drone was and where it thought it was."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np

from flightd.core.paint import is_tone
from flightd.replay.report.flight import Array, RecordedFlight, Track
from flightd.replay.report.markup import element, number, path_data, scrolled, text
from flightd.site.rack_depth import RACK_DEPTH_M, rack_body
from flightd.site.site import Shelf, Site

_MARGIN_M = 0.35
_WIDTH_PX = 1000.0
"""Width of the drawing's own units: sizes of text and marks below are in them."""

_POINTS = 2400
_ARROW_M = 0.3
"""Stops nearer to each other than this have no arrow between them."""

_ARROW_SAMPLES = 12
"""Its direction is that of the track over so many samples to both sides."""

_NAMED_SPACING = 52.0
"""Nodes nearer to each other than this (in drawing units) are named only at the ends of aisles."""


class _Projection:
    """Map metres to drawing units: x to the right, y down, as seen from above."""

    def __init__(self, bounds: tuple[float, float, float, float]) -> None:
        self._x_min, self._y_min, x_max, y_max = bounds
        width_m, height_m = max(x_max - self._x_min, 1.0), max(y_max - self._y_min, 0.5)
        self.scale = _WIDTH_PX / width_m
        self.height = height_m * self.scale

    def x(self, x_m: float) -> float:
        return (x_m - self._x_min) * self.scale

    def y(self, y_m: float) -> float:
        return (y_m - self._y_min) * self.scale

    def points(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        return (x_m - self._x_min) * self.scale, (y_m - self._y_min) * self.scale


def floor_plan(flight: RecordedFlight) -> str:
    """The plan as a figure; a sentence where there is neither a map nor a track."""
    bounds = _bounds(flight)
    if bounds is None:
        return element("p", "The log holds neither a map nor a position to draw.", class_="empty")
    place = _Projection(bounds)
    layers = []
    if flight.site is not None:
        layers.append(_site(flight.site, place))
    if flight.truth is not None:
        layers.append(_track(flight.truth, place, "truth", flight))
    layers.append(_track(flight.estimate, place, "estimate", flight))
    layers.append(_track(flight.smoothed, place, "smoothed", flight))
    if flight.site is not None:
        layers += [_nodes(flight.site, flight, place), _visits(flight, flight.site, place)]
    layers.append(_scale_bar(place))
    layers.append('<circle class="drone" r="8" cx="-99" cy="-99"/>')
    drawing = (
        f'<svg class="plan" viewBox="0 0 {_WIDTH_PX:g} {number(place.height)}" role="img" '
        f'aria-label="Floor plan with the flown track">{"".join(layers)}</svg>'
    )
    return element(
        "figure", element("div", drawing, **scrolled("Floor plan")), _caption(flight), class_="floor"
    )


def _bounds(flight: RecordedFlight) -> tuple[float, float, float, float] | None:
    boxes = []
    if flight.site is not None:
        x0, y0, x1, y1 = flight.site.bounds()
        depth = RACK_DEPTH_M if flight.site.shelves else 0.0
        boxes.append((x0, y0 - depth, x1, y1 + depth))
    boxes += [
        (track.x_m.min(), track.y_m.min(), track.x_m.max(), track.y_m.max())
        for track in (flight.truth, flight.estimate)
        if track is not None and len(track.t_s)
    ]
    if not boxes:
        return None
    corners = np.array(boxes, np.float64)
    low, high = corners[:, :2].min(axis=0) - _MARGIN_M, corners[:, 2:].max(axis=0) + _MARGIN_M
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _site(site: Site, place: _Projection) -> str:
    shelves = "".join(_shelf(site, shelf, place) for shelf in site.shelves)
    lines = "".join(
        f'<line class="paint" x1="{number(place.x(line.x0_m))}" y1="{number(place.y(line.y0_m))}" '
        f'x2="{number(place.x(line.x1_m))}" y2="{number(place.y(line.y1_m))}" '
        f'stroke-width="{number(max(line.width_m * place.scale, 2.0))}"/>'
        for line in site.lines
    )
    pads = "".join(
        _square(
            "pad",
            place.x(site.nodes[pad.node].x_m),
            place.y(site.nodes[pad.node].y_m),
            pad.size_m * place.scale,
        )
        for pad in site.pads
    )
    tone = f"--paint: {site.line_colour}" if is_tone(site.line_colour) else None
    return element("g", shelves, lines, pads, class_=f"site {site.line_colour}", style=tone)


def _shelf(site: Site, shelf: Shelf, place: _Projection) -> str:
    body = rack_body(site, shelf)
    front, top, depth = place.y(shelf.y_m), place.y(body.y0_m), (body.y1_m - body.y0_m) * place.scale
    x0, x1 = place.x(shelf.x0_m), place.x(shelf.x1_m)
    label = element("title", text(f"shelf {shelf.aisle} {shelf.side}"))
    return (
        f'<g>{label}<rect class="shelf" x="{number(x0)}" y="{number(top)}" width="{number(x1 - x0)}" '
        f'height="{number(depth)}" rx="3"/>'
        f'<path class="front" d="M{number(x0)},{number(front)}H{number(x1)}"/></g>'
    )


def _square(name: str, x: float, y: float, size: float) -> str:
    return (
        f'<rect class="{name}" x="{number(x - size / 2)}" y="{number(y - size / 2)}" '
        f'width="{number(size)}" height="{number(size)}" rx="{number(size / 8)}"/>'
    )


def _track(track: Track, place: _Projection, role: str, flight: RecordedFlight) -> str:
    if not len(track.t_s):
        return ""
    chosen = np.unique(np.linspace(0, len(track.t_s) - 1, min(_POINTS, len(track.t_s))).astype(int))
    x, y = place.points(track.x_m[chosen], track.y_m[chosen])
    times = " ".join(number(t_s) for t_s in track.t_s[chosen])
    arrows = _arrows(track, place, flight) if role == "estimate" else ""
    return f'<path class="flown {role}" d="{path_data(x, y, 1)}" data-times="{times}"/>{arrows}'


def _arrows(track: Track, place: _Projection, flight: RecordedFlight) -> str:
    """A chevron halfway between two stops, pointing where the drone went."""
    arrows = []
    for before, after in itertools.pairwise(flight.visits):
        between = (track.t_s >= before.end_s) & (track.t_s <= after.start_s)
        x, y = track.x_m[between], track.y_m[between]
        flown_m = np.hypot(x - x[0], y - y[0]) if len(x) else x
        if not len(x) or flown_m[-1] < _ARROW_M:
            continue
        middle = int(np.argmax(flown_m >= flown_m[-1] / 2))
        ahead, behind = min(middle + _ARROW_SAMPLES, len(x) - 1), max(middle - _ARROW_SAMPLES, 0)
        degrees = math.degrees(math.atan2(y[ahead] - y[behind], x[ahead] - x[behind]))
        arrows.append(
            f'<path class="arrow" d="M-5,-5L4,0L-5,5" transform="translate({number(place.x(x[middle]))} '
            f'{number(place.y(y[middle]))}) rotate({number(degrees)})"/>'
        )
    return "".join(arrows)


def _nodes(site: Site, flight: RecordedFlight, place: _Projection) -> str:
    visited = {visit.node for visit in flight.visits}
    spacing = min((site.distance_m(edge.a, edge.b) for edge in site.edges), default=1.0) * place.scale
    named = spacing >= _NAMED_SPACING
    radius = max(3.0, min(7.0, spacing / 8))
    marks = []
    for node in site.nodes.values():
        x, y = place.x(node.x_m), place.y(node.y_m)
        state = "visited" if node.id in visited else "node"
        ends = node.index in {1, len(site.aisle_nodes(node.aisle))}
        marks.append(
            f'<circle class="{state}" cx="{number(x)}" cy="{number(y)}" r="{number(radius)}">'
            f"{element('title', text(node.id))}</circle>"
        )
        if named or ends:
            marks.append(_label("name", x + radius + 4, y - radius - 5, node.id))
    return "".join(marks)


def _visits(flight: RecordedFlight, site: Site, place: _Projection) -> str:
    """The order of the stops, below each node that was visited."""
    orders: dict[str, list[str]] = {}
    for visit in flight.visits:
        orders.setdefault(visit.node, []).append(str(visit.number))
    if len(flight.visits) > 60:
        return ""
    return "".join(
        _label(
            "order",
            place.x(site.nodes[node].x_m) + 11,
            place.y(site.nodes[node].y_m) + 20,
            ", ".join(numbers),
        )
        for node, numbers in orders.items()
        if node in site.nodes
    )


def _label(kind: str, x: float, y: float, label: str) -> str:
    return f'<text class="{kind}" x="{number(x)}" y="{number(y)}">{text(label)}</text>'


def _caption(flight: RecordedFlight) -> str:
    keys: Iterable[tuple[str, str]] = [("estimate", "where it thought it was")]
    if flight.truth is not None:
        keys = [("truth", "where it was"), *keys]
    keys = [*keys, ("smoothed", "where the whole flight says it was (smoothed)")]
    shown = "".join(
        element("span", element("i", class_=role), text(name), class_="key") for role, name in keys
    )
    return element("figcaption", shown)


def _scale_bar(place: _Projection) -> str:
    """One metre, in the lower left corner."""
    y = place.height - 10
    return (
        f'<g class="scale"><path d="M12,{number(y - 4)}v4h{number(place.scale)}v-4"/>'
        f'<text x="{number(18 + place.scale)}" y="{number(y + 1)}">1 m</text></g>'
    )
