"""A computer whose date lies before what its inventory has: said before a flight, and in the air."""

from __future__ import annotations

import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.computer_check import ComputerCheck
from flightd.app.counting.count import Counting
from flightd.app.counting.flight_count import FlightCount
from flightd.app.counting.store_writer import StoreWriter
from flightd.app.startup_faults import StartupFaults
from flightd.config.schema import load_config
from flightd.core.inventory import LocationState, Observation, PlannedLocation
from flightd.core.refusal import words
from flightd.core.tick import TickOutput
from flightd.core.types import Demand, Phase
from flightd.doctor.computer import check_computer, check_fitness
from flightd.runtime.clock import LoopClock
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real
from tests.unit.ground.test_front_pictures import Here
from tests.unit.mission.shelves import FITTED

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(front_camera=FITTED)
SITE = load_site(CONFIGS / "site-racks-small.toml")
PLACE = min(SITE.locations)
DAY_NS = 86_400 * 10**9


@pytest.mark.parametrize("ahead_ns", [2 * DAY_NS, DAY_NS // 24, -DAY_NS])
@pytest.mark.parametrize("in_air", [True, False])
def test_a_date_before_the_newest_look_speaks_against_a_flight(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, ahead_ns: int, in_air: bool
) -> None:
    newest_ns = time.time_ns() + ahead_ns
    with SqliteStore(tmp_path) as store:
        store.plan([PlannedLocation(PLACE, SITE.locations[PLACE].node)])
        store.commit(Observation("before", PLACE, newest_ns, LocationState.EMPTY, 0.9))
    with ExitStack() as stack:
        faults = StartupFaults(in_air=in_air)
        count = FlightCount(CONFIG, SITE, tmp_path, stack, run="now", faults=faults)
    assert (count.newest_ns, faults.first) == (newest_ns, None)
    behind = ahead_ns > 0
    assert ("set the clock" in caplog.text) is (behind and in_air)
    unfit = words(ComputerCheck(partial(check_fitness, CONFIG, SITE, count.newest_ns)).unfit)
    assert ("set the clock" in unfit) is (ahead_ns > DAY_NS), "what lost an hour is dated after that look"
    shown = [check.name for check in check_computer(CONFIG, SITE, count.newest_ns)]
    assert ("inventory clock" in shown) is behind


class Dated(StoreWriter):
    """Counts how often the date was looked at."""

    flights = 0

    def take_off(self) -> None:
        self.flights += 1
        super().take_off()


def test_the_date_is_looked_at_once_for_each_take_off(tmp_path: Path) -> None:
    phases = (Phase.PREFLIGHT, Phase.TAKE_OFF, Phase.TAKE_OFF, Phase.FOLLOW, Phase.SWAP, Phase.TAKE_OFF)

    async def fly(store: SqliteStore) -> int:
        with Dated(store, "now", 0, LoopClock(), pytest.fail) as writer:
            counting = Counting(Here(), workers=1, writer=writer)
            for phase in phases:
                counting.keep(TickOutput(None, Demand.STANDBY, phase, "", "", 0, 0, None, None))
            return writer.flights

    with SqliteStore(tmp_path) as store:
        assert real(fly(store)) == 2
