"""The inventory as JSON, with everything that is known of each location."""

from __future__ import annotations

import json
from collections.abc import Sequence

from flightd.core.inventory import LocationRecord, Observation
from flightd.core.utc_time import utc_text


def location_json(record: LocationRecord) -> dict[str, object]:
    """One location with all that is known of it."""
    seen = record.observation
    return {
        "location": record.code,
        "state": record.state.value,
        "node": record.node,
        "texts": list(record.texts),
        "observation": observation_json(seen) if seen else None,
    }


def observation_json(seen: Observation) -> dict[str, object]:
    """One look at a location."""
    pose = seen.pose
    return {
        "utc": utc_text(seen.utc_ns),
        "run": seen.run,
        "state": seen.state.value,
        "confidence": seen.confidence,
        "evidence": seen.evidence,
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
            }
            for read in seen.reads
        ],
    }


def as_json(records: Sequence[LocationRecord]) -> bytes:
    """Every location with its newest look."""
    document = {"locations": [location_json(record) for record in records]}
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()
