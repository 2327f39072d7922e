"""The store's tables as Parquet files, for DuckDB, pandas and the like."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flightd.core.errors import InputError, UnavailableError, cannot_write
from flightd.core.extras import missing_extra
from flightd.ground.ground_store.engine import Engine, Row
from flightd.ground.ground_store.fill_text import fill_of

_PART = 10_000
_LOOKS = (
    "SELECT observation.utc_ns, observation.id, site.name, run.name, place.code, observation.state,"
    " observation.confidence, standing, observation.node, x_m, y_m, height_m, yaw_rad, observation.evidence,"
    " reads, observation.undecided, observation.printed, again, observation.fill FROM observation"
    " JOIN place ON place.id = observation.place JOIN run ON run.id = observation.run"
    " JOIN site ON site.id = run.site WHERE observation.run = ?"
    " AND (observation.utc_ns, observation.id) > (?, ?) ORDER BY observation.utc_ns, observation.id LIMIT ?"
)
_DIFFERENCES = (
    "SELECT utc_ns, look, site.name, run.name, code, kind, state, texts, before_ns, before_state,"
    " before_texts FROM difference JOIN run ON run.id = difference.run JOIN site ON site.id = run.site"
    " WHERE difference.run = ? AND code > ? ORDER BY code LIMIT ?"
)
TABLES = {
    "observations": {
        "utc": "TIMESTAMP_NS", "id": "VARCHAR", "site": "VARCHAR", "run": "VARCHAR", "location": "VARCHAR",
        "state": "VARCHAR", "confidence": "DOUBLE", "standing": "TINYINT", "node": "VARCHAR", "x_m": "DOUBLE",
        "y_m": "DOUBLE", "height_m": "DOUBLE", "yaw_rad": "DOUBLE", "evidence": "VARCHAR", "reads": "VARCHAR",
        "undecided": "VARCHAR", "printed": "VARCHAR", "again": "BOOLEAN", "fill_asked": "BOOLEAN",
        "fill": "DOUBLE", "overhang_m": "DOUBLE", "lean_m": "DOUBLE", "case_columns": "INTEGER",
        "case_rows": "INTEGER",
    },
    "differences": {
        "utc": "TIMESTAMP_NS", "observation": "VARCHAR", "site": "VARCHAR", "run": "VARCHAR",
        "location": "VARCHAR", "change": "VARCHAR", "state": "VARCHAR", "texts": "VARCHAR",
        "before_utc": "TIMESTAMP_NS", "before_state": "VARCHAR", "before_texts": "VARCHAR",
    },
}  # fmt: skip
"""With the types of their columns."""


def export(engine: Engine, site: str, folder: Path) -> dict[str, int]:
    """Write `observations.parquet` and `differences.parquet` of one site, or of all for "", into the folder,
    which is made; the number of rows of each.  A run is read at one moment."""
    duckdb = _duckdb()
    runs = _runs(engine, site)
    written = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=".export-") as beside:
            for name, columns in TABLES.items():
                text, part = Path(beside) / f"{name}.csv", Path(beside) / f"{name}.parquet"
                written[name] = _write_csv(text, _rows(engine, name, runs))
                _convert(duckdb, text, part, columns)
                part.replace(folder / f"{name}.parquet")
    except OSError as err:
        raise cannot_write(folder, err) from None
    return written


def _duckdb() -> Any:
    try:
        import duckdb
    except ModuleNotFoundError:
        raise missing_extra("parquet", "flightd store export") from None
    return duckdb


def _runs(engine: Engine, site: str) -> list[int]:
    with engine.reading() as session:
        if not site:
            return [row[0] for row in session.rows("SELECT id FROM run ORDER BY site, began_ns, id")]
        found = session.rows("SELECT id FROM site WHERE name = ?", site)
        if not found:
            raise InputError(f"there is no site {site!r}")
        runs = session.rows("SELECT id FROM run WHERE site = ? ORDER BY began_ns, id", found[0][0])
        return [row[0] for row in runs]


def _rows(engine: Engine, table: str, runs: Sequence[int]) -> Iterator[Row]:
    for run in runs:
        with engine.reading() as session:
            mark: tuple[object, ...] = (-1, b"") if table == "observations" else ("",)
            question = _LOOKS if table == "observations" else _DIFFERENCES
            while part := session.rows(question, run, *mark, _PART):
                yield from part if table == "differences" else map(_with_fill, part)
                mark = part[-1][:2] if table == "observations" else (part[-1][4],)


def _with_fill(row: Row) -> Row:
    """A look with a cell for each figure of how full its place is."""
    *look, again, fill = row
    look.append(bool(again))
    told = fill_of(fill)
    if told is None:
        return (*look, False, None, None, None, None, None)
    cases = (told.cases.columns, told.cases.rows) if told.cases else (None, None)
    return (*look, True, told.share, told.overhang_m, told.lean_m, *cases)


def _write_csv(file: Path, rows: Iterator[Row]) -> int:
    """Every field in quotes but for those that are not there."""
    count = 0
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, quoting=csv.QUOTE_ALL, lineterminator="\n")
        for row in rows:
            writer.writerow([_cell(value) for value in row])
            count += 1
    return count


def _cell(value: object) -> object:
    if value is None:
        return _NONE
    return value.hex() if isinstance(value, bytes) else value


_NONE = "\N{EMPTY SET}"
"""A field that is not there: none of ours is called that alone."""


def _convert(duckdb: Any, text: Path, parquet: Path, columns: dict[str, str]) -> None:
    read = {name: "BIGINT" if kind == "TIMESTAMP_NS" else kind for name, kind in columns.items()}
    chosen = ", ".join(
        f"make_timestamp_ns({name}) AS {name}" if kind == "TIMESTAMP_NS" else name
        for name, kind in columns.items()
    )
    types = ", ".join(f"'{name}': '{kind}'" for name, kind in read.items())
    form = "auto_detect = false, parallel = false, header = false, delim = ',', quote = '\"', escape = '\"'"
    options = f"{form}, nullstr = '{_NONE}', columns = {{{types}}}"
    with duckdb.connect() as connection:
        try:
            connection.execute(
                f"COPY (SELECT {chosen} FROM read_csv({_quoted(text)}, {options}))"
                f" TO {_quoted(parquet)} (FORMAT parquet, COMPRESSION zstd)"
            )
        except duckdb.Error as err:
            raise UnavailableError(f"DuckDB answers: {err}", file=parquet) from None


def _quoted(path: Path) -> str:
    return "'" + str(path).replace("'", "''") + "'"
