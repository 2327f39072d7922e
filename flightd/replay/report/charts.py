"""Values over time: one strip per quantity, all on the same time axis, the phases as shaded bands.

The drawings stretch with the page (their strokes do not); the axis labels are HTML beside them, so
that they stay legible on a phone and on paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.core.types import EventLevel, Phase
from flightd.replay.report.flight import Array, RecordedFlight
from flightd.replay.report.markup import MINUS, clock, element, number, path_data, text, thin, ticks

PHASE_TONE: dict[Phase, str] = {
    Phase.PREFLIGHT: "ground",
    Phase.RECOVER: "hold",
    Phase.ARMING: "ground",
    Phase.TAKE_OFF: "climb",
    Phase.ACQUIRE: "seek",
    Phase.FOLLOW: "follow",
    Phase.HOVER: "hover",
    Phase.TURN: "turn",
    Phase.CLIMB: "climb",
    Phase.SCAN: "hover",
    Phase.HOLD: "hold",
    Phase.RELOCATE: "hold",
    Phase.LAND: "climb",
    Phase.SWAP: "ground",
    Phase.DONE: "ground",
    Phase.ABORTED: "bad",
    Phase.PILOT: "hold",
}
"""Which of the page's colours stands for a phase."""

_FULL = 100.0
"""Height of a strip in its own units: y runs from 0 (top) to this."""


@dataclass(frozen=True, slots=True)
class ChartLine:
    """One curve; `role` is its colour on the page: estimate, smoothed, truth, setpoint or plain."""

    name: str
    role: str
    t_s: Array
    values: Array


@dataclass(frozen=True, slots=True)
class ChartStrip:
    """One chart.  `least_span` keeps a quiet curve from filling the strip with noise; `zero` puts zero
    on the axis; `symmetric` puts it in the middle."""

    title: str
    unit: str
    lines: tuple[ChartLine, ...]
    digits: int = 1
    least_span: float = 0.0
    zero: bool = False
    symmetric: bool = False

    def has_data(self) -> bool:
        return any(np.isfinite(line.values).any() for line in self.lines)

    def range(self) -> tuple[float, float]:
        """The values that the strip shows, lowest and highest."""
        values = np.concatenate([line.values[np.isfinite(line.values)] for line in self.lines])
        low, high = float(values.min()), float(values.max())
        if self.zero:
            low, high = min(low, 0.0), max(high, 0.0)
        if self.symmetric:
            high = max(abs(low), abs(high), self.least_span / 2) * 1.06
            return -high, high
        missing = max(self.least_span - (high - low), 0.0)
        margin = 0.06 * max(high - low, self.least_span, 1e-9)
        floor = 0.0 if self.zero and low == 0.0 else low - missing / 2 - margin
        return floor, high + missing / 2 + margin


def strips(flight: RecordedFlight) -> tuple[ChartStrip, ...]:
    """The charts of a flight, top to bottom; those without data are left out."""
    estimate, truth, vehicle, setpoints = flight.estimate, flight.truth, flight.telemetry, flight.setpoints
    cross = [ChartLine("estimated", "estimate", estimate.t_s, flight.cross_track_m(estimate) * 100)]
    height = [ChartLine("measured", "estimate", vehicle.t_s, vehicle.height_m)]
    heading = [ChartLine("estimated", "estimate", estimate.t_s, np.degrees(np.unwrap(estimate.yaw_rad)))]
    smoothed_m = flight.cross_track_m(flight.smoothed)
    cross.append(ChartLine("smoothed", "smoothed", flight.smoothed.t_s, smoothed_m * 100))
    if truth is not None:
        cross.append(ChartLine("true", "truth", truth.t_s, flight.cross_track_m(truth) * 100))
        height.append(ChartLine("true", "truth", truth.t_s, truth.height_m))
        heading.append(ChartLine("true", "truth", truth.t_s, np.degrees(np.unwrap(truth.yaw_rad))))
    tilt = [
        (
            ChartLine("setpoint", "setpoint", setpoints.t_s, np.degrees(wanted)),
            ChartLine("measured", "estimate", vehicle.t_s, np.degrees(measured)),
        )
        for measured, wanted in (
            (vehicle.roll_rad, setpoints.roll_rad),
            (vehicle.pitch_rad, setpoints.pitch_rad),
        )
    ]
    latency = flight.latency
    total = latency.stage("total") if "total" in latency.stages else np.array([])
    times = latency.t_s if len(total) else np.array([])
    made = (
        ChartStrip("Cross-track", "cm", tuple(cross), 1, 12.0, symmetric=True),
        ChartStrip("Height", "m", tuple(height), 2, 1.0, zero=True),
        ChartStrip("Roll", "°", tilt[0], 1, 6.0, symmetric=True),
        ChartStrip("Pitch", "°", tilt[1], 1, 6.0, symmetric=True),
        ChartStrip("Heading", "°", tuple(heading), 1, 10.0),
        ChartStrip(
            "Picture to setpoint", "ms", (ChartLine("latency", "estimate", times, total),), 1, 20.0, zero=True
        ),
        ChartStrip(
            "Battery",
            "%",
            (ChartLine("charge", "estimate", vehicle.t_s, vehicle.battery_frac * 100),),
            0,
            10.0,
        ),
    )
    return tuple(strip for strip in made if strip.has_data())


def timeline(flight: RecordedFlight, shown: Sequence[ChartStrip]) -> str:
    """The phase ribbon and all strips, one below the other on one time axis."""
    if not shown:
        return element("p", "The log holds no telemetry to draw.", class_="empty")
    duration_s = max(flight.duration_s, 1e-3)
    bands = _bands(flight)
    body = "".join(_strip(strip, duration_s, bands) for strip in shown)
    drawn = _ribbon(flight, duration_s) + body + _time_axis(duration_s)
    return _tones(flight) + element("div", drawn, class_="timeline", data_duration=number(duration_s, 3))


def _bands(flight: RecordedFlight) -> str:
    return "".join(
        f'<rect class="band {PHASE_TONE[span.phase]}" x="{number(span.start_s, 3)}" y="0" '
        f'width="{number(max(span.end_s - span.start_s, 0.0), 3)}" height="{_FULL:g}"/>'
        for span in flight.phases
    )


def _ribbon(flight: RecordedFlight, duration_s: float) -> str:
    """The phases by name, above the strips, with a mark at each warning and error; names hide where
    there is no room."""
    blocks = "".join(
        element(
            "span",
            element("b", text(_words(span.phase))),
            class_=f"block {PHASE_TONE[span.phase]}",
            style=f"left:{number(100 * span.start_s / duration_s, 3)}%;"
            f"width:{number(100 * (span.end_s - span.start_s) / duration_s, 3)}%",
            title=f"{_words(span.phase)} {clock(span.start_s)} to {clock(span.end_s)}",
            data_start=number(span.start_s, 3),
            data_end=number(span.end_s, 3),
            data_phase=_words(span.phase),
        )
        for span in flight.phases
    )
    alarms = "".join(
        element(
            "i",
            class_=f"alarm {event.level}",
            style=f"left:{number(100 * flight.seconds(event.stamp_ns) / duration_s, 3)}%",
            title=f"{clock(flight.seconds(event.stamp_ns))} {event.name.replace('_', ' ')}: {event.text}",
            data_at=number(flight.seconds(event.stamp_ns), 3),
        )
        for event in flight.events
        if event.level != EventLevel.INFO
    )
    return element(
        "div",
        element("div", blocks, class_="track"),
        element("div", alarms, class_="alarms"),
        class_="ribbon",
    )


def _tones(flight: RecordedFlight) -> str:
    """The legend of the bands: each colour with the phases it stands for."""
    names: dict[str, list[str]] = {}
    for phase in Phase:
        if any(span.phase == phase for span in flight.phases):
            names.setdefault(PHASE_TONE[phase], []).append(_words(phase))
    keys = (
        element("span", element("i", class_=f"swatch {tone}"), text(", ".join(phases)), class_="key")
        for tone, phases in names.items()
    )
    return element("div", *keys, class_="tones")


def _words(phase: Phase) -> str:
    return phase.replace("_", " ")


def _strip(strip: ChartStrip, duration_s: float, bands: str) -> str:
    low, high = strip.range()

    def down(values: Array) -> Array:
        return _FULL * (high - values) / (high - low)

    marks = ticks(low, high, 4)
    grid = "".join(
        f'<line class="grid{" zero" if mark == 0 else ""}" x1="0" x2="{number(duration_s, 3)}" '
        f'y1="{number(y)}" y2="{number(y)}"/>'
        for mark, y in ((mark, _FULL * (high - mark) / (high - low)) for mark in marks)
    )
    curves = "".join(
        f'<path class="curve {line.role}" d="{path_data(t_s, down(values))}" data-name="{text(line.name)}"/>'
        for line, (t_s, values) in ((line, thin(line.t_s, line.values)) for line in strip.lines)
    )
    labels = "".join(
        element(
            "span", text(_tick_label(mark, marks)), style=f"top:{number(100 * (high - mark) / (high - low))}%"
        )
        for mark in marks
    )
    keys = "".join(
        element("span", element("i", class_=line.role), text(line.name), element("output"), class_="key")
        for line in strip.lines
    )
    heading = element(
        "figcaption",
        element("span", text(strip.title), element("small", text(strip.unit)), class_="name"),
        keys,
    )
    drawing = (
        f'<svg class="drawing" viewBox="0 0 {number(duration_s, 3)} {_FULL:g}" preserveAspectRatio="none" '
        f'role="img" aria-label="{text(strip.title)} over time">{bands}{grid}{curves}</svg>'
    )
    plot = element("div", element("div", labels, class_="labels"), drawing, class_="plot")
    return element(
        "figure",
        heading,
        plot,
        class_="strip",
        data_low=repr(low),
        data_high=repr(high),
        data_digits=strip.digits,
        data_unit=strip.unit,
    )


def _tick_label(mark: float, marks: Sequence[float]) -> str:
    step = abs(marks[1] - marks[0]) if len(marks) > 1 else 1.0
    digits = max(0, -math.floor(math.log10(step) + 1e-9)) if step > 0 else 0
    return f"{mark:.{digits}f}".replace("-", MINUS)


def _time_axis(duration_s: float) -> str:
    step_s = next(
        (step for step in (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600) if duration_s / step <= 10),
        7200,
    )
    count = int(duration_s // step_s) + 1
    labels = "".join(
        element("span", clock(index * step_s), style=f"left:{number(100 * index * step_s / duration_s, 3)}%")
        for index in range(count)
    )
    return element("div", element("div", labels, class_="times"), class_="axis")
