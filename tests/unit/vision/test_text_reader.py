"""Printed lines on drawn labels, with the networks of the extra; and by the commands that use them."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from flightd.adapters.store.sqlite import SqliteStore
from flightd.cli.main import app
from flightd.config.label_text import LabelTextConfig
from flightd.core.errors import UnavailableError
from flightd.core.inventory import LocationState, Observation
from flightd.core.label_text import TextLook
from flightd.core.label_values import told_text
from flightd.core.types import Image
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg
from flightd.vision.shelf.label_regions import label_regions
from flightd.vision.shelf.text_reader import TextReader
from flightd.vision.shelf.text_search import BrokenPictureError, TextSearch
from flightd.vision.shelf.text_values import text_values, worth_another

CONFIG = """
[mission]
site = "hall.toml"

[[scan.text]]
kind = "lot"
pattern = "LOT\\\\s*([A-Z]\\\\d{4})"

[[scan.text]]
kind = "expiry"
pattern = "EXP\\\\s*(\\\\S+)"
dates = ["%d.%m.%Y"]
"""


def shelf(*lines: str, cut_px: int = 0) -> Image:
    """A label with these lines, capitals 20 px high, on dark goods; `cut_px` are off its right end."""
    picture = np.full((400, 700, 3), 60, np.uint8)
    width = 420 - cut_px
    label = np.full((60 + 60 * len(lines), 420, 3), 235, np.uint8)
    for number, text in enumerate(lines):
        cv2.putText(
            label, text, (40, 70 + 60 * number), cv2.FONT_HERSHEY_SIMPLEX, 20 / 21, (20,) * 3, 2, cv2.LINE_AA
        )
    picture[80 : 80 + label.shape[0], 120 : 120 + width] = label[:, :width]
    return picture


LINES = "LOT B1203", "EXP 31.12.2026"


def test_a_region_is_looked_at_that_is_bright_and_written_on() -> None:
    picture = shelf(*LINES)
    picture[300:380, 500:690] = 230  # blank paper
    ((x0, y0, x1, y1),) = label_regions(picture)
    assert (x0, y0, x1, y1) == pytest.approx((120, 80, 540, 260), abs=20)


def test_without_the_extra_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rapidocr", None)
    with pytest.raises(UnavailableError, match=r"reading text needs what is not installed \(extra ocr\)"):
        TextReader()


def boxes(*corners: tuple[int, int, int, int]) -> list[list[tuple[int, int]]]:
    return [[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, y0, x1, y1 in corners]


class Engine:
    """Finds boxes where a test says, by the picture's height, and reads the width of what it is given."""

    found: ClassVar[dict[int, list[list[tuple[int, int]]]]] = {}
    sure: ClassVar[float] = 1.0
    turned: ClassVar[str] = "0"
    read: ClassVar[list[Image]] = []

    def __init__(self, **_: object) -> None:
        pass

    def __call__(self, bgr: Image, use_det: bool, use_cls: bool, **_: object) -> SimpleNamespace:
        if use_det:
            return SimpleNamespace(boxes=self.found.get(bgr.shape[0]))
        if use_cls:
            return SimpleNamespace(cls_res=[(self.turned, 0.99)])
        self.read.append(bgr)
        words = [SimpleNamespace(confs=[self.sure] * len(str(bgr.shape[1])))]
        return SimpleNamespace(txts=[str(bgr.shape[1])], word_results=words)


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> type[Engine]:
    one = type("OneEngine", (Engine,), {"read": []})
    monkeypatch.setitem(sys.modules, "rapidocr", SimpleNamespace(RapidOCR=one))
    return one


def fewer_than(most: int, looks: Sequence[TextLook]) -> bool:
    return len(looks) < most


BLANK = np.full((120, 200, 3), 235, np.uint8)
"""No label stands out: the whole is looked at."""


def test_pieces_of_a_line_are_one_and_a_broken_picture_is_no_fault_of_the_reader(
    engine: type[Engine],
) -> None:
    # two pieces of one line, right one first, and a line below
    engine.found = {120: boxes((90, 20, 150, 40), (20, 21, 80, 41), (20, 60, 100, 80))}
    search = TextSearch((LabelTextConfig(kind="quantity", pattern=r"(\d+)"),))
    lines = TextReader().read(BLANK)
    assert len(lines) == 2
    # 130 px long and 20 high, with 0.35 and 0.6 of that at both ends, 0.05 and 0.15 above and below
    widths = [round(144 * 48 / 22), round(154 * 48 / 26)]
    assert [look.text for look in lines[0].looks] == list(map(str, widths))
    assert search(evidence_jpeg(BLANK))
    for broken in (b"no picture", evidence_jpeg(BLANK)[:200]):
        with pytest.raises(BrokenPictureError):
            search(broken)


def test_what_is_a_line_only_from_afar_is_read_and_none_twice(engine: type[Engine]) -> None:
    engine.found = {
        120: boxes((20, 20, 80, 40)),
        60: boxes((10, 10, 40, 20), (10, 40, 80, 50)),  # the first again, and one
    }
    first, second = TextReader().read(BLANK)
    assert first.corners_px[0] == (20 - 99.5, 20 - 59.5)
    assert second.corners_px[0] == (20 - 99.5, 80 - 59.5)


def test_a_line_is_looked_at_in_other_ways_as_long_as_that_is_wanted(engine: type[Engine]) -> None:
    engine.found = {120: boxes((20, 20, 80, 40))}
    for most, looks in ((0, 1), (2, 2), (3, 3), (9, 4)):
        (line,) = TextReader().read(BLANK, partial(fewer_than, most))
        assert len(line.looks) == looks


def test_an_ill_read_line_is_turned_round_where_it_is_upside_down(engine: type[Engine]) -> None:
    picture = BLANK.copy()
    picture[20:40, 20:40] = 0  # the left third of the line
    engine.found = {120: boxes((20, 20, 80, 40))}
    for sure, turned, round_turned in ((0.5, "180", True), (0.5, "0", False), (0.95, "180", False)):
        engine.sure, engine.turned = sure, turned
        (line,) = TextReader().read(picture, lambda looks: False)
        left, right = engine.read[-1][:, :40].mean(), engine.read[-1][:, -40:].mean()
        assert (left > right) == round_turned
        assert (line.corners_px[0] == (80 - 99.5, 40 - 59.5)) == round_turned


def test_lines_are_read_and_a_cut_one_is_not_believed() -> None:
    pytest.importorskip("rapidocr")
    reader = TextReader()
    lot = LabelTextConfig(kind="lot", pattern=r"LOT\s*([A-Z]\d+)")
    whole = reader.read(shelf("LOT B2345"))
    (value,) = text_values(whole, (lot,))
    assert value.value == "B2345"
    assert value.confidence > 0.9
    ((x0, y0), _, (x1, y1), _) = whole[0].corners_px
    assert (x0 + 349.5, y0 + 199.5, x1 + 349.5, y1 + 199.5) == pytest.approx((160, 130, 330, 150), abs=25)
    cut = text_values(reader.read(shelf("LOT B2345", cut_px=235)), (lot,))
    assert all(value.confidence == 0.0 for value in cut), [told_text(value.value) for value in cut]


def test_what_is_printed_on_the_goods_beside_a_label_and_below_much_text_is_read_too() -> None:
    pytest.importorskip("rapidocr")
    picture = np.full((1000, 1000, 3), 60, np.uint8)
    picture[:400, :700] = shelf(*LINES)
    for number in range(30):
        text, x_px, y_px = f"SUGAR {number}", 40 + 480 * (number % 2), 440 + 34 * (number // 2)
        cv2.putText(picture, text, (x_px, y_px), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (220,) * 3, 2, cv2.LINE_AA)
    cv2.putText(
        picture, "USE BY 2027.03.14", (40, 975), cv2.FONT_HERSHEY_SIMPLEX, 1.0, (220,) * 3, 2, cv2.LINE_AA
    )
    patterns = (
        LabelTextConfig(kind="lot", pattern=r"LOT\s*([A-Z]\d{4})"),
        LabelTextConfig(kind="expiry", pattern=r"USE BY ?(\d{4}\.\d{2}\.\d{2})", dates=("%Y.%m.%d",)),
    )
    told = {
        str(one.kind): (told_text(one.value), one.confidence)
        for one in TextSearch(patterns)(evidence_jpeg(picture))
    }
    assert {kind: text for kind, (text, _) in told.items()} == {"lot": "B1203", "expiry": "2027-03-14"}
    assert min(sure for _, sure in told.values()) > 0.9
    lines = TextReader().read(picture, lambda looks: "USE" in looks[0].text and len(looks) < 2)
    assert {len(line.looks) for line in lines if "SUGAR" in line.looks[0].text} == {1}
    assert {len(line.looks) for line in lines if "USE" in line.looks[0].text} == {2}


@pytest.mark.parametrize("turn", [cv2.ROTATE_180, cv2.ROTATE_90_CLOCKWISE, cv2.ROTATE_90_COUNTERCLOCKWISE])
def test_turned_labels_are_read(turn: int) -> None:
    pytest.importorskip("rapidocr")
    patterns = (
        LabelTextConfig(kind="lot", pattern=r"LOT\s*([A-Z]\d{4})"),
        LabelTextConfig(kind="expiry", pattern=r"EXP\s*(\S+)", dates=("%d.%m.%Y",)),
    )
    told = TextSearch(patterns)(evidence_jpeg(np.ascontiguousarray(cv2.rotate(shelf(*LINES), turn))))
    assert {(str(one.kind), told_text(one.value)) for one in told if one.confidence > 0.9} == {
        ("lot", "B1203"), ("expiry", "2026-12-31"),
    }  # fmt: skip


def test_dots_that_stand_far_apart_are_read() -> None:
    """As a dot printer writes them, letters 110 px high: from near there is no line."""
    pytest.importorskip("rapidocr")
    small = np.zeros((14, 90), np.uint8)
    cv2.putText(small, "2027.03.14", (1, 11), cv2.FONT_HERSHEY_PLAIN, 0.8, 255, 1)
    picture = np.full((352, 1200, 3), 205, np.uint8)
    for y, x in np.argwhere(small > 110):
        cv2.circle(picture, (60 + 12 * int(x), 80 + 12 * int(y)), 2, (60,) * 3, cv2.FILLED, cv2.LINE_AA)
    asked = LabelTextConfig(kind="expiry", pattern=r"(\d{4}\.\d{2}\.\d{2})", dates=("%Y.%m.%d",))
    lines = TextReader().read(picture, lambda looks: worth_another(looks, (asked,)))
    told = text_values(lines, (asked,))
    assert [(told_text(one.value), one.confidence > 0.9) for one in told] == [("2027-03-14", True)]


def test_light_letters_on_dark_goods_have_plain_ends() -> None:
    """So that a year of two digits is not taken for one that is cut short there."""
    pytest.importorskip("rapidocr")
    picture = np.full((300, 700, 3), 40, np.uint8)
    cv2.putText(picture, "31/12/26", (150, 160), cv2.FONT_HERSHEY_SIMPLEX, 1.2, (210,) * 3, 2, cv2.LINE_AA)
    (line,) = TextReader().read(picture)
    assert {look.text for look in line.looks} == {"31/12/26"}
    assert (line.open_left, line.open_right) == (False, False)
    picture[120:170, 100:152] = 200  # something light that touches it
    assert any(line.open_left for line in TextReader().read(picture))


def test_a_line_whose_last_letter_fades_into_glare_may_go_on_there(engine: type[Engine]) -> None:
    engine.found = {120: boxes((20, 40, 116, 60))}
    for faint, burnt, is_open in ((70, 255, False), (190, 255, True), (190, 235, False)):
        picture = np.full((120, 200, 3), 235, np.uint8)
        cv2.rectangle(picture, (90, 30), (150, 52), (burnt,) * 3, cv2.FILLED)
        for x in range(24, 110, 16):
            cv2.rectangle(picture, (x, 42), (x + 6, 58), (faint if x > 100 else 60,) * 3, cv2.FILLED)
        (line,) = TextReader().read(picture)
        assert (line.open_left, line.open_right) == (False, is_open)


def test_the_commands_read_photographs_and_kept_pictures(tmp_path: Path) -> None:
    pytest.importorskip("rapidocr")
    config = tmp_path / "hall-flight.toml"
    config.write_text(CONFIG)
    photograph = tmp_path / "A-01.png"
    cv2.imwrite(str(photograph), shelf(*LINES))
    run = CliRunner()
    told = json.loads(
        run.invoke(app, ["codes", str(photograph), "--text", "--config", str(config), "--json"]).stdout
    )["images"][0]["text"]
    assert [(line["text"], line["agreed"]) for line in told["lines"]] == [(text, True) for text in LINES]
    assert [(value["kind"], value["value"]) for value in told["values"]] == [
        ("lot", "B1203"), ("expiry", "2026-12-31"),
    ]  # fmt: skip
    labels = tmp_path / "labels.json"
    texts = [{"file": "A-01.png", "kind": "lot", "value": lot, "group": "ink"} for lot in ("B1203", "B1204")]
    labels.write_text(json.dumps({"texts": texts}))
    verdict = run.invoke(
        app, ["codes", str(photograph), "--text", "--config", str(config), "--labels", str(labels)]
    ).stdout
    assert "ink: 1 of 2 values told right, 0 unknown, 1 not read" in verdict
    assert "1 values told wrong\n  wrong A-01.png: expiry 2026-12-31" in verdict
    folder = tmp_path / "inventory"
    with SqliteStore(folder) as store:
        for place, name in (("A-01", store.keep_evidence(evidence_jpeg(shelf(*LINES)))), ("A-02", "ab" * 32)):
            store.commit(Observation("r", place, 1, LocationState.UNREADABLE, 0.9, evidence=name))
    search = ["inventory", "texts", str(folder), "--config", str(config), "--json"]
    first, second = (json.loads(run.invoke(app, search).stdout) for _ in range(2))
    assert first == {"searched": 1, "before": 0, "lost": 1, "sure": 2, "unsure": 0}
    assert second == {"searched": 0, "before": 1, "lost": 1, "sure": 0, "unsure": 0}
    shown = json.loads(run.invoke(app, ["inventory", "show", str(folder), "--json"]).stdout)["locations"][0]
    assert [(value["kind"], value["value"], value["source"]) for value in shown["values"]] == [
        ("lot", "B1203", "text"), ("expiry", "2026-12-31", "text"),
    ]  # fmt: skip


def test_a_configuration_that_says_nothing_of_text_is_refused(tmp_path: Path) -> None:
    config = tmp_path / "hall.toml"
    config.write_text('[mission]\nsite = "hall.toml"\n')
    SqliteStore(tmp_path / "inventory").close()
    run = CliRunner()
    for arguments in (
        ["inventory", "texts", str(tmp_path / "inventory")],
        ["codes", str(tmp_path), "--text"],
    ):
        refused = run.invoke(app, [*arguments, "--config", str(config)])
        assert "has no [[scan.text]]; add [[scan.text]]" in str(refused.exception)
    told = run.invoke(app, ["codes", str(tmp_path), "--config", str(config)])
    assert "add --text" in str(told.exception)
