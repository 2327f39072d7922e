"""What printed text in pictures should have said, and how what was told compares with it."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from flightd.core.errors import InputError
from flightd.core.label_values import LabelValue, ValueKind
from flightd.studies.label_texts import is_sure


@dataclass(frozen=True, slots=True)
class TextLabel:
    """A value that is printed in a picture; `group` is what it is counted with (`dot matrix`), or empty."""

    kind: ValueKind
    value: str
    group: str = ""


TextLabels: TypeAlias = Mapping[str, tuple[TextLabel, ...]]
"""The values of each picture by its file name."""


@dataclass(frozen=True, slots=True)
class TextVerdict:
    """The printed values of one group: told, read without being sure, and not read."""

    group: str
    right: int
    unknown: int
    missed: int

    @property
    def expected(self) -> int:
        return self.right + self.unknown + self.missed


@dataclass(frozen=True, slots=True)
class TextComparison:
    """The groups, and values told as sure that are not printed in their picture."""

    groups: tuple[TextVerdict, ...]
    wrong: tuple[str, ...]


def text_labels(document: Mapping[str, object], path: Path) -> TextLabels:
    """The `texts` of a labels file; none where it has none.  Raises InputError naming file and entry."""
    entries = document.get("texts", [])
    if not isinstance(entries, list):
        raise InputError(
            '"texts" is no list', file=path, remedy='write "texts": [{"file": …, "kind": …, "value": …}]'
        )
    found: dict[str, list[TextLabel]] = defaultdict(list)
    for at, entry in enumerate(entries):
        one = entry if isinstance(entry, dict) else {}
        file, kind, value, group = (one.get(key, "") for key in ("file", "kind", "value", "group"))
        if not (
            isinstance(file, str) and isinstance(value, str) and isinstance(group, str) and file and value
        ):
            raise InputError('needs "file" and "value", both texts', file=path, key=f"texts[{at}]")
        if kind not in set(ValueKind):
            raise InputError(f"{kind!r} is no kind of value", file=path, key=f"texts[{at}].kind")
        found[file].append(TextLabel(ValueKind(kind), value, group))
    return {file: tuple(labels) for file, labels in found.items()}


def compare_texts(told: Mapping[str, Sequence[LabelValue]], labels: TextLabels) -> TextComparison:
    """Hold the values told of each picture against its labels; pictures without labels are left out.  Raises
    InputError for a label whose picture is missing."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    wrong: list[str] = []
    for file, those in labels.items():
        if file not in told:
            raise InputError("is labelled, but not among the pictures", file=file)
        sure = {(value.kind, value.text): is_sure(value) for value in told[file]}
        for label in those:
            found = sure.get((label.kind, label.value))
            counts[label.group]["missed" if found is None else "right" if found else "unknown"] += 1
        known = {(label.kind, label.value) for label in those}
        wrong += [
            f"{file}: {kind} {text}"
            for (kind, text), is_told in sure.items()
            if is_told and (kind, text) not in known
        ]
    groups = tuple(
        TextVerdict(group, count["right"], count["unknown"], count["missed"])
        for group, count in sorted(counts.items())
    )
    return TextComparison(groups, tuple(wrong))
