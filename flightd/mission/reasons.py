"""Why a mission does what it does, or does not: values with fields, and their words in one place.  Pure."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TypeAlias

from flightd.core.refusal import Refusal
from flightd.mission.triggers import Trigger
from flightd.tracking.battery_charge import ChargeDoubt


class Plain(enum.Enum):
    """Reasons that need no figures."""

    AWAITS_START = "waiting for the start command"
    LANDED = "landed on the pad"
    NO_TELEMETRY = "no telemetry from the vehicle"
    ARMED_ALREADY = "the vehicle is armed already: disarm it first"
    NO_HEIGHT = "no height from the vehicle's range finder"
    NO_CLIMB = "no climb rate from the vehicle"
    NO_CELLS = "how many cells the battery has is not known: set battery.cells"
    HIGH_FLOOR = "its range finder reads over 0.5 m on the floor"
    OTHER_CELLS = "the vehicle tells other cells than battery.cells"
    NO_PICTURE = "no picture from the down camera"
    AISLE_OPEN = "the aisle is not closed"
    NO_RECORD = "the flight log cannot be written"
    GROUND_SILENT = "the ground station that attends this flight fell silent"


@dataclass(frozen=True, slots=True)
class Happened:
    """What has just happened, as the machine knows it."""

    trigger: Trigger


@dataclass(frozen=True, slots=True)
class VehicleRefuses:
    """As `why`, and the vehicle says what it refuses."""

    why: Reason
    refusal: Refusal


@dataclass(frozen=True, slots=True)
class Paused:
    """As `why`, and an operator wants it to wait, too."""

    why: Reason


@dataclass(frozen=True, slots=True)
class StartChargeLow:
    """Too little charge to start."""

    charge_frac: float
    needed_frac: float


@dataclass(frozen=True, slots=True)
class ChargeUnknown:
    """The battery's charge is not known, and why."""

    doubt: ChargeDoubt


@dataclass(frozen=True, slots=True)
class CellsLow:
    """A cell has too little to start, or in flight to go on with."""

    cell_v: float
    needed_v: float


@dataclass(frozen=True, slots=True)
class ClockUnsure:
    """The vehicle's clock is not known in ours well enough; `error_s` is NaN where it does not answer."""

    error_s: float
    limit_s: float


@dataclass(frozen=True, slots=True)
class Unfit:
    """What the check before the flight found."""

    found: Refusal


@dataclass(frozen=True, slots=True)
class StartsIn:
    """The count-down of a start command."""

    seconds: int


@dataclass(frozen=True, slots=True)
class LatePictures:
    """Pictures are looked at later than they may be."""

    limit_s: float


@dataclass(frozen=True, slots=True)
class AwaitsBattery:
    """On the pad with stops left, for a battery that is full enough."""

    stops_left: int
    charge_frac: float
    full_frac: float


@dataclass(frozen=True, slots=True)
class ChargeLow:
    """Below the charge at which it flies home, whatever the way."""

    charge_frac: float


@dataclass(frozen=True, slots=True)
class ChargeShort:
    """The charge does not last for a visit to `node` (empty: none) and the way back to `pad`."""

    node: str
    pad: str
    charge_frac: float
    needed_frac: float
    reserve_frac: float


@dataclass(frozen=True, slots=True)
class NothingRead:
    """No picture of a shelf was read in the last `blind` of `scans`."""

    blind: int
    scans: int


_OfBattery: TypeAlias = StartChargeLow | ChargeUnknown | CellsLow | AwaitsBattery | ChargeLow | ChargeShort
Reason: TypeAlias = (
    Plain
    | Happened
    | VehicleRefuses
    | Paused
    | StartsIn
    | Unfit
    | _OfBattery
    | ClockUnsure
    | LatePictures
    | NothingRead
)


def in_words(reason: Reason) -> str:
    """What is reported to people, in status, events and logs."""
    match reason:
        case Plain():
            text = reason.value
        case Happened(trigger):
            text = trigger.value
        case VehicleRefuses(why, refusal):
            text = f"{in_words(why)}: {refusal}"
        case ClockUnsure(error_s, limit_s) if math.isnan(error_s):
            text = "the vehicle does not answer about its clock (TIMESYNC)"
        case ClockUnsure(error_s, limit_s):
            known = f"known to {error_s * 1e3:.0f} ms only"
            text = f"the vehicle's clock is {known}, {limit_s * 1e3:.0f} ms are needed"
        case Paused(why):
            text = f"{in_words(why)}; paused besides, until resume"
        case Unfit(found):
            text = f"not fit to fly: {found}"
        case StartsIn(seconds):
            text = f"arms in {seconds} s; pause takes the start back"
        case LatePictures(limit_s):
            text = f"pictures are more than {limit_s * 1e3:.0f} ms old when they have been looked at"
        case NothingRead(blind, scans):
            text = f"no picture of a shelf was read at the last {blind} of {scans} scans"
        case _:
            text = _of_battery(reason)
    return text


def _of_battery(reason: _OfBattery) -> str:
    match reason:
        case StartChargeLow(charge, needed):
            text = f"battery at {charge:.0%}, {needed:.0%} needed to start"
        case ChargeUnknown(ChargeDoubt.UNKNOWN):
            text = "no battery level from the vehicle"
        case ChargeUnknown(doubt):
            text = f"battery: {doubt.value}"
        case CellsLow(cell_v, needed_v):
            text = f"battery at {cell_v:.2f} V a cell, {needed_v:.2f} V needed"
        case AwaitsBattery(stops, charge, full):
            text = f"{stops} stops left: waiting for a battery at {full:.0%}, it is at {charge:.0%}"
        case ChargeLow(charge):
            text = f"battery low: {charge:.0%}"
        case ChargeShort(node, pad, charge, needed, reserve):
            what = f"a visit to {node} and the way back" if node else f"the way back to {pad}"
            text = f"battery at {charge:.0%}: {what} needs {needed:.0%} and {reserve:.0%} stay in reserve"
    return text
