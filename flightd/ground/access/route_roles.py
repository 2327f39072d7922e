"""Who may ask for what: each route of the station with the role that it needs.

A route that is not listed here does not exist: the station refuses to start with it.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass

from flightd.ground.access.key_book import Scope
from flightd.ground.access.roles import Role


class Line(enum.Enum):
    """Which line a request leaves in the audit."""

    NONE = enum.auto()
    """It changes nothing."""
    ACT = enum.auto()
    """Method, path and status, with what the route notes about it."""
    OWN = enum.auto()
    """The route writes it itself."""


@dataclass(frozen=True, slots=True)
class Rule:
    """`role` None: anybody, without signing in; nothing that is anybody's business may be behind it.  A key
    with scopes needs the `scope`, and may nothing where there is none."""

    role: Role | None
    line: Line
    scope: Scope | None = None


_ANYBODY = Rule(None, Line.NONE)
_LOOKS = Rule(Role.VIEWER, Line.NONE)
_ACTS = Rule(Role.OPERATOR, Line.ACT)
_RULES_OVER_ALL = Rule(Role.ADMIN, Line.NONE)
_CHANGES = Rule(Role.ADMIN, Line.ACT)
_READS_STORE = Rule(Role.VIEWER, Line.NONE, Scope.STOCK)
_DELIVERS = Rule(Role.OPERATOR, Line.OWN, Scope.DELIVER)

RULES: Mapping[str, Rule] = {
    # the pages' document and files, which are the same for all, and the way in
    "GET /": _ANYBODY,
    "GET /stock": _ANYBODY,
    "GET /stock/{rest:path}": _ANYBODY,
    "GET /fleet": _ANYBODY,
    "GET /fleet/{rest:path}": _ANYBODY,
    "GET /missions": _ANYBODY,
    "GET /missions/{rest:path}": _ANYBODY,
    "GET /flights": _ANYBODY,
    "GET /flights/{rest:path}": _ANYBODY,
    "GET /studio": _ANYBODY,
    "GET /studio/{rest:path}": _ANYBODY,
    "GET /site": _ANYBODY,
    "GET /site/{rest:path}": _ANYBODY,
    "GET /doctor": _ANYBODY,
    "GET /doctor/{rest:path}": _ANYBODY,
    "GET /guide": _ANYBODY,
    "GET /guide/{rest:path}": _ANYBODY,
    "MOUNT /static": _ANYBODY,
    "GET /api/session": _ANYBODY,
    "POST /api/session": Rule(None, Line.OWN),
    "DELETE /api/session": Rule(None, Line.OWN),
    # what a viewer may order stands in roles.py
    "WEBSOCKET /live": Rule(Role.VIEWER, Line.OWN),
    "POST /drones/{drone}/acts": Rule(Role.VIEWER, Line.OWN),
    "POST /drones/{drone}/manager": _ACTS,
    "GET /api/fleet": _LOOKS,
    "POST /api/fleet/tour": _ACTS,
    "POST /api/fleet/value": _ACTS,
    "POST /api/fleet/close": _ACTS,
    "POST /api/fleet/open": _ACTS,
    "POST /api/fleet/stop": Rule(Role.VIEWER, Line.OWN),  # as STOP to one drone
    "GET /api/stock": _LOOKS,
    "GET /api/stock/places": _LOOKS,
    "GET /api/stock/place": _LOOKS,
    "GET /api/stock/find": _LOOKS,
    "GET /api/stock/picture": _LOOKS,
    "GET /api/stock/outlines": _LOOKS,
    "GET /api/stock/export": _LOOKS,
    "POST /api/stock/compare": _LOOKS,  # a question with a file, which is kept nowhere
    "GET /api/stock/expected": _LOOKS,
    "PUT /api/stock/expected": _ACTS,
    "POST /api/stock/expected": _ACTS,
    "DELETE /api/stock/expected": _ACTS,
    "GET /api/stock/decisions": _LOOKS,
    "POST /api/stock/decisions": _ACTS,
    "GET /api/missions": _LOOKS,
    "GET /api/missions/estimate": _LOOKS,  # what the drone would do, which changes nothing in it
    "POST /api/missions/recount": _LOOKS,  # a question, too long for an address
    "POST /api/missions/fly": _ACTS,
    "PUT /api/missions/{mission}": _ACTS,
    "DELETE /api/missions/{mission}": _ACTS,
    "GET /api/schedules": _LOOKS,
    "GET /api/schedules/calendar": _LOOKS,
    "GET /api/schedules/{schedule}/runs": _LOOKS,
    "PUT /api/schedules/{schedule}": _ACTS,
    "DELETE /api/schedules/{schedule}": _ACTS,
    "GET /api/flights": _LOOKS,
    "GET /api/flights/{flight}": _LOOKS,
    "GET /api/flights/{flight}/series": _LOOKS,
    "GET /api/flights/{flight}/pictures/{place}": _LOOKS,
    "GET /api/flights/{flight}/thumbnail": _LOOKS,
    "GET /api/flights/{flight}/report": _LOOKS,
    "GET /api/studio": _LOOKS,
    "GET /api/studio/sets/{set}": _LOOKS,
    "GET /api/studio/sets/{set}/pictures/{file}": _LOOKS,
    "GET /api/studio/sets/{set}/pictures/{file}/mask": _LOOKS,
    "GET /api/studio/sets/{set}/boards": _LOOKS,
    "GET /api/studio/flights/{flight}/sensors": _LOOKS,
    "GET /api/studio/profiles/{set}/file": _LOOKS,
    "POST /api/studio/sets": _ACTS,  # pictures and what is learnt of them fly nothing
    "POST /api/studio/sets/{set}/pictures": _ACTS,
    "POST /api/studio/sets/{set}/uploads": _ACTS,
    "PUT /api/studio/sets/{set}/pictures/{file}": _ACTS,
    "DELETE /api/studio/sets/{set}/pictures/{file}": _ACTS,
    "POST /api/studio/sets/{set}/train": _ACTS,
    "POST /api/studio/sets/{set}/install": _CHANGES,
    "POST /api/studio/profiles/{set}/back": _CHANGES,
    "GET /api/site": _LOOKS,
    "GET /api/site/file": _LOOKS,
    "GET /api/site/version": _LOOKS,
    "POST /api/site/check": _LOOKS,  # questions with a draft, which is kept nowhere
    "POST /api/site/new": _LOOKS,
    "POST /api/site/import": _LOOKS,
    "POST /api/site/export": _LOOKS,
    "PUT /api/site/file": _CHANGES,
    "POST /api/site/simulation": _ACTS,  # an admin's where other machines reach the station
    "DELETE /api/site/simulation": _ACTS,
    "GET /api/doctor": _LOOKS,
    "GET /api/doctor/{drone}/report": _LOOKS,
    "GET /api/doctor/{drone}/settings": _LOOKS,
    "POST /api/doctor/{drone}/check": _LOOKS,  # a question with what is typed, which is sent nowhere
    "POST /api/doctor/{drone}/fix": _CHANGES,
    "POST /api/doctor/{drone}/settings": _CHANGES,
    "POST /api/doctor/{drone}/take-back": _CHANGES,
    "POST /api/doctor/{drone}/profile": _CHANGES,
    "POST /api/doctor/{drone}/restart": _CHANGES,
    "GET /api/guide": _LOOKS,
    "GET /api/guide/search": _LOOKS,
    "GET /api/guide/pages/{topic}": _LOOKS,
    "MOUNT /api/guide/pictures": _LOOKS,
    "GET /api/audit": _RULES_OVER_ALL,
    # the ground store, for programs
    "GET /api/v1/openapi.json": _READS_STORE,
    "GET /api/v1/sites": _READS_STORE,
    "GET /api/v1/stock": _READS_STORE,
    "GET /api/v1/history": _READS_STORE,
    "GET /api/v1/runs": _READS_STORE,
    "GET /api/v1/differences": _READS_STORE,
    "GET /api/v1/observations": _READS_STORE,
    "GET /api/v1/flights": _READS_STORE,
    "GET /api/v1/decisions": _READS_STORE,
    "GET /api/v1/questions": _READS_STORE,
    "POST /api/v1/questions": Rule(Role.OPERATOR, Line.ACT, Scope.ASK),
    "GET /api/v1/pictures/{name}": Rule(Role.VIEWER, Line.NONE, Scope.PICTURES),
    "POST /api/v1/deliveries": _DELIVERS,  # the store's own books have each
    "POST /api/v1/deliveries/standings": _DELIVERS,
    "POST /api/v1/deliveries/printed-texts": _DELIVERS,
    "POST /api/v1/deliveries/missing-pictures": _DELIVERS,
    "POST /api/v1/deliveries/pictures": _DELIVERS,
}
