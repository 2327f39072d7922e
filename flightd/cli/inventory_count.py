"""Counting from photographs, the expected stock, and the mission over what must be counted again."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flightd.adapters.store.sqlite import SqliteStore
from flightd.config.schema import load_table, parse_config
from flightd.core.csv_text import exact
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationRecord, LocationState, Observation, StoredRead
from flightd.core.types import Image
from flightd.studies.frame_files import list_files, read_image
from flightd.studies.progress_bar import track
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg

if TYPE_CHECKING:
    from flightd.replay.report.stock import Count


def count_pictures(folder: Path, paths: Sequence[Path], run: str) -> list[LocationRecord]:
    """Count the pictures into the inventory at `folder`; returns the locations that they show."""
    files = list_files(paths)
    with SqliteStore(folder) as store:
        for file in track(files, "counting"):
            picture = read_image(file)
            evidence = store.keep_evidence(evidence_jpeg(picture))
            store.commit(_look(file.stem, picture, file.stat().st_mtime_ns, run, evidence))
        seen = {file.stem for file in files}
        return [record for record in store.locations() if record.code in seen]


def _look(location: str, picture: Image, utc_ns: int, run: str, evidence: str) -> Observation:
    believed = [read for read in read_codes(picture) if read.believed]
    reads = tuple(
        StoredRead(read.symbology, read.text, read.sure, read.agreeing, read.quality, read.gs1)
        for read in believed
    )
    texts = {read.text for read in reads}
    if not texts:
        return Observation(run, location, utc_ns, LocationState.UNREADABLE, 0.0, evidence=evidence)
    state = LocationState.READ if len(texts) == 1 else LocationState.SEVERAL
    # one look that a checksum vouches for, or as many agreeing looks: each more halves the doubt
    doubt = max(0.5 ** (read.agreeing + read.sure) for read in reads)
    return Observation(run, location, utc_ns, state, 1.0 - doubt, reads, evidence=evidence)


def read_stock(path: Path) -> dict[str, list[str]]:
    """The expected codes of each location.  Raises InputError naming the file, the line and the remedy."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            columns = reader.fieldnames or []
            for column in ("location", "code"):
                if column not in columns:
                    raise InputError(f"{path}: no column {column!r}; the first line must name location,code")
            stock: dict[str, list[str]] = {}
            for row in reader:
                location, code = (exact((row[name] or "").strip()) for name in ("location", "code"))
                if not location:
                    raise InputError(f"{path}: line {reader.line_num}: no location")
                stock.setdefault(location, []).extend([code] if code else [])
    except OSError as err:
        raise InputError(f"{path}: cannot read the expected stock: {err.strerror or err}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8 text; save the CSV as UTF-8") from None
    except csv.Error as err:
        raise InputError(f"{path}: not CSV: {err}") from None
    return stock


def counted_beside(log: Path, inventory: Path | None = None, expected: Path | None = None) -> Count | None:
    """What was counted, for the report of `log`: the inventory in `inventory`, or beside the log if there
    is one; compared with an `expected` stock.  Raises InputError when what is asked for is missing; one that
    merely lies there and cannot be read is told and left out."""
    from flightd.inventory.comparison import compare_stock
    from flightd.replay.report.stock import Count

    stock = read_stock(expected) if expected is not None else None
    folder = inventory or log.parent
    asked = inventory is not None or stock is not None
    if not asked and not (folder / "inventory.db").exists():
        return None
    try:
        with SqliteStore(folder, create=False) as store:
            records, evidence = store.locations(), store.evidence
    except (InputError, UnavailableError) as err:
        if asked:
            raise
        print(f"flightd: {err}; the report shows the flight alone", file=sys.stderr)
        return None
    differences = compare_stock(records, stock) if stock is not None else None

    def picture(name: str) -> bytes | None:
        try:
            return evidence.path(name).read_bytes()
        except (OSError, ValueError):
            return None

    return Count(records, picture, differences)


def write_recount(
    out: Path, config: Path, doubtful: Mapping[str, str], records: Sequence[LocationRecord]
) -> list[str]:
    """Write a configuration like `config` whose mission visits the nodes of the doubtful locations.

    Returns the doubtful locations whose node nobody knows.  Raises InputError when there is nothing to
    fly to, or `out` does not stand beside `config` (paths in it are taken from there).
    """
    table = load_table(config)
    parse_config(table, config)
    if out.resolve().parent != config.resolve().parent or out.resolve() == config.resolve():
        raise InputError(f"{out}: must be a new file beside {config}: paths in it are taken from there")
    node_of = {record.code: record.node for record in records}
    nodes = list(dict.fromkeys(node for code in doubtful if (node := node_of.get(code, ""))))
    without = [code for code in doubtful if not node_of.get(code)]
    if not nodes:
        raise InputError(f"{out}: nothing to fly to: no doubtful location has a node")
    table.setdefault("mission", {})["nodes"] = nodes
    heading = [f"# Counts {len(doubtful) - len(without)} doubtful locations again:"]
    heading += [f"# {json.dumps(code)}: {why}" for code, why in doubtful.items() if code not in without]
    try:
        out.write_text("\n".join(heading) + "\n\n" + _toml(table), encoding="utf-8")
    except OSError as err:
        raise InputError(f"{out}: cannot write: {err.strerror or err}") from None
    return without


def _toml(table: Mapping[str, Any], name: str = "") -> str:
    """A table of strings, numbers, booleans, arrays and tables as TOML."""
    plain = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    parts = [f"[{name}]"] if name and plain else []
    # a JSON value of these kinds is a TOML value but for the DEL character
    parts += [
        f"{_key(key)} = {json.dumps(value, ensure_ascii=False)}".replace("\x7f", "\\u007f")
        for key, value in plain.items()
    ]
    text = "\n".join(parts) + ("\n\n" if parts else "")
    for key, value in table.items():
        if isinstance(value, Mapping):
            text += _toml(value, f"{name}.{_key(key)}" if name else _key(key))
    return text


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else json.dumps(key, ensure_ascii=False)
