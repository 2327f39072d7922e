"""Where a drone may be while traffic does not fly it.

That only ever grows: what such a drone tells is no proof that it left any air for good.  It ends when the
drone rests on its own pad at the end of a flight, when a person gives it back, or when traffic flies it on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import OVER, Phase
from flightd.ground.fleet.fleet_floor import FleetFloor
from flightd.ground.mqtt.order_flight import WAITS


@dataclass(frozen=True, slots=True)
class KeptAir:
    """What of `DroneAir` outlives the station."""

    place: int
    closed: frozenset[int]
    doubt_m: float
    rests: bool
    is_astray: bool
    is_believed: bool | None
    flew: bool
    at: tuple[float, float] | None
    stand: int | None = None


class DroneAir:
    """`see` it often, `close` it while traffic does not fly the drone.  At first it rests on its pad, or on
    that of the node that it `stands_on`."""

    def __init__(self, drone: str, floor: FleetFloor, stands_on: str | None = None) -> None:
        self._drone = drone
        self._floor = floor
        self.stand = floor.stand(drone, stands_on)
        """The pad on which it rested last: its own, or a shared one."""
        self.place = self.stand
        """A vertex near the drone."""
        self.closed: frozenset[int] = frozenset()
        self.doubt_m = 0.0
        """By how much it may be beside all that."""
        self.rests = True
        """It stands on its own pad, or on a shared one, for certain."""
        self.is_astray = False
        """It is on the ground, and nothing shows that it is on a pad."""
        self.is_believed: bool | None = None
        """Its session began on the ground, so that its position is none that it took for granted; None: not
        told yet."""
        self._told_stand = self.stand
        self._session = ""
        self._armed = self._flew = False
        self._is_untold = False
        """It waits on a pad, maybe a shared one, and has not told on which."""
        self._given_back = False
        """A person gave it back before it had told."""
        self._at: tuple[float, float] | None = None
        """Told last while armed: a drone on the ground tells none."""

    def kept(self) -> KeptAir:
        """What the next station has to know of it."""
        return KeptAir(
            self.place,
            self.closed,
            self.doubt_m,
            self.rests,
            self.is_astray,
            self.is_believed,
            self._flew,
            self._at,
            self.stand,
        )

    def recall(self, session: str, kept: KeptAir, ways: Sequence[Sequence[str]]) -> None:
        """Go on with what the station before knew of it in that session; it may be on these ways since."""
        self._session = session
        self.place, self.closed, self.doubt_m = kept.place, kept.closed, kept.doubt_m
        self.rests, self.is_astray, self.is_believed = kept.rests, kept.is_astray, kept.is_believed
        self._flew, self._at = kept.flew, kept.at
        self.stand = self._floor.pad(self._drone) if kept.stand is None else kept.stand
        if any(ways):
            self.rests = False
        self.close(ways, kept.doubt_m)

    def see(self, status: StatusReport | None, *, stands_on: str | None, ordered: bool) -> None:
        """What it told last; `stands_on`: where it stands, where it told so in this session; `ordered`: it is
        silent, and may fly what it was ordered."""
        if status is not None:
            self._told_stand = self._floor.stand(self._drone, stands_on)
            self._is_untold = status.phase is Phase.PREFLIGHT and stands_on is None
            self._see_session(status, stood=stands_on is not None)
            self._see_flight(status)
            self._see_given_back()
        if ordered:
            self.rests = False

    def _see_session(self, status: StatusReport, *, stood: bool) -> None:
        if status.session != self._session:
            # a daemon takes it for granted that it begins on the drone's own pad
            knows = self.rests and self.stand == self._floor.pad(self._drone)
            self.is_astray |= bool(self._session) and not knows
            self.rests &= not self.is_astray
            self._session, self.is_believed, self._flew = status.session, None, False
        vehicle = status.vehicle
        self._armed = vehicle.armed if vehicle is not None else status.phase not in WAITS | OVER
        if status.phase is Phase.RECOVER:
            self.is_believed = False
        elif self.is_believed is None and vehicle is not None:
            self.is_believed = stood or not vehicle.armed

    def _see_flight(self, status: StatusReport) -> None:
        if self._armed:
            self.rests, self._flew = False, True
            if self.is_believed and status.position is not None:
                self._at = status.position.x_m, status.position.y_m
        elif status.vehicle is None or self.rests or self.is_astray:
            return
        elif status.phase in OVER:
            is_home = self._at is not None and self._floor.is_pad(self._drone, self._at)
            if status.phase is Phase.DONE and self.is_believed and is_home:
                self._rest(self._floor.pad(self._drone))
            else:
                self.is_astray = True
        elif status.phase is Phase.PREFLIGHT and not self._flew:
            self._rest(self.stand)
        elif status.phase is Phase.PREFLIGHT and self.is_believed and self._stands_on_shared:
            self._rest(self._told_stand)

    def _see_given_back(self) -> None:
        """It rests where it tells to stand, as the person said."""
        self._given_back &= not self._armed and not self.is_astray
        if self._given_back and not self._is_untold:
            self._given_back = False
            self._rest(self._told_stand)

    @property
    def _stands_on_shared(self) -> bool:
        return self._told_stand != self._floor.pad(self._drone)

    def close(
        self,
        ways: Sequence[Sequence[str]],
        doubt_m: float,
        *,
        pads: Iterable[int] = (),
        holds: bool = False,
    ) -> None:
        """It may be on these ways, over nodes, from where it was seen last, on its way home, and on its way
        down onto shared `pads`.  How far beside all that lessens only by what a drone tells that `holds`,
        and knows its place."""
        if self.rests:
            return
        floor = self._floor
        stood = floor.lanes.vertices[self.stand].node
        here = stood if self._at is None else floor.nearest(self._at)
        around = floor.onto(self.stand) if self._at is None else floor.around(self._at)
        found = (floor.way(self._drone, (here, *way)) for way in ((), *ways))
        self.closed = self.closed.union([self.place], around, *found, *map(floor.onto, pads))
        self.place = floor.lanes.over(here)
        is_sure = holds and self._armed and bool(self.is_believed)
        self.doubt_m = doubt_m if is_sure else max(self.doubt_m, doubt_m)

    @property
    def here(self) -> frozenset[int]:
        """The air in which it was seen last, alone."""
        return frozenset([self.place]).union(() if self._at is None else self._floor.around(self._at))

    def give_back(self) -> None:
        """A person says that on the ground it stands on its pad, and in the air it is where it tells.  One
        that has flown and waits on a pad is asked first on which."""
        self.is_astray = False
        if not self._armed and self._flew and self._is_untold:
            self._given_back = True
        elif not self._armed:
            self._rest(self._told_stand)
        elif self.is_believed:
            self.begin()

    def begin(self) -> None:
        """Traffic flies it, from where it rests."""
        self.closed, self.doubt_m = frozenset(), 0.0

    def _rest(self, pad: int) -> None:
        self.rests, self._at, self.place, self.stand = True, None, pad, pad
        self.begin()
