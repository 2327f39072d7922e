"""One flight's normal equations about what is believed of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Lens, Matrix, Mount
from flightd.core.types import LineSet
from flightd.studies.flight_fit.bordered_chain import BorderedChain
from flightd.studies.flight_fit.camera_model import SeenFrom, ends_off
from flightd.studies.flight_fit.motion import (
    FIRST,
    HEIGHT,
    PITCH,
    PSI,
    PUSH_X,
    PUSH_Y,
    ROLL,
    SENSORS,
    STATES,
    Motion,
    Sensor,
    X,
    Y,
)
from flightd.studies.flight_fit.record import FlightRecord
from flightd.studies.flight_fit.sights import PaintedLines, Poses, Sights

_HUBER = 2.0
"""A sight that errs by more of its own sigmas is weighed less."""
_ALIKE = 3.0
"""A line's errors are alike from frame to frame (the same worn edge): so many sights count as one."""
SHAKES = 3
_LINE = 2
_SMALL = 1e-5
_DELAY_STEP_S = 0.005


@dataclass(slots=True)
class FlightState:
    """What is believed of one flight: `states` (K, n) of `motion`, `shakes` (K, 3) roll, pitch and yaw of
    each picture beside the airframe and their sigmas (3,), `sensors` (SENSORS,); `motion` goes from each
    frame in `linked` to the next; `frames` are the record's, as if all rows had been exposed at once."""

    record: FlightRecord
    lens: Lens
    mount: Mount
    motion: Motion
    linked: NDArray[np.bool_]
    states: Matrix
    shakes: Matrix
    shake_rad: Matrix
    sensors: Matrix
    sights: Sights
    frames: tuple[LineSet, ...]

    def poses(self) -> Poses:
        """The camera's body at each frame."""
        when_s = self.record.frame_s + self.sensors[Sensor.DELAY]
        told, states = self.record.attitudes.at(when_s), self.states
        high = self.record.heights.at(when_s)[:, 0] * (1.0 + self.sensors[Sensor.HEIGHT])
        return Poses(
            states[:, X],
            states[:, Y],
            high + states[:, HEIGHT],
            told[:, 0] + states[:, ROLL] + self.shakes[:, 0],
            told[:, 1] + states[:, PITCH] + self.shakes[:, 1],
            told[:, 2] + states[:, PSI] + self.shakes[:, 2],
        )

    def believed_mount(self) -> Mount:
        mount, sensors = self.mount, self.sensors
        return Mount(
            mount.yaw_rad + float(sensors[Sensor.MOUNT_YAW]),
            mount.offset_m,
            mount.roll_rad + float(sensors[Sensor.MOUNT_ROLL]),
            mount.pitch_rad + float(sensors[Sensor.MOUNT_PITCH]),
        )

    def believed_lens(self) -> Lens:
        share = math.exp(float(self.sensors[Sensor.FOCAL]))
        return replace(self.lens, fx_px=self.lens.fx_px * share, fy_px=self.lens.fy_px * share)

    def seen_from(self, lines: PaintedLines, late_s: float = 0.0) -> SeenFrom:
        """The views of all sights."""
        sensors, sights = self.sensors, self.sights
        if late_s:
            sensors = sensors.copy()
            sensors[Sensor.DELAY] += late_s
        poses = replace(self, sensors=sensors).poses()
        frame, line = sights.frame, sights.line

        def each(value: float) -> Matrix:
            return np.full(len(sights), value)

        return SeenFrom(
            poses.x_m[frame],
            poses.y_m[frame],
            poses.height_m[frame],
            poses.roll_rad[frame],
            poses.pitch_rad[frame],
            poses.yaw_rad[frame],
            each(sensors[Sensor.MOUNT_ROLL]),
            each(sensors[Sensor.MOUNT_PITCH]),
            each(sensors[Sensor.MOUNT_YAW]),
            each(sensors[Sensor.FOCAL]),
            each(sensors[Sensor.BEND]),
            lines.at_m[line, 0],
            lines.at_m[line, 1],
            lines.direction_rad[line],
        )


@dataclass(frozen=True, slots=True)
class Linearised:
    """`chain` is what is left when the shakes are expressed by the rest: (K, 3, n + G + 1) `by`, whose own
    variances are `shake_variance` (K, 3).  G are the sensors, the lines' places and their angles.  `squares`
    are the sights' (N,) squared residuals in their own sigmas, of two degrees of freedom each."""

    chain: BorderedChain
    shakes_by: Matrix
    shake_variance: Matrix
    squares: Matrix


def linearised(flight: FlightState, lines: PaintedLines) -> Linearised:
    """The equations of all that was seen and of how the drone moves, without what was believed before of
    sensors and lines."""
    count, frames = len(lines.at_m), len(flight.states)
    shared = SENSORS + 2 * count
    chain = BorderedChain.empty(frames, STATES, shared)
    _add_motion(chain, flight)
    sights = flight.sights
    seen = flight.seen_from(lines)
    off = ends_off(sights.ends_px, flight.lens, flight.mount, seen)
    states, shakes, sensors, line = _derivatives(flight, lines, seen)
    inverse = np.linalg.inv(sights.covariance_px2)
    squares = np.einsum("ne,nef,nf->n", off, inverse, off)
    weight = np.minimum(1.0, _HUBER / np.sqrt(np.maximum(squares, 1e-12))) / _ALIKE
    inverse = inverse * weight[:, None, None]
    frame = sights.frame

    def times(a: Matrix, b: Matrix) -> Matrix:
        return np.asarray(np.einsum("nea,nef,nfb->nab", a, inverse, b, optimize=True))

    rhs = -np.einsum("nef,nf->ne", inverse, off)

    def pull(a: Matrix) -> Matrix:
        return np.asarray(np.einsum("nea,ne->na", a, rhs))

    np.add.at(chain.own, frame, times(states, states))
    np.add.at(chain.own_rhs, frame, pull(states))
    np.add.at(chain.border[:, :, :SENSORS], frame, times(states, sensors))
    chain.shared[:SENSORS, :SENSORS] += times(sensors, sensors).sum(axis=0)
    chain.shared_rhs[:SENSORS] += pull(sensors).sum(axis=0)
    own = np.broadcast_to(np.diag(flight.shake_rad**-2.0), (frames, SHAKES, SHAKES)).copy()
    shake_rhs = -flight.shakes * flight.shake_rad**-2.0
    to_states, to_shared = np.zeros((frames, SHAKES, STATES)), np.zeros((frames, SHAKES, shared))
    np.add.at(own, frame, times(shakes, shakes))
    np.add.at(shake_rhs, frame, pull(shakes))
    np.add.at(to_states, frame, times(shakes, states))
    np.add.at(to_shared[:, :, :SENSORS], frame, times(shakes, sensors))
    by_line, line_line, line_pull = times(states, line), times(line, line), pull(line)
    sensors_line, shakes_line = times(sensors, line), times(shakes, line)
    columns = np.stack([SENSORS + sights.line, SENSORS + count + sights.line], axis=1)
    for i in range(_LINE):
        # a frame has each line once, so that no place is written twice
        chain.border[frame, :, columns[:, i]] += by_line[:, :, i]
        to_shared[frame, :, columns[:, i]] += shakes_line[:, :, i]
        np.add.at(chain.shared_rhs, columns[:, i], line_pull[:, i])
        crossed = np.zeros((shared, SENSORS))
        np.add.at(crossed, columns[:, i], sensors_line[:, :, i])
        chain.shared[:, :SENSORS] += crossed
        chain.shared[:SENSORS, :] += crossed.T
        for j in range(_LINE):
            np.add.at(chain.shared, (columns[:, i], columns[:, j]), line_line[:, i, j])
    by, variance = _without_shakes(chain, own, shake_rhs, to_states, to_shared)
    return Linearised(chain, by, variance, squares)


def _without_shakes(
    chain: BorderedChain, own: Matrix, rhs: Matrix, to_states: Matrix, to_shared: Matrix
) -> tuple[Matrix, Matrix]:
    """Express the shakes by the rest; by what, and their own variances."""
    right = np.concatenate([to_states, to_shared, rhs[:, :, None]], axis=2)
    by = np.linalg.solve(own, right)
    size = to_states.shape[2]
    chain.own -= np.einsum("kia,kib->kab", to_states, by[:, :, :size], optimize=True)
    chain.border -= np.einsum("kia,kib->kab", to_states, by[:, :, size:-1], optimize=True)
    chain.own_rhs -= np.einsum("kia,ki->ka", to_states, by[:, :, -1])
    flat, flat_by = (part.reshape(-1, part.shape[2]) for part in (to_shared, by[:, :, size:-1]))
    chain.shared -= flat.T @ flat_by
    chain.shared_rhs -= np.einsum("kia,ki->a", to_shared, by[:, :, -1])
    variance = np.diagonal(np.linalg.inv(own), axis1=1, axis2=2)
    return by, variance


def _derivatives(
    flight: FlightState, lines: PaintedLines, seen: SeenFrom
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """(N, 2, ·) of the ends' errors by the frame's state, its shakes, the sensors and the line."""
    ends, lens, mount = flight.sights.ends_px, flight.lens, flight.mount

    def by(name: str) -> Matrix:
        value = getattr(seen, name)
        up, down = (
            ends_off(ends, lens, mount, replace(seen, **{name: value + step})) for step in (_SMALL, -_SMALL)
        )
        return np.asarray((up - down) / (2 * _SMALL))

    late, early = (
        ends_off(ends, lens, mount, flight.seen_from(lines, step)) for step in (_DELAY_STEP_S, -_DELAY_STEP_S)
    )
    by_x, by_y, by_height = by("x_m"), by("y_m"), by("height_m")
    tilts = np.stack([by("roll_rad"), by("pitch_rad"), by("yaw_rad")], axis=-1)
    shape = (*by_x.shape,)
    states, sensors = np.zeros((*shape, STATES)), np.zeros((*shape, SENSORS))
    states[..., X], states[..., Y], states[..., HEIGHT] = by_x, by_y, by_height
    states[..., [ROLL, PITCH, PSI]] = tilts
    sensors[..., Sensor.DELAY] = (late - early) / (2 * _DELAY_STEP_S)
    for one, name in (
        (Sensor.MOUNT_ROLL, "mount_roll_rad"),
        (Sensor.MOUNT_PITCH, "mount_pitch_rad"),
        (Sensor.MOUNT_YAW, "mount_yaw_rad"),
        (Sensor.FOCAL, "log_focal"),
        (Sensor.BEND, "bend"),
    ):
        sensors[..., one] = by(name)
    told_m = flight.record.heights.at(flight.record.frame_s)[:, 0]
    sensors[..., Sensor.HEIGHT] = by_height * told_m[flight.sights.frame, None]
    across_x = (flight.sights.line < lines.across_x)[:, None]
    offset = np.where(across_x, -by_x, -by_y)
    return states, tilts, sensors, np.stack([offset, by("direction_rad")], axis=-1)


def _add_motion(chain: BorderedChain, flight: FlightState) -> None:
    """The steps from frame to frame, and the first state of each unbroken stretch."""
    states, sensors, motion = flight.states, flight.sensors, flight.motion
    start = np.flatnonzero(flight.linked)
    end = start + 1
    here = states[start]
    error = states[end] - motion.after(here, sensors)
    weight = 1.0 / motion.variances()
    by_state, by_sensors = -motion.by_states(here, sensors), -motion.by_sensors(here, sensors)
    weighed = by_state * weight[:, :, None]
    diagonal = np.arange(STATES)
    border = slice(0, SENSORS)
    chain.own[start] += np.einsum("sia,sib->sab", weighed, by_state)
    chain.own[end[:, None], diagonal, diagonal] += weight
    chain.link[start] += np.swapaxes(weighed, 1, 2)
    chain.border[start, :, border] += np.einsum("sia,sib->sab", weighed, by_sensors)
    chain.border[end, :, border] += weight[:, :, None] * by_sensors
    chain.shared[border, border] += np.einsum("sia,si,sib->ab", by_sensors, weight, by_sensors)
    chain.own_rhs[start] -= np.einsum("sia,si->sa", weighed, error)
    chain.own_rhs[end] -= weight * error
    chain.shared_rhs[border] -= np.einsum("sia,si,si->a", by_sensors, weight, error)
    first = np.setdiff1d(np.arange(len(states)), end)
    about = states[first].copy()
    about[:, [X, Y]] = about[:, [PSI]] = 0.0
    expected = np.zeros(STATES)
    expected[[ROLL, PITCH]] = sensors[[Sensor.BIAS_ROLL, Sensor.BIAS_PITCH]]
    expected[[PUSH_X, PUSH_Y]] = sensors[[Sensor.DRAUGHT_X, Sensor.DRAUGHT_Y]]
    apart = about - expected
    tight = FIRST**-2.0
    chain.own[first[:, None], diagonal, diagonal] += tight
    chain.own_rhs[first] -= tight * apart
    for state, sensor in (
        (ROLL, Sensor.BIAS_ROLL),
        (PITCH, Sensor.BIAS_PITCH),
        (PUSH_X, Sensor.DRAUGHT_X),
        (PUSH_Y, Sensor.DRAUGHT_Y),
    ):
        chain.border[first, state, sensor] -= tight[state]
        chain.shared[sensor, sensor] += tight[state] * len(first)
        chain.shared_rhs[sensor] += tight[state] * float(apart[:, state].sum())
