"""The formats in which the inventory goes out to other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.inventory.export.csv_table import as_csv
from flightd.inventory.export.epcis import as_epcis
from flightd.inventory.export.json_document import as_json
from flightd.inventory.export.xlsx import as_xlsx


class Writer(Protocol):
    """Makes a file of an inventory; values are known from `least_confidence` on."""

    def __call__(
        self, records: Sequence[LocationRecord], *, least_confidence: float = LEAST_CONFIDENCE
    ) -> bytes: ...


class ExportFormat(NamedTuple):
    """The ending of its files, and what makes the bytes of one."""

    suffix: str
    write: Writer


FORMATS: Final = {
    "csv": ExportFormat(".csv", as_csv),
    "xlsx": ExportFormat(".xlsx", as_xlsx),
    "json": ExportFormat(".json", as_json),
    "epcis": ExportFormat(".jsonld", as_epcis),
}
"""By the name that `--format` takes."""

STDOUT: Final = Path("-")


def chosen_format(name: str | None, out: Path) -> ExportFormat:
    """The format of this name for the file `out`, or without a name the one that its ending says.

    CSV for stdout without a name.  InputError for a name or an ending that is none of `FORMATS`, and for
    two that contradict each other.
    """
    if name is not None and name not in FORMATS:
        raise InputError("unknown", key=f"--format {name}", remedy=f"choose one of {', '.join(FORMATS)}")
    if out == STDOUT:
        return FORMATS[name or "csv"]
    meant = next((key for key, known in FORMATS.items() if known.suffix == out.suffix.lower()), None)
    if meant is None:
        endings = ", ".join(f"{known.suffix} ({key})" for key, known in FORMATS.items())
        ending = f"ending {out.suffix}" if out.suffix else "name without an ending"
        raise InputError(f"{ending} is no format", key=f"--out {out}", remedy=f"choose one of {endings}")
    if name not in {None, meant}:
        fitting = out.with_suffix(FORMATS[name or meant].suffix).name
        raise InputError(
            f"its ending says {meant}, --format says {name}",
            key=f"--out {out}",
            remedy=f"leave --format out, or name the file {fitting}",
        )
    return FORMATS[meant]
