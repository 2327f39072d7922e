"""The predefined errors of VDA 5050, word for word, by the names of version 3.0."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Final

from flightd.fleet.vda5050.state import ErrorLevel


class ErrorType(enum.StrEnum):
    """What a vehicle refuses, or cannot do any more.  The last three are flightd's own."""

    UNSUPPORTED_PARAMETER = "UNSUPPORTED_PARAMETER"
    NO_ORDER_TO_CANCEL = "NO_ORDER_TO_CANCEL"
    VALIDATION_FAILURE = "VALIDATION_FAILURE"
    INVALID_ORDER_ACTION = "INVALID_ORDER_ACTION"
    INVALID_INSTANT_ACTION = "INVALID_INSTANT_ACTION"
    INSTANT_ACTION_STATES_FULL = "INSTANT_ACTION_STATES_FULL"
    INSUFFICIENT_MEMORY = "INSUFFICIENT_MEMORY"
    OUTDATED_ORDER_UPDATE = "OUTDATED_ORDER_UPDATE"
    SAME_ORDER_UPDATE_ID = "SAME_ORDER_UPDATE_ID"
    ORDER_UPDATE_FOLLOWING_CANCEL = "ORDER_UPDATE_FOLLOWING_CANCEL"
    NODE_UNREACHABLE = "NODE_UNREACHABLE"
    LOCALIZATION_ERROR = "LOCALIZATION_ERROR"
    NO_ROUTE_TO_TARGET = "NO_ROUTE_TO_TARGET"
    OTHER_ORDER_ACTIVE = "OTHER_ORDER_ACTIVE"
    START_NODE_OUT_OF_RANGE = "START_NODE_OUT_OF_RANGE"
    MOBILE_ROBOT_NOT_AVAILABLE = "MOBILE_ROBOT_NOT_AVAILABLE"
    UNKNOWN_MAP_ID = "UNKNOWN_MAP_ID"
    BASE_BEYOND_SAFE_RETURN = "BASE_BEYOND_SAFE_RETURN"
    DRONE_NOT_HEARD = "DRONE_NOT_HEARD"
    COMMAND_REFUSED = "COMMAND_REFUSED"


_CRITICAL: Final = {ErrorType.UNSUPPORTED_PARAMETER, ErrorType.NODE_UNREACHABLE}
_URGENT: Final = {
    ErrorType.INSTANT_ACTION_STATES_FULL,
    ErrorType.INSUFFICIENT_MEMORY,
    ErrorType.BASE_BEYOND_SAFE_RETURN,
    ErrorType.COMMAND_REFUSED,
}

IN_2_1: Final[Mapping[str, str]] = {
    ErrorType.VALIDATION_FAILURE: "validationError",
    ErrorType.NO_ORDER_TO_CANCEL: "noOrderToCancel",
    ErrorType.OUTDATED_ORDER_UPDATE: "orderUpdateError",
    ErrorType.SAME_ORDER_UPDATE_ID: "orderUpdateError",
    ErrorType.ORDER_UPDATE_FOLLOWING_CANCEL: "orderUpdateError",
    ErrorType.INVALID_ORDER_ACTION: "orderError",
    ErrorType.UNSUPPORTED_PARAMETER: "orderError",
    ErrorType.NO_ROUTE_TO_TARGET: "orderError",
    ErrorType.OTHER_ORDER_ACTIVE: "orderError",
    ErrorType.START_NODE_OUT_OF_RANGE: "orderError",
    ErrorType.MOBILE_ROBOT_NOT_AVAILABLE: "orderError",
    ErrorType.UNKNOWN_MAP_ID: "orderError",
    ErrorType.INSUFFICIENT_MEMORY: "orderError",
    ErrorType.DRONE_NOT_HEARD: "orderError",
}
"""Version 2.1 knows four names; all errors that it has one for are warnings there.  Others keep theirs."""


def level_of(error: ErrorType) -> ErrorLevel:
    """How bad a predefined error is, in version 3.0."""
    if error in _CRITICAL:
        return ErrorLevel.CRITICAL
    if error is ErrorType.LOCALIZATION_ERROR:
        return ErrorLevel.FATAL
    return ErrorLevel.URGENT if error in _URGENT else ErrorLevel.WARNING
