"""Made-up flights for the judge, between the first nodes of the demo site."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from flightd.config.mission import Heading
from flightd.core.types import AttitudeSetpoint, Event, Phase, Status
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.sim.judge.flight_evidence import FlightEvidence
from flightd.sim.plant.kinematics import ArmedChange, Kinematics
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[2] / "configs" / "site-demo.toml")
PLAN = make_plan(SITE, ["A2"], "A1", "A1", HeadingPolicy(Heading.ALONG))
MS = 1_000_000
S = 1_000_000_000


def at(
    stamp_ns: int, x_m: float = 1.5, y_m: float = 0.0, height_m: float = 1.6, climb: float = 0.0
) -> Kinematics:
    return Kinematics(stamp_ns, x_m, y_m, height_m, 0.0, 0.0, climb, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def status(
    stamp_ns: int, phase: Phase = Phase.FOLLOW, node: str = "A2", goal: str = "A2", height_m: float = 1.6
) -> Status:
    return Status(stamp_ns, phase, "", node, goal, 0, 1, 1.0, 1.6, 1, 0, 30.0, {}, height_m)


def evidence(
    truth: Iterable[Kinematics],
    statuses: Sequence[Status],
    events: Sequence[Event] = (),
    armed: Sequence[ArmedChange] | None = None,
    setpoints: Sequence[AttitudeSetpoint] | None = None,
) -> FlightEvidence:
    return FlightEvidence(SITE, PLAN, statuses, events, list(truth), setpoints, armed)


def landed(*flown: Kinematics) -> list[Kinematics]:
    """What was flown, from the pad and back to it."""
    last = flown[-1].stamp_ns
    return [at(0, 0.0, height_m=0.1), *flown, at(last + S, 0.0, height_m=0.1)]
