"""A drone as its ground link tells it, in the words of VDA 5050."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import HazardReport, StatusReport
from flightd.core.types import CommandKind, Phase
from flightd.fleet.vda5050.errors import ErrorType, level_of
from flightd.fleet.vda5050.parts import MobileRobotPosition, Velocity
from flightd.fleet.vda5050.state import Error, ErrorLevel, Info, InfoLevel, OperatingMode, PowerSupply
from flightd.fleet.vehicle.signals import Situation
from flightd.ground.mqtt.order_flight import AT_NODE, WAITS
from flightd.mission.machine import FLYING

_DRIVES_MPS: Final = 0.1
_HALF_TURN: Final = 3.1415
_ON_NODE_M: Final = 0.3
_WATCHES: Final = "report"
"""The action of a hazard about which the drone does nothing but tell."""


def takes_orders(status: StatusReport, ours: Collection[str]) -> bool:
    """Whether a fleet's manager could fly the drone now: it waits for a plan, or flies one of `ours`, by
    their ids, and may be sent on.  Who started another one flies the drone himself."""
    if status.phase in WAITS:
        return status.plan in ours or CommandKind.PLAN in status.possible
    return status.plan in ours and CommandKind.GOTO in status.possible


def situation_of(
    status: StatusReport,
    floor: FloorStatus,
    mode: OperatingMode,
    last_node: str = "",
    stands_on: str | None = None,
    errors: Sequence[Error] = (),
) -> Situation:
    """How the drone is: y to the left, angles counter-clockwise.  `last_node` is what it reached last,
    `stands_on` the node on which it waits for its start, where it may see no floor; `errors` are told beside
    its own."""
    vehicle, at = status.vehicle, status.position
    position = velocity = None
    if at is not None:
        sigmas = [sigma for sigma in (at.sigma_x_m, at.sigma_y_m) if sigma is not None]
        position = MobileRobotPosition(
            x=round(at.x_m, 3),
            y=round(0.0 - at.y_m, 3) + 0.0,
            theta=_rounded_angle(-at.yaw_rad),
            map_id=floor.name,
            localized=True,
            localization_score=min(max(at.integrity, 0.0), 1.0),
            deviation_range=round(max(sigmas), 3) if sigmas else None,
        )
        velocity = Velocity(vx=round(at.speed_mps, 2))
    charge = vehicle.battery_frac if vehicle else None
    return Situation(
        mode=mode,
        driving=_drives(status, floor, last_node),
        power=PowerSupply(
            state_of_charge=round(100.0 * min(max(charge or 0.0, 0.0), 1.0)),
            charging=False,
            battery_voltage=vehicle.battery_v if vehicle else None,
        ),
        node=(stands_on if status.phase is Phase.PREFLIGHT else None) or _node_under(status, floor),
        position=position,
        velocity=velocity,
        errors=(*_lost(status), *map(_error, status.hazards), *errors),
        information=(Info(info_type="phase", info_level=InfoLevel.INFO, info_descriptor=status.phase.value),),
    )


def _rounded_angle(angle_rad: float) -> float:
    """To the fourth decimal, and within -pi..pi still."""
    turned = round(math.remainder(angle_rad, math.tau), 4)
    return min(max(turned, -_HALF_TURN), _HALF_TURN) + 0.0


def _drives(status: StatusReport, floor: FloorStatus, last_node: str) -> bool:
    """It is on its way, or turns for it: not while it looks at the shelf beside a node, nor where it is held
    at the last one, however the air moves it there."""
    is_there = status.phase in FLYING and status.goal == last_node == _node_under(status, floor)
    if status.phase in AT_NODE or is_there:
        return False
    if status.position is not None and status.position.speed_mps > _DRIVES_MPS:
        return True
    return status.phase in FLYING and status.phase is not Phase.HOLD


def _node_under(status: StatusReport, floor: FloorStatus) -> str | None:
    at = status.position
    if at is None:
        return None
    near = [node for node in floor.nodes if math.hypot(node.x_m - at.x_m, node.y_m - at.y_m) <= _ON_NODE_M]
    return near[0].id if near else None


def _lost(status: StatusReport) -> list[Error]:
    flies = status.vehicle is not None and status.vehicle.armed
    if not flies or status.position is not None:
        return []
    kind = ErrorType.LOCALIZATION_ERROR
    return [Error(error_type=kind, error_level=level_of(kind), error_description=status.reason)]


def _error(hazard: HazardReport) -> Error:
    level = ErrorLevel.WARNING if hazard.action == _WATCHES else ErrorLevel.URGENT
    return Error(
        error_type="HAZARD",
        error_level=level,
        error_description=hazard.text,
        error_hint=f"the drone does: {hazard.action}",
    )
