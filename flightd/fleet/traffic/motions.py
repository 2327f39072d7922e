"""How a drone moves on the lanes: turns, hops, launches, cruising, braking, each with the air it sweeps and
when.

A configuration is a vertex, a heading (quarter turn) and whether the drone is at rest there or at cruising
speed. Speeds between are passed within a motion: what is flown is the trapezoid of bounded speed and
acceleration. Times are whole milliseconds, rounded up, so that plans can be compared exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from flightd.fleet.traffic.lanes import UPRIGHT, Arc, LaneGraph
from flightd.mission.plan.leg_times import Pace

NEVER: Final = 1 << 60
"""Later than any time, in milliseconds."""


class Act(StrEnum):
    """What a drone does in one part of a motion."""

    TURN = "turn"
    FLY = "fly"
    CLIMB = "climb"
    TAKE_OFF = "take off"
    LAND = "land"
    COUNT = "count"


@dataclass(frozen=True, slots=True)
class Part:
    """One resource of a motion, taken from `in_ms` to `out_ms` after its start; at its end the drone is at
    `vertex`."""

    act: Act
    resource: int
    vertex: int
    in_ms: int
    out_ms: int


@dataclass(frozen=True, slots=True)
class Motion:
    """From one configuration to another in `duration_ms`."""

    target: int
    duration_ms: int
    parts: tuple[Part, ...]


def at_rest(vertex: int, quarter: int) -> int:
    """The configuration of a drone that stands."""
    return (vertex * 4 + quarter) * 2


def vertex_of(configuration: int) -> int:
    """Where it is."""
    return configuration >> 3


class MotionNet:
    """The motions of one kind of drone on one graph, made when they are first asked for."""

    def __init__(self, lanes: LaneGraph, pace: Pace) -> None:
        self.lanes = lanes
        self.pace = pace
        self._ramp_m = pace.speed_mps**2 / (2 * pace.accel_mps2)
        self._motions: dict[int, tuple[Motion, ...]] = {}
        self._straight: list[dict[int, Arc]] = [
            {arc.quarter: arc for arc in arcs if arc.quarter != UPRIGHT} for arcs in lanes.arcs
        ]
        turns_ms = [_ms(pace.turn_s(min(k, 4 - k) * math.pi / 2)) for k in range(4)]
        self._turn_ms = [max(1, each) for each in turns_ms]
        ramp_s = pace.speed_mps / (2 * pace.accel_mps2)
        self.stop_ms = int((ramp_s + pace.settle_s) * 1000)
        """What a stop from cruising takes longer than going on, rounded down."""
        self.launch_ms = int(ramp_s * 1000)
        """The same for a launch."""
        level_m = [lane.length_m for lane in lanes.lanes if lane.quarter != UPRIGHT]
        self.ramps_fit = min(level_m, default=0.0) >= 2 * self._ramp_m
        """Whether every lane is long enough to reach cruising speed on it and to stop again."""

    def onward(self, configuration: int) -> tuple[Motion, ...]:
        """Every motion that begins there."""
        found = self._motions.get(configuration)
        if found is None:
            vertex, quarter, moves = configuration >> 3, configuration >> 1 & 3, configuration & 1
            found = self._moving(vertex, quarter) if moves else self._resting(vertex, quarter)
            self._motions[configuration] = found
        return found

    def lower_bound_ms(self, arc: Arc) -> int:
        """No motion along the arc takes less."""
        if arc.quarter == UPRIGHT:
            return self._upright(arc, 0).duration_ms
        return int(arc.length_m / self.pace.speed_mps * 1000)

    def _resting(self, vertex: int, quarter: int) -> tuple[Motion, ...]:
        found = [
            self._turn(vertex, quarter, wanted) for wanted in self._straight[vertex] if wanted != quarter
        ]
        found += [self._upright(arc, quarter) for arc in self.lanes.arcs[vertex] if arc.quarter == UPRIGHT]
        return (*found, *self._runs(vertex, quarter))

    def _runs(self, vertex: int, quarter: int) -> Iterator[Motion]:
        """Launches, and from rest to rest as far as a launch and braking do not reach."""
        run: list[Arc] = []
        arc = self._straight[vertex].get(quarter)
        while arc is not None:
            run.append(arc)
            lengths_m = [each.length_m for each in run]
            launch = _first_reaching(lengths_m, self._ramp_m)
            if launch == len(run):
                yield self._along(run, quarter, ends_moving=True)
            elif launch is not None and _first_reaching(lengths_m[launch:], self._ramp_m) is not None:
                return
            yield self._along(run, quarter, ends_moving=False)
            arc = self._straight[arc.to].get(quarter)

    def _moving(self, vertex: int, quarter: int) -> tuple[Motion, ...]:
        found: list[Motion] = []
        run: list[Arc] = []
        arc = self._straight[vertex].get(quarter)
        if arc is not None:
            found.append(self._cruise(arc, quarter))
        while arc is not None:
            run.append(arc)
            if math.fsum(each.length_m for each in run) >= self._ramp_m:
                found.append(self._brake(run, quarter))
                break
            arc = self._straight[arc.to].get(quarter)
        return tuple(found)

    def _turn(self, vertex: int, quarter: int, wanted: int) -> Motion:
        duration_ms = self._turn_ms[(wanted - quarter) % 4]
        part = Part(Act.TURN, vertex, vertex, 0, duration_ms)
        return Motion(at_rest(vertex, wanted), duration_ms, (part,))

    def _upright(self, arc: Arc, quarter: int) -> Motion:
        p, vertices = self.pace, self.lanes.vertices
        lane = self.lanes.lanes[arc.resource - len(vertices)]
        start = lane.a if arc.to == lane.b else lane.b
        if vertices[arc.to].pad is not None:
            act, seconds = Act.LAND, p.land_s + p.leg_s(arc.length_m - vertices[start].height_m)
        elif vertices[start].pad is not None:
            act, seconds = Act.TAKE_OFF, p.take_off_s + p.leg_s(arc.length_m - vertices[arc.to].height_m)
        else:
            act, seconds = Act.CLIMB, p.climb_s(arc.length_m)
        return Motion(
            at_rest(arc.to, quarter), _ms(seconds), (Part(act, arc.resource, arc.to, 0, _ms(seconds)),)
        )

    def _cruise(self, arc: Arc, quarter: int) -> Motion:
        duration_ms = _ms(arc.length_m / self.pace.speed_mps)
        part = Part(Act.FLY, arc.resource, arc.to, 0, duration_ms)
        return Motion(at_rest(arc.to, quarter) + 1, duration_ms, (part,))

    def _along(self, run: Sequence[Arc], quarter: int, *, ends_moving: bool) -> Motion:
        """From rest along some lanes."""
        total_m = math.fsum(arc.length_m for arc in run)
        passed = _cumulative(run)
        if ends_moving:
            times = [self._from_rest_s(metres) for metres in passed]
            return _motion(run, quarter, times, moving=True)
        peak_m = total_m / 2
        total_s = 2 * self._from_rest_s(peak_m)
        times = [
            self._from_rest_s(metres) if metres <= peak_m else total_s - self._from_rest_s(total_m - metres)
            for metres in passed
        ]
        times[-1] = total_s + self.pace.settle_s
        return _motion(run, quarter, times, moving=False)

    def _brake(self, run: Sequence[Arc], quarter: int) -> Motion:
        total_m = math.fsum(arc.length_m for arc in run)
        total_s = self._from_rest_s(total_m)
        times = [total_s - self._from_rest_s(max(total_m - metres, 0.0)) for metres in _cumulative(run)]
        times[-1] = total_s + self.pace.settle_s
        return _motion(run, quarter, times, moving=False)

    def _from_rest_s(self, metres: float) -> float:
        """Time from rest over `metres` without braking."""
        p = self.pace
        if metres <= self._ramp_m:
            return math.sqrt(2 * metres / p.accel_mps2)
        return p.speed_mps / p.accel_mps2 + (metres - self._ramp_m) / p.speed_mps


def _cumulative(run: Sequence[Arc]) -> list[float]:
    passed, all_m = 0.0, []
    for arc in run:
        passed += arc.length_m
        all_m.append(passed)
    return all_m


def _first_reaching(lengths_m: Sequence[float], wanted_m: float) -> int | None:
    """How many of the lengths make `wanted_m`, None where all do not."""
    passed = 0.0
    for i, length_m in enumerate(lengths_m, start=1):
        passed += length_m
        if passed >= wanted_m:
            return i
    return None


def _motion(run: Sequence[Arc], quarter: int, out_s: Sequence[float], *, moving: bool) -> Motion:
    parts: list[Part] = []
    in_ms = 0
    for arc, seconds in zip(run, out_s, strict=True):
        out_ms = max(_ms(seconds), in_ms + 1)
        parts.append(Part(Act.FLY, arc.resource, arc.to, in_ms, out_ms))
        in_ms = out_ms
    return Motion(at_rest(run[-1].to, quarter) + moving, in_ms, tuple(parts))


def _ms(seconds: float) -> int:
    return math.ceil(seconds * 1000 - 1e-6)
