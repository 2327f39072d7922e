"""How long drones fly, and how long it takes until they can again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Endurance:
    """`flight_s` in the air from full to empty, `charge_s` on a pad from empty to full; nobody flies below
    the share `reserve`."""

    flight_s: float = 1500.0
    charge_s: float = 1800.0
    reserve: float = 0.15
    starts_at: float = 0.9

    def left_ms(self, charge: float) -> int:
        """In the air, down to the reserve."""
        return int((charge - self.reserve) * self.flight_s * 1000)
