"""One flight in the list: what its log says at first glance, and its judgement where there is one."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from flightd.core.errors import InputError
from flightd.core.flight_order import FlightOrder
from flightd.core.types import Phase, Status
from flightd.ground.flights.log_folder import FoundLog, beside, path_of
from flightd.replay.log_skim import SkimmedLog, skim

_RUNNING_S = 10.0
"""A log is written out once a second: one that is not closed and was not touched for so long is broken, as is
one that a clock far ahead dates into the future."""
_MOST_SUMMARY_BYTES = 1 << 20
_NAMED_NODES = 6
_STARTED = "%Y-%m-%d %H:%M:%S UTC"
_ENDED = {Phase.DONE: "completed", Phase.ABORTED: "aborted", Phase.PILOT: "taken over"}


class FlightRow(msgspec.Struct, frozen=True):
    """`trouble` is what is wrong with the log, in a line; "" for a good one.  Numbers are None where they
    are not known.  `stamp` is another whenever the log is.  `outcome` is completed, aborted, taken over,
    unfinished, flying or "" (no flight)."""

    id: str
    path: str
    bytes: int
    stamp: str = ""
    running: bool = False
    trouble: str = ""
    started_s: float = 0.0
    site: str = ""
    drone: str = ""
    world: str = ""
    mission: str = ""
    outcome: str = ""
    reason: str = ""
    verdict: str = ""
    faults: tuple[str, ...] = ()
    duration_s: float | None = None
    nodes_planned: int | None = None
    nodes_visited: int | None = None
    cross_track_rms_m: float | None = None
    hover_error_p95_m: float | None = None
    landed_error_m: float | None = None
    codes_expected: int | None = None
    codes_read: int | None = None
    codes_wrong: int | None = None


def read_rows(logs: tuple[FoundLog, ...]) -> tuple[FlightRow, ...]:
    """A row for each log, whatever is wrong with it."""
    return tuple(_row(log) for log in logs)


def unreadable(log: FoundLog, trouble: str) -> FlightRow:
    """The row of a log of which nothing is known but why."""
    return FlightRow(
        log.id, log.shown_path, log.size, log.mark, trouble=trouble, started_s=log.mtime_ns * 1e-9
    )


def _row(log: FoundLog) -> FlightRow:
    blank = unreadable(log, "")
    try:
        path = path_of(log.root, log.relative)
        skimmed = skim(path)
    except InputError as err:
        return msgspec.structs.replace(blank, trouble=err.what)
    except OSError as err:
        return msgspec.structs.replace(blank, trouble=f"cannot be read: {err.strerror}")
    summary, trouble = _summary(path)
    running = not skimmed.whole and abs(time.time() - log.mtime_ns * 1e-9) < _RUNNING_S
    if not skimmed.whole:
        cut = "is being recorded" if running else "cut off before its end: a kill, or a loss of power"
        trouble = "; ".join(filter(None, (cut, trouble)))
    return row_of(blank, skimmed, summary, running=running, trouble=trouble)


def row_of(
    blank: FlightRow, skimmed: SkimmedLog, summary: Mapping[str, Any], *, running: bool, trouble: str
) -> FlightRow:
    """The row of a log that could be read; where the summary speaks, it decides."""
    last = skimmed.last_status
    outcome, reason = _outcome(summary, last, running=running)
    flight_s = _number(summary, "flight_time_s")
    return FlightRow(
        id=blank.id,
        path=blank.path,
        bytes=blank.bytes,
        stamp=blank.stamp,
        running=running,
        trouble=trouble or ("" if last is not None else "holds no flight"),
        started_s=_started_s(skimmed, blank.started_s),
        site=skimmed.site,
        drone=skimmed.metadata.get("drone", "") or _text(summary, "vehicle") or skimmed.vehicle,
        world=_text(summary, "world"),
        mission=_mission(skimmed.order),
        outcome=outcome,
        reason=reason,
        verdict=_text(summary, "verdict"),
        faults=_faults(summary),
        duration_s=flight_s if flight_s is not None else round(skimmed.duration_s, 2),
        nodes_planned=_count(summary, "nodes_planned", last.nodes_planned if last else None),
        nodes_visited=_count(summary, "nodes_visited", last.nodes_done if last else None),
        cross_track_rms_m=_number(summary, "cross_track_rms_m"),
        hover_error_p95_m=_number(summary, "hover_error_p95_m"),
        landed_error_m=_number(summary, "landed_error_m"),
        codes_expected=_count(summary, "codes_expected"),
        codes_read=_count(summary, "codes_read"),
        codes_wrong=_count(summary, "codes_wrong"),
    )


def _summary(log: Path) -> tuple[Mapping[str, Any], str]:
    """`summary.json` beside the log, and what is wrong with it."""
    path = beside(log, "summary.json")
    if path is None:
        return {}, ""
    try:
        with path.open("rb") as stream:
            text = stream.read(_MOST_SUMMARY_BYTES)
        return msgspec.json.decode(text, type=dict[str, Any]), ""
    except (OSError, msgspec.DecodeError):
        return {}, "summary.json cannot be read"


def _outcome(summary: Mapping[str, Any], last: Status | None, *, running: bool) -> tuple[str, str]:
    mission = _text(summary, "mission")
    if mission in {"completed", "aborted"}:
        return mission, _text(summary, "reason")
    if last is None:
        return "", ""
    if running:
        return "flying", last.reason
    return _ENDED.get(last.phase, "unfinished"), last.reason


def _started_s(skimmed: SkimmedLog, written_s: float) -> float:
    """When it began: as the log says, else by when the file was written last."""
    try:
        said = datetime.strptime(skimmed.metadata["started"], _STARTED).replace(tzinfo=UTC)
    except (KeyError, ValueError):
        return max(written_s - skimmed.duration_s, 0.0)
    return said.timestamp()


def _mission(order: FlightOrder | None) -> str:
    if order is None:
        return ""
    if not order.nodes:
        return "every node"
    named = ", ".join(order.nodes[:_NAMED_NODES])
    more = len(order.nodes) - _NAMED_NODES
    return f"{named} and {more} more" if more > 0 else named


def _faults(summary: Mapping[str, Any]) -> tuple[str, ...]:
    faults = summary.get("faults")
    if not isinstance(faults, list):
        return ()
    kinds = (fault.get("kind") for fault in faults if isinstance(fault, dict))
    return tuple(dict.fromkeys(kind for kind in kinds if isinstance(kind, str)))


def _text(summary: Mapping[str, Any], key: str) -> str:
    value = summary.get(key)
    return value if isinstance(value, str) else ""


def _number(summary: Mapping[str, Any], key: str) -> float | None:
    value = summary.get(key)
    known = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if known else None  # type: ignore[arg-type]


def _count(summary: Mapping[str, Any], key: str, otherwise: int | None = None) -> int | None:
    value = _number(summary, key)
    return otherwise if value is None else round(value)
