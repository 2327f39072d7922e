"""A plan flown on several batteries: when to turn back, to which pad, and what is left to do then."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.config.battery import BatteryConfig
from flightd.config.schema import Config
from flightd.core.count_choice import CountChoice
from flightd.core.errors import InputError
from flightd.mission.battery.consumption import BatteryGauge
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy
from flightd.mission.plan.leg_times import Legs, Pace
from flightd.mission.reasons import ChargeShort
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.site.site import Site
from flightd.site.ways import NoWayError


def check_battery(
    site: Site,
    plan: FlightPlan,
    policy: HeadingPolicy,
    config: Config,
    scanner: AnyScanner = NO_SCAN,
) -> None:
    """InputError when a full battery does not reach one of the stops, last for what is done there, and come
    back with its reserve."""
    sorties = Sorties(site, Legs(site, policy, Pace.of(config.mission)), config.battery, scanner)
    far = sorties.out_of_reach([stop.node for stop in plan.stops if stop.visit])
    if far:
        raise InputError(
            f"site {site.name}: a full battery (battery.flight_s = {config.battery.hover_s:g}) does not"
            f" reach {far[0]}, last for the stop there and come back with its reserve; add a charge pad, or"
            " leave the node out"
        )


@dataclass(frozen=True, slots=True)
class WayBack:
    """The charge pad that is reached soonest, and the seconds to stand on it."""

    pad: str
    seconds: float


class Sorties:
    """The battery against the ways of one site.  `step` at each tick; the rest answers questions.

    With a `scanner` a stop lasts as long as what it has left to count there; with a `choice` as long as
    what it takes, whether or not it is counted already, in passing or only `by_stopping`."""

    def __init__(
        self,
        site: Site,
        legs: Legs,
        battery: BatteryConfig,
        scanner: AnyScanner = NO_SCAN,
        choice: CountChoice | None = None,
        *,
        by_stopping: bool = False,
    ) -> None:
        self._choice = choice
        self._by_stopping = by_stopping
        self._site = site
        self._legs = legs
        self._scanner = scanner
        self._battery = battery
        self._gauge = BatteryGauge(battery.hover_s)
        self._ways: dict[str, WayBack] = {}
        self._charge_frac = 1.0

    def step(self, now_ns: int, charge_frac: float, flying: bool) -> None:
        self._charge_frac = charge_frac
        self._gauge.step(now_ns, charge_frac, flying)

    @property
    def take_off_s(self) -> float:
        """Seconds from the pad up to the flying height."""
        return self._legs.pace.take_off_s

    @property
    def land_s(self) -> float:
        """Seconds from the flying height down onto a pad."""
        return self._legs.pace.land_s

    @property
    def rate_per_s(self) -> float:
        """Share of the full battery used per second in flight."""
        return self._gauge.rate_per_s

    def sure_frac(self, now_ns: int) -> float:
        """The charge that is surely left where it is not known any more; NaN where it never was."""
        return self._gauge.sure_frac(now_ns)

    @property
    def charge_frac(self) -> float:
        """The newest charge, 0..1; 1 where none is known."""
        return 1.0 if math.isnan(self._charge_frac) else self._charge_frac

    @property
    def left_s(self) -> float:
        """Seconds in the air until only the reserve is left; NaN without a charge."""
        if math.isnan(self._charge_frac):
            return math.nan
        return max(self._charge_frac - self._battery.reserve, 0.0) / self.rate_per_s

    def home_s(self, node: str) -> float:
        """Seconds from `node` down onto the nearest charge pad; NaN where no open way leads there."""
        try:
            return self.way_back(node).seconds
        except NoWayError:
            return math.nan

    def way_back(self, node: str) -> WayBack:
        """The quickest legal way from `node` to a charge pad and down onto it; where closed lines leave
        none, the one against one-way lines.  NoWayError."""
        if node not in self._ways:
            found = self._ways_back(node, in_need=False) or self._ways_back(node, in_need=True)
            if not found:
                raise NoWayError(f"site {self._site.name}: no open way from {node} to a charge pad")
            self._ways[node] = min(found, key=lambda way: way.seconds)
        return self._ways[node]

    def must_return(self, goal: str, left_m: float, speed_mps: float = math.inf) -> ChargeShort | None:
        """Why the drone must turn back now, None if it need not: the charge only just suffices for the rest
        of the leg to `goal`, `left_m`, flown no faster than `speed_mps`, the way back from there, and the
        reserve."""
        back = self.way_back(goal)
        rest_s = self._legs.pace.leg_s(left_m, speed_mps) if left_m > 0.0 else 0.0
        return self._short(rest_s + back.seconds, "", back.pad)

    def must_not_go_on(
        self, here: str, there: str, speed_mps: float = math.inf, *, stops: bool = True
    ) -> ChargeShort | None:
        """Why the drone should not fly on from `here`, no faster than `speed_mps`, to visit `there` (only to
        be there, if it never `stops` for a count), None if it may."""
        pace = self._legs.pace
        try:
            on_s = self._legs.way_s(here, there)
            if speed_mps < pace.speed_mps:
                length_m = self._site.length_m((here, there))
                on_s += pace.leg_s(length_m, speed_mps) - pace.leg_s(length_m)
        except NoWayError:  # the way was left by an order: the return is watched anyway
            return None
        needed_s = self._out_s(on_s, there) if stops else on_s + self.way_back(there).seconds
        return self._short(needed_s, there, self.way_back(there).pad)

    def out_of_reach(self, nodes: Sequence[str]) -> tuple[str, ...]:
        """The nodes that cannot be visited from any charge pad on one full battery."""
        pads = [pad.node for pad in self._site.own_charge_pads]
        return tuple(
            node
            for node in dict.fromkeys(nodes)
            if min(self._fresh_frac(pad, node) for pad in pads) > 1.0 - self._battery.reserve
        )

    def on_s(self, here: str, there: str) -> float:
        """Seconds of the legal way between two nodes.  NoWayError."""
        return self._legs.way_s(here, there)

    def stop_s(self, node: str) -> float:
        """Seconds of the stop at a node."""
        pace = self._legs.pace
        counted_s = self._scanner.stop_s(node, pace, self._choice, by_stopping=self._by_stopping)
        return counted_s or pace.dwell_s

    def _out_s(self, on_s: float, there: str) -> float:
        return on_s + self.stop_s(there) + self.way_back(there).seconds

    def _fresh_frac(self, pad: str, node: str) -> float:
        on_s = self._legs.way_s(pad, node)
        return (self._legs.pace.take_off_s + self._out_s(on_s, node)) * self.rate_per_s

    def _short(self, seconds: float, node: str, pad: str) -> ChargeShort | None:
        needed, reserve = seconds * self.rate_per_s, self._battery.reserve
        if not self._charge_frac < needed + reserve:  # NaN: no charge reported, nothing known
            return None
        return ChargeShort(node, pad, self._charge_frac, needed, reserve)

    def _ways_back(self, node: str, *, in_need: bool) -> list[WayBack]:
        found = []
        for pad in self._site.own_charge_pads:
            try:
                seconds = self._legs.way_s(node, pad.node, against_one_way=in_need)
            except NoWayError:
                continue
            found.append(WayBack(pad.node, seconds + self._legs.pace.land_s))
        return found
