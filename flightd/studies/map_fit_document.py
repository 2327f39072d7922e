"""A fitted map as JSON, as rows for people, and as what is drawn beside the map."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from flightd.site.floor_plan_svg import LineOff
from flightd.site.site import Site
from flightd.studies.map_fit import FittedLine, MapFit


def fit_document(fit: MapFit) -> dict[str, Any]:
    """Everything that was fitted; lengths in metres to tenths of a millimetre."""
    return {
        "frames": fit.frames,
        "misfit": round(fit.misfit, 3),
        "scale": {
            "factor": round(fit.scale.factor, 5),
            "sigma": round(fit.scale.sigma, 5),
            "by": [
                {"source": one.source, "factor": round(one.factor, 5), "sigma": round(one.sigma, 5)}
                for one in fit.scale.witnesses
            ],
        },
        "lines": [_line(line) for line in fit.lines],
        "nodes": [
            {
                "node": node.id,
                "map_m": [round(node.across.map_m, 4), round(node.along.map_m, 4)],
                "fitted_m": [round(node.across.fitted_m, 4), round(node.along.fitted_m, 4)],
                "sigma_m": [round(node.across.sigma_m, 4), round(node.along.sigma_m, 4)],
                "sightings": node.sightings,
                "seen_enough": node.seen_enough,
            }
            for node in fit.nodes
        ],
    }


def _line(line: FittedLine) -> dict[str, Any]:
    return {
        "line": line.name,
        "axis": line.axis,
        "map_m": round(line.map_m, 4),
        "fitted_m": round(line.fitted_m, 4),
        "difference_m": round(line.difference_m, 4),
        "sigma_m": round(line.sigma_m, 4),
        "angle_deg": round(math.degrees(line.angle_rad), 3),
        "angle_sigma_deg": round(math.degrees(line.angle_sigma_rad), 3),
        "sightings": line.sightings,
        "seen_enough": line.seen_enough,
        "given": line.given,
    }


def fit_rows(fit: MapFit) -> Iterator[tuple[str, ...]]:
    """(line, map, fitted, difference, sigma, angle, sightings) of each line, in the words of the table."""
    for line in fit.lines:
        fitted = (
            f"{line.fitted_m:.3f}",
            f"{line.difference_m * 100:+.1f} cm",
            f"{line.sigma_m * 100:.1f} cm",
        )
        angle = f"{math.degrees(line.angle_rad):+.2f}"
        if line.given:
            fitted, angle = ("measured from", "", ""), angle if line.angle_sigma_rad else ""
        elif not line.seen_enough:
            fitted, angle = ("not enough seen", "", f"{line.sigma_m * 100:.1f} cm"), ""
        yield (line.name, f"{line.axis} {line.map_m:.3f}", *fitted, angle, str(line.sightings))


def lines_off(fit: MapFit, site: Site) -> list[LineOff]:
    """What is drawn on the map by which the flights were flown."""
    return [
        LineOff(
            line.axis,
            line.map_m,
            site.nodes[line.nodes[0]].y_m if line.axis == "x" else site.nodes[line.nodes[0]].x_m,
            line.difference_m if line.seen_enough else None,
        )
        for line in fit.lines
        if not line.given
    ]
