"""Codes in pictures: what was read, and how it compares with what should have been."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TypeAlias

from rich.console import Console

from flightd.core.errors import InputError
from flightd.core.terminal_text import visible
from flightd.core.types import CodeRead
from flightd.studies.frame_files import all_pictures
from flightd.studies.label_texts import PictureTexts, PrintedTexts, is_sure, surest, texts_json
from flightd.studies.text_labels import TextComparison, TextLabels, compare_texts, text_labels
from flightd.vision.shelf.code_reader import read_codes

Expected: TypeAlias = Mapping[str, frozenset[str]]
"""The texts of each picture by its file name."""


@dataclass(frozen=True, slots=True)
class ReadPicture:
    """What was read in one picture, and how long that took; None for texts that nobody asked for."""

    name: str
    width_px: int
    height_px: int
    ms: float
    reads: tuple[CodeRead, ...]
    texts: PrintedTexts | None = None

    @property
    def believed(self) -> tuple[CodeRead, ...]:
        return tuple(read for read in self.reads if read.believed)


@dataclass(frozen=True, slots=True)
class ReadVerdict:
    """Reads against the labels: codes expected, read with exactly their text, and texts told that no
    label of the picture knows."""

    expected: int
    read: int
    missed: tuple[str, ...]
    wrong: tuple[str, ...]
    ms_median: float

    @property
    def read_part(self) -> float:
        return self.read / self.expected if self.expected else 1.0


def read(paths: Sequence[Path], texts: PictureTexts | None = None) -> Iterator[ReadPicture]:
    """Read every picture that `paths` mean, in order; `texts` reads printed lines, too."""
    for picture in all_pictures(paths, "reading"):
        start = perf_counter()
        reads = read_codes(picture.bgr)
        ms = (perf_counter() - start) * 1e3
        printed = texts(picture.bgr) if texts else None
        yield ReadPicture(picture.name, picture.bgr.shape[1], picture.bgr.shape[0], ms, reads, printed)


@dataclass(frozen=True, slots=True)
class LabelsFile:
    """What a labels file expects of pictures; no codes where it has no list of them."""

    codes: Expected | None
    texts: TextLabels


def read_labels(path: Path) -> LabelsFile:
    """What a labels file expects: codes, printed texts, or both.  Raises InputError naming file and entry."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise InputError(f"cannot read the labels: {err.strerror or err}", file=path) from None
    except (ValueError, RecursionError) as err:
        raise InputError(f"not JSON: {err}", file=path) from None
    if not isinstance(document, dict):
        document = {}
    if "codes" not in document and "texts" in document:
        return LabelsFile(None, text_labels(document, path))
    entries = document.get("codes")
    if not isinstance(entries, list):
        remedy = 'write {"codes": [{"file": …, "text": …}]}'
        raise InputError('has no list "codes"', file=path, remedy=remedy)
    texts: dict[str, set[str]] = defaultdict(set)
    for i, entry in enumerate(entries):
        file, text = (entry.get("file"), entry.get("text")) if isinstance(entry, dict) else (None, None)
        if not isinstance(file, str) or not isinstance(text, str):
            raise InputError('needs "file" and "text", both strings', file=path, key=f"codes[{i}]")
        texts[file].add(_plain(text))
    codes = {file: frozenset(those) for file, those in texts.items()}
    return LabelsFile(codes, text_labels(document, path))


def compare(pictures: Sequence[ReadPicture], expected: Expected) -> ReadVerdict:
    """Hold the believed reads against the labels; pictures without a label are left out."""
    told = {Path(picture.name).name: picture for picture in pictures}
    missed, wrong, read_count, count = [], [], 0, 0
    for file, texts in expected.items():
        picture = told.get(file)
        if picture is None:
            raise InputError("is labelled, but not among the pictures", file=file)
        seen = {_plain(read.text) for read in picture.believed}
        count += len(texts)
        read_count += len(texts & seen)
        missed += [f"{file}: {text}" for text in sorted(texts - seen)]
        wrong += [f"{file}: {text}" for text in sorted(seen - texts)]
    times = [picture.ms for picture in pictures]
    return ReadVerdict(count, read_count, tuple(missed), tuple(wrong), median(times) if times else 0.0)


def _plain(text: str) -> str:
    """Texts that mean the same code: line ends at its end aside, an EAN-13 of a UPC-A as UPC-A."""
    bare = text.strip()
    return bare[1:] if len(bare) == 13 and bare.startswith("0") and bare.isdecimal() else bare


def compared_texts(pictures: Sequence[ReadPicture], labels: TextLabels) -> TextComparison:
    """Hold what printed text was told to say against the labels."""
    told = {Path(one.name).name: one.texts.values for one in pictures if one.texts is not None}
    return compare_texts(told, labels)


def as_json(pictures: Sequence[ReadPicture], expected: LabelsFile | None) -> str:
    """The one JSON document of `flightd codes --json`; corners are pixels from the top left."""
    document: dict[str, object] = {"images": [_image(picture) for picture in pictures]}
    if expected is not None and expected.codes is not None:
        verdict = compare(pictures, expected.codes)
        document["verdict"] = asdict(verdict) | {"read_part": round(verdict.read_part, 5)}
    if expected is not None and expected.texts:
        document["text_verdict"] = asdict(compared_texts(pictures, expected.texts))
    return json.dumps(document, indent=1, ensure_ascii=False)


def _image(picture: ReadPicture) -> dict[str, object]:
    cx, cy = (picture.width_px - 1) / 2, (picture.height_px - 1) / 2
    codes = [
        {
            "symbology": read.symbology,
            "text": read.text,
            "corners": [[round(x + cx, 1), round(y + cy, 1)] for x, y in read.corners_px],
            "checksum": read.sure,
            "agreeing": read.agreeing,
            "quality": read.quality,
            "gs1": dict(read.gs1),
            "gs1_problem": read.gs1_problem,
        }
        for read in picture.believed
    ]
    printed = picture.texts and {"text": texts_json(picture.texts, picture.width_px, picture.height_px)}
    return {
        "path": picture.name,
        "width": picture.width_px,
        "height": picture.height_px,
        "ms": round(picture.ms, 3),
        "codes": codes,
        "doubtful": len(picture.reads) - len(picture.believed),
        **(printed or {}),
    }


def print_picture(picture: ReadPicture, console: Console) -> None:
    """One picture for people."""
    title = f"{picture.name}  {picture.width_px}x{picture.height_px}  {picture.ms:.1f} ms"
    console.print(title, style="bold", highlight=False, markup=False, soft_wrap=True)
    for read in picture.believed:
        how = "checksum" if read.sure else f"{read.agreeing} reads agree"
        line = f"  {read.symbology:<12} {visible(read.text)}  ({how})"
        console.print(line, highlight=False, markup=False, soft_wrap=True)
        for ai, value in read.gs1:
            console.print(f"    ({ai}) {value}", highlight=False, markup=False)
        if read.gs1_problem:
            console.print(f"    no valid GS1: {read.gs1_problem}", highlight=False, markup=False)
    doubtful = len(picture.reads) - len(picture.believed)
    if not picture.believed:
        console.print("  no code")
    if doubtful:
        console.print(f"  {doubtful} doubtful, not told")
    if picture.texts is not None:
        _print_texts(picture.texts, console)


def _print_texts(texts: PrintedTexts, console: Console) -> None:
    """Lines as they are read, and what they say."""
    for line in texts.lines:
        look = surest(line)
        told = f"  line         {visible(look.text)}  ({min(look.sure, default=0.0):.2f})"
        console.print(told, highlight=False, markup=False, soft_wrap=True)
    for value in texts.values:
        text = visible(value.text) if is_sure(value) else "unknown"
        told = f"  {value.kind:<12} {text}  ({value.confidence:.2f})"
        console.print(told, highlight=False, markup=False, soft_wrap=True)


def print_verdict(verdict: ReadVerdict, console: Console) -> None:
    """The comparison for people."""
    share = f"{verdict.read} of {verdict.expected} codes read ({100 * verdict.read_part:.1f} %)"
    console.print(
        f"{share}, {len(verdict.wrong)} wrong texts, median {verdict.ms_median:.1f} ms", style="bold"
    )
    for kind, those in (("missed", verdict.missed), ("wrong", verdict.wrong)):
        for entry in those:
            console.print(f"  {kind} {visible(entry)}", highlight=False, markup=False, soft_wrap=True)


def print_texts_verdict(compared: TextComparison, console: Console) -> None:
    """The comparison of printed values for people."""
    for one in compared.groups:
        name = f"{visible(one.group)}: " if one.group else ""
        counts = (
            f"{one.right} of {one.expected} values told right, {one.unknown} unknown, {one.missed} not read"
        )
        console.print(name + counts, style="bold", highlight=False, markup=False, soft_wrap=True)
    console.print(f"{len(compared.wrong)} values told wrong", style="bold")
    for entry in compared.wrong:
        console.print(f"  wrong {visible(entry)}", highlight=False, markup=False, soft_wrap=True)
