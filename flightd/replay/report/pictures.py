"""A few pictures of the down camera with what vision saw in them."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import cv2
import numpy as np

from flightd.core.topics import RecordedFrame, Topic
from flightd.core.types import LineKind, LineSet
from flightd.replay.log import LogReader
from flightd.replay.report.flight import FLYING, RecordedFlight
from flightd.replay.report.markup import clock, element, number, text
from flightd.vision.jpeg import decoded_jpeg

_SHOWN = 6
_WIDEST_PX = 960
_QUALITY = 82


def frames_section(flight: RecordedFlight) -> str:
    """Up to six pictures spread over the flight; a sentence where none were recorded."""
    pictures = _chosen(flight)
    if not pictures:
        return element("p", "No pictures were recorded.", class_="empty")
    return element("div", *(_figure(flight, picture) for picture in pictures), class_="frames")


def _chosen(flight: RecordedFlight) -> list[RecordedFrame]:
    """Pictures at times spread evenly over the flying phases (over all, if there are none)."""
    reader = LogReader(flight.log.path)
    stamps = [entry.stamp_ns for entry in reader.entries({Topic.FRAME})]
    flying = [
        stamp for stamp in stamps if (span := flight.phase_at(flight.seconds(stamp))) and span.phase in FLYING
    ]
    candidates = flying or stamps
    if not candidates:
        return []
    wanted = {
        candidates[round(index)]
        for index in np.linspace(0, len(candidates) - 1, min(_SHOWN, len(candidates)))
    }
    kept: dict[int, RecordedFrame] = {}
    for entry in LogReader(flight.log.path).entries({Topic.FRAME}):
        if entry.stamp_ns in wanted and isinstance(entry.message, RecordedFrame):
            kept.setdefault(entry.stamp_ns, entry.message)
    return [kept[stamp] for stamp in sorted(kept)]


def _figure(flight: RecordedFlight, picture: RecordedFrame) -> str:
    shown = _embedded(picture.jpeg)
    if shown is None:
        return ""
    url, width_px, height_px = shown
    seen = flight.line_sets.get(picture.seq)
    t_s = flight.seconds(picture.stamp_ns)
    span = flight.phase_at(t_s)
    phase = span.phase.replace("_", " ") if span else ""
    image = element(
        "img", src=url, alt=f"Down camera at {clock(t_s)}", width=width_px, height=height_px
    ).removesuffix("</img>")
    facts = [f"frame {picture.seq}"]
    if seen is not None:
        facts.append(_counted(len(seen.lines), "line"))
        spent_ms = sum(seen.timings_ms.values())
        if spent_ms > 0:  # a simulation in lockstep takes no time
            facts.append(f"{number(spent_ms, 1)} ms")
    caption = element(
        "figcaption", element("b", clock(t_s)), f" {text(phase)}", element("small", text(" · ".join(facts)))
    )
    return element("figure", element("div", image, _overlay(seen) if seen else "", class_="shot"), caption)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _embedded(jpeg: bytes) -> tuple[str, int, int] | None:
    """The picture as a data URI with its size, made smaller if it is large; None if it is no picture."""
    image = decoded_jpeg(jpeg)
    if image is None:
        return None
    height_px, width_px = image.shape[:2]
    if width_px > _WIDEST_PX:
        height_px, width_px = round(height_px * _WIDEST_PX / width_px), _WIDEST_PX
        smaller = cv2.resize(image, (width_px, height_px), interpolation=cv2.INTER_AREA)
        jpeg = cv2.imencode(".jpg", smaller, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}", width_px, height_px


def _overlay(seen: LineSet) -> str:
    """Centre line and edges of each line and a ring at each junction, in the picture's pixels."""
    left, top = -(seen.width_px - 1) / 2 - 0.5, -(seen.height_px - 1) / 2 - 0.5
    marks: list[str] = []
    for line in seen.lines:
        role = "vertical" if line.kind == LineKind.VERTICAL else "horizontal"
        centre = line.point_at(line.start_px), line.point_at(line.end_px)
        across = np.cos(line.theta_rad) * line.width_px / 2, np.sin(line.theta_rad) * line.width_px / 2
        marks += (_segment(f"edge {role}", centre, (side * across[0], side * across[1])) for side in (-1, 1))
        marks.append(_segment(f"centre {role}", centre, (0.0, 0.0)))
    marks += (
        f'<circle class="junction" cx="{number(junction.x_px)}" cy="{number(junction.y_px)}" r="9"/>'
        for junction in seen.junctions
    )
    view = f"{number(left)} {number(top)} {seen.width_px} {seen.height_px}"
    return f'<svg viewBox="{view}" preserveAspectRatio="none" aria-hidden="true">{"".join(marks)}</svg>'


def _segment(name: str, ends: Sequence[tuple[float, float]], shift: tuple[float, float]) -> str:
    (x0, y0), (x1, y1) = ((x + shift[0], y + shift[1]) for x, y in ends)
    return f'<line class="{name}" x1="{number(x0)}" y1="{number(y0)}" x2="{number(x1)}" y2="{number(y1)}"/>'
