"""Every strategy flown: orders in the air, closed lines, batteries.  Ideal sight, virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from flightd.config.battery import BatteryConfig
from flightd.config.schema import Config, load_config
from flightd.core.tick import TickOutput
from flightd.core.types import Command, CommandKind, Phase
from flightd.sim.plant.airframe import AirframeParams
from flightd.sim.plant.charge_pads import ChargePads, PadService
from flightd.site.site_file import load_site, parse_site, site_toml
from tests.rigs.brisk import QUICK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=QUICK)
DEMO = load_site(CONFIGS / "site-demo.toml")
NEAR = ("A2", "A3")
ROW = ("A2", "A3", "A4", "A5")
THREE = ROW[:3]
"""More than what is left of a battery at `LOW` is enough for."""
LOW = 0.43
SWAPS = BatteryConfig(flight_s=120.0, swap=True, swap_wait_s=120.0)
SMALL = AirframeParams(battery_capacity_ah=0.4)
"""Hovers for some 100 s."""


def config(battery: BatteryConfig = CONFIG.battery, **mission: object) -> Config:
    return CONFIG.with_values(battery=battery, mission=mission)


def when(flight: IdealFlight, *script: tuple[Callable[[TickOutput], bool], CommandKind, str]) -> None:
    """Give each order when its condition first holds, one after the other."""
    waiting: Iterator[tuple[Callable[[TickOutput], bool], CommandKind, str]] = iter(script)
    step = flight.pilot.step
    current = [next(waiting, None)]

    def watch(tick):  # type: ignore[no-untyped-def]
        output = step(tick)
        if current[0] is not None and current[0][0](output):
            flight.commands.append(Command("1", current[0][1], current[0][2]))
            current[0] = next(waiting, None)
        return output

    flight.pilot.step = watch  # type: ignore[method-assign]


def following(goal: str) -> Callable[[TickOutput], bool]:
    return lambda output: output.phase is Phase.FOLLOW and output.goal == goal


def held(seconds: float) -> Callable[[TickOutput], bool]:
    ticks = [0]

    def condition(output: TickOutput) -> bool:
        ticks[0] += output.phase is Phase.HOLD
        return ticks[0] > seconds / 0.02

    return condition


def phases(flown: Flown) -> list[Phase]:
    """The phases in order, repetitions left out."""
    found: list[Phase] = []
    for output in flown.outputs:
        if not found or found[-1] is not output.phase:
            found.append(output.phase)
    return found


def told(flown: Flown, name: str) -> list[str]:
    return [event.text for event in flown.events if event.name == name]


def landed_at(flown: Flown, within_m: float = 0.15) -> str:
    last = flown.truth[-1][1]
    node = DEMO.nearest(last.x_m, last.y_m)
    assert last.height_m < 0.2
    assert abs(last.x_m - node.x_m) + abs(last.y_m - node.y_m) < within_m
    return node.id


def test_paused_it_holds_and_resumed_it_finishes() -> None:
    flight = IdealFlight(DEMO, config(), visits=NEAR)
    when(flight, (following("A3"), CommandKind.PAUSE, ""), (held(3.0), CommandKind.RESUME, ""))
    flown = flight.fly()
    assert (flown.phase, flown.visited) == (Phase.DONE, [*NEAR])
    still = [k for phase, k in flown.truth if phase is Phase.HOLD]
    assert 150 <= len(still) <= 200, "until it is resumed and no longer"
    assert max(abs(k.vx_mps) + abs(k.vy_mps) for k in still[100:]) < 0.15


def test_ordered_to_a_node_it_goes_there_and_then_home() -> None:
    flight = IdealFlight(DEMO, config(), visits=ROW)
    when(flight, (following("A2"), CommandKind.GOTO, "B1"))
    flown = flight.fly()
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2", "B1"])
    assert landed_at(flown) == "A1"


def test_ordered_home_it_lands_there_with_the_rest_unvisited() -> None:
    flight = IdealFlight(DEMO, config(), visits=ROW)
    when(flight, (following("A3"), CommandKind.HOME, ""))
    flown = flight.fly()
    assert (flown.phase, flown.visited, landed_at(flown)) == (Phase.ABORTED, ["A2"], "A1")
    assert flight.pilot.mission.remaining == ROW[1:]


@pytest.mark.parametrize(("order", "within_m"), [(CommandKind.LAND, 0.15), (CommandKind.STOP, 0.6)])
def test_ordered_down_it_lands_where_it_is(order: CommandKind, within_m: float) -> None:
    """A stop goes down level and unsteered: the wind carries it."""
    flight = IdealFlight(DEMO, config(), visits=ROW)
    when(flight, (lambda o: o.phase is Phase.HOVER and o.goal == "A2", order, ""))
    flown = flight.fly()
    assert (flown.phase, landed_at(flown, within_m)) == (Phase.ABORTED, "A2")


def test_a_closed_line_is_flown_round_and_what_it_cuts_off_is_refused() -> None:
    blocks = "".join(
        f'\n[[blocked]]\nnodes = ["{a}", "{b}"]\n' for a, b in (("A3", "A4"), ("B2", "B3"), ("B3", "B4"))
    )
    site = parse_site(site_toml(DEMO) + blocks, "closed.toml")
    flight = IdealFlight(site, config(), visits=NEAR)
    when(
        flight,
        (following("A2"), CommandKind.GOTO, "B3"),
        (following("A2"), CommandKind.GOTO, "B2"),
    )
    flown = flight.fly()
    assert any(
        "goto B3 refused: site demo: no open way from A2 to B3" in text for text in told(flown, "command")
    )
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2", "B2"])
    crossed = [k for _, k in flown.truth if k.y_m > 1.0 and k.y_m < 2.0 and k.height_m > 1.0]
    assert max(k.x_m for k in crossed) < 0.3, "by the cross at A1, not over the closed line"


def test_a_small_battery_flies_the_plan_in_sorties_with_its_reserve() -> None:
    flight = IdealFlight(
        DEMO,
        config(battery=SWAPS.with_values(flight_s=60.0), battery_home=0.02, battery_land=0.01),
        visits=ROW,
        airframe=AirframeParams(battery_capacity_ah=0.17),
        pads=PadService(swap_s=6.0),
    )
    lowest = [1.0]
    step = flight.pilot.step

    def watch(tick):  # type: ignore[no-untyped-def]
        lowest[0] = min(lowest[0], flight.airframe.battery_frac)
        return step(tick)

    flight.pilot.step = watch  # type: ignore[method-assign]
    flown = flight.fly(1500)
    assert (flown.phase, flown.reason) == (Phase.DONE, "landed on the pad")
    assert flown.visited == [*ROW], "each once, in order"
    sorties = phases(flown).count(Phase.TAKE_OFF)
    assert sorties >= 2
    assert phases(flown).count(Phase.SWAP) == sorties - 1
    assert all("in reserve" in text for text in told(flown, "home"))
    assert not told(flown, "position"), "where it is reckoned to be while it waits is not carried on"
    assert 0.7 * SWAPS.reserve < lowest[0] < 0.35, "neither stranded nor home with half a battery"


def test_with_nobody_to_change_the_battery_it_gives_up() -> None:
    flight = IdealFlight(
        DEMO, config(battery=SWAPS.with_values(swap_wait_s=10.0)), visits=ROW, airframe=SMALL
    )
    flight.airframe.battery_frac = 0.5
    flown = flight.fly(600)
    assert phases(flown)[-2:] == [Phase.SWAP, Phase.ABORTED]
    assert flown.outputs[-2].reason.startswith(f"{len(flight.pilot.mission.remaining)} stops left: waiting")


def test_contacts_fill_its_battery_as_far_as_it_needs_to_go_on() -> None:
    flight = IdealFlight(
        DEMO, config(battery=SWAPS), visits=THREE, airframe=SMALL, pads=PadService(contact_s=100.0)
    )
    flight.airframe.battery_frac = LOW
    begins: list[tuple[Phase, float]] = []

    def note(phase: Phase, _now_ns: int) -> None:
        if not begins or begins[-1][0] is not phase:
            begins.append((phase, flight.airframe.battery_frac))

    flight.on_tick = note
    flown = flight.fly(900)
    assert (flown.phase, flown.visited) == (Phase.DONE, [*THREE])
    came, left = next((down, up) for (phase, down), (_, up) in pairwise(begins) if phase is Phase.SWAP)
    assert came < 0.4
    assert SWAPS.full <= left < SWAPS.full + 0.03, "it does not wait for more"


def test_contacts_fill_the_battery_of_who_stands_on_them_alone() -> None:
    flight = IdealFlight(DEMO, config(), visits=("A2",))
    frame = flight.airframe
    pads = ChargePads(DEMO, frame, PadService(contact_s=100.0))
    frame.battery_frac = 0.5
    for t in range(11):
        pads.look(t * 10**9)
    assert frame.battery_frac == pytest.approx(0.6), "also where it has not flown"
    frame.y_m += 0.3
    pads.look(21 * 10**9)
    assert frame.battery_frac == pytest.approx(0.6), "beside the contacts"
    frame.y_m -= 0.3
    frame.on_floor = False
    pads.look(31 * 10**9)
    assert frame.battery_frac == pytest.approx(0.6), "in the air"
    frame.on_floor = True
    for t in range(32, 100):
        pads.look(t * 10**9)
    assert frame.battery_frac == 1.0


def test_after_a_swap_the_start_command_is_waited_for_unless_it_starts_by_itself() -> None:
    flight = IdealFlight(
        DEMO, config(battery=SWAPS, autostart=False), visits=THREE, airframe=SMALL, pads=PadService(5.0)
    )
    flight.airframe.battery_frac = LOW
    swapped = lambda o: o.phase is Phase.SWAP and o.reason == "waiting for the start command"  # noqa: E731
    ready = lambda o: o.reason == "waiting for the start command"  # noqa: E731
    when(flight, (ready, CommandKind.START, ""), (swapped, CommandKind.START, ""))
    flown = flight.fly(600)
    assert (flown.phase, flown.visited) == (Phase.DONE, [*THREE])
    assert phases(flown).count(Phase.TAKE_OFF) == 2


def test_without_swaps_it_ends_on_the_pad_and_the_plan_left_over_is_flown_by_the_next_start() -> None:
    first = IdealFlight(DEMO, config(battery=SWAPS.with_values(swap=False)), visits=THREE, airframe=SMALL)
    first.airframe.battery_frac = LOW
    flown = first.fly(600)
    assert (flown.phase, landed_at(flown)) == (Phase.ABORTED, "A1")
    assert "battery at" in told(flown, "home")[0]
    done, rest = flown.visited, first.pilot.mission.remaining
    second = IdealFlight(DEMO, config(), visits=rest).fly()
    assert second.phase is Phase.DONE
    assert 0 < len(rest) < len(THREE)
    assert (*done, *second.visited) == THREE


def test_somebody_changes_the_battery_of_a_drone_that_came_back() -> None:
    flight = IdealFlight(DEMO, config(), visits=("A2",))
    frame = flight.airframe
    swapper = ChargePads(DEMO, frame, PadService(swap_s=30.0))
    frame.battery_frac = 0.4
    for t in range(100):
        swapper.look(t * 10**9)
    assert frame.battery_frac == 0.4, "it has not flown"
    frame.on_floor = False
    swapper.look(100 * 10**9)
    frame.on_floor = True
    for t in range(101, 130):
        swapper.look(t * 10**9)
    assert frame.battery_frac == 0.4
    swapper.look(131 * 10**9)
    assert frame.battery_frac == 1.0
