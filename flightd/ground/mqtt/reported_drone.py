"""A drone as its ground link tells it, in the words of VDA 5050."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Final

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import HazardReport, StatusReport
from flightd.core.types import CommandKind, Phase
from flightd.fleet.vda5050.errors import ErrorType, level_of
from flightd.fleet.vda5050.parts import MobileRobotPosition
from flightd.fleet.vda5050.state import Error, ErrorLevel, Info, InfoLevel, OperatingMode, PowerSupply
from flightd.fleet.vehicle.signals import Situation
from flightd.ground.mqtt.linked_floor import node_of_pad
from flightd.ground.mqtt.order_flight import AT_NODE, WAITS
from flightd.mission.machine import FLYING

_DRIVES_MPS: Final = 0.1
_HALF_TURN: Final = 3.1415
_ON_NODE_M: Final = 0.3
_RISE: Final = 0.005
_RISES_WITHIN_NS: Final = 600_000_000_000
"""A battery that is filled slowly, and told in percent."""
_OTHER_BATTERY: Final = 0.05
"""So much at once is no charging."""
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
    *,
    charging: bool = False,
    dropped: int = 0,
) -> Situation:
    """How the drone is: y to the left, angles counter-clockwise.  `last_node` is what it reached last,
    `stands_on` the node on which it waits for its start, where it may see no floor; `errors` are told beside
    its own.  So many messages were `dropped`.  Its velocity is not told: the link has no direction of it."""
    vehicle, at = status.vehicle, status.position
    position = None
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
    charge = vehicle.battery_frac if vehicle else None
    return Situation(
        mode=mode,
        driving=_drives(status, floor, last_node),
        power=PowerSupply(
            state_of_charge=round(100.0 * min(max(charge or 0.0, 0.0), 1.0)),
            charging=charging,
            battery_voltage=vehicle.battery_v if vehicle else None,
        ),
        node=(stands_on if status.phase is Phase.PREFLIGHT else None) or _node_under(status, floor),
        position=position,
        errors=(*_lost(status), *map(_error, status.hazards), *errors),
        information=tuple(_information(status.phase, charge, dropped)),
    )


def _information(phase: Phase, charge: float | None, dropped: int) -> Iterator[Info]:
    yield _info("phase", phase.value)
    if charge is None:
        yield _info("battery", "its charge is not known")
    if dropped:
        yield _info("droppedMessages", f"{dropped} since the station began")


def _info(kind: str, text: str) -> Info:
    return Info(info_type=kind, info_level=InfoLevel.INFO, info_descriptor=text)


class ChargeTrend:
    """Whether a drone's battery is being filled where it stands: on a pad that charges, while it tells more
    than before."""

    def __init__(self) -> None:
        self._place: tuple[FloorStatus | None, str | None] = None, None
        self._charges = False
        self._peak: float | None = None
        self._rose_ns: int | None = None

    def see(self, status: StatusReport, floor: FloorStatus, stands_on: str | None) -> bool:
        """By its newest status, on the pad of this node."""
        charge = None if status.vehicle is None else status.vehicle.battery_frac
        if status.phase is not Phase.PREFLIGHT or charge is None or not self._is_on_charger(floor, stands_on):
            self._peak = self._rose_ns = None
            return False
        rise = 0.0 if self._peak is None else charge - self._peak
        if self._peak is None or abs(rise) > _OTHER_BATTERY:
            self._peak, self._rose_ns = charge, None
        elif rise >= _RISE:
            self._peak, self._rose_ns = charge, status.stamp_ns
        is_new = self._rose_ns is not None and status.stamp_ns - self._rose_ns <= _RISES_WITHIN_NS
        return is_new and charge < 1.0

    def _is_on_charger(self, floor: FloorStatus, stands_on: str | None) -> bool:
        if floor is not self._place[0] or stands_on != self._place[1]:
            self._place = floor, stands_on
            self._charges = stands_on in {node_of_pad(floor, pad) for pad in floor.pads if pad.charge}
        return self._charges


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
