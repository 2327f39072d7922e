"""The inventory's part of the page: racks, exceptions, differences, and what a click and a download give."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta

import cv2
import numpy as np

from flightd.core.inventory import LocationRecord, LocationState
from flightd.inventory.comparison import ComparisonOutcome
from flightd.inventory.export.rows import COLUMNS, rows_of
from flightd.inventory.export.value_columns import value_text
from flightd.inventory.place_values import place_values
from flightd.replay.report.markup import NOTHING, element, table, text
from flightd.replay.report.racks import STATE_NAMES, racks_section
from flightd.replay.report.stock import SETTLED, CountedStock, cases_text, fill_text, share, undecided_text
from flightd.site.site import Site
from flightd.vision.jpeg import decoded_jpeg

_PICTURES_BYTES = 12_000_000
"""All pictures in the page together, before base64; those of exceptions come first."""
_PICTURE_PX = 480
_QUALITY = 60
_ROWS = 2000
_NAMED = 20
"""So many locations are named in one sentence."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_ORDER = (
    LocationState.UNREADABLE,
    LocationState.OCCLUDED,
    LocationState.SEVERAL,
    LocationState.NOT_VISITED,
)
_REMEDIES = {
    LocationState.UNREADABLE: "look at the label",
    LocationState.OCCLUDED: "something stands before it",
    LocationState.SEVERAL: "more than one code in one place",
    LocationState.NOT_VISITED: "the flight did not get there",
}


def inventory_section(count: CountedStock, site: Site | None) -> str:
    """Racks, exceptions and differences, with the data that a click shows."""
    parts = [
        element("h2", "Racks"),
        element("p", "Point to a place to read it, press it for its picture.", class_="hint"),
        _filter_bar(count),
        racks_section(count, site),
        element("h2", "Exceptions"),
        _exceptions(count),
    ]
    if count.differences is not None:
        parts += [element("h2", "Against the expected stock"), _differences(count)]
    close = element("button", "Close", type="button", class_="close")
    dialog = element(
        "dialog", close, element("div", class_="look"), class_="look-box", aria_labelledby="look-title"
    )
    return element("section", *parts, class_="wide inventory") + dialog + _data(count)


def _filter_bar(count: CountedStock) -> str:
    """Search, choice of states and download; the script shows it, for without one it does nothing."""
    states = count.states()
    kinds = [("", "all"), ("exceptions", "exceptions")]
    kinds += [("differs", "not as expected")] if count.outcomes() else []
    kinds += [(state.value, name) for state, name in STATE_NAMES.items() if states[state]]
    choice = element(
        "select", *(element("option", name, value=value) for value, name in kinds), class_="state"
    )
    words = element("input", type="search", class_="words", autocomplete="off").replace("></input>", "/>")
    downloads = [
        element("button", f"Download {name.upper()}", type="button", data_format=name)
        for name in ("csv", "json")
    ]
    parts = [
        element("label", "Location or code ", words),
        element("label", "State ", choice),
        element("output", class_="told", aria_live="polite"),
        *downloads,
    ]
    return element("form", *parts, class_="filter", hidden="", role="search", aria_label="Locations")


def _opener(code: str) -> str:
    """What opens the picture of a row by key as well."""
    return element("button", text(code), type="button", class_="open")


def _exceptions(count: CountedStock) -> str:
    odd = [record for state in _ORDER for record in count.records if record.state is state]
    odd += [record for record in count.records if record.state not in _ORDER and _is_odd(record)]
    found = [record for record in odd if record.observation or count.task.includes(record)]
    apart = len(odd) - len(found)
    note = f"{apart:,} locations not visited are at nodes that this flight was not to count." if apart else ""
    tail = element("p", note, class_="note") if note else ""
    if not found:
        told = "None: every location was counted, each with one code or empty."
        return element("p", told, class_="empty") + tail
    rows = [_exception(record) for record in found[:_ROWS]]
    heads = ["Location", "State", "Codes", "Confidence", "Looked at", "What to do"]
    return table(heads, rows, "exceptions") + _more(len(found) - len(rows), "flightd inventory show") + tail


def _is_odd(record: LocationRecord) -> bool:
    """Whether a person should look there: by its state, or for what stayed undecided beside its codes."""
    seen = record.observation
    return record.state in _ORDER or bool(seen and seen.undecided)


def _remedy(record: LocationRecord) -> str:
    """What to do about it."""
    undecided = undecided_text(record.observation.undecided) if record.observation else ""
    known = _REMEDIES.get(record.state, "")
    return "; ".join(
        filter(None, (known, undecided and f"something else hangs there, undecided: {undecided}"))
    )


def _exception(record: LocationRecord) -> str:
    seen = record.observation
    cells = [
        element("td", _opener(record.code)),
        element("td", element("i", class_=f"cell {record.state.value}"), text(STATE_NAMES[record.state])),
        element("td", text(", ".join(record.texts) or NOTHING)),
        element("td", share(seen.confidence) if seen else NOTHING),
        element("td", _when(seen.utc_ns) if seen else NOTHING),
        element("td", text(_remedy(record))),
    ]
    return element("tr", *cells, data_code=record.code)


def _differences(count: CountedStock) -> str:
    wrong = [line for line in count.differences or () if line.outcome not in SETTLED]
    unknown = sum(line.outcome is ComparisonOutcome.UNCOUNTED for line in count.differences or ())
    note = (
        f"{unknown:,} expected codes lie where nobody could see: nothing is said of them." if unknown else ""
    )
    tail = element("p", note, class_="note") if note else ""
    if count.unknown:
        shown = ", ".join(count.unknown[:_NAMED])
        more = f" and {len(count.unknown) - _NAMED:,} more" if len(count.unknown) > _NAMED else ""
        tail += element(
            "p", text(f"Unknown to the count, misspelt or not planned: {shown}{more}."), class_="note"
        )
    if not wrong:
        return element("p", "No difference.", class_="empty") + tail
    rows = [
        element(
            "tr",
            element("td", _opener(line.location)),
            element("td", element("i", line.outcome.replace("_", " "), class_="level error")),
            element("td", text(line.text if line.outcome is not ComparisonOutcome.UNEXPECTED else NOTHING)),
            element(
                "td",
                text(line.text if line.outcome is ComparisonOutcome.UNEXPECTED else line.found or NOTHING),
            ),
            element("td", text(line.found_at or NOTHING)),
            element("td", share(line.confidence)),
            data_code=line.location,
        )
        for line in wrong[:_ROWS]
    ]
    heads = ["Location", "Outcome", "Expected", "Found there", "Found at", "Confidence"]
    return (
        table(heads, rows, "differences") + _more(len(wrong) - len(rows), "flightd inventory compare") + tail
    )


def _more(missing: int, command: str) -> str:
    return element("p", f"{missing:,} more: {command}.", class_="note") if missing > 0 else ""


def _when(utc_ns: int) -> str:
    return f"{_EPOCH + timedelta(microseconds=utc_ns // 1000):%Y-%m-%d %H:%M:%S}"


# What a click shows


def _data(count: CountedStock) -> str:
    outcomes = {code: outcome.value.replace("_", " ") for code, outcome in count.outcomes().items()}
    places = {record.code: _look(record, outcomes.get(record.code, "")) for record in count.records}
    return _block("counted", {"columns": [*COLUMNS, "outcome"], "places": places}) + _block(
        "pictures", _pictures(count, outcomes)
    )


def _look(record: LocationRecord, outcome: str) -> dict[str, object]:
    seen = record.observation
    look: dict[str, object] = {"state": record.state.value, "name": STATE_NAMES[record.state]}
    look |= {
        "texts": record.texts,
        "odd": _is_odd(record),
        "differs": bool(outcome),
        "rows": [[*row, outcome] for row in rows_of([record])],
    }
    look["facts"] = [
        [label, value]
        for label, value in (
            ("Codes", ", ".join(record.texts)),
            ("Undecided", undecided_text(seen.undecided) if seen else ""),
            ("Symbology", ", ".join(dict.fromkeys(read.symbology for read in seen.reads)) if seen else ""),
            ("Values", ", ".join(value_text(value).replace("_", " ") for value in place_values(seen))),
            ("Confidence", share(seen.confidence) if seen else ""),
            ("Filled", fill_text(seen.fill) if seen else ""),
            ("Cases", cases_text(seen.fill) if seen else ""),
            ("Looked at", f"{_when(seen.utc_ns)} UTC" if seen else ""),
            ("From node", (seen.pose.node if seen and seen.pose else record.node)),
            ("Height", f"{seen.pose.height_m:.2f} m" if seen and seen.pose else ""),
            ("Run", seen.run if seen else ""),
            ("Books", outcome),
        )
        if value
    ]
    if seen and seen.evidence:
        look["picture"] = seen.evidence
    return look


def _pictures(count: CountedStock, outcomes: Mapping[str, str]) -> dict[str, str]:
    """Small JPEGs in base64 by name, as many as the page may carry; what needs a look comes first."""

    def calm(record: LocationRecord) -> bool:
        return record.code not in outcomes and not _is_odd(record)

    shown: dict[str, str] = {}
    room = _PICTURES_BYTES
    for record in sorted(count.records, key=calm):
        name = record.observation.evidence if record.observation else ""
        data = count.picture(name) if name and name not in shown else None
        small = _small(data) if data else None
        if small is None:
            continue
        room -= len(small)
        if room < 0:
            break
        shown[name] = base64.b64encode(small).decode()
    return shown


def _small(jpeg: bytes) -> bytes | None:
    """The picture at most 480 px wide; None for a file that is no picture."""
    picture = decoded_jpeg(jpeg)
    if picture is None:
        return None
    height_px, width_px = picture.shape[:2]
    if width_px > _PICTURE_PX:
        size = (_PICTURE_PX, max(1, round(height_px * _PICTURE_PX / width_px)))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()


def _block(name: str, value: object) -> str:
    """Data for the script; nothing in it can end the element."""
    data = json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{data}</script>'
