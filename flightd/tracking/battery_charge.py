"""What a battery is believed to hold, by all that is told of it: charge, volts, current, and their age.

A charge is mostly counted by the autopilot, from a full battery that it takes for granted; the volts of a
cell under load do not lie.  What is not known is not full.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from flightd.config.battery import BatteryConfig
from flightd.core.types import VehicleState

_UNKNOWN_S = 3.0
"""A charge that is missing now and then in what is told is still known."""
_LOW_S = 2.0
"""A cell may sag below its threshold for so long."""
_BAND_FRAC, _BAND_SHARE = 0.015, 0.15
"""A charge that stays within so much, and within so much of what should have gone, stands still: a gauge in
whole percents may flicker between two."""
_FROZEN_LEAST_S = 30.0
_RISE_FRAC = 0.05
"""A gauge may rise again by so much when the load falls; in flight nothing charges a battery."""
_CELL_V = (2.4, 4.4)
"""Between these a cell can be, the fullest of all kinds at 4.35 V; outside them the number of cells is wrong,
or the volts are."""
_LOAD_A = 4.0


class ChargeDoubt(enum.Enum):
    """Why a battery's charge is not known."""

    SILENT = "nothing is told of the battery any more"
    UNKNOWN = "the vehicle does not know its charge"
    FROZEN = "its charge stands still in flight"
    CELLS = "its volts do not fit its cells"
    VOLTS = "its volts are told no longer"


@dataclass(frozen=True, slots=True)
class Charge:
    """What is believed: `frac` of full, NaN with the reason in `doubt` where none is, and the mean volts of a
    cell, NaN where volts or cells are not told.  `low` and `empty` say that the cells are,
    whatever the charge; `loaded` that the volts are those under load."""

    frac: float
    cell_v: float = math.nan
    doubt: ChargeDoubt | None = None
    low: bool = False
    empty: bool = False
    loaded: bool = False


class BatteryCharge:
    """Call `step` at each tick with what was told, and whether the vehicle flies."""

    def __init__(self, config: BatteryConfig) -> None:
        self._config = config
        self._known_ns: int | None = None
        self._told_frac = math.nan
        self._least_frac = math.inf
        self._band: tuple[int, float, float] | None = None
        """Since when all charges have been within what limits."""
        self._volts_ns: int | None = None
        self._low_ns: int | None = None
        self._empty_ns: int | None = None

    def step(self, now_ns: int, vehicle: VehicleState | None, *, flying: bool) -> Charge:
        if vehicle is None:
            return Charge(math.nan, doubt=ChargeDoubt.UNKNOWN)
        if not flying:
            self._least_frac, self._band, self._volts_ns = math.inf, None, None
        cell_v = self._cell_v(vehicle)
        self._volts_ns = now_ns if math.isfinite(cell_v) else self._volts_ns
        frac = self._frac(now_ns, vehicle.battery_frac)
        doubt = self._doubt(now_ns, vehicle, frac, cell_v, flying)
        sane = math.isfinite(cell_v) and doubt not in {ChargeDoubt.CELLS, ChargeDoubt.SILENT}
        low = sane and flying and cell_v < self._config.cell_home_v
        empty = sane and flying and cell_v < self._config.cell_land_v
        self._low_ns = (self._low_ns or now_ns) if low else None
        self._empty_ns = (self._empty_ns or now_ns) if empty else None
        if flying and math.isfinite(frac):
            self._least_frac = min(self._least_frac, frac)
            frac = min(frac, self._least_frac + _RISE_FRAC)
        return Charge(
            math.nan if doubt is not None else frac,
            cell_v,
            doubt,
            _lasts(self._low_ns, now_ns, _LOW_S),
            _lasts(self._empty_ns, now_ns, _LOW_S),
            flying or vehicle.battery_a > _LOAD_A,
        )

    def _cell_v(self, vehicle: VehicleState) -> float:
        cells = self._config.cells or vehicle.battery_cells
        return vehicle.battery_v / cells if cells else math.nan

    def _frac(self, now_ns: int, told_frac: float) -> float:
        """The charge that is told, or the last that was, for a moment."""
        if math.isfinite(told_frac):
            self._known_ns, self._told_frac = now_ns, told_frac
            return told_frac
        if self._known_ns is not None and now_ns - self._known_ns <= _UNKNOWN_S * 1e9:
            return self._told_frac
        return math.nan

    def _doubt(
        self, now_ns: int, vehicle: VehicleState, frac: float, cell_v: float, flying: bool
    ) -> ChargeDoubt | None:
        told_ns = vehicle.battery_stamp_ns
        if told_ns and now_ns - told_ns > self._config.silent_s * 1e9:
            return ChargeDoubt.SILENT
        if math.isnan(frac):
            return ChargeDoubt.UNKNOWN
        if math.isfinite(cell_v) and not _CELL_V[0] <= cell_v <= _CELL_V[1]:
            return ChargeDoubt.CELLS
        if self._volts_ns is not None and now_ns - self._volts_ns > _UNKNOWN_S * 1e9:
            return ChargeDoubt.VOLTS
        if flying and self._stands_still(now_ns, frac):
            return ChargeDoubt.FROZEN
        return None

    def _stands_still(self, now_ns: int, frac: float) -> bool:
        """Whether the charge has hardly moved while much of it should have gone."""
        frozen = self._config.frozen
        since_ns, low, high = self._band or (now_ns, frac, frac)
        low, high = min(low, frac), max(high, frac)
        if high - low >= min(_BAND_FRAC, _BAND_SHARE * frozen):
            since_ns, low, high = now_ns, frac, frac
        self._band = since_ns, low, high
        still_s = (now_ns - since_ns) * 1e-9
        return frozen < 1.0 and still_s > _FROZEN_LEAST_S and still_s / self._config.hover_s > frozen


def told_charge(vehicle: VehicleState | None) -> Charge:
    """The charge as the vehicle tells it, judged by nothing."""
    if vehicle is None or math.isnan(vehicle.battery_frac):
        return Charge(math.nan, doubt=ChargeDoubt.UNKNOWN)
    return Charge(vehicle.battery_frac)


def _lasts(since_ns: int | None, now_ns: int, seconds: float) -> bool:
    return since_ns is not None and now_ns - since_ns >= seconds * 1e9
