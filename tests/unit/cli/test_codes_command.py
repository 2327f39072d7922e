"""`flightd codes` as its user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import zxingcpp
from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.errors import InputError

RUNNER = CliRunner()


def run(*arguments: object) -> str:
    """Standard output of a command that must succeed."""
    result = RUNNER.invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output + repr(result.exception)
    return result.stdout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text, kind in (
        ("a.png", "PALLET-1", zxingcpp.BarcodeFormat.DataMatrix),
        ("b.png", "\x1b[31mred", zxingcpp.BarcodeFormat.QRCode),
        ("c.png", "036602301467", zxingcpp.BarcodeFormat.UPCA),
    ):
        drawing = np.asarray(zxingcpp.create_barcode(text, kind).to_image(scale=5), np.uint8)
        cv2.imwrite(str(tmp_path / name), np.pad(drawing, 60, constant_values=255))
    cv2.imwrite(str(tmp_path / "d.png"), np.full((200, 300), 90, np.uint8))
    return tmp_path


def test_json_tells_what_where_and_how_sure(folder: Path) -> None:
    images = json.loads(run("codes", folder, "--json"))["images"]
    assert [[code["text"] for code in image["codes"]] for image in images] == [
        ["PALLET-1"], ["\x1b[31mred"], ["036602301467"], [],
    ]  # fmt: skip
    (code,) = images[0]["codes"]
    assert (code["symbology"], code["checksum"], images[0]["doubtful"]) == ("Data Matrix", True, 0)
    (x0, y0), (x1, _), *_ = code["corners"]
    assert 55 < x0 < 75
    assert 55 < y0 < 75
    assert x1 > x0 + 50


def test_people_see_texts_without_terminal_controls(folder: Path) -> None:
    out = run("codes", folder / "b.png", folder / "d.png")
    assert "\x1b" not in out
    assert r"\x1b[31mred" in out
    assert "no code" in out


def test_labels_give_a_verdict(folder: Path) -> None:
    labels = folder / "expected.json"
    entries = [("a.png", "PALLET-1\r\n"), ("b.png", "green"), ("c.png", "0036602301467"), ("d.png", "gone")]
    labels.write_text(json.dumps({"codes": [{"file": f, "text": t} for f, t in entries]}))
    verdict = json.loads(run("codes", folder, "--labels", labels, "--json"))["verdict"]
    assert (verdict["expected"], verdict["read"], verdict["read_part"]) == (4, 2, 0.5)
    assert verdict["missed"] == ["b.png: green", "d.png: gone"]
    assert verdict["wrong"] == ["b.png: \x1b[31mred"]
    assert "2 of 4 codes read (50.0 %), 1 wrong texts" in run("codes", folder, "--labels", labels)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", 'no list "codes"'),
        ('{"codes": [{"file": "a.png"}]}', "codes[0]"),
        ('{"codes": [{"file": "z.png", "text": "x"}]}', "z.png"),
        ('{"texts": {}}', '"texts" is no list'),
        ('{"texts": [{"file": "a.png", "kind": "lot"}]}', "texts[0]"),
        ('{"texts": [{"file": "a.png", "kind": "colour", "value": "red"}]}', "texts[0].kind"),
        ('{"texts": [{"file": "a.png", "kind": "lot", "value": "B1203"}]}', "add --text --config"),
    ],
)
def test_bad_labels_are_refused_in_one_line(folder: Path, text: str, words: str) -> None:
    labels = folder / "expected.json"
    labels.write_text(text)
    result = RUNNER.invoke(app, ["codes", str(folder / "a.png"), "--labels", str(labels)])
    assert isinstance(result.exception, InputError)
    assert words in str(result.exception)
    assert "\n" not in str(result.exception)
