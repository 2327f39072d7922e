"""Counts that changed, into a drop folder: as CSV by the other program's column names and order."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from flightd.core.errors import InputError
from flightd.core.inventory import LocationState
from flightd.core.utc_time import utc_text
from flightd.ground.ground_store.outbox import Outbox, PlaceCount
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.shared_folder import SharedFolder
from flightd.ground.wms_exchange.exchange_file import CountField, CountsSection


def deliver_counts(
    folder: SharedFolder, store: GroundStore, asked: CountsSection, name: str, file: Path
) -> Iterator[str]:
    """All that changed since the last delivery to `name`, and what it asked for; yields the names of files
    that lie there now.  Cut anywhere and begun again, it writes the same files.  InputError, which names the
    `file` that asks for it, where the store has not the site."""
    box = f"{name}/{asked.site}"
    mark = hashlib.sha256(f"{store.id}/{box}".encode()).hexdigest()[:8]
    told = Outbox(
        name=box,
        who=name,
        recounts=asked.recounts,
        file_name=lambda number: f"{asked.prefix}-{mark}-{number:06}.csv",
        content=lambda counts: counts_csv(counts, asked),
    )
    try:
        while (begun := store.next_file(asked.site, told)) is not None:
            folder.write(begun.name, begun.content)
            store.file_lies_there(box, begun.name)
            yield begun.name
    except InputError as err:
        if err.file:
            raise
        remedy = err.remedy or "flightd store show names those that there are"
        raise InputError(err.what, file=file, key=err.key or "counts.site", remedy=remedy) from None


def counts_csv(counts: Sequence[PlaceCount], asked: CountsSection) -> bytes:
    """A heading, and a line for each code of each place, one for a place without any.  InputError for a text
    that the encoding does not have."""
    out = io.StringIO()
    writer = csv.writer(out, delimiter=asked.separator, lineterminator="\r\n")
    writer.writerow(asked.columns)
    for count in counts:
        for row in _rows(count, asked):
            writer.writerow([row[field] for field in asked.columns.values()])
    try:
        return out.getvalue().encode(asked.encoding)
    except UnicodeEncodeError as err:
        raise InputError(
            f"{asked.encoding} has no {err.object[err.start]!r}, which a label has",
            key="counts.encoding",
            remedy='give "utf-8"',
        ) from None


def _rows(count: PlaceCount, asked: CountsSection) -> Iterator[dict[CountField, str]]:
    state = LocationState(count.state)
    for text in count.texts or ("",):
        yield {
            CountField.SITE: asked.site,
            CountField.PLACE: count.code,
            CountField.CODE: text,
            CountField.STATE: asked.states.get(state, state.value),
            CountField.COUNTED: utc_text(count.utc_ns) if count.utc_ns else "",
            CountField.RUN: count.run,
            CountField.NODE: count.node,
            CountField.CONFIDENCE: "" if count.confidence is None else f"{count.confidence:.3f}",
            CountField.PICTURE: count.evidence,
            CountField.REFERENCE: ", ".join(count.references),
        }
