"""What was told of printed text, held against what a labels file says."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.studies.text_labels import TextVerdict, compare_texts, text_labels


def value(kind: ValueKind, text: str, confidence: float = 0.99) -> LabelValue:
    return LabelValue(kind, text, "", ValueSource.TEXT, confidence)


LABELS = text_labels(
    {
        "texts": [
            {"file": "a.jpg", "kind": "expiry", "value": "2026-12-31", "group": "dot matrix"},
            {"file": "a.jpg", "kind": "lot", "value": "B1203"},
            {"file": "b.jpg", "kind": "lot", "value": "B1204"},
            {"file": "b.jpg", "kind": "lot", "value": "B1205"},
        ]
    },
    Path("labels.json"),
)


def test_values_are_right_unknown_or_not_read_by_groups_and_what_is_printed_nowhere_is_wrong() -> None:
    told = {
        "a.jpg": [value(ValueKind.EXPIRY, "2026-12-31"), value(ValueKind.EXPIRY, "2026-12-30")],
        "b.jpg": [value(ValueKind.LOT, "B1204", 0.5), value(ValueKind.LOT, "C9", 0.5)],
        "c.jpg": [value(ValueKind.LOT, "B1205")],  # has no label
    }
    compared = compare_texts(told, LABELS)
    assert compared.groups == (TextVerdict("", 0, 1, 2), TextVerdict("dot matrix", 1, 0, 0))
    assert compared.wrong == ("a.jpg: expiry 2026-12-30",)


def test_a_label_without_its_picture_is_refused() -> None:
    with pytest.raises(InputError, match=r"b\.jpg.*not among the pictures"):
        compare_texts({"a.jpg": []}, LABELS)
