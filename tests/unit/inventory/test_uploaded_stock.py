"""The books as people upload them: whatever program wrote them, read right, or refused in one line."""

from __future__ import annotations

import io
import random
import time
import zipfile
from collections.abc import Sequence

import pytest
import xlsxwriter
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.inventory.stock_columns import StockColumns, guess_columns
from flightd.inventory.stock_table import MOST_BYTES, MOST_CHARACTERS, MOST_COLUMNS, read_table
from flightd.inventory.uploaded_stock import uploaded_stock
from tests.fuzz.mutate import spoil_bytes

PLACES = ("AL-01-1-1", "AL-01-1-2", "AL-02-1-1")
CODES = ("00340123450002439853", "4006381333931")
ROWS = (("AL-01-1-1", "340123450002439853"), ("AL-01-1-2", "4006381333931"), ("AL-02-1-1", ""))


def workbook(rows: Sequence[Sequence[object]]) -> bytes:
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"in_memory": True})
    sheet = book.add_worksheet()
    for number, row in enumerate(rows):
        sheet.write_row(number, 0, row)
    book.close()
    return out.getvalue()


def packed(parts: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as package:
        for name, content in parts.items():
            package.writestr(name, content)
    return out.getvalue()


@pytest.mark.parametrize("separator", [";", ",", "\t", "|"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_csv_is_read_however_it_is_written(separator: str, encoding: str, end: str) -> None:
    lines = [("Lagerplatz", "Stück", "Artikel"), *((place, "1", code) for place, code in ROWS)]
    table = read_table(end.join(separator.join(line) for line in lines).encode(encoding))
    assert table.rows[0] == ("Lagerplatz", "Stück", "Artikel")
    columns = guess_columns(table, (), ())
    assert columns == StockColumns(0, 2, 1, heading=True)
    stock = uploaded_stock(table, columns)
    assert stock.expected == {place: [code] if code else [] for place, code in ROWS}
    assert stock.problems == ()


def test_a_workbook_is_read_with_its_numbers_as_codes() -> None:
    table = read_table(
        workbook([("code", "bin"), (4006381333931, "AL-01-1-2"), (None, None), ("P 7", "AL-02-1-1")])
    )
    assert (table.kind, table.numbers) == ("XLSX", (1, 2, 4))
    assert uploaded_stock(table, guess_columns(table, (), ())).expected == {
        "AL-01-1-2": ["4006381333931"],
        "AL-02-1-1": ["P 7"],
    }


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (("location", "code"), (0, 1, None)),
        (("CODE", "LOCATION"), (1, 0, None)),
        (("Barcode", "Qty on hand", "Bin location"), (2, 0, 1)),
        (("Artikelnummer", "Menge", "Lagerplatz"), (2, 0, 1)),
        (("Emplacement", "Code-barres", "Quantité"), (0, 1, 2)),
        (("Ubicación", "SSCC", "Artículo"), (0, 1, None)),
        (("remark", "storage bin", "handling unit"), (1, 2, None)),
    ],
)
def test_columns_are_guessed_by_their_names(
    names: Sequence[str], columns: tuple[int, int, int | None]
) -> None:
    rows = [";".join(names), ";".join("1" * len(names))]
    guessed = guess_columns(read_table("\n".join(rows).encode()), (), ())
    assert (guessed.place, guessed.code, guessed.quantity) == columns


def test_columns_without_names_are_guessed_by_what_the_count_knows() -> None:
    table = read_table(b"x;340123450002439853;al-01-1-1\ny;4006381333931;al-01-1-2\n")
    assert guess_columns(table, PLACES, CODES) == StockColumns(2, 1, None, heading=False)
    table = read_table(b"A;B;C\nx;340123450002439853;al-01-1-1\n")
    assert guess_columns(table, PLACES, CODES) == StockColumns(2, 1, None, heading=True)


def test_a_quantity_of_zero_expects_nothing_and_others_are_kept() -> None:
    table = read_table(b'place,code,qty\nA,X,0\nA,Y,0.00\nB,X,12\nB,Y,"1.200,5"\nC,Z,-1\nC,Z,many\nC,Z,\n')
    stock = uploaded_stock(table, StockColumns(0, 1, 2))
    assert stock.expected == {"A": [], "B": ["X", "Y"], "C": ["Z"]}
    assert [stock.quantity(*pair) for pair in (("b", "X"), ("B", "y"), ("C", "Z"), ("A", "X"))] == [
        "12", "1.200,5", "", ""
    ]  # fmt: skip
    assert stock.problems == ("row 6: '-1' is no quantity", "row 7: 'many' is no quantity")


@pytest.mark.parametrize(
    "data",
    [
        b"place,code\nA,3.40123E+17\n",
        b"place;code\nA;3,40123E+17\n",
        workbook([("place", "code"), ("A", 340123450002439853)]),
    ],
)
def test_a_code_that_a_spreadsheet_has_rounded_is_not_compared(data: bytes) -> None:
    stock = uploaded_stock(read_table(data), StockColumns(0, 1))
    assert stock.expected == {}
    assert "has rounded this code" in stock.problems[0]


def test_a_row_without_a_place_is_named() -> None:
    stock = uploaded_stock(read_table(b"place,code\n,X\nA,Y\n"), StockColumns(0, 1))
    assert (stock.expected, stock.problems) == ({"A": ["Y"]}, ("row 2: no place",))


def test_cells_that_were_made_inert_are_read_back() -> None:
    assert read_table(b"place,code\nA,'=1+2\n").rows[1] == ("A", "=1+2")


DTD = b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa">]><x>&a;</x>'


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "has not two columns"),
        (b"\n \n;;\n", "has not two columns"),
        (b"only one column\nA\n", "has not two columns"),
        (b"a;b\n" * 100_001, "more than 100,000 rows; upload it in parts"),
        (b"a" * (MOST_BYTES + 1), "more than 8 MB"),
        (b"a;b\n\x00\x01;c\n", "neither text nor a workbook"),
        (b"\xff\xfea;b\n\x00", "neither text nor a workbook"),
        (b"a;b\n\x81;\x8d\n", "neither text nor a workbook"),
        (b'a;b\n"c;d\n', "not CSV: unexpected end of data"),
        (b";".join([b"x"] * (MOST_COLUMNS + 1)), "row 1 has more than 60 columns"),
        (b"a;" + b"b" * (MOST_CHARACTERS + 1), "row 1 has a cell of more than 500 characters"),
        (b"a;" + b"b" * 200_000, "not CSV: field larger than field limit"),
        (b"\xd0\xcf\x11\xe0 and so on", "an old or an encrypted workbook"),
        (b"PK\x03\x04 and nothing more", "not a workbook, or a damaged one"),
        (packed({"readme.txt": b"no workbook"}), "not a workbook, or a damaged one"),
        (packed({"xl/workbook.xml": DTD}), "holds a document type definition"),
        (packed({"xl/workbook.xml": DTD[21:].decode().encode("utf-16")}), "holds a document type definition"),
        (packed({"xl/a.xml": b" " * 100_000_001}), "too large when it is unpacked"),
        (packed({f"xl/{i}.xml": b"" for i in range(501)}), "too large when it is unpacked"),
        (packed({"xl/workbook.bin": DTD}), "holds a document type definition"),
        (packed({"x": b" " * ((1 << 20) - 60) + DTD}), "holds a document type definition"),
    ],
)  # fmt: skip
def test_what_is_no_table_is_refused_in_one_line(data: bytes, said: str) -> None:
    with pytest.raises(InputError) as refused:
        read_table(data)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def with_sheet(xml: bytes, part: str = "xl/worksheets/sheet1.xml") -> bytes:
    """A good workbook with another first sheet, which may lie elsewhere."""
    with zipfile.ZipFile(io.BytesIO(workbook(ROWS))) as package:
        parts = {name: package.read(name) for name in package.namelist()}
    del parts["xl/worksheets/sheet1.xml"]
    relations = "xl/_rels/workbook.xml.rels"
    parts[relations] = parts[relations].replace(b"worksheets/sheet1.xml", part.removeprefix("xl/").encode())
    parts["[Content_Types].xml"] = parts["[Content_Types].xml"].replace(
        b"/xl/worksheets/sheet1.xml", f"/{part}".encode()
    )
    return packed({**parts, part: xml})


SHEET = (
    '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    '<row r="1"><c r="A1"><v>1</v></c><c r="B1"><v>2</v></c></row>{}</sheetData></worksheet>'
)


@pytest.mark.parametrize(
    "data",
    [
        with_sheet(SHEET.format("<row r='99999999999'><c><v>1</v></c></row>").encode()),
        with_sheet(SHEET.format('<row r="99999999999"/>').encode("utf-16")),
        with_sheet(SHEET.format('<row r="200001"/>').encode(), "xl/worksheets/sheet1.bin"),
        with_sheet(SHEET.format("<row/>" * 200_001).encode()),
    ],
    ids=["single quotes", "UTF-16", "another name", "no numbers"],
)
def test_a_sheet_without_an_end_is_refused_however_it_is_written(data: bytes) -> None:
    with pytest.raises(InputError, match="rows beyond 200,000"):
        read_table(data)


def test_rows_that_never_close_take_no_longer_than_they_are_long() -> None:
    began_s = time.process_time()
    with pytest.raises(InputError):
        read_table(packed({"xl/worksheets/sheet1.xml": b"<row " * 400_000}))
    assert time.process_time() - began_s < 5.0, "its square would take minutes"


@pytest.mark.parametrize("columns", [(0, 0, None), (0, 2, None), (-1, 1, None), (0, 1, 1), (0, 1, 5)])
def test_columns_that_are_none_are_refused(columns: tuple[int, int, int | None]) -> None:
    with pytest.raises(InputError, match=r"the table has 2 columns|in different columns"):
        uploaded_stock(read_table(b"a,b\n1,2\n"), StockColumns(*columns))


@given(st.binary(max_size=400))
def test_any_bytes_are_a_table_or_refused(data: bytes) -> None:
    try:
        table = read_table(data)
    except InputError:
        return
    uploaded_stock(table, guess_columns(table, PLACES, CODES))


@settings(max_examples=150)
@given(st.integers(0, 10**9))
def test_a_spoilt_workbook_is_a_table_or_refused(seed: int) -> None:
    whole = workbook([("place", "code"), *ROWS])
    spoilt = spoil_bytes(random.Random(seed), [whole])
    with zipfile.ZipFile(io.BytesIO(whole)) as package:
        parts = {part: package.read(part) for part in package.namelist()}
    part = random.Random(seed).choice(sorted(parts))
    inside = packed({**parts, part: spoil_bytes(random.Random(seed), [parts[part]])})
    for data in (spoilt, inside):
        try:
            table = read_table(data)
        except InputError:
            continue
        uploaded_stock(table, guess_columns(table, PLACES, CODES))
