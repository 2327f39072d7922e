"""What a LIF layout says that a site has no place for, in a line for each kind of part."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

import msgspec

from flightd.site.exchange.lif_file import Layout

VEHICLE: Final = "flightd"
"""The type of vehicle that our own files are for."""
CHARGING: Final = "startCharging"
PAD: Final = "charging pad"
PAD_WITHOUT_CHARGER: Final = "pad"
_HELD: Final[Mapping[str, frozenset[str]]] = {
    "the layout": frozenset({"layoutName"}),
    "nodes": frozenset({"nodeId", "nodePosition", "x", "y", "vehicleTypeNodeProperties", "vehicleTypeId"}),
    "edges": frozenset(
        {"edgeId", "startNodeId", "endNodeId", "vehicleTypeEdgeProperties", "vehicleTypeId", "maxHeight"}
    ),
    "stations": frozenset({"stationId", "interactionNodeIds", "stationHeight", "stationPosition", "x", "y"}),
}


def unheld(told: Mapping[str, Any], layout: Layout) -> list[str]:
    """The notes on a layout as it is written (`told`) and as it is understood."""
    known = msgspec.to_builtins(layout)
    parts: list[tuple[str, Any, Any]] = [("the layout", _without_parts(told), _without_parts(known))]
    for kind in ("nodes", "edges", "stations"):
        parts += [(kind, one, two) for one, two in zip(told.get(kind) or (), known[kind] or (), strict=True)]
    lost: dict[str, Counter[str]] = {}
    foreign: dict[str, Counter[str]] = {}
    for kind, one, two in parts:
        unknown: set[str] = set()
        keys = set(_lost(kind, one, two, layout, unknown))
        lost.setdefault(kind, Counter()).update(sorted(keys))
        foreign.setdefault(kind, Counter()).update(sorted(unknown))
    return [
        *(f"of {kind} not held by a site: {_counted(keys)}" for kind, keys in lost.items() if keys),
        *(
            f"of {kind} no part of LIF 1.0, not read: {_counted(keys)}"
            for kind, keys in foreign.items()
            if keys
        ),
    ]


def _without_parts(told: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in told.items() if key not in {"nodes", "edges", "stations"}}


def _counted(keys: Counter[str]) -> str:
    return ", ".join(f"{key} ({n})" for key, n in sorted(keys.items()))


def _lost(kind: str, told: Any, known: Any, layout: Layout, unknown: set[str]) -> list[str]:
    """The keys of one part that a site does not hold; `unknown` gathers those that LIF does not have."""
    lost: list[str] = []
    if isinstance(told, dict):
        for key, value in told.items():
            if key not in known:
                unknown.add(str(key))
            elif value is not None and not _is_ours(key, value, layout):
                if key in _HELD[kind]:
                    lost += _lost(kind, value, known[key], layout, unknown)
                else:
                    lost.append(key)
    elif isinstance(told, list):
        for one, two in zip(told, known, strict=True):
            lost += _lost(kind, one, two, layout, unknown)
    return lost


def _is_ours(key: str, value: Any, layout: Layout) -> bool:
    """Whether it says what our own files always say, or what is said by another key."""
    always: Mapping[str, tuple[Any, ...]] = {
        "layoutVersion": ("1",),
        "layoutId": (layout.layout_id,) if layout.layout_name in {None, layout.layout_id} else (),
        "mapId": (layout.layout_id, layout.layout_name),
        "rotationAllowed": (True,),
        "stationDescription": (PAD, PAD_WITHOUT_CHARGER),
    }
    if key == "actions":
        return [one.get("actionType") for one in value if isinstance(one, dict)] == [CHARGING]
    return value in always.get(key, ())
