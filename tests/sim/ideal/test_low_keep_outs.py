"""A conveyor stands below the leg: it is flown over, but nothing that sees where it is comes down on it."""

from __future__ import annotations

from pathlib import Path

from flightd.config.schema import load_config
from flightd.core.types import Command, CommandKind, Phase
from flightd.sim.judge.clearance import clearances
from flightd.sim.judge.motion import TrueMotion
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site_file import parse_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml").with_values(mission=BRISK)
SITE = parse_site(
    """
[site]
name = "crossed"
ceiling_m = 4.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [2.0, 2.0, 2.0, 2.0]

[[pad]]
id = "home"
node = "A1"

[[keep_out]]
x0_m = 3.4
y0_m = -2.0
x1_m = 4.6
y1_m = 2.0
to_m = 1.0
""",
    "crossed",
)
(CONVEYOR,) = SITE.keep_outs


def over(truth: Kinematics) -> bool:
    """The whole body is above it."""
    return CONVEYOR.x0_m + 0.3 < truth.x_m < CONVEYOR.x1_m - 0.3


class Crossing(IdealFlight):
    """Something begins when it first is over the conveyor, and lasts."""

    def __init__(self, lasts_s: float, **trouble: bool) -> None:
        super().__init__(SITE, CONFIG, visits=("A5",), seed=3)
        self._trouble, self._lasts_ns, self._since_ns = trouble, round(lasts_s * 1e9), 0
        self.on_tick = self._look

    def _look(self, phase: Phase, now_ns: int) -> None:
        if not self._since_ns and phase is Phase.FOLLOW and over(self.airframe.kinematics(now_ns)):
            self._since_ns = now_ns
            if self._trouble.get("landed"):
                self.commands.append(Command("1", CommandKind.LAND))
        begun = 0 < self._since_ns <= now_ns < self._since_ns + self._lasts_ns
        self.faults.frozen = begun and self._trouble.get("frozen", False)


def free_m(flown: Flown) -> float:
    motion = TrueMotion.of([truth for _, truth in flown.truth])
    return next(each.least_m for each in clearances(SITE, motion) if each.obstacle == "keep_out")


def test_it_is_flown_over_as_before() -> None:
    flown = Crossing(0.0).fly(200)
    assert flown.phase is Phase.DONE
    assert flown.visited == ["A5"]
    assert free_m(flown) > 0.3


def test_a_camera_that_freezes_above_it_does_not_make_it_sink_into_it() -> None:
    flown = Crossing(1.2, frozen=True).fly(200)
    assert Phase.HOLD in {phase for phase, _ in flown.truth}
    assert free_m(flown) > 0.1
    assert flown.phase is Phase.DONE, "on once it sees again"


def test_who_has_to_land_above_it_comes_down_beside_it() -> None:
    flown = Crossing(0.0, landed=True).fly(200)
    assert flown.phase is Phase.ABORTED
    assert flown.truth[-1][1].height_m < 0.2
    assert not CONVEYOR.x0_m - 0.3 < flown.truth[-1][1].x_m < CONVEYOR.x1_m + 0.3
    assert free_m(flown) > 0.1


def test_who_sees_nothing_any_more_reaches_it_slowly() -> None:
    """To stay up there would be to fly on stale data: it comes down on it, the last resort."""
    flown = Crossing(1e3, frozen=True).fly(200)
    assert flown.phase is Phase.ABORTED
    reached = [k for phase, k in flown.truth if phase is Phase.LAND and over(k) and k.height_m < 1.05]
    assert reached
    assert reached[0].climb_mps > -0.5
