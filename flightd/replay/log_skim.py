"""What a flight log tells at first glance: its head and its end are read, not what lies between."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import msgspec

from flightd.core.flight_order import ChosenPlan, FlightOrder
from flightd.core.topics import RETAINED, Document, Topic
from flightd.core.types import Status
from flightd.replay.log import converted
from flightd.replay.log_chunks import LogChunks

_FIRST_CHUNKS = 4
"""What a flight is flown with stands in the first of them."""
_LAST_CHUNKS = 30
"""The last status stands in the last that holds any; half a minute without one is no flight any more."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SkimmedLog:
    """`whole`: it was closed as it should be.  `first_ns`, `last_ns`: stamps of the first and the last
    message of the flight, equal where there is none.  `site` is its name and `vehicle` its kind, "" where
    that is not recorded; `order` has the nodes of the plan that was chosen last, if any was."""

    whole: bool
    first_ns: int = 0
    last_ns: int = 0
    site: str = ""
    vehicle: str = ""
    order: FlightOrder | None = None
    last_status: Status | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        return (self.last_ns - self.first_ns) * 1e-9


def skim(path: Path) -> SkimmedLog:
    """Look at a log.  InputError if it cannot be opened or is not MCAP; what is damaged in it is passed
    over."""
    with LogChunks(path) as log:
        site, vehicle, order, chosen, first_ns = "", "", None, None, 0
        for found in log.messages(log.chunks[:_FIRST_CHUNKS]):
            if found.topic == Topic.MAP:
                site = _site_name(_decoded(Document, found.payload))
            elif found.topic == Topic.CONFIG:
                vehicle = _vehicle_kind(_decoded(Document, found.payload))
            elif found.topic == Topic.ORDER:
                order = _decoded(FlightOrder, found.payload)
            elif found.topic not in RETAINED:
                first_ns = min(first_ns or found.stamp_ns, found.stamp_ns)
        for found in log.messages(log.chunks_with(Topic.PLAN)[-1:], {Topic.PLAN}):
            chosen = _decoded(ChosenPlan, found.payload)
        if chosen is not None and chosen.nodes:
            order = replace(order or FlightOrder(), nodes=chosen.nodes)
        last_ns, newest = _end(log)
        last_ns = max(last_ns, first_ns)
        first_ns = first_ns or last_ns
        return SkimmedLog(log.whole, first_ns, last_ns, site, vehicle, order, newest, log.metadata)


def _end(log: LogChunks) -> tuple[int, Status | None]:
    """The newest stamp of the flight and the last status."""
    last_ns = 0
    for span in reversed(log.chunks[-_LAST_CHUNKS:]):
        newest = None
        for found in log.messages([span]):
            if found.topic not in RETAINED:
                last_ns = max(last_ns, found.stamp_ns)
            if found.topic == Topic.STATUS:
                newest = found.payload
        if newest is not None:
            return last_ns, _decoded(Status, newest)
    return last_ns, None


def _decoded(kind: type[T], payload: bytes) -> T | None:
    """The message, None where it is not what this version records."""
    try:
        return msgspec.json.decode(payload, type=kind)
    except msgspec.ValidationError:
        pass
    except msgspec.DecodeError:
        return None
    try:
        return converted(msgspec.json.decode(payload), kind)
    except (msgspec.MsgspecError, ValueError, TypeError):
        return None


class _VehicleSection(msgspec.Struct):
    kind: str = ""


class _ConfigHead(msgspec.Struct):
    vehicle: _VehicleSection = msgspec.field(default_factory=_VehicleSection)


def _vehicle_kind(document: Document | None) -> str:
    if document is None:
        return ""
    try:
        return msgspec.json.decode(document.text, type=_ConfigHead).vehicle.kind
    except msgspec.MsgspecError:
        return ""


def _site_name(document: Document | None) -> str:
    if document is None:
        return ""
    try:
        name = tomllib.loads(document.text).get("site", {}).get("name", "")
    except (tomllib.TOMLDecodeError, AttributeError):
        return ""
    return name if isinstance(name, str) else ""
