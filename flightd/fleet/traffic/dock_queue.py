"""Drones on their way to docks, on them, and in the queue before them.

Whoever has nothing left to count and too little charge for a tour wants a dock.  It flies there once the
dock that is best for it is free; until then it goes on to its own pad and waits there, in nobody's way.  A
dock has one drone at a time, from when it is chosen until that drone has left it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.docks import Dock, DockKind, Waiting, chosen_docks
from flightd.fleet.traffic.drone_course import DroneCourse
from flightd.fleet.traffic.motions import NEVER
from flightd.fleet.traffic.open_ways import OpenWays
from flightd.fleet.traffic.plan import Stop
from flightd.fleet.traffic.traffic_control import TrafficControl

LANDINGS: Final = 3
"""On one dock without contact; then the drone takes another one."""
_CONTACT_MS: Final = 15_000
"""A drone that stands on a dock says so by then."""
_RETRY_MS: Final = 15_000
_LEAVES_MS: Final = 40_000
"""Until a dock is free of a drone that is done."""
_TOLD_KEPT: Final = 200
_HOVERS_MS: Final = 1_000
"""Over a dock before it lands anew."""


@dataclass(frozen=True, slots=True)
class Standing:
    """What is known of a drone: its charge, whether it says that it is being charged, and whether it may be
    sent on from where it stands."""

    charge: float
    charging: bool | None
    may_start: bool = True


@dataclass(frozen=True, slots=True)
class KeptTries:
    """Of one drone: its landings without contact on the dock where it is, and the docks that it gave up."""

    landings: int
    shunned: tuple[str, ...]


class DockQueue:
    """The docks of one floor; without any, every drone is charged on its own pad.  Where a drone `returns` it
    flies to no dock from which it would not come to its own pad."""

    def __init__(
        self,
        control: TrafficControl,
        distances: Distances,
        open_ways: OpenWays,
        docks: Sequence[Dock],
        full_enough: float,
        *,
        returns: bool = False,
    ) -> None:
        self._returns = returns
        self._control = control
        self._distances = distances
        self._open_ways = open_ways
        self._docks = {dock.name: dock for dock in docks}
        self._full_enough = full_enough
        self._homes: dict[str, int] = {}
        self._holder: dict[str, str] = {}
        self._since_ms: dict[str, int] = {}
        self._landings: dict[str, int] = {}
        self._shunned: dict[str, set[str]] = {}
        self._next_try_ms: dict[str, int] = {}
        self.waited_ms = 0
        self._stranded: set[str] = set()
        self.told: deque[str] = deque(maxlen=_TOLD_KEPT)
        """The newest lines for people; `told_count` counts all."""
        self.told_count = 0

    @property
    def are_there(self) -> bool:
        """Whether there are any."""
        return bool(self._docks)

    def home(self, drone: str) -> int:
        """Its own pad: that on which it entered, or comes home to since it was flown on."""
        course = self._control.drones[drone]
        return self._homes.setdefault(drone, course.ends[0]) if self._docks else course.ends[0]

    @property
    def docks(self) -> tuple[Dock, ...]:
        """All of them."""
        return tuple(self._docks.values())

    @property
    def holders(self) -> Mapping[str, str]:
        """Dock to drone: from when it is chosen until that drone has left it."""
        return self._holder

    def flies_on(self, drone: str, home: int) -> bool:
        """A drone entered anew that comes home to this pad.  Whether it may stay where it is: on a dock."""
        self._homes[drone] = home
        place = self._control.drones[drone].place
        return any(place == dock.place for dock in self._docks.values())

    def kept(self) -> dict[str, KeptTries]:
        """What whoever goes on with this queue has to know."""
        return {
            drone: KeptTries(self._landings.get(drone, 0), tuple(sorted(self._shunned.get(drone, ()))))
            for drone in {*self._landings, *self._shunned}
        }

    def remember(self, kept: Mapping[str, KeptTries]) -> None:
        """Go on with what another one kept."""
        for drone, tries in kept.items():
            self._landings[drone], self._shunned[drone] = tries.landings, set(tries.shunned)

    def keep_ms(self, drone: str) -> int:
        """What has to be left of a battery on the drone's own pad: the way to a dock."""
        if not self._docks:
            return 0
        home = self.home(drone)
        ways = (self._distances.to(dock.place)[home] + self._back_ms(drone, dock) for dock in self.docks)
        return min(ways) + self._stops_ms

    def step(self, now_ms: int, known: dict[str, Standing], left_ms: dict[str, int]) -> None:
        """Free docks, land anew, let those go that are done, and send who waits.  `known` are the drones that
        may be sent; `left_ms` is how long each may fly still."""
        self._free_docks()
        for drone, standing in known.items():
            self._watch_contact(drone, standing, now_ms)
        waiting = self._waiting(known, left_ms, now_ms)
        if waiting:
            self._send(waiting, known, left_ms, now_ms)

    def turn_back(self, drone: str, left_ms: int, now_ms: int) -> None:
        """Let a drone that waited too long on its way to a dock go home while it can: it may fly so long
        still, which is not enough any more to come there, and from there home."""
        dock, course = self._dock_of(drone), self._control.drones[drone]
        is_in_air = self._control.lanes.vertices[course.place].pad is None
        if dock is None or not course.tail or course.ahead[-1].vertex != dock.place or not is_in_air:
            return
        home = (self.home(drone),)
        base_ms = sum(action.duration_ms for action in course.base)
        back_ms = self._open_ways.ms(drone, dock.place, home) if self._returns else 0
        there_ms = self._open_ways.ms(drone, course.base_end, (dock.place,)) + back_ms
        home_ms = self._open_ways.ms(drone, course.base_end, home)
        if (
            home_ms < min(there_ms, NEVER)
            and base_ms + there_ms > left_ms
            and not self._is_early(drone, now_ms)
        ):
            self._next_try_ms[drone] = now_ms + _RETRY_MS
            self._tell(f"{drone} turns back on its way to dock {dock.name}: its battery would not last")
            self._go_home(drone, now_ms)

    def _tell(self, line: str) -> None:
        self.told.append(line)
        self.told_count += 1

    def _dock_of(self, drone: str) -> Dock | None:
        return next((self._docks[name] for name, holder in self._holder.items() if holder == drone), None)

    def _free_docks(self) -> None:
        """Of those who are neither on it nor going there; who stands on one has it, however he came there."""
        for name, drone in list(self._holder.items()):
            course, place = self._control.drones[drone], self._docks[name].place
            may_be = place in self._control.avoided(drone) if course.wreck else place == _end_of(course)
            if place != course.place and not may_be:
                del self._holder[name]
        at = {dock.place: name for name, dock in self._docks.items() if name not in self._holder}
        for drone, course in self._control.drones.items() if at else ():
            if course.place in at and not course.ahead:
                self._holder[at.pop(course.place)] = drone

    def _watch_contact(self, drone: str, standing: Standing, now_ms: int) -> None:
        course, dock = self._control.drones[drone], self._dock_of(drone)
        if dock is None or course.ahead or course.place != dock.place:
            return
        # a full battery takes no more
        is_well = standing.charging or standing.charge >= self._full_enough
        if is_well:
            self._landings.pop(drone, None)
            self._shunned.pop(drone, None)
        if (
            is_well
            or standing.charging is None
            or now_ms - course.since_ms < _CONTACT_MS
            or self._is_early(drone, now_ms)
        ):
            return
        landings = self._landings[drone] = self._landings.get(drone, 0) + 1
        self._next_try_ms[drone] = now_ms + _RETRY_MS
        if landings < LANDINGS:
            self._tell(f"{drone} has no contact on dock {dock.name}: it lands anew")
            vertex = self._control.lanes.vertices[dock.place]
            over = Stop(
                self._control.lanes.over(vertex.node), self._control.lanes.column_of[vertex.node], _HOVERS_MS
            )
            self._give(drone, (over,), dock, now_ms)
            return
        none = f"{drone} has no contact on dock {dock.name} after {landings} landings"
        self._tell(f"{none}: it takes another, if there is one")
        self._landings.pop(drone)
        self._shunned.setdefault(drone, set()).add(dock.name)
        self._go_home(drone, now_ms)

    def _waiting(self, known: dict[str, Standing], left_ms: dict[str, int], now_ms: int) -> list[Waiting]:
        """Those that want a dock, who waited longest first."""
        found: list[Waiting] = []
        shut = frozenset().union(*map(self._control.avoided, self._control.drones))
        for drone, standing in known.items():
            course = self._control.drones[drone]
            is_low = standing.charge < self._full_enough and standing.may_start
            if course.stops or not is_low or self._dock_of(drone) is not None:
                self._since_ms.pop(drone, None)
                continue
            self._since_ms.setdefault(drone, now_ms)
            ways = {
                dock.name: self._open_ways.ms(drone, course.base_end, (dock.place,)) + self._stops_ms
                for dock in self._docks.values()
                if dock.place not in shut
            }
            ways = {name: way_ms for name, way_ms in ways.items() if way_ms < NEVER}
            near = {
                name: way_ms
                for name, way_ms in ways.items()
                if way_ms + self._back_ms(drone, self._docks[name]) <= left_ms[drone]
            }
            shunned = self._shunned.get(drone, set())
            others = {name: way_ms for name, way_ms in near.items() if name not in shunned}
            if not others:
                self._shunned.pop(drone, None)  # all in reach: once more from the first
            if ways and not near and not course.ahead and drone not in self._stranded:
                self._stranded.add(drone)
                self._tell(f"{drone} reaches no dock any more with what is left of its battery")
            found.append(Waiting(drone, standing.charge, others or near))
        return sorted(found, key=lambda each: (self._since_ms[each.drone], each.drone))

    def _send(
        self, waiting: Sequence[Waiting], known: dict[str, Standing], left_ms: dict[str, int], now_ms: int
    ) -> None:
        free_ms = {name: self._free_in_ms(name, known) for name in self._docks}
        for drone, dock in chosen_docks(self._docks.values(), free_ms, waiting).items():
            holder = self._holder.get(dock.name)
            if holder is not None:
                self._make_room(holder, dock, known, now_ms)
            elif not self._is_early(drone, now_ms):
                self._next_try_ms[drone] = now_ms + _RETRY_MS
                if self._fly_to(drone, dock, left_ms[drone], now_ms):
                    self._holder[dock.name] = drone
                    self.waited_ms += now_ms - self._since_ms.pop(drone)

    def _fly_to(self, drone: str, dock: Dock, left_ms: int, now_ms: int) -> bool:
        """To a dock, if its battery lasts for that with all that it has to wait for; home otherwise.  Whether
        it flies to the dock: also where it does not come home."""
        if not self._give(drone, (), dock, now_ms):
            return False
        way_ms = self._control.drones[drone].ahead[-1].end_ms - now_ms
        if way_ms + self._back_ms(drone, dock) <= left_ms:
            return True
        return not self._go_home(drone, now_ms)

    def _make_room(self, holder: str, dock: Dock, known: dict[str, Standing], now_ms: int) -> None:
        """Who is charged, and has nothing to do, goes home for whoever waits."""
        course = self._control.drones[holder]
        standing = known.get(holder)
        is_charged = standing is not None and standing.charge >= self._full_enough
        rests = not course.ahead and course.place == dock.place
        if standing is None or not (is_charged and rests) or self._is_early(holder, now_ms):
            return
        if self._may_leave(holder, standing):
            self._next_try_ms[holder] = now_ms + _RETRY_MS
            self._go_home(holder, now_ms)

    def _may_leave(self, holder: str, standing: Standing) -> bool:
        """Whether it may be sent home, and a way there is open."""
        place, home = self._control.drones[holder].place, self.home(holder)
        return standing.may_start and self._open_ways.ms(holder, place, (home,)) < NEVER

    def _free_in_ms(self, name: str, known: dict[str, Standing]) -> int:
        holder = self._holder.get(name)
        if holder is None:
            return 0
        dock, course = self._docks[name], self._control.drones[holder]
        standing = known.get(holder)
        charge = 0.0 if standing is None else standing.charge
        is_charged = charge >= self._full_enough
        if standing is not None and is_charged and not self._may_leave(holder, standing):
            charge = 0.0  # it stays for nobody knows how long
        return self._distances.to(dock.place)[course.place] + dock.service_ms(charge) + _LEAVES_MS

    def _is_early(self, drone: str, now_ms: int) -> bool:
        return now_ms < self._next_try_ms.get(drone, 0)

    def _give(self, drone: str, stops: tuple[Stop, ...], dock: Dock, now_ms: int) -> bool:
        """To a dock; home, where it cannot be had any more."""
        home = self.home(drone)
        if not self._control.give(drone, stops, (dock.place,), now_ms):
            return False
        self._control.drones[drone].ends = (dock.place, home)
        return True

    def _go_home(self, drone: str, now_ms: int) -> bool:
        return self._control.give(drone, (), (self.home(drone),), now_ms)

    def _back_ms(self, drone: str, dock: Dock) -> int:
        """From a dock to the drone's own pad, where it has to come there."""
        return self._distances.to(self.home(drone))[dock.place] if self._returns else 0

    @property
    def _stops_ms(self) -> int:
        """On the way to a dock."""
        return 4 * (self._control.net.launch_ms + self._control.net.stop_ms)


def docks_of(
    places: Iterable[tuple[str, int]], swaps: int, swap_s: float, charge_s: float
) -> tuple[Dock, ...]:
    """Docks at these pads (name, vertex), of which `swaps` are spread among them as swaps."""
    pads = list(places)
    kinds = [(i + 1) * swaps // len(pads) > i * swaps // len(pads) for i in range(len(pads))]
    return tuple(
        Dock(name, place, DockKind.SWAP, swap_s) if is_swap else Dock(name, place, DockKind.CONTACT, charge_s)
        for (name, place), is_swap in zip(pads, kinds, strict=True)
    )


def _end_of(course: DroneCourse) -> int:
    return course.ahead[-1].vertex if course.ahead else course.place
