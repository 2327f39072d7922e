"""Whether a flight may be started without a person now, and if not, why.  Pure.

The drone has its own list of what keeps it on the ground (an open aisle among it), and judges that again when
it is started and until it arms; what stands here comes before."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Final

from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import CommandKind, Phase

PLAN = "schedule-"
"""How the ids of plans begin that a schedule has handed over."""
PERSON_S = 300.0
"""So long after a command of a person the drone is his."""


class Cause(enum.StrEnum):
    """What keeps a run from being started."""

    QUIET = "quiet"
    UNREACHABLE = "unreachable"
    SITE = "site"
    RULES = "rules"
    ROLE = "role"
    MANAGER = "manager"
    PERSON = "person"
    BUSY = "busy"
    NOT_READY = "not_ready"
    WORK = "work"
    REFUSED = "refused"
    OFF = "off"
    CHANGED = "changed"


@dataclass(frozen=True, slots=True)
class Objection:
    """Why a run is not started, for programs and for people."""

    cause: Cause
    why: str


QUIET: Final = Objection(Cause.QUIET, "these are quiet hours")
OFF: Final = Objection(Cause.OFF, "the station was off, or its clock jumped")
CHANGED: Final = Objection(Cause.CHANGED, "the schedule was changed")
SUSPENDED: Final = Objection(Cause.CHANGED, "the schedule was suspended")


def objection(
    site: str,
    welcome: Welcome | None,
    status: StatusReport | None,
    *,
    by_manager: bool,
    since_person_s: float,
) -> Objection | None:
    """What comes first of all that speaks against a start on `site`, by what the drone told; `by_manager`: a
    fleet's manager flies it; `since_person_s`: since a person of this station commanded it."""
    if welcome is None or status is None:
        return Objection(Cause.UNREACHABLE, "the drone is not heard")
    floor, possible = welcome.floor, set(status.possible)
    checks = (
        (floor.name != site, Cause.SITE, f"the drone is on site {floor.name}"),
        (
            not floor.unattended_start,
            Cause.RULES,
            f"the site file of {site} does not say unattended_start = true",
        ),
        (
            welcome.role is not Role.OPERATOR,
            Cause.ROLE,
            "the station's key is a viewer's: it may start nothing",
        ),
        (by_manager, Cause.MANAGER, "the fleet's manager flies the drone"),
        (
            status.phase is not Phase.PREFLIGHT,
            Cause.BUSY,
            f"the drone is in phase {status.phase}",
        ),
        (
            bool(status.plan) and not status.plan.startswith(PLAN),
            Cause.PERSON,
            "somebody's plan stands there and was not started",
        ),
        (
            since_person_s < PERSON_S,
            Cause.PERSON,
            f"a person commanded the drone less than {PERSON_S:.0f} s ago",
        ),
        (bool(status.obstacles), Cause.NOT_READY, "; ".join(status.obstacles)),
        (
            not {CommandKind.PLAN, CommandKind.START} <= possible,
            Cause.NOT_READY,
            status.reason or "the drone takes no start",
        ),
    )
    return next((Objection(cause, why) for applies, cause, why in checks if applies), None)


def is_flying_plan(status: StatusReport | None, plan: str = "") -> bool:
    """Whether the drone flies this plan (none given: any of a schedule), or is about to take off with it."""
    if status is None or status.phase in {Phase.PREFLIGHT, Phase.DONE, Phase.ABORTED}:
        return False
    return status.plan == plan if plan else status.plan.startswith(PLAN)
