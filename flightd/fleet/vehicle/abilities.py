"""The actions that a drone can do in an order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

from flightd.core.errors import InputError
from flightd.fleet.vda5050.factsheet import ActionScope, KnownAction, KnownParameter, ValueType
from flightd.fleet.vda5050.parts import Action, BlockingType
from flightd.fleet.vehicle.floor import Floor
from flightd.site.site import Side

SCAN_SHELF: Final = "scanShelf"
_HIGHEST: Final = 99
"""The highest level that a drone is told to count, and how many it is told at most."""
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
    """To read the labels of a node's shelf: `levels` from 1 at the floor (none: all), on `side` as seen along
    +x (None: on both); the codes that are `expected` there, if that is told."""

    levels: tuple[int, ...] = ()
    side: Side | None = None
    expected: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Ability:
    """An action of orders.  `check` raises InputError for what a node does not allow, its key a parameter."""

    check: Callable[[Action, str, Floor], object]
    blocking: frozenset[BlockingType]
    pausable: bool = True
    cancellable: bool = True


def shelf_of(action: Action) -> ScanShelf:
    """What a scanShelf asks for, without the codes expected there, which may be many.  InputError naming the
    parameter that is wrong."""
    levels, side = action.parameter("levels"), action.parameter("side")
    if levels is not None and not _are_levels(levels):
        raise InputError(f"is no list of 1 to {_HIGHEST} levels, from 1 to {_HIGHEST}", key="levels")
    if side is not None and side not in [one.value for one in Side]:  # no set: it may be a list
        raise InputError("is neither left nor right", key="side")
    chosen = tuple(dict.fromkeys(levels)) if isinstance(levels, list) else ()
    return ScanShelf(chosen, None if side is None else Side(str(side)))


def scan_shelf_of(action: Action) -> ScanShelf:
    """All that a scanShelf asks for.  InputError naming the parameter that is wrong."""
    shelf = shelf_of(action)
    expected = action.parameter("expected")
    codes = isinstance(expected, list) and all(isinstance(one, str) for one in expected)
    if expected is not None and (
        not isinstance(expected, list) or not codes or len(expected) > _MOST_EXPECTED
    ):
        raise InputError(f"is no list of up to {_MOST_EXPECTED} codes", key="expected")
    told = tuple(str(one) for one in expected) if isinstance(expected, list) else None
    return replace(shelf, expected=told)


def _are_levels(told: object) -> bool:
    if not isinstance(told, list) or not 1 <= len(told) <= _HIGHEST:
        return False
    return all(isinstance(one, int) and not isinstance(one, bool) and 1 <= one <= _HIGHEST for one in told)


def _check_scan(action: Action, node: str, floor: Floor) -> None:
    scan, shelves = scan_shelf_of(action), floor.shelves.get(node, {})
    if scan.side is not None and scan.side not in shelves:
        raise InputError(f"node {node} has no shelf on its {scan.side} side", key="side")
    asked = [shelves[side] for side in shelves if scan.side in {None, side}]
    known = [levels for levels in asked if levels is not None]
    if len(known) < len(asked):
        return
    where = f"node {node}" if scan.side is None else f"the {scan.side} side of node {node}"
    hangs = frozenset().union(*known)
    if not hangs:
        raise InputError(f"{where} has no place to count", key="side" if scan.side else "actionType")
    if scan.levels and hangs.isdisjoint(scan.levels):
        levels = ", ".join(map(str, sorted(hangs)))
        raise InputError(f"{where} has places on level {levels} alone", key="levels")


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
        action_description="Counts the places that are seen from the node, on one side and level or all",
        action_parameters=[
            KnownParameter(
                key="levels",
                value_data_type=ValueType.ARRAY,
                description="Levels that are counted, from 1 at the floor; all without it",
                is_optional=True,
            ),
            KnownParameter(
                key="side",
                value_data_type=ValueType.STRING,
                description="left or right side of the aisle, the only one that is counted, for someone who "
                "looks along the site's +x, whichever way the drone flies; both without it",
                is_optional=True,
            ),
            KnownParameter(
                key="expected",
                value_data_type=ValueType.ARRAY,
                description="Codes that should be there",
                is_optional=True,
            ),
        ],
        action_result="At how many of these places codes were read, and which expected ones were not",
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
