"""A mission that is fed by hand: by default all is well and the drone is wherever it is led."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from flightd.config.mission import Heading
from flightd.config.schema import Config
from flightd.core.types import (
    Attitude,
    Command,
    CommandKind,
    Demand,
    GridPose,
    LandedState,
    Phase,
    VehicleState,
)
from flightd.mission.guidance import Guidance, Guide, MissionInputs
from flightd.mission.mission import Mission
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.sim.random_sites import random_site
from flightd.site.site import Site
from tests.unit.mission.configured import configured

SITE = random_site(3)
POLICY = HeadingPolicy(Heading.ALONG)
TICK_NS = 20_000_000
UNHEARD_S = 3.0
"""An adapter says so of a vehicle whose heartbeat is older."""


def at_rest(_seconds: float) -> tuple[float, float]:
    """Right where it is led."""
    return 0.0, 0.0


class Flight:
    """Feeds a mission with inputs: by default all is well and the drone is wherever the mission wants."""

    def __init__(
        self,
        params: Config | None = None,
        site: Site = SITE,
        scanner: AnyScanner = NO_SCAN,
        policy: HeadingPolicy = POLICY,
    ) -> None:
        home = site.home.node
        plan = make_plan(site, site.serpentine_route(), home, home, policy)
        self.mission = Mission(site, plan, policy, params or configured(dwell_s=1.0), scanner)
        self.site = site
        self.integrity = 1.0
        self.heartbeat_s = 0.0
        self.off_m: Callable[[float], tuple[float, float]] = at_rest
        """How far from where it is led it is along the aisles, and above, at a time in s."""
        self.now_ns = 10**12
        self.guidance: Guidance | None = None
        state = VehicleState(
            Attitude(0, 0, 0, 0),
            0.1,
            0,
            0.0,
            "GUIDED_NOGPS",
            True,
            False,
            LandedState.ON_GROUND,
            0.9,
            12.0,
            0,
        )
        self.inputs = MissionInputs(0, 0.02, None, True, 0.1, True, 0.0, 0.0, 0.0, state)

    @property
    def phase(self) -> Phase:
        return self.mission.phase

    @property
    def demand(self) -> Demand:
        """What was asked of the vehicle last."""
        assert self.guidance is not None
        return self.guidance.demand

    def set(self, **changes: object) -> None:
        vehicle = {k: v for k, v in changes.items() if k in VehicleState.__slots__ and k != "height_m"}
        other = {k: v for k, v in changes.items() if k not in vehicle}
        assert self.inputs.vehicle is not None
        state = replace(self.inputs.vehicle, **vehicle)  # type: ignore[arg-type]
        self.inputs = replace(self.inputs, vehicle=state, **other)  # type: ignore[arg-type]

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False, follow: bool = True) -> None:
        for _ in range(round(seconds / 0.02)):
            self.now_ns += TICK_NS
            g, moved = self.guidance, dict[str, Any]()
            if follow and g is not None and g.guide is not Guide.NONE:
                along_m, above_m = self.off_m(self.now_ns * 1e-9)
                along_mps = (along_m - self.off_m((self.now_ns - TICK_NS) * 1e-9)[0]) / 0.02
                height = 0.1 + (0.0 if math.isnan(g.reference.height_m) else g.reference.height_m) + above_m
                if not math.isnan(self.inputs.height_m):
                    moved["height_m"] = height
                r = g.reference
                node = self.site.nearest(r.x_m, r.y_m)
                moved["pose"] = GridPose(
                    self.now_ns,
                    node.id,
                    0,
                    0,
                    r.yaw_rad,
                    r.x_m + along_m,
                    r.y_m,
                    r.vx_mps + along_mps,
                    r.vy_mps,
                    height,
                    (0.0,) * 9,
                    self.integrity,
                )
            vehicle = self.inputs.vehicle
            assert vehicle is not None
            armed = vehicle.armed or (follow and g is not None and g.demand is Demand.FLY)
            heard_s = self.inputs.telemetry_age_s + self.heartbeat_s
            beat_ns = self.now_ns - round(heard_s * 1e9)
            # once a tick: copying them costs as much as a third of the mission's step
            unheard = heard_s > UNHEARD_S
            vehicle = replace(vehicle, armed=armed, heartbeat_ns=beat_ns, unheard=unheard)
            self.inputs = replace(self.inputs, now_ns=self.now_ns, vehicle=vehicle, **moved)
            self.guidance = self.mission.step(self.inputs)
            if until():
                return

    def to(self, phase: Phase, within_s: float = 60.0) -> None:
        self.run(within_s, lambda: self.phase is phase)
        assert self.phase is phase, self.mission.reason

    def land(self) -> Phase:
        """It comes down and stands disarmed; what became of it."""
        self.to(Phase.LAND, 120.0)
        self.set(landed=LandedState.ON_GROUND, armed=False, height_m=0.1)
        self.run(0.02, follow=False)
        return self.phase

    def order(
        self,
        kind: CommandKind,
        node: str = "",
        nodes: tuple[str, ...] = (),
        *,
        waits: bool = False,
        lands: bool = False,
    ) -> None:
        self.mission.command(Command("1", kind, node, nodes, waits=waits, lands=lands), self.now_ns)
