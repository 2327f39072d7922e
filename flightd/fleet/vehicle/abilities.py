"""The actions that a drone can do in an order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from flightd.core.errors import InputError
from flightd.fleet.vda5050.factsheet import ActionScope, KnownAction, KnownParameter, ValueType
from flightd.fleet.vda5050.parts import Action, BlockingType
from flightd.fleet.vehicle.floor import Floor
from flightd.site.site import Side

SCAN_SHELF: Final = "scanShelf"
_MOST_LEVELS: Final = 100
_MOST_EXPECTED: Final = 10_000
_INSTANT: Final = (
    "startPause",
    "stopPause",
    "cancelOrder",
    "stateRequest",
    "factsheetRequest",
    "clearInstantActions",
)


@dataclass(frozen=True, slots=True)
class ScanShelf:
    """To read the labels of a node's shelf: `levels` from 1 at the floor, seen along +x on `side`; the codes
    that are `expected` there, if that is told."""

    levels: tuple[int, ...]
    side: Side
    expected: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Ability:
    """An action of orders.  `check` raises InputError for what a node does not allow, its key a parameter."""

    check: Callable[[Action, str, Floor], object]
    blocking: frozenset[BlockingType]
    pausable: bool = True
    cancellable: bool = True


def scan_shelf_of(action: Action) -> ScanShelf:
    """What a scanShelf asks for.  InputError naming the parameter that is wrong."""
    levels = action.parameter("levels")
    whole = isinstance(levels, list) and all(
        isinstance(one, int) and not isinstance(one, bool) for one in levels
    )
    if not isinstance(levels, list) or not whole or not 1 <= len(levels) <= _MOST_LEVELS or min(levels) < 1:
        raise InputError(f"is no list of 1 to {_MOST_LEVELS} levels, counted from 1", key="levels")
    side = action.parameter("side")
    if side not in {one.value for one in Side}:
        raise InputError("is neither left nor right", key="side")
    expected = action.parameter("expected")
    codes = isinstance(expected, list) and all(isinstance(one, str) for one in expected)
    if expected is not None and (
        not isinstance(expected, list) or not codes or len(expected) > _MOST_EXPECTED
    ):
        raise InputError(f"is no list of up to {_MOST_EXPECTED} codes", key="expected")
    told = tuple(str(one) for one in expected) if isinstance(expected, list) else None
    return ScanShelf(tuple(dict.fromkeys(levels)), Side(str(side)), told)


def _check_scan(action: Action, node: str, floor: Floor) -> None:
    scan = scan_shelf_of(action)
    if scan.side not in floor.shelves.get(node, frozenset()):
        raise InputError(f"node {node} has no shelf on its {scan.side} side", key="side")


ABILITIES: Final[Mapping[str, Ability]] = {
    SCAN_SHELF: Ability(_check_scan, frozenset({BlockingType.SOFT, BlockingType.HARD}))
}


def known_actions() -> list[KnownAction]:
    """All actions as the factsheet tells them."""
    scan = KnownAction(
        action_type=SCAN_SHELF,
        action_scopes=[ActionScope.NODE],
        pause_allowed=ABILITIES[SCAN_SHELF].pausable,
        cancel_allowed=ABILITIES[SCAN_SHELF].cancellable,
        action_description="Reads the labels of the shelf beside the node",
        action_parameters=[
            KnownParameter(
                key="levels", value_data_type=ValueType.ARRAY, description="Levels, from 1 at the floor"
            ),
            KnownParameter(
                key="side", value_data_type=ValueType.STRING, description="left or right, seen along +x"
            ),
            KnownParameter(
                key="expected",
                value_data_type=ValueType.ARRAY,
                description="Codes that should be there",
                is_optional=True,
            ),
        ],
        action_result="How many codes were read",
        blocking_types=sorted(ABILITIES[SCAN_SHELF].blocking),
    )
    instant = [
        KnownAction(
            action_type=name,
            action_scopes=[ActionScope.INSTANT],
            pause_allowed=False,
            cancel_allowed=False,
            blocking_types=[BlockingType.NONE],
        )
        for name in _INSTANT
    ]
    return [scan, *instant]
