"""A flight log as tables: one CSV file for each topic, the documents as they were."""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

import msgspec

from flightd.core.csv_text import inert
from flightd.core.errors import UnavailableError
from flightd.core.refusal import Refusal
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.core.types import LineSet
from flightd.replay.log import Entry, FlightLog

Row: TypeAlias = dict[str, object]


def export_csv(log: FlightLog, folder: Path) -> list[Path]:
    """Write the log's messages to `folder`; returns the files, UnavailableError if one cannot be written.

    Columns are the fields by name, those inside others joined by a dot; `t_s` counts from the first
    message.  A line set has a row for each line and one with empty columns where nothing was seen.
    Pictures are left out.  Texts, the names of a foreign log's fields too, are inert cells
    (`core.csv_text`).
    """
    start_ns = min((entry.stamp_ns for entry in log.entries if not _is_document(entry)), default=0)
    by_topic: dict[str, list[Entry]] = {}
    for entry in log.entries:
        if not isinstance(entry.message, RecordedFrame):
            by_topic.setdefault(entry.topic, []).append(entry)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return [_write_topic(folder, topic, entries, start_ns) for topic, entries in by_topic.items()]
    except OSError as err:
        raise UnavailableError(f"{err.filename or folder}: cannot export: {err.strerror}") from None


def _is_document(entry: Entry) -> bool:
    return isinstance(entry.message, Document)


def _write_topic(folder: Path, topic: str, entries: list[Entry], start_ns: int) -> Path:
    name = topic.strip("/").replace("/", "_") or "unnamed"
    newest = entries[-1].message
    if isinstance(newest, Document):
        path = folder / f"{name}.{'json' if newest.text.lstrip().startswith('{') else 'toml'}"
        path.write_text(newest.text, encoding="utf-8")
        return path
    path = folder / f"{name}.csv"
    rows = [row for entry in entries for row in _rows(entry, start_ns)]
    columns = list(dict.fromkeys(column for row in rows for column in row))
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, columns)
        writer.writerow({column: inert(column) for column in columns})
        writer.writerows(rows)
    return path


def _rows(entry: Entry, start_ns: int) -> Iterator[Row]:
    clock: Row = {"t_s": round((entry.stamp_ns - start_ns) / 1e9, 6)}
    message = entry.message
    if entry.topic == Topic.LINES and isinstance(message, LineSet):
        counts = {"lines": len(message.lines), "junctions": len(message.junctions)}
        base = clock | dict(_flat({**_fields(message), **counts}))
        if not message.lines:
            yield base
        for number, line in enumerate(message.lines):
            line_fields = dict(_flat(_fields(line), "line."))
            yield base | {"line": number, "line.kind": str(line.kind)} | line_fields
        return
    yield clock | dict(_flat(_fields(message)))


def _fields(message: object) -> Mapping[str, object]:
    if dataclasses.is_dataclass(message) and not isinstance(message, type):
        return {field.name: getattr(message, field.name) for field in dataclasses.fields(message)}
    return message if isinstance(message, dict) else {"value": message}


def _flat(fields: Mapping[str, object], prefix: str = "") -> Iterable[tuple[str, object]]:
    for name, value in fields.items():
        if isinstance(value, Refusal):
            yield prefix + name, inert(str(value))
        elif isinstance(value, dict) or dataclasses.is_dataclass(value):
            yield from _flat(_fields(value), f"{prefix}{name}.")
        elif isinstance(value, tuple | list):
            yield prefix + name, msgspec.json.encode(value).decode()
        elif isinstance(value, float) and math.isnan(value):
            yield prefix + name, ""
        else:
            yield prefix + name, inert(value) if isinstance(value, str) else value
