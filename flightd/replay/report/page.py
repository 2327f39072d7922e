"""The page as a whole: template, style and script in one file that needs nothing else."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from importlib import resources
from pathlib import Path
from string import Template

from flightd import __version__
from flightd.core.errors import UnavailableError
from flightd.core.replaced_output import check_replaceable
from flightd.replay.report.charts import strips, timeline
from flightd.replay.report.figures import Figure, flight_time_s, key_figures, outcome
from flightd.replay.report.flight import RecordedFlight
from flightd.replay.report.floor_plan import floor_plan
from flightd.replay.report.latency import latency_section
from flightd.replay.report.loader import load_flight
from flightd.replay.report.markup import NOTHING, clock, element, number, table, text
from flightd.replay.report.pictures import frames_section
from flightd.replay.report.stock import CountedStock, CountTask, count_figures
from flightd.replay.report.stocktaking import inventory_section

_EVENTS_SHOWN = 400

_STOPS_OPEN = 16
"""More stops than this are folded away."""


def write_report(log: Path, out: Path, count: CountedStock | None = None) -> None:
    """Write the report of `log` to `out`, with `truth.mcap` and `summary.json` if they lie beside it, and
    with what was counted.

    Raises InputError for a log that cannot be read and for an `out` that is there and no HTML page,
    UnavailableError if it cannot be written."""
    check_replaceable(out, "<!doctype html>", "report")
    page = render(load_flight(log), count)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(page, encoding="utf-8")
    except OSError as err:
        raise UnavailableError(f"{out}: cannot write the report: {err.strerror}") from None


def render(flight: RecordedFlight, count: CountedStock | None = None) -> str:
    """The report as HTML text."""
    ending = outcome(flight)
    if count is not None:
        count = replace(count, task=CountTask(flight.nodes, flight.log.metadata.get("run", "")))
    figures = (*(count_figures(count, flight_time_s(flight)) if count else ()), *key_figures(flight))
    return Template(_file("report.html")).substitute(
        style=_file("report.css") + _file("inventory.css"),
        script=_file("report.js") + _file("inventory.js"),
        title=text(f"{ending.headline} · {_site_name(flight)}"),
        site=text(_site_name(flight)),
        tone=ending.tone,
        headline=text(ending.headline),
        detail=text(ending.detail),
        facts=_facts(flight),
        tiles="".join(_tile(figure) for figure in figures),
        inventory=inventory_section(count, flight.site) if count else "",
        plan=floor_plan(flight),
        visits=_visits(flight),
        timeline=timeline(flight, strips(flight)),
        latency=latency_section(flight.latency),
        frames=frames_section(flight),
        events=_events(flight),
        summary=_summary(flight),
        documents=_documents(flight),
        version=text(__version__),
    )


def _file(name: str) -> str:
    return resources.files("flightd.replay.report").joinpath(name).read_text(encoding="utf-8")


def _site_name(flight: RecordedFlight) -> str:
    if flight.site is not None:
        return flight.site.name
    return flight.log.metadata.get("site") or flight.log.path.name


def _facts(flight: RecordedFlight) -> str:
    """The line under the headline: when, with what, how long, and what is wrong with the log."""
    metadata = flight.log.metadata
    facts = [
        ("Started", metadata.get("started", "")),
        ("Drone", metadata.get("drone", "")),
        ("Run", metadata.get("run", "")),
        ("Vehicle", str(flight.summary.get("vehicle") or metadata.get("vehicle", ""))),
        ("Seed", str(flight.summary.get("seed", metadata.get("seed", "")))),
        ("Recorded", f"{clock(flight.duration_s)} min" if flight.duration_s else ""),
        ("Flown by", f"flightd {metadata['version']}" if "version" in metadata else ""),
        (
            "Log",
            f"{flight.log.path.name}, {flight.log.damage}" if flight.log.damage else flight.log.path.name,
        ),
    ]
    if "dropped" in metadata:
        facts.append(("Lost", f"{metadata['dropped']} messages"))
    facts.append(("Map", flight.map_error))
    return "".join(
        element("div", element("dt", label), element("dd", text(value))) for label, value in facts if value
    )


def _tile(figure: Figure) -> str:
    return element(
        "div",
        element("dt", text(figure.label)),
        element(
            "dd",
            element("b", text(figure.value)),
            element("span", text(figure.unit)) if figure.unit else "",
            class_="value",
        ),
        element("dd", text(figure.note), class_="about") if figure.note else "",
        class_=f"tile {figure.tone}".strip(),
    )


def _visits(flight: RecordedFlight) -> str:
    if not flight.visits:
        return ""
    has_truth = any(math.isfinite(visit.true_error_m) for visit in flight.visits)
    heads = ["#", "Node", "Arrived", "Dwell", *(["True error"] if has_truth else []), "Believed error"]
    rows = []
    for visit in flight.visits:
        cells = [str(visit.number), visit.node, clock(visit.start_s), f"{visit.dwell_s:.1f} s"]
        cells += [_centimetres(visit.true_error_m)] if has_truth else []
        cells.append(_centimetres(visit.believed_error_m))
        row = (element("td", text(cell)) for cell in cells)
        rows.append(element("tr", *row, data_start=number(visit.start_s, 3)))
    note = "Errors: 95th percentile of the horizontal distance from the node during the stop."
    stops = table(heads, rows, "visits") + element("p", note, class_="note")
    few = len(rows) <= _STOPS_OPEN
    title = element("summary", f"Stops ({len(rows)})")
    return element("details", title, stops, class_="stops", open="" if few else None)


def _centimetres(value_m: float) -> str:
    return f"{value_m * 100:.1f} cm" if math.isfinite(value_m) else NOTHING


def _events(flight: RecordedFlight) -> str:
    if not flight.events:
        return element("p", "Nothing was reported.", class_="empty")
    rows = [
        element(
            "tr",
            element("td", clock(flight.seconds(event.stamp_ns))),
            element("td", element("i", text(event.level), class_=f"level {event.level}")),
            element("td", text(event.name.replace("_", " "))),
            element("td", text(event.text)),
            data_start=number(flight.seconds(event.stamp_ns), 3),
        )
        for event in flight.events[:_EVENTS_SHOWN]
    ]
    shown = table(["Time", "Level", "Event", ""], rows, "events")
    missing = len(flight.events) - len(rows)
    return shown + (element("p", f"{missing} more in the log.", class_="note") if missing > 0 else "")


def _summary(flight: RecordedFlight) -> str:
    """Every field of summary.json, as it stands there."""
    if not flight.summary:
        return ""
    rows = [
        element("tr", element("th", text(key), scope="row"), element("td", text(_plain(value))))
        for key, value in flight.summary.items()
    ]
    return element("details", element("summary", "All figures"), element("table", *rows, class_="plain"))


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(item)}" for key, item in value.items())
    if isinstance(value, float):
        return number(value, 4)
    return value if isinstance(value, str) else json.dumps(value)


def _documents(flight: RecordedFlight) -> str:
    if not flight.config.strip():
        return ""
    return element("details", element("summary", "Configuration"), element("pre", text(flight.config)))
