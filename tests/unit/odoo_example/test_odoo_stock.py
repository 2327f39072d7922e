"""Odoo's stock in the words of a count: every record once, and each label as it is read."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from flightd.core.errors import InputError
from tools.odoo.connector_file import OdooSection
from tools.odoo.counts import Counted, StationCounts
from tools.odoo.expected_file import expected_csv
from tools.odoo.found_labels import made_of
from tools.odoo.odoo import PAGE, Odoo
from tools.odoo.plan import Made
from tools.odoo.stock import Location, OdooStock, Product, Quant, barcodes_of, label_of, read_stock

_ASKED = OdooSection(url="http://localhost:8069", location="WH/Stock")
_GTIN = "4011200296908"


class ShelvedOdoo(Odoo):
    """Answers from rows: all that are equal where the question says so, and come after an id."""

    def __init__(self, **rows: list[dict[str, Any]]) -> None:
        super().__init__(_ASKED, "key")
        self.rows = {name.replace("_", "."): told for name, told in rows.items()}
        self.asked = 0

    def _ask(self, model: str, method: str, kind: type[Any], *, changes: bool = False, **given: Any) -> Any:
        self.asked += 1
        after = next((one[2] for one in given["domain"] if one[:2] == ["id", ">"]), 0)
        fields: list[str] = given["fields"]
        domain = given["domain"][: given["domain"].index("|")] if "|" in given["domain"] else given["domain"]
        same = [(one[0], one[2]) for one in domain if one[1] == "="]
        rows = [
            {name: row[name] for name in fields}
            for row in self.rows.get(model, [])
            if row["id"] > after and all(_is(row.get(name, value), value) for name, value in same)
        ]
        return msgspec.convert(rows[: given["limit"]], kind)


def _is(told: Any, value: Any) -> bool:
    return bool((told[0] if isinstance(told, list) else told) == value)


def _location(number: int, barcode: str | bool) -> dict[str, Any]:
    named = {"name": str(barcode), "complete_name": f"WH/{barcode}", "barcode": barcode}
    return {"id": number, "location_id": False, **named}


def _quant(number: int, location: int, **given: Any) -> dict[str, Any]:
    whole = {
        "id": number, "location_id": [location, "WH"], "product_id": [7, "Drill"], "lot_id": False,
        "package_id": False, "quantity": 1.0, "reserved_quantity": 0.0, "inventory_quantity": 0.0,
        "inventory_quantity_set": False,
    }  # fmt: skip
    return whole | given


def _stock(quants: list[dict[str, Any]], barcode: str | bool = _GTIN) -> OdooStock:
    root = {"id": 9, "name": "Stock", "complete_name": "WH/Stock", "barcode": False, "location_id": False}
    locations = [_location(1, "A-1"), _location(2, "A-2"), _location(3, "A-3"), root]
    product = {"id": 7, "barcode": barcode, "tracking": "serial"}
    odoo = ShelvedOdoo(stock_location=locations, stock_quant=quants, product_product=[product])
    return read_stock(odoo, _ASKED)


def test_every_record_comes_once_page_by_page() -> None:
    odoo = ShelvedOdoo(stock_location=[_location(n, f"A-{n}") for n in range(1, 2 * PAGE + 3)])
    found = list(odoo.records("stock.location", Location, []))
    assert [one.id for one in found] == list(range(1, 2 * PAGE + 3))
    assert odoo.asked == 3
    with pytest.raises(InputError, match=r"more than 1000 records of stock\.location; name a smaller part"):
        list(odoo.records("stock.location", Location, [], most=2 * PAGE))


@pytest.mark.parametrize(
    ("labels", "given", "barcode", "label"),
    [
        (("package", "lot"), {"package_id": (5, "PAL-1"), "lot_id": (6, "S1")}, _GTIN, "PAL-1"),
        (("lot", "package"), {"package_id": (5, "PAL-1"), "lot_id": (6, "S1")}, _GTIN, f"(01)0{_GTIN}(21)S1"),
        (("package", "lot"), {"lot_id": (6, "S1")}, False, "S1"),
        (("lot",), {"lot_id": (6, "Größe 3")}, _GTIN, "Größe 3"),
        (("package", "product"), {"lot_id": (6, "S1")}, _GTIN, _GTIN),
        (("package",), {}, _GTIN, ""),
    ],
)
def test_the_first_name_that_a_quant_has_is_on_its_label(
    labels: tuple[Any, ...], given: dict[str, Any], barcode: str | bool, label: str
) -> None:
    quant = msgspec.convert(_quant(1, 1, **given), Quant)
    assert label_of(quant, Product(7, barcode, "serial"), labels) == label


def test_a_barcode_is_looked_for_in_each_of_its_lengths() -> None:
    assert barcodes_of(f"0{_GTIN}") == [f"0{_GTIN}", _GTIN]
    assert barcodes_of("00000096385074") == ["00000096385074", "0000096385074", "000096385074", "96385074"]


def test_nothing_is_said_of_a_place_whose_goods_have_no_label() -> None:
    stock = _stock([_quant(1, 1), _quant(2, 2, package_id=[5, "=PAL"], quantity=2.5)], barcode=False)
    assert stock.expected == {"A-2": ["=PAL"], "A-3": []}
    assert expected_csv(stock).decode().splitlines() == ["place;code;quantity", "A-2;'=PAL;2.5", "A-3;;"]
    below_none = _stock([_quant(1, 1, quantity=-2.0)])
    assert below_none.left_out[-1] == "Drill at A-1: Odoo has -2 of it"
    assert "A-1" not in below_none.expected


def test_a_package_of_several_products_has_no_quantity_and_what_has_none_left_is_not_expected() -> None:
    stock = _stock(
        [_quant(1, 1, package_id=[5, "P"]), _quant(2, 1, package_id=[5, "P"]), _quant(3, 2, quantity=0.0)]
    )
    assert [(one.code, one.quantity) for one in stock.lying] == [("P", 2.0), (_GTIN, 0.0)]
    assert stock.expected == {"A-1": ["P"], "A-2": [], "A-3": []}


def test_a_location_with_others_below_it_is_an_area_and_no_place() -> None:
    hall = _location(1, "WHSTOCK") | {"complete_name": "WH/Stock"}
    bays = [_location(number, f"A-{number}") | {"location_id": [1, "WH/Stock"]} for number in (2, 3)]
    stock = read_stock(ShelvedOdoo(stock_location=[hall, *bays]), _ASKED)
    assert stock.expected == {"A-2": [], "A-3": []}
    assert stock.left_out == ("locations with others below them: 1",)


def test_what_lies_in_no_place_is_told_by_how_much_it_is() -> None:
    hall = _location(1, "WHSTOCK") | {"complete_name": "WH/Stock"}
    below = {"location_id": [1, "WH/Stock"]}
    locations = [hall, _location(2, "A-1") | below, _location(3, False) | below]
    quants = [_quant(number, location) for number, location in enumerate((1, 1, 2, 3, 1), 1)]
    product = {"id": 7, "barcode": _GTIN, "tracking": "none"}
    odoo = ShelvedOdoo(stock_location=locations, stock_quant=quants, product_product=[product])
    stock = read_stock(odoo, _ASKED)
    assert stock.expected == {"A-1": [_GTIN]}
    assert stock.left_out == (
        "locations with others below them: 1; quants that lie in them, not compared: 3",
        "locations without a barcode: 1; quants that lie in them, not compared: 1",
    )


def test_a_label_with_the_bare_number_is_the_same_serial_number() -> None:
    stock = _stock([_quant(1, 1, lot_id=[6, "SN-1"])])
    counted = msgspec.convert(
        {
            "location": "A-1", "node": "A1", "state": "several", "texts": ["sn-1", f"(01)0{_GTIN}(21)SN-1"],
            "utc": "2026-11-26T08:00:00.000Z", "run": "r", "confidence": 0.9,
        },
        Counted,
    )  # fmt: skip
    (record,) = StationCounts({"A-1": counted}).records(stock.aliases)
    assert record.texts == (f"(01)0{_GTIN}(21)SN-1",)
    assert record.texts == tuple(stock.expected["A-1"])


def test_only_a_serial_number_that_lies_nowhere_is_made() -> None:
    place = Location(1, "A-1", "WH/A-1", "A-1")
    lot = {"id": 6, "name": "SN-1", "product_id": [7, "Drill"]}

    def told(tracking: str, **rows: list[dict[str, Any]]) -> Made | str:
        product = {"id": 7, "barcode": _GTIN, "tracking": tracking}
        return made_of(ShelvedOdoo(product_product=[product], **rows), f"(01)0{_GTIN}(21)SN-1", place)

    assert told("serial", stock_lot=[lot]) == Made(location=1, product=7, lot=6)
    assert (
        told("serial", stock_lot=[lot], stock_quant=[_quant(1, 3, lot_id=[6, "SN-1"])])
        == "Odoo has it at WH: move it in Odoo"
    )
    assert "does not say how many there are" in str(told("lot", stock_lot=[lot]))
    assert "several products have a lot SN-1" in str(told("serial", stock_lot=[lot, lot | {"id": 8}]))
    assert "Odoo knows no lot or serial number SN-1" in str(told("serial"))
    assert "knows no product with the barcode" in str(made_of(ShelvedOdoo(), f"(01)0{_GTIN}(21)SN-1", place))
    sscc = "340123450002439853"
    assert f"Odoo knows no package {sscc}" in str(made_of(ShelvedOdoo(), f"00{sscc}", place))
