"""A flight that counts nothing: what a scanner answers when there is none."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeAlias

from flightd.core.count_choice import ALL, CountChoice
from flightd.core.planned_flight import PlannedSweep
from flightd.core.scanning import BodyPose, CodeSet, CountedPlace, Finding, Place, Settled
from flightd.core.types import Event
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.code_assignment import Sighting
from flightd.mission.scan.scanner import Scanner


class NoScan:
    """A `Scanner` for which there is never anything to scan; it keeps no state."""

    counts = False
    least_integrity = 0.0
    look_s = 0.0
    view = None
    exposure = 1.0, 1.0
    blind = None
    doubted = False
    looking = False
    looks = 0
    sweeps = False
    unproven = ()
    evidence: frozenset[str] = frozenset()

    def wants(self, _node: str) -> bool:
        return False

    def stop_s(
        self,
        _node: str,
        _pace: Pace,
        _choice: CountChoice | None = None,
        *,
        by_stopping: bool = False,  # noqa: ARG002 - named by who asks
    ) -> float:
        return 0.0

    def places_at(self, _node: str, _choice: CountChoice = ALL) -> frozenset[str]:
        return frozenset()

    def choose(self, choice: CountChoice, *, by_stopping: bool = False) -> None:
        """Nothing is counted anyway."""

    def choose_at(self, node: str, choice: CountChoice) -> None:
        """Nothing is counted anyway."""

    def count_anew(self) -> None:
        """Nothing is counted anyway."""

    def go_on_with(self, counted: Iterable[CountedPlace]) -> None:
        """Nothing is counted anyway."""

    def arrive(self, node: str, height_m: float, yaw_rad: float) -> None:
        """Nothing begins."""

    def begin(self, now_ns: int) -> None:
        """Nothing begins."""

    def miss(self, now_ns: int) -> None:
        """No view is flown to."""

    def step(self, _now_ns: int) -> bool:
        return True

    def leave(self) -> None:
        """Nothing is left."""

    def told_sweeps(
        self, _runs: Iterable[Sequence[str]], _choice: CountChoice = ALL
    ) -> tuple[PlannedSweep, ...]:
        return ()

    def legs(
        self, _run: Sequence[str], _here: str, _yaw_rad: float, _height_m: float
    ) -> tuple[SweepLeg, ...]:
        return ()

    def begin_sweep(self, legs: Sequence[SweepLeg]) -> None:
        """Nothing begins."""

    def begin_leg(self, now_ns: int) -> None:
        """Nothing begins."""

    def end_leg(self, leg: SweepLeg) -> None:
        """Nothing ends."""

    def pause_leg(self) -> None:
        """Nothing is interrupted."""

    def step_sweep(self, now_ns: int, leg: SweepLeg | None, flown_mps: float) -> None:
        """Nothing is decided."""

    @property
    def passing_mps(self) -> float:
        return math.inf

    def end_sweep(self, now_ns: int) -> None:
        """Nothing ends."""

    def reached(self, node: str, certain: bool) -> None:
        """Nothing is proven."""

    def home(self, certain: bool) -> None:
        """Nothing is proven."""

    def end(self, now_ns: int) -> None:
        """Nothing was to be counted."""

    def doubt(self) -> None:
        """Nothing is kept back."""

    def withdraw(self, now_ns: int, reason: str) -> None:
        """Nothing is taken back."""

    def trust(self, *, moved: bool = False) -> None:
        """Nothing was doubted."""

    def take_due(self) -> tuple[str, ...]:
        return ()

    def places(self, _pose: BodyPose) -> tuple[Place, ...]:
        return ()

    def take(self, codes: CodeSet, pose: BodyPose) -> None:
        """No picture is looked at."""

    def drain(self) -> tuple[tuple[Finding, ...], tuple[Settled, ...]]:
        return (), ()

    def drain_events(self) -> list[Event]:
        return []

    def drain_sightings(self) -> tuple[Sighting, ...]:
        return ()


AnyScanner: TypeAlias = Scanner | NoScan
NO_SCAN = NoScan()
