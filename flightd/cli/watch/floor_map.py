"""The warehouse floor in a terminal: painted lines in braille dots, nodes by name, the drone an arrow."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeAlias

from rich.style import Style
from rich.text import Text

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import Position

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_BRAILLE = 0x2800
_ARROWS = "→↘↓↙←↖↑↗"
_MARGIN_M = 0.3

PAINT = Style(color="yellow3")
TRAIL = Style(color="dodger_blue1")
NODE = Style(color="grey70")
GOAL = Style(color="green1", bold=True)
HOME = Style(color="cyan1", bold=True)
DRONE = Style(color="white", bgcolor="red3", bold=True)

_Cell: TypeAlias = tuple[int, int]


class FloorMap:
    """A floor fitted into `columns` x `rows` of a terminal, x to the right, y down, as seen from above.

    Braille dots are taken to be square (a terminal's cells are about twice as high as wide)."""

    def __init__(self, floor: FloorStatus, columns: int, rows: int) -> None:
        self._floor = floor
        self._columns, self._rows = columns, rows
        xs = [x for line in floor.lines for x in (line.x0_m, line.x1_m)] or [0.0]
        ys = [y for line in floor.lines for y in (line.y0_m, line.y1_m)] or [0.0]
        self._x0_m, self._y0_m = min(xs) - _MARGIN_M, min(ys) - _MARGIN_M
        width_m, height_m = max(xs) + _MARGIN_M - self._x0_m, max(ys) + _MARGIN_M - self._y0_m
        self._per_m = min(2 * columns / width_m, 4 * rows / height_m)
        self._left = (2 * columns - width_m * self._per_m) / 2
        self._top = (4 * rows - height_m * self._per_m) / 2

    def cell(self, x_m: float, y_m: float) -> _Cell:
        """Column and row of a point of the floor."""
        across, down = self._dot(x_m, y_m)
        return across // 2, down // 4

    def draw(
        self, position: Position | None, goal: str = "", trail: Sequence[tuple[float, float]] = ()
    ) -> Text:
        """The picture: rows of the terminal, joined by line ends."""
        bits: dict[_Cell, int] = {}
        styles: dict[_Cell, Style] = {}
        for line in self._floor.lines:
            self._mark(
                bits, styles, PAINT, _steps(self._dot(line.x0_m, line.y0_m), self._dot(line.x1_m, line.y1_m))
            )
        self._mark(bits, styles, TRAIL, (self._dot(x_m, y_m) for x_m, y_m in trail))
        letters = self._letters(goal)
        if position is not None:
            letters[self.cell(position.x_m, position.y_m)] = (arrow(position.yaw_rad), DRONE)
        text = Text(no_wrap=True)
        for row in range(self._rows):
            for column in range(self._columns):
                here = column, row
                if here in letters:
                    text.append(*letters[here])
                elif here in bits:
                    text.append(chr(_BRAILLE + bits[here]), styles[here])
                else:
                    text.append(" ")
            if row + 1 < self._rows:
                text.append("\n")
        return text

    def _letters(self, goal: str) -> dict[_Cell, tuple[str, Style]]:
        """Names of the nodes below and to the right of them, as far as there is room."""
        letters: dict[_Cell, tuple[str, Style]] = {}
        floor = self._floor
        first = {goal: 0, floor.home: 1}
        for node in sorted(floor.nodes, key=lambda node: first.get(node.id, 2)):
            column, row = self.cell(node.x_m, node.y_m)
            style = GOAL if node.id == goal else HOME if node.id == floor.home else NODE
            cells = [(column + 1 + i, row + 1) for i in range(len(node.id))]
            around = {(cells[0][0] - 1, row + 1), (cells[-1][0] + 1, row + 1), *cells}
            if not any(cell in letters for cell in around):
                letters.update({cell: (sign, style) for cell, sign in zip(cells, node.id, strict=True)})
        return letters

    def _dot(self, x_m: float, y_m: float) -> tuple[int, int]:
        across = self._left + (x_m - self._x0_m) * self._per_m
        down = self._top + (y_m - self._y0_m) * self._per_m
        limits = 2 * self._columns - 1, 4 * self._rows - 1
        return min(max(int(across), 0), limits[0]), min(max(int(down), 0), limits[1])

    def _mark(
        self,
        bits: dict[_Cell, int],
        styles: dict[_Cell, Style],
        style: Style,
        dots: Iterable[tuple[int, int]],
    ) -> None:
        for across, down in dots:
            here = across // 2, down // 4
            bits[here] = bits.get(here, 0) | _DOTS[down % 4][across % 2]
            styles[here] = style


def arrow(yaw_rad: float) -> str:
    """The arrow nearest to a heading, clockwise from x (to the right)."""
    return _ARROWS[round(yaw_rad / (math.pi / 4)) % 8]


def _steps(start: tuple[int, int], end: tuple[int, int]) -> Iterable[tuple[int, int]]:
    count = max(abs(end[0] - start[0]), abs(end[1] - start[1]), 1)
    for i in range(count + 1):
        yield (
            round(start[0] + (end[0] - start[0]) * i / count),
            round(start[1] + (end[1] - start[1]) * i / count),
        )
