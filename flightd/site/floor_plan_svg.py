"""A site as an SVG floor plan: seen from above, x to the right and y down, to scale."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

from flightd.site.rack_depth import RACK_DEPTH_M, rack_body
from flightd.site.site import Edge, LineColour, Marker, Node, PaintedLine, Site

_PX_PER_M = 64.0
_MARGIN_M = 1.1
_HEADER_M = 0.9
_MIN_WIDTH_M = 6.0
_PAINT: dict[str, str] = {
    LineColour.YELLOW: "#f2bd1d",
    LineColour.WHITE: "#ffffff",
    LineColour.RED: "#c0322f",
    LineColour.BLUE: "#2f63ad",
    LineColour.GREEN: "#2f8f52",
    LineColour.BLACK: "#26282b",
    LineColour.ORANGE: "#e2701f",
}
_EXAGGERATED = 10.0
"""How many times as far as it is a line is drawn beside its place."""
_ARROW = "M-7 -6L9 0L-7 6Z"
_STYLE = """
  text { font-family: ui-sans-serif, system-ui, "Segoe UI", Helvetica, Arial, sans-serif; fill: #2b3036 }
  .title { font-size: 22px; font-weight: 650 } .fact { font-size: 13px; fill: #6b737c }
  .node { font-size: 12px; font-weight: 600 } .step { font-size: 10.5px; fill: #7a828b }
  .aisle { font-size: 20px; font-weight: 700; fill: #8b939c }
  .rack { stroke: #8d98a5; stroke-width: 2 } .shelf { fill: url(#rack) }
  .front { stroke: #56626f; stroke-width: 2.5 }
  .pad { fill: #3c4046; stroke: #1f2225 } .dot { fill: #fff; stroke: #2b3036; stroke-width: 1.8 }
  .shut { stroke: #c0322f; stroke-width: 4; fill: none } .way { fill: #2b3036 }
  .keep { fill: #c0322f; fill-opacity: 0.18; stroke: #c0322f; stroke-width: 1.5; stroke-dasharray: 6 4 }
  .off { stroke: #8a2be2; stroke-width: 2; stroke-dasharray: 7 4; fill: none }
  .off-by { font-size: 11.5px; font-weight: 600; fill: #8a2be2 }
  .axis { stroke: #8b939c; stroke-width: 1.4; fill: none } .home { fill: #1d9a57; stroke: #0f6b3a }
"""


@dataclass(frozen=True, slots=True)
class LineOff:
    """A painted line that lies `off_m` beside its place on the map, along the axis that it crosses ("x" or
    "y") at `at_m`; None: that is not known.  Among those at one place it is the one through `through_m`."""

    axis: str
    at_m: float
    through_m: float
    off_m: float | None


def draw_site(site: Site, off: Sequence[LineOff] = ()) -> str:
    """The text of an SVG file.  Lines, shelves and pads are to scale, dots and letters are not; what is `off`
    is drawn ten times as far beside its place as it is."""
    return _Plan(site, off).svg()


class _Plan:
    def __init__(self, site: Site, off: Sequence[LineOff]) -> None:
        self._site, self._off = site, off
        x0, y0, x1, y1 = site.bounds()
        depth = RACK_DEPTH_M if site.shelves else 0.0
        self._x0_m, self._y0_m = x0 - _MARGIN_M, y0 - depth - 0.3 - _HEADER_M
        self._width = max(x1 - x0 + 2 * _MARGIN_M, _MIN_WIDTH_M) * _PX_PER_M
        self._height = (y1 - self._y0_m + depth + 0.9) * _PX_PER_M

    def svg(self) -> str:
        site = self._site
        size = f'width="{self._width:.0f}" height="{self._height:.0f}"'
        box = f"0 0 {self._width:.0f} {self._height:.0f}"
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" {size}>',
            f"<title>{escape(site.name)}</title>",
            f"<style>{_STYLE}</style>",
            '<defs><pattern id="rack" width="9" height="9" patternUnits="userSpaceOnUse" '
            'patternTransform="rotate(45)"><rect width="9" height="9" fill="#dfe4ea"/>'
            '<path d="M0 0V9" stroke="#c7cfd8" stroke-width="3"/></pattern></defs>',
            '<rect width="100%" height="100%" fill="#f3f4f1"/>',
            *self._header(),
            *self._shelves(),
            *self._pads(),
            *self._lines(),
            *self._markers(),
            *self._keep_outs(),
            *itertools.chain.from_iterable(self._restriction(edge) for edge in site.edges),
            *self._steps(),
            *itertools.chain.from_iterable(self._node(node) for node in site.nodes.values()),
            *self._aisle_names(),
            *itertools.chain.from_iterable(self._beside(one) for one in self._off),
            *self._frame(),
            "</svg>",
        ]
        return "\n".join(parts) + "\n"

    def _at(self, x_m: float, y_m: float) -> tuple[float, float]:
        return (x_m - self._x0_m) * _PX_PER_M, (y_m - self._y0_m) * _PX_PER_M

    def _header(self) -> list[str]:
        site = self._site
        facts = [
            f"{len(site.aisles)} aisles",
            f"{len(site.nodes)} nodes",
            f"route {site.length_m(site.serpentine_route()):.0f} m",
            f"{site.line_width_m * 1000:.0f} mm {site.line_colour} lines",
            f"ceiling {site.ceiling_m:g} m" if site.ceiling_given else "ceiling not given",
        ]
        if self._off:
            facts.append(f"dashed: where the lines lie, {_EXAGGERATED:g} times exaggerated")
        return [
            f'<text class="title" x="24" y="38">{escape(site.name)}</text>',
            f'<text class="fact" x="24" y="59">{escape("  ·  ".join(facts))}</text>',
        ]

    def _shelves(self) -> list[str]:
        """All outlines below all racks, so that those back to back have none between them."""
        outlines, racks, fronts = [], [], []
        for shelf in self._site.shelves:
            body = rack_body(self._site, shelf)
            left, top = self._at(body.x0_m, body.y0_m)
            right, bottom = self._at(body.x1_m, body.y1_m)
            _, front = self._at(shelf.x0_m, shelf.y_m)
            box = f'x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{bottom - top:.1f}"'
            outlines.append(f'<rect class="rack" {box}/>')
            racks.append(f'<rect class="shelf" {box}/>')
            fronts.append(f'<path class="front" d="M{left:.1f} {front:.1f}H{right:.1f}"/>')
        return [*outlines, *racks, *fronts]

    def _lines(self) -> list[str]:
        """All outlines below all paint, so that crossings stay open."""
        colour = _PAINT.get(self._site.line_colour, self._site.line_colour)
        rectangles = [self._stroke(line) for line in self._site.lines]
        outlines = [f'<path d="{d}" fill="none" stroke="#6b6047" stroke-width="2"/>' for d in rectangles]
        return [*outlines, *(f'<path d="{d}" fill="{colour}"/>' for d in rectangles)]

    def _beside(self, one: LineOff) -> list[str]:
        """Where the line lies, exaggerated, and by how much it is off in centimetres."""
        line = next(line for line in self._site.lines if _is_at(line, one))
        across_x, off_m = one.axis == "x", one.off_m
        text = "not enough seen" if off_m is None else f"{off_m * 100:+.1f} cm"
        shown_m = _EXAGGERATED * (off_m or 0.0)
        dx_m, dy_m = (shown_m, 0.0) if across_x else (0.0, shown_m)
        x0, y0 = self._at(line.x0_m + dx_m, line.y0_m + dy_m)
        x1, y1 = self._at(line.x1_m + dx_m, line.y1_m + dy_m)
        where = f'x="{x0:.1f}" y="{y0 - 6:.1f}" text-anchor="middle"'
        if not across_x:
            where = f'x="{x1 + 6:.1f}" y="{y1 + 4:.1f}"'
        label = f'<text class="off-by" {where}>{text}</text>'
        return (
            [label]
            if off_m is None
            else [f'<path class="off" d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>', label]
        )

    def _stroke(self, line: PaintedLine) -> str:
        half = line.width_m / 2
        along_x = line.y0_m == line.y1_m
        x0, y0 = self._at(line.x0_m - (0 if along_x else half), line.y0_m - (half if along_x else 0))
        x1, y1 = self._at(line.x1_m + (0 if along_x else half), line.y1_m + (half if along_x else 0))
        return f"M{x0:.1f} {y0:.1f}H{x1:.1f}V{y1:.1f}H{x0:.1f}Z"

    def _keep_outs(self) -> list[str]:
        parts = []
        for area in self._site.keep_outs:
            x0, y0 = self._at(area.x0_m, area.y0_m)
            x1, y1 = self._at(area.x1_m, area.y1_m)
            top = min(area.to_m, self._site.ceiling_m)
            size = f'width="{x1 - x0:.1f}" height="{y1 - y0:.1f}"'
            parts += [
                f'<rect class="keep" x="{x0:.1f}" y="{y0:.1f}" {size}/>',
                _middle((x0 + x1) / 2, y0 + 14, f"keep out {area.from_m:g}..{top:g} m"),
            ]
        return parts

    def _restriction(self, edge: Edge) -> list[str]:
        """A cross over a closed line, an arrow on a one-way line."""
        a, b = self._site.nodes[edge.a], self._site.nodes[edge.b]
        x, y = self._at((a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2)
        if self._site.is_closed(edge):
            return [f'<path class="shut" d="M{x - 8:.1f} {y - 8:.1f}l16 16m0 -16l-16 16"/>']
        if not edge.one_way:
            return []
        turn = math.degrees(math.atan2(b.y_m - a.y_m, b.x_m - a.x_m))
        return [f'<path class="way" transform="translate({x:.1f} {y:.1f}) rotate({turn:.0f})" d="{_ARROW}"/>']

    def _pads(self) -> list[str]:
        parts = []
        for pad in self._site.pads:
            node = self._site.nodes[pad.node]
            x, y = self._at(node.x_m - pad.size_m / 2, node.y_m - pad.size_m / 2)
            side = pad.size_m * _PX_PER_M
            beside, below = x + side + 5, y + side / 2 + 31
            name = escape(pad.id if pad.charge else f"{pad.id} (no charging)")
            parts += [
                f'<rect class="pad" x="{x:.1f}" y="{y:.1f}" width="{side:.1f}" height="{side:.1f}" rx="3"/>',
                f'<text class="step" x="{beside:.1f}" y="{below:.1f}">{name}</text>',
            ]
        return parts

    def _markers(self) -> list[str]:
        return list(itertools.chain.from_iterable(self._marker(marker) for marker in self._site.markers))

    def _marker(self, marker: Marker) -> list[str]:
        """The square with a white point in its first corner, and its number."""
        x, y = self._at(marker.x_m, marker.y_m)
        half = marker.size_m / 2 * _PX_PER_M
        turn = f"translate({x:.1f} {y:.1f}) rotate({math.degrees(marker.yaw_rad):.1f})"
        return [
            f'<g class="marker" transform="{turn}"><path d="M{-half:.1f} {-half:.1f}h{2 * half:.1f}'
            f'v{2 * half:.1f}h{-2 * half:.1f}Z" fill="#111"/>'
            f'<circle cx="{-half / 2:.1f}" cy="{-half / 2:.1f}" r="{half / 4:.1f}" fill="#fff"/></g>',
            _middle(x, y + 1.5 * half + 9, f"#{marker.id}"),
        ]

    def _steps(self) -> list[str]:
        """The spacing between neighbours of an aisle, in metres, above the line."""
        parts = []
        for aisle in self._site.aisles:
            for a, b in itertools.pairwise(self._site.aisle_nodes(aisle.id)):
                x, y = self._at((a.x_m + b.x_m) / 2, a.y_m - self._site.line_width_m / 2)
                parts.append(_middle(x, y - 5, f"{b.x_m - a.x_m:.4g}"))
        return parts

    def _node(self, node: Node) -> list[str]:
        x, y = self._at(node.x_m, node.y_m)
        kind = "home" if node.id == self._site.home.node else "dot"
        pads = [pad.size_m / 2 * _PX_PER_M + 5 for pad in self._site.pads if pad.node == node.id]
        beside = max([7.0, *pads])
        return [
            f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="4.5"/>',
            f'<text class="node" x="{x + beside:.1f}" y="{y + 17:.1f}">{node.id}</text>',
        ]

    def _aisle_names(self) -> list[str]:
        parts = []
        for aisle in self._site.aisles:
            x, y = self._at(aisle.x_m - aisle.overrun_m, aisle.y_m)
            parts.append(
                f'<text class="aisle" x="{x - 12:.1f}" y="{y + 7:.1f}" text-anchor="end">{aisle.id}</text>'
            )
        return parts

    def _frame(self) -> list[str]:
        """The map's axes, and a scale of one metre."""
        x, y = 24.0, self._height - 58.0
        bar = self._width - 24.0 - _PX_PER_M
        foot = self._height - 22.0
        return [
            f'<path class="axis" d="M{x} {y}h34m-6 -4l6 4l-6 4M{x} {y}v34m-4 -6l4 6l4 -6"/>',
            f'<text class="step" x="{x + 39}" y="{y + 4}">x</text>',
            f'<text class="step" x="{x + 8}" y="{y + 38}">y</text>',
            f'<path class="axis" d="M{bar:.1f} {foot - 4:.1f}v8m0 -4h{_PX_PER_M:.1f}m0 -4v8"/>',
            _middle(bar + _PX_PER_M / 2, foot - 6, "1 m"),
        ]


def _is_at(line: PaintedLine, one: LineOff) -> bool:
    if one.axis == "x":
        return line.x0_m == line.x1_m == one.at_m and line.y0_m <= one.through_m <= line.y1_m
    return line.y0_m == line.y1_m == one.at_m and line.x0_m <= one.through_m <= line.x1_m


def _middle(x: float, y: float, text: str) -> str:
    return f'<text class="step" x="{x:.1f}" y="{y:.1f}" text-anchor="middle">{text}</text>'
