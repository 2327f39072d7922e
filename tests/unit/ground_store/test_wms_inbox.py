"""A warehouse system's files of expected stock are taken once, wherever it is cut, or refused in a line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flightd.ground.expected_stock_book import ExpectedStockBook
from flightd.ground.uploaded_comparison import column_words, compare_upload
from tests.rigs.wms_exchange import (
    EXPECTED,
    CutError,
    Cuts,
    exchange,
    kept,
    lying,
    once,
)


@pytest.mark.parametrize(
    ("heading", "encoding"),
    [("nve;MENGE;lgpla", "cp1252"), ("Menge,LGPLA,NVE", "utf-8-sig"), ("LgPla\tNVE\tMenge", "utf-16")],
)
def test_files_are_read_however_they_are_written(place: Path, heading: str, encoding: str) -> None:
    separator = next(mark for mark in ";,\t" if mark in heading)
    row = {"lgpla": "ä-3", "nve": "PAL-1", "menge": "4"}
    names = heading.split(separator)
    text = f"{heading}\n{separator.join(row[name.casefold()] for name in names)}\n"
    (place / "in" / "Stock.CSV").write_bytes(text.encode(encoding))
    (taken,) = once(place, EXPECTED).files
    assert (taken.taken, taken.said) == (True, "1 rows")
    upload, data = kept(place)
    assert data == text.encode(encoding)
    assert (upload.name, upload.who) == ("Stock.CSV", "wms")
    asked = [
        names[n].casefold() for n in (upload.columns.place, upload.columns.code, upload.columns.quantity or 0)
    ]
    assert asked == ["lgpla", "nve", "menge"]


def test_the_newest_file_is_kept_and_one_that_comes_again_is_taken_again(place: Path) -> None:
    for text in ("A-1;PAL-1;1", "A-1;PAL-2;1", "A-1;PAL-1;1"):
        (place / "in" / "stock.csv").write_text(f"LGPLA;NVE;MENGE\n{text}\n")
        assert [file.taken for file in once(place, EXPECTED).files] == [True]
        assert kept(place)[1].decode().splitlines()[1] == text
    assert len(lying(place / "in")) == 4
    assert once(place, EXPECTED).files == []
    upload, data = kept(place)
    other = data.replace(b"PAL-1", b"PAL-3")
    ExpectedStockBook(place / "station").keep(".", upload, other)  # somebody, at the page
    (place / "in" / "stock.csv").write_bytes(data)
    assert once(place, EXPECTED).files[0].taken
    assert kept(place)[1] == data


def test_the_page_compares_with_what_was_dropped(place: Path) -> None:
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\na-1;PAL-1;12\n")
    once(place, EXPECTED)
    upload, data = kept(place)
    (place / "s.csv").write_bytes(data)
    told = json.loads(
        compare_upload(place / "station", place / "s.csv", column_words(upload.columns)).content
    )
    assert (told["rows"], told["unknown_places"], told["outcome_counts"]["uncounted"]) == (1, [], 1)


def test_a_file_that_is_written_still_is_left_alone(place: Path) -> None:
    file = place / "in" / "stock.csv"
    names = ("stock.csv.part", ".stock.csv", "x.tmp", "readme.pdf")
    for name in names:
        (place / "in" / name).touch()
    file.write_text("LGPLA;NVE;MENGE\n")

    def written_on(_: float) -> None:
        with file.open("a") as stream:
            stream.write("A-1;PAL-1;1\n")

    assert once(place, EXPECTED, sleep=written_on).files == []
    assert [taken.said for taken in once(place, EXPECTED).files] == ["1 rows"]
    assert {name for name in lying(place / "in") if "/" not in name} == set(names)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("LGPLA;SSCC;MENGE\nA-1;PAL-1;1\n", "the first line has no column 'NVE' (it says LGPLA,"),
        ("LGPLA;NVE;NVE;MENGE\nA-1;P;Q;1\n", "the first line has 2 columns 'NVE'"),
        ("LGPLA;NVE;MENGE\n", "no row can be used: it has none but the heading"),
        ("LGPLA;NVE;MENGE\nA-1;1.2E+17;1\n", "no row can be used: row 2: 1.2E+17: the spreadsheet"),
        ("LGPLA;NVE;MENGE\nB-7;PAL-1;1\n", "the inventory knows none of its places, of which the first"),
        ("\0\0", "neither text nor a workbook"),
        ('LGPLA;NVE;MENGE\n"A-1;PAL-1;1\n', "not CSV:"),
    ],
)  # fmt: skip
def test_what_is_of_no_use_is_refused_with_one_line_beside_it(place: Path, text: str, said: str) -> None:
    (place / "in" / "stock.csv").write_text(text)
    (file,) = once(place, EXPECTED).files
    assert not file.taken
    assert file.said.startswith(said)
    (refused, line) = lying(place / "in").items()
    assert refused[1] == text
    assert line == (f"{refused[0]}.txt", f"{file.said}\n")
    assert refused[0].startswith("refused/stock-")
    assert ExpectedStockBook(place / "station").kept(".") is None


def test_an_inventory_that_the_station_reads_elsewhere_has_its_prefix(place: Path) -> None:
    (place / "station").rename(place / "drones")
    (place / "station").mkdir()
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    elsewhere = EXPECTED.replace("settle_s", 'flights = ["drones"]\nsettle_s')
    (failure,) = exchange(place, elsewhere).once().failures
    assert str(failure).endswith("there is no inventory '.'; choose among drones:.")
    assert once(place, elsewhere.replace("settle_s", 'inventory = "drones:."\nsettle_s')).files[0].taken
    assert ExpectedStockBook(place / "station").kept("drones:.") is not None


def test_what_is_left_out_is_said(place: Path) -> None:
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\nA-2;PAL-2;many\nB-1;PAL-3;1\n")
    (file,) = once(place, EXPECTED).files
    assert file.said == (
        "3 rows; 1 left out: row 3: 'many' is no quantity; 1 places that the inventory does not know: B-1"
    )


def test_a_file_is_taken_once_wherever_it_is_cut(place: Path, cuts: Cuts) -> None:
    at, came = 0, True
    while came:
        at += 1
        text = f"LGPLA;NVE;MENGE\nA-1;PAL-{at};1\n"
        (place / "in" / "stock.csv").write_text(text)
        (place / "in" / "wrong.csv").write_text(f"{at}\n")
        cuts.steps, cuts.at, cuts.done = 0, at, []
        try:
            once(place, EXPECTED)
            came = False
        except CutError:
            pass
        cuts.at = 0
        once(place, EXPECTED)
        assert (cuts.done.count("keep"), kept(place)[1].decode()) == (1, text)
        lies = lying(place / "in")
        assert sorted(lies.values()).count(text) == 1
        assert len(lies) == 4 * at, lies
        assert not [name for name in lies if not name.startswith(("done/", "refused/"))]
    assert at > 20


def test_a_file_of_the_same_name_that_comes_while_one_is_claimed_is_another(place: Path, cuts: Cuts) -> None:
    (place / "in" / "stock.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    while lying(place / "in").keys() != {"taking/stock.csv"}:
        cuts.steps, cuts.at = 0, cuts.at + 1
        with pytest.raises(CutError):
            once(place, EXPECTED)
    cuts.at = 0
    (place / "in" / "stock.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-2;1\n")
    assert len(once(place, EXPECTED).files) == 2
    assert "PAL-2" in kept(place)[1].decode()
