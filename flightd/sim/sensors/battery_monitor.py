"""What an autopilot tells of its battery: volts and current as measured, and a charge counted by them."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.sim.plant.airframe import Airframe

_CHANGED_FRAC = 1e-9


@dataclass(frozen=True, slots=True)
class MonitorParams:
    """`capacity_ah` is what is configured of the battery; current and voltage are measured as these shares of
    the true ones."""

    capacity_ah: float = 5.0
    current_share: float = 1.0
    volt_share: float = 1.0


class BatteryMonitor:
    """Call `update` after each step of the airframe.

    The charge is that at power-on less what has been drawn since, of the capacity that is configured: a
    battery that holds less is empty before it is told to be.  What is done to the battery otherwise (another
    one, a charger's current) is told to the autopilot, and what is full is full."""

    def __init__(self, params: MonitorParams) -> None:
        self._params = params
        self._charge_frac = 1.0
        self._held_frac: float | None = None
        self.used_ah = 0.0
        self.volts = self.amperes = 0.0

    @property
    def charge_frac(self) -> float:
        """Of a full battery, 0 to 1."""
        return min(max(self._charge_frac, 0.0), 1.0)

    def update(self, dt_s: float, airframe: Airframe) -> None:
        """Measure for `dt_s`."""
        p, now_frac = self._params, airframe.battery_frac
        self.amperes, self.volts = p.current_share * airframe.current_a, p.volt_share * airframe.battery_v
        if self._held_frac is None:  # it is switched on
            self._charge_frac = self._held_frac = now_frac
            return
        used_ah = self.amperes * dt_s / 3600.0
        drained_frac = airframe.current_a * dt_s / (airframe.params.battery_capacity_ah * 3600.0)
        changed_frac = now_frac - max(self._held_frac - drained_frac, 0.0)
        self._held_frac = now_frac
        self.used_ah += used_ah
        self._charge_frac -= used_ah / p.capacity_ah
        if abs(changed_frac) > _CHANGED_FRAC:
            is_full = now_frac + drained_frac > 1.0 - _CHANGED_FRAC
            self._charge_frac = 1.0 if is_full else self.charge_frac + changed_frac
