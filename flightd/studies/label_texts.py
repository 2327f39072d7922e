"""Values of printed text from the pictures that an inventory keeps, and from photographs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.config.label_text import LabelTextConfig
from flightd.core.errors import InputError
from flightd.core.inventory import LocationState
from flightd.core.label_text import TextLine, TextLook
from flightd.core.label_values import LEAST_TEXT_CONFIDENCE, LabelValue
from flightd.core.types import Image
from flightd.studies.progress_bar import track
from flightd.vision.shelf.text_reader import TextReader
from flightd.vision.shelf.text_search import BrokenPictureError, search_name
from flightd.vision.shelf.text_values import text_values, worth_another


@dataclass(frozen=True, slots=True)
class SearchedTexts:
    """What came of a search: pictures that were searched, those searched before, those that are gone or
    broken, and the values that are sure and those that are not."""

    searched: int
    before: int
    lost: int
    sure: int
    unsure: int


def check_patterns(patterns: Sequence[LabelTextConfig], file: Path) -> None:
    """InputError for a configuration that says nothing about text."""
    if not patterns:
        remedy = 'add [[scan.text]] with kind = "lot" and pattern = "LOT\\\\s*([A-Z]\\\\d{4})"'
        raise InputError("has no [[scan.text]]", file=file, remedy=remedy)


def search_inventory(
    store: SqliteStore,
    patterns: Sequence[LabelTextConfig],
    search: Callable[[bytes], tuple[LabelValue, ...]],
    *,
    again: bool = False,
) -> SearchedTexts:
    """Search the picture of every location's newest look, but for empty ones; what was searched with the same
    patterns before only `again`."""
    asked = search_name(patterns)
    newest = [record.observation for record in store.locations() if record.observation]
    looks = [look for look in newest if look.evidence and look.state is not LocationState.EMPTY]
    searched = before = lost = 0
    found: list[LabelValue] = []
    for seen in track(looks, "reading text"):
        if not again and store.was_searched(seen.id, asked):
            before += 1
            continue
        try:
            values = search(store.evidence.path(seen.evidence).read_bytes())
        except (OSError, BrokenPictureError):
            lost += 1
            continue
        store.keep_texts(seen.id, values, asked)
        searched += 1
        found += values
    sure = sum(map(is_sure, found))
    return SearchedTexts(searched, before, lost, sure, len(found) - sure)


@dataclass(frozen=True, slots=True)
class PrintedTexts:
    """The lines of one picture and what they say of the goods."""

    lines: tuple[TextLine, ...] = ()
    values: tuple[LabelValue, ...] = ()


class PictureTexts:
    """Reads the lines of pictures.  UnavailableError where the extra `ocr` is missing."""

    def __init__(self, patterns: Sequence[LabelTextConfig]) -> None:
        self._patterns = tuple(patterns)
        self._reader = TextReader()

    def __call__(self, bgr: Image) -> PrintedTexts:
        lines = self._reader.read(bgr, lambda looks: len(looks) < 2 or worth_another(looks, self._patterns))
        return PrintedTexts(lines, text_values(lines, self._patterns))


def surest(line: TextLine) -> TextLook:
    """The look at a line whose least sure character is surest."""
    return max(line.looks, key=lambda look: min(look.sure, default=0.0))


def is_sure(value: LabelValue) -> bool:
    """Whether it is as sure as is demanded of printed text."""
    return value.confidence >= LEAST_TEXT_CONFIDENCE


def texts_json(texts: PrintedTexts, width_px: int, height_px: int) -> dict[str, object]:
    """For `flightd codes --text --json`; corners are pixels from the top left, unsure values null."""
    cx, cy = (width_px - 1) / 2, (height_px - 1) / 2
    lines = [
        {
            "text": look.text,
            "confidence": round(min(look.sure, default=0.0), 4),
            "agreed": len({other.text for other in line.looks}) == 1,
            "corners": [[round(x + cx, 1), round(y + cy, 1)] for x, y in line.corners_px],
        }
        for line in texts.lines
        for look in (surest(line),)
    ]
    values = [
        {
            "kind": value.kind.value,
            "value": value.text if is_sure(value) else None,
            "confidence": value.confidence,
        }
        for value in texts.values
    ]
    return {"lines": lines, "values": values}
