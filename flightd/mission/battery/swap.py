"""Back to a charge pad in time, and on from there with a fresh battery.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.core.types import Phase
from flightd.mission.battery.sorties import Sorties
from flightd.mission.guidance import MissionInputs
from flightd.mission.machine import State
from flightd.mission.plan.flight_plan import HeadingPolicy
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.plan.leg_times import Legs, Pace
from flightd.mission.reasons import CellsLow, ChargeLow, ChargeShort, Reason
from flightd.mission.safety.hazard_monitor import HazardMonitor
from flightd.mission.scan.no_scan import AnyScanner
from flightd.mission.triggers import Trigger
from flightd.site.site import Site
from flightd.site.ways import NoWayError
from flightd.tracking.battery_charge import ChargeDoubt

_ON_LEG = frozenset({Phase.FOLLOW, Phase.HOLD})


class BatterySwap:
    """The battery of a mission in flight: turns the itinerary back when it must be."""

    def __init__(
        self,
        site: Site,
        policy: HeadingPolicy,
        config: Config,
        scanner: AnyScanner,
        itinerary: Itinerary,
        monitor: HazardMonitor,
    ) -> None:
        self._sorties = Sorties(site, Legs(site, policy, Pace.of(config.mission)), config.battery, scanner)
        self._swap = config.battery.swap
        self._cell_home_v = config.battery.cell_home_v
        self._frozen_frac, self._land_frac = config.battery.frozen, config.mission.battery_land
        self._route = itinerary
        self._monitor = monitor
        self._short = False
        self._scanner = scanner
        self._done_before = 0
        self.presses = False
        """The charge allows no waiting any more on the way back: no hold for what was lost."""

    @property
    def _goes_on(self) -> bool:
        """On the way to a pad on which a battery is waited for, with stops left for it."""
        return self._short and bool(self._route.left_over)

    @property
    def swaps(self) -> bool:
        """Goes on from this pad, something having been done on the last battery: one that does nothing is
        the last."""
        return self._goes_on and self._done > self._done_before

    @property
    def _done(self) -> int:
        """Grows with each visit to a node and each look at a place, also with those that are taken back."""
        return self._route.visits + self._scanner.looks

    @property
    def endurance_s(self) -> tuple[float, float]:
        """Seconds in the air that the charge above the reserve gives, and those of the way from the goal down
        onto a charge pad; NaN where that is not known."""
        return self._sorties.left_s, self._sorties.home_s(self._route.goal.node)

    @property
    def charge(self) -> tuple[float, float]:
        """The charge, 0..1 (full where it is not known), and the share of a full battery used per second in
        the air."""
        return self._sorties.charge_frac, self._sorties.rate_per_s

    def step(self, s: MissionInputs, state: State) -> Trigger | None:
        """Turn back in time: below the fixed share, or when what is left only just brings it back.  How it
        turned back with this tick, None if it did not."""
        charge = s.charge.frac
        self._sorties.step(s.now_ns, charge, state.airborne)
        if not state.airborne or state.phase is Phase.LAND:
            return None
        is_low = self._monitor.battery_low(s)
        if is_low or s.charge.doubt is not None:
            self.presses = True
        if state.returning:
            self.presses = self.presses or self._short_of_way(s, state)
            return None
        if is_low:
            self._route.shorten(s.pose)
            low = CellsLow(s.charge.cell_v, self._cell_home_v) if s.charge.low else ChargeLow(charge)
            return self._go_charge(s.now_ns, low, in_need=True)
        if reason := self._must_return(s, state):
            self.presses = True
            return self._go_charge(s.now_ns, reason, in_need=False)
        return None

    def is_spent(self, s: MissionInputs) -> bool:
        """The charge is not known, and what it was has been flown: nobody may wait for it to be told."""
        if s.charge.doubt is None:
            return False
        # one that stood still was believed until so much should have gone
        behind = self._frozen_frac if s.charge.doubt is ChargeDoubt.FROZEN else 0.0
        return self._sorties.sure_frac(s.now_ns) - behind < self._land_frac

    def _must_return(self, s: MissionInputs, state: State) -> ChargeShort | None:
        """Why it must turn back now by what is left of the leg, or of the one that a hold interrupted."""
        goal = self._route.goal
        left_m = s.distance_m((goal.x_m, goal.y_m)) if state.phase in _ON_LEG else 0.0
        if math.isinf(left_m):  # no pose
            left_m = 0.0
        speed_mps = min(goal.speed_mps, self._scanner.passing_mps)
        return self._sorties.must_return(goal.node, left_m, speed_mps)

    def _short_of_way(self, s: MissionInputs, state: State) -> bool:
        try:
            return self._must_return(s, state) is not None
        except NoWayError:  # what leads nowhere ends by itself
            return False

    def look_ahead(self, now_ns: int) -> Trigger | None:
        """Turn back here rather than half-way to a stop that the battery does not reach.  How it turned
        back, None if it did not."""
        route = self._route
        end = route.next_end
        if end is None:
            return None
        why = self._sorties.must_not_go_on(route.goal.node, end.node, end.speed_mps, stops=end.visit)
        if why is None:
            return None
        route.leave(route.onward)
        return self._go_charge(now_ns, why, in_need=False)

    def await_battery(self, now_ns: int) -> None:
        """Stand on the pad with the rest of the plan ahead."""
        self.begin_anew()
        self._route.resume_from_pad(now_ns)

    def begin_anew(self) -> None:
        """Stand on a pad; whatever the last battery was short of is over."""
        self._done_before = self._done
        self._short = self.presses = False

    def _go_charge(self, now_ns: int, reason: Reason, *, in_need: bool) -> Trigger:
        """Fly to the charge pad that is reached soonest; with batteries swapped the rest is flown later."""
        pad = self._sorties.way_back(self._route.goal.node).pad
        self._route.turn_home(now_ns, reason, in_need=in_need, pad=pad)
        self._short = self._swap
        return Trigger.BACK_TO_SWAP if self._goes_on else Trigger.BACK_TO_END
