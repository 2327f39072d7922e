"""The file that says which Odoo and which station are connected, and which counts are trusted."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

from pydantic import Field, ValidationError

from flightd.config.mistakes import complaint
from flightd.config.schema import load_table
from flightd.config.section import Section
from flightd.core.errors import InputError

Zeroed: TypeAlias = Literal["empty_but_expected", "wrong", "missing"]
Naming: TypeAlias = Literal["package", "lot", "product"]


class OdooSection(Section):
    """The Odoo; its key is in ODOO_API_KEY."""

    url: str = Field(min_length=1, description="https://HOST, without a path")
    database: str = Field(default="", description="Which one, where a server has several")
    location: str = Field(min_length=1, description='Complete name, as "WH/Stock": it and all below it')
    place: Literal["barcode", "name", "complete_name"] = Field(
        default="barcode", description="What of a location is the code of a place of the site"
    )
    labels: tuple[Naming, ...] = Field(
        default=("package", "lot", "product"),
        min_length=1,
        description="What a label names: the first that a quant has",
    )
    timeout_s: float = Field(default=30.0, gt=0.0, le=600.0)


class ExpectedSection(Section):
    """Where the expected stock goes."""

    inbox: str = Field(min_length=1, description="As `expected.inbox` of `flightd store exchange`")


class CountsSection(Section):
    """Where counts come from, and which are trusted; the station's key is in FLIGHTD_STORE_KEY."""

    station: str = Field(min_length=1, description="https://HOST:PORT")
    site: str = Field(min_length=1, description="Of which site of its store")
    least_confidence: float = Field(default=0.9, ge=0.5, le=1.0)
    oldest_h: float = Field(default=24.0, gt=0.0, description="An older count is not booked")
    zeroed: tuple[Zeroed, ...] = Field(
        default=("empty_but_expected",),
        description="By which outcomes of the comparison nothing is left of a quant",
    )
    timeout_s: float = Field(default=30.0, gt=0.0, le=600.0)
    journal: Path = Field(default=Path("odoo-booked.jsonl"), description="What was booked, a line each")


class ConnectorFile(Section):
    """The whole file."""

    odoo: OdooSection
    expected: ExpectedSection
    counts: CountsSection


def load_connector(path: Path) -> ConnectorFile:
    """Relative paths in it are taken from its own folder.  InputError naming file, key and remedy."""
    try:
        file = ConnectorFile.model_validate(load_table(path))
    except ValidationError as err:
        found = sorted(
            err.errors(), key=lambda error: error["type"] != "extra_forbidden"
        )  # a misspelt key first
        raise InputError(complaint(found[0], ConnectorFile), file=path) from None
    here = path.resolve().parent
    inbox = file.expected.inbox if "://" in file.expected.inbox else str(here / file.expected.inbox)
    return file.model_copy(
        update={
            "expected": file.expected.model_copy(update={"inbox": inbox}),
            "counts": file.counts.model_copy(update={"journal": here / file.counts.journal}),
        }
    )
