"""What a flight log holds: its topics, how long it is, whether it is whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flightd.core.topics import RETAINED
from flightd.replay.log import LogReader


def summary_of(log: Path) -> dict[str, Any]:
    """Size in bytes, damage ("" for none), duration in seconds, metadata, and messages and Hz of each topic.

    InputError as `read_log`.
    """
    reader = LogReader(log)
    counts: dict[str, int] = {}
    first_ns: dict[str, int] = {}
    last_ns: dict[str, int] = {}
    for entry in reader.entries():
        counts[entry.topic] = counts.get(entry.topic, 0) + 1
        first_ns[entry.topic] = min(first_ns.get(entry.topic, entry.stamp_ns), entry.stamp_ns)
        last_ns[entry.topic] = max(last_ns.get(entry.topic, entry.stamp_ns), entry.stamp_ns)
    streams = [topic for topic in counts if topic not in RETAINED]
    span_ns = max((last_ns[t] for t in streams), default=0) - min((first_ns[t] for t in streams), default=0)

    def rate_hz(topic: str) -> float:
        span_s = (last_ns[topic] - first_ns[topic]) / 1e9
        return round((counts[topic] - 1) / span_s, 2) if span_s > 0 else 0.0

    return {
        "path": str(log),
        "bytes": log.stat().st_size,
        "damage": reader.damage,
        "duration_s": round(span_ns / 1e9, 3),
        "messages": sum(counts.values()),
        "metadata": reader.metadata,
        "topics": {topic: {"messages": counts[topic], "hz": rate_hz(topic)} for topic in sorted(counts)},
    }
