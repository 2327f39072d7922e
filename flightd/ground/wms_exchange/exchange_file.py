"""The file that says between which folders and by which columns is exchanged."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationError, model_validator

from flightd.config.mistakes import complaint
from flightd.config.schema import load_table
from flightd.config.section import Section
from flightd.core.errors import InputError
from flightd.core.inventory import LocationState


class CountField(enum.StrEnum):
    """What a column of an outgoing file can tell of a place."""

    SITE = "site"
    PLACE = "place"
    CODE = "code"
    """One row for each; empty where none was found."""
    STATE = "state"
    COUNTED = "counted"
    """ISO 8601, UTC."""
    RUN = "run"
    NODE = "node"
    CONFIDENCE = "confidence"
    PICTURE = "picture"
    """The name under which the store has it."""
    REFERENCE = "reference"
    """Of the question that this answers."""


class StockNames(Section):
    """What the columns are called, whatever their case."""

    place: str = Field(min_length=1)
    code: str = Field(min_length=1)
    quantity: str | None = Field(default=None, min_length=1)


class QuestionNames(Section):
    """What the columns are called, whatever their case."""

    place: str = Field(min_length=1)
    reason: str | None = Field(default=None, min_length=1)
    reference: str | None = Field(default=None, min_length=1)


class InboxSection(Section):
    """Files that come in."""

    inbox: str = Field(min_length=1, description="Folder, or URL of one")
    pattern: str = Field(default="*.csv", min_length=1, description="Of their names, whatever the case")
    settle_s: float = Field(default=10.0, ge=0.0, le=600.0, description="So long a file has to stay as it is")


class ExpectedSection(InboxSection):
    """Expected stock that comes in."""

    folder: Path = Field(description="The station's folder, as of `flightd ground --folder`")
    flights: tuple[Path, ...] = Field(default=(), description="And as of its `--flights`")
    inventory: str = Field(default=".", description="Of which inventory in them")
    columns: StockNames


class QuestionsSection(InboxSection):
    """Places that come in, of which is asked what lies there now."""

    site: str = Field(min_length=1, description="Of which site of the store")
    columns: QuestionNames


class CountsSection(Section):
    """Counts that go out.  `columns` are the names, in their order, and what stands below each."""

    outbox: str = Field(min_length=1, description="Folder, or URL of one")
    site: str = Field(min_length=1, description="Of which site of the store")
    prefix: str = Field(default="counts", pattern=r"^[A-Za-z0-9_-]{1,40}$")
    separator: Literal[";", ",", "\t", "|"] = ";"
    encoding: Literal["utf-8", "utf-8-sig", "cp1252"] = "utf-8"
    recounts: bool = Field(default=False, description="Tell of places that were found as before, too")
    columns: dict[str, CountField]
    states: dict[LocationState, str] = Field(default={}, description="Words for states")

    @model_validator(mode="after")
    def _tells_enough(self) -> Self:
        for needed in (CountField.PLACE, CountField.CODE, CountField.STATE):
            if needed not in self.columns.values():
                raise ValueError(f'no column is "{needed}", without which a count says nothing; add one')
        return self


class ExchangeFile(Section):
    """The whole file; `name` is of whom is exchanged with, and whose notes the store keeps."""

    name: str = Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")
    expected: ExpectedSection | None = None
    questions: QuestionsSection | None = None
    counts: CountsSection | None = None


def load_exchange(path: Path) -> ExchangeFile:
    """Relative paths in it are taken from its own folder.  InputError naming file, key and remedy."""
    try:
        file = ExchangeFile.model_validate(load_table(path))
    except ValidationError as err:
        found = sorted(
            err.errors(), key=lambda error: error["type"] != "extra_forbidden"
        )  # a misspelt key first
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise InputError(f"{complaint(found[0], ExchangeFile)}{more}", file=path) from None
    expected, questions, counts = file.expected, file.questions, file.counts
    if expected is None and questions is None and counts is None:
        raise InputError(
            "nothing is exchanged", file=path, remedy="add a table [expected], [questions] or [counts]"
        )
    here = path.resolve().parent
    if expected is not None:
        inbox, folder = _address(here, expected.inbox), here / expected.folder
        flights = tuple(here / path for path in expected.flights)
        expected = expected.model_copy(update={"inbox": inbox, "folder": folder, "flights": flights})
    if questions is not None:
        questions = questions.model_copy(update={"inbox": _address(here, questions.inbox)})
    if counts is not None:
        counts = counts.model_copy(update={"outbox": _address(here, counts.outbox)})
    file = file.model_copy(update={"expected": expected, "questions": questions, "counts": counts})
    _check_together(file, path)
    return file


def _check_together(file: ExchangeFile, path: Path) -> None:
    expected, questions, counts = file.expected, file.questions, file.counts
    if questions is None:
        return
    if expected is not None and (expected.inbox, expected.pattern.casefold()) == (
        questions.inbox, questions.pattern.casefold(),
    ):  # fmt: skip
        remedy = "give another folder, or another pattern"
        raise InputError("these files are expected stock", file=path, key="questions.inbox", remedy=remedy)
    if counts is not None and counts.site != questions.site:
        remedy = f"give {counts.site!r}, or leave [counts] out"
        raise InputError("counts of another site answer no question", file=path, key="questions.site",
                         remedy=remedy)  # fmt: skip


def _address(here: Path, given: str) -> str:
    return given if "://" in given else str(here / given)
