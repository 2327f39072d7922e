"""The picture of the layers, drawn from the contract that import-linter checks."""

from __future__ import annotations

import tomllib
from html import escape
from pathlib import Path

WORDS = {
    "__main__": "python -m flightd",
    "cli": "one thin file a command",
    "ground": "the ground station",
    "app": "builds and runs a flight",
    "doctor": "fit to fly?",
    "studies": "bench, evaluate, train",
    "guide": "these pages",
    "inventory": "count and books",
    "adapters": "camera, vehicle, link, log",
    "sim": "the world in a box",
    "replay": "recorded flights, report",
    "runtime": "clock, processes, shared memory",
    "ports": "interfaces",
    "config": "keys, units, ranges",
    "pilot": "one step: inputs to setpoint",
    "mission": "phases, hazards, scan",
    "localisation": "where on the grid",
    "site": "the map",
    "vision": "lines, codes, pads",
    "tracking": "line tracks, tilt",
    "control": "PID loops, limits",
    "core": "messages, units, geometry",
}
"""What each package is for; one that is missing here is drawn with its name alone."""

_PURE_FROM = "pilot"
_WIDTH, _ROW, _GAP, _LEFT = 960, 50, 8, 20


def layers(pyproject: Path) -> list[list[str]]:
    """The packages of each layer, highest first."""
    tables = tomllib.loads(pyproject.read_text(encoding="utf-8"))
    contracts = tables["tool"]["importlinter"]["contracts"]
    rows = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    names = (row.replace("|", ":").split(":") for row in rows)
    return [[name.strip().removeprefix("flightd.") for name in row] for row in names]


def picture(rows: list[list[str]]) -> str:
    """An SVG: each layer a row; the pure ones in another colour."""
    height = len(rows) * (_ROW + _GAP) + 52
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}"'
        f' height="{height}" role="img"'
        ' font-family="system-ui, Segoe UI, Roboto, Helvetica, Arial, sans-serif">',
        "<title>The layers: each imports only what stands below it</title>",
        f'<rect width="{_WIDTH}" height="{height}" rx="12" fill="#f8fafc"/>',
    ]
    pure = False
    for number, row in enumerate(rows):
        pure = pure or _PURE_FROM in row
        parts += _row(row, 16 + number * (_ROW + _GAP), pure)
    legend = "blue: pure code, the same in flight, simulation and replay: it opens nothing and asks no clock"
    parts.append(f'<text x="{_LEFT}" y="{height - 16}" font-size="13" fill="#475569">{legend}</text>')
    return "\n".join([*parts, "</svg>", ""])


def _row(names: list[str], top: int, pure: bool) -> list[str]:
    width = (_WIDTH - 2 * _LEFT - (len(names) - 1) * _GAP) / len(names)
    fill, stroke = ("#eff6ff", "#1d4ed8") if pure else ("#ffffff", "#475569")
    parts = []
    for number, name in enumerate(names):
        left = _LEFT + number * (width + _GAP)
        middle, words = left + width / 2, WORDS.get(name, "")
        parts += [
            f'<rect x="{left:.1f}" y="{top}" width="{width:.1f}" height="{_ROW}" rx="7" fill="{fill}"'
            f' stroke="{stroke}" stroke-width="1.4"/>',
            f'<text x="{middle:.1f}" y="{top + (21 if words else 30)}" text-anchor="middle" font-size="15"'
            f' font-weight="600" fill="#0f172a">{escape(name)}</text>',
            f'<text x="{middle:.1f}" y="{top + 39}" text-anchor="middle" font-size="12.5"'
            f' fill="#475569">{escape(words)}</text>',
        ]
    return parts
