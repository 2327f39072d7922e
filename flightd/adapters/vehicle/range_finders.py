"""Which of a vehicle's range finders is flown by: one, for two never measure from the same place."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

_HEARD_NS = 1_000_000_000
_BETTER_PC = 20
_UNKNOWN_PC = 50


@dataclass(frozen=True, slots=True)
class RangeSample:
    """One sample of a range finder that looks down, along the body's axis.  `sensor` tells it from others,
    `quality_pc` is that of the signal, None where it is not told."""

    sensor: Hashable
    distance_m: float
    least_m: float
    most_m: float
    quality_pc: int | None = None

    @property
    def measures(self) -> bool:
        """Within the sensor's own limits; outside them it saw nothing."""
        return self.least_m <= self.distance_m <= self.most_m

    @property
    def is_below(self) -> bool:
        """Nearer than it can measure, or nothing came back: the two look alike."""
        return self.distance_m < self.least_m


@dataclass(slots=True)
class _Heard:
    sample: RangeSample
    sample_ns: int
    measured_ns: int | None = None

    def worth(self, now_ns: int) -> tuple[bool, int]:
        """What measures is better than what does not, whatever its signal."""
        measures = self.measured_ns is not None and now_ns - self.measured_ns <= _HEARD_NS
        quality_pc = self.sample.quality_pc
        return measures, _UNKNOWN_PC if quality_pc is None else quality_pc


class RangeFinders:
    """Chooses among those that are heard, while the vehicle is not armed; then the choice stands.

    `wanted` is the one that is configured: no other is taken.  Without it the one that measures as the
    vehicle stands, of several that with the better signal, else the one heard first."""

    def __init__(self, wanted: Hashable | None = None) -> None:
        self._wanted = wanted
        self._heard: dict[Hashable, _Heard] = {}
        self.chosen: Hashable | None = wanted

    def take(self, sample: RangeSample, now_ns: int, *, armed: bool) -> bool:
        """Whether the vehicle is flown by the sensor of this sample."""
        if self._wanted is not None:
            return sample.sensor == self._wanted
        heard = self._heard.setdefault(sample.sensor, _Heard(sample, now_ns))
        heard.sample, heard.sample_ns = sample, now_ns
        if sample.measures:
            heard.measured_ns = now_ns
        if self.chosen is None or not armed:
            self._choose(now_ns)
        return sample.sensor == self.chosen

    def _choose(self, now_ns: int) -> None:
        self._heard = {
            sensor: heard for sensor, heard in self._heard.items() if now_ns - heard.sample_ns <= _HEARD_NS
        }
        now = self._heard.get(self.chosen) if self.chosen is not None else None
        best_worth = (False, -1) if now is None else now.worth(now_ns)
        for sensor, heard in self._heard.items():
            measures, quality_pc = worth = heard.worth(now_ns)
            much = now is None or measures is not best_worth[0] or quality_pc > best_worth[1] + _BETTER_PC
            if worth > best_worth and much:
                self.chosen, now, best_worth = sensor, heard, worth
