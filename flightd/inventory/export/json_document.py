"""The inventory as JSON, with everything that is known of each location."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from flightd.core.inventory import LocationRecord, Observation, PlaceFill, UndecidedCode
from flightd.core.label_values import LEAST_CONFIDENCE, PlaceValue, told_number
from flightd.core.utc_time import utc_text
from flightd.inventory.place_values import code_values, place_values


def location_json(record: LocationRecord, least_confidence: float = LEAST_CONFIDENCE) -> dict[str, object]:
    """One location with all that is known of it; values that are less sure than demanded are unknown."""
    seen = record.observation
    return {
        "location": record.code,
        "state": record.state.value,
        "node": record.node,
        "pallets_deep": record.pallets_deep,
        "pallets_seen": record.pallets_seen,
        "texts": list(record.texts),
        "values": [_value_json(value) for value in place_values(seen, least_confidence)],
        "observation": observation_json(seen, least_confidence) if seen else None,
    }


def observation_json(seen: Observation, least_confidence: float = LEAST_CONFIDENCE) -> dict[str, object]:
    """One look at a location, each code with its own values."""
    pose = seen.pose
    return {
        "utc": utc_text(seen.utc_ns),
        "run": seen.run,
        "state": seen.state.value,
        "confidence": seen.confidence,
        "evidence": seen.evidence,
        "fill": seen.fill and fill_json(seen.fill),
        "pose": pose
        and {
            "node": pose.node,
            "x_m": pose.x_m,
            "y_m": pose.y_m,
            "height_m": pose.height_m,
            "yaw_rad": pose.yaw_rad,
        },
        "reads": [
            {
                "symbology": read.symbology,
                "text": read.text,
                "checksum": read.sure,
                "agreeing": read.agreeing,
                "quality": read.quality,
                "gs1": dict(read.gs1),
                "values": [_value_json(value) for value in code_values(read, seen, least_confidence)],
            }
            for read in seen.reads
        ],
        "undecided": undecided_json(seen.undecided),
    }


def undecided_json(codes: Sequence[UndecidedCode]) -> list[dict[str, Any]]:
    """What was read beside the codes and does not count."""
    return [{"symbology": code.symbology, "text": code.text, "looks": code.looks} for code in codes]


def fill_json(fill: PlaceFill) -> dict[str, Any]:
    """How full a place is, and the cases in its front; null for what the pictures do not tell."""
    cases = fill.cases
    return {
        "share": fill.share,
        "overhang_m": fill.overhang_m,
        "lean_m": fill.lean_m,
        "cases": cases and {"columns": cases.columns, "rows": cases.rows, "count": cases.count},
    }


def _value_json(stands: PlaceValue) -> dict[str, object]:
    """A value with its unit and source; of one that is unknown, the reason."""
    told = stands.known
    if told is None:
        return {"kind": stands.kind.value, "value": None, "unknown": stands.unknown}
    number = told_number(told.value)
    return {
        "kind": stands.kind.value,
        "value": told.text if number is None else number,
        "unit": told.unit,
        "source": told.source.value,
        "confidence": told.confidence,
    }


def as_json(records: Sequence[LocationRecord], least_confidence: float = LEAST_CONFIDENCE) -> bytes:
    """Every location with its newest look."""
    document = {"locations": [location_json(record, least_confidence) for record in records]}
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()
