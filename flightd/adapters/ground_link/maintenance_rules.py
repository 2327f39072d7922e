"""Whether a drone may be looked after now, and by whom.  Pure: the newest status and who asks."""

from __future__ import annotations

import math
from collections.abc import Collection

from flightd.adapters.ground_link.messages.answers import Code
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.maintenance import AskDoctor, AskSettings, Maintenance
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import CommandKind, LandedState, Phase

HEARD_S = 3.0
"""An older heartbeat does not say whether the vehicle is armed now."""
_LOOKS = (AskDoctor, AskSettings)


def objection(
    request: Maintenance,
    role: Role,
    status: StatusReport | None,
    possible: Collection[CommandKind],
    now_ns: int,
) -> tuple[Code, str] | None:
    """Why this is not done now; None where it may be.  `possible` are the commands that the mission takes.

    The drone has to stand disarmed and idle: before a flight, without a start under way.  To look suffices
    that nothing says otherwise; what changes something needs a vehicle that was heard to be disarmed."""
    if role is not Role.OPERATOR:
        return Code.ROLE, f"a {role} looks on; checks and settings need the role operator"
    if status is None:
        return Code.UNAVAILABLE, "flightd has not published a status yet; ask again in a moment"
    vehicle = status.vehicle
    age_s = math.inf
    if vehicle is not None:
        age_s = vehicle.heartbeat_age_s + (now_ns - status.stamp_ns) * 1e-9
    changes = changes_something(request)
    reasons = (
        (
            status.phase is not Phase.PREFLIGHT,
            f"only while the drone stands and waits, not in phase {status.phase}",
        ),
        (CommandKind.PAUSE in possible, "a start is under way: take it back first (pause)"),
        (vehicle is not None and vehicle.armed, "the vehicle is armed: disarm it first"),
        (
            vehicle is not None and vehicle.landed == LandedState.IN_AIR,
            "the vehicle says that it is in the air",
        ),
        (
            changes and vehicle is None,
            "the vehicle was not heard: nobody knows whether it is armed",
        ),
        (
            changes and not age_s <= HEARD_S,
            f"the vehicle was not heard for {age_s:.0f} s: nobody knows whether it is armed",
        ),
    )
    return next(((Code.PHASE, text) for applies, text in reasons if applies), None)


def changes_something(request: Maintenance) -> bool:
    """Whether it is written into the audit log."""
    return not isinstance(request, _LOOKS)
