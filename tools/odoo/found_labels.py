"""A label that Odoo does not expect where it was read: which serial number it is, if it is one."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flightd.vision.shelf.code_equality import code_key
from tools.odoo.odoo import Domain, Odoo, Record
from tools.odoo.plan import Made
from tools.odoo.stock import Location, Named, Product, barcodes_of

_ARTICLE = re.compile(r"gs1:\(01\)(?P<gtin>\d{14})(?:\((?:10|21)\)(?P<lot>.+))?")
_UNIT = re.compile(r"gs1:\(00\)(?P<sscc>\d{18})")


class _Lot(Record, frozen=True):
    name: str
    product_id: tuple[int, str]


class _Package(Record, frozen=True):
    name: str
    location_id: Named


class _Whereabouts(Record, frozen=True):
    location_id: tuple[int, str]


def made_of(odoo: Odoo, text: str, location: Location) -> Made | str:
    """The quant to be made of a label at a location, or why none is: a label says which serial number lies
    there, and of nothing else how many."""
    key = code_key(text)
    article, unit = _ARTICLE.fullmatch(key), _UNIT.fullmatch(key)
    if unit is not None:
        return _package(odoo, [unit["sscc"], f"00{unit['sscc']}"]) or (
            f"Odoo knows no package {unit['sscc']}: receive it in Odoo"
        )
    if article is None:
        return _lot(odoo, text, [], location)
    barcodes = barcodes_of(article["gtin"])
    products = odoo.first("product.product", Product, [["barcode", "in", barcodes]], 2)
    if not products:
        return f"Odoo knows no product with the barcode {article['gtin']}: correct it in Odoo, or the label"
    if article["lot"] is None:
        return "its label does not say how many there are: count it in Odoo"
    return _lot(odoo, article["lot"], [product.id for product in products], location)


def _lot(odoo: Odoo, name: str, products: Sequence[int], location: Location) -> Made | str:
    of_these: Domain = [["product_id", "in", products]] if products else []
    lots = odoo.first("stock.lot", _Lot, [["name", "=", name], *of_these], 2)
    if len(lots) > 1:
        return f"several products have a lot {name}: correct the label"
    if not lots:
        return (not products and _package(odoo, [name])) or (
            f"Odoo knows no lot or serial number {name}: make it in Odoo, or correct the label"
        )
    product_id, product_name = lots[0].product_id
    tracked = odoo.first("product.product", Product, [["id", "=", product_id]], 1)
    if not tracked or tracked[0].tracking != "serial":
        return f"a lot of {product_name}: its label does not say how many there are, count it in Odoo"
    there: Domain = [["lot_id", "=", lots[0].id], ["location_id.usage", "in", ["internal", "transit"]]]
    elsewhere = odoo.first("stock.quant", _Whereabouts, [*there, ["quantity", ">", 0]], 1)
    if elsewhere:
        return f"Odoo has it at {elsewhere[0].location_id[1]}: move it in Odoo"
    return Made(location.id, product_id, lots[0].id)


def _package(odoo: Odoo, names: Sequence[str]) -> str:
    """What to do about a package; "" where there is none of these names."""
    found = odoo.first("stock.package", _Package, [["name", "in", names]], 1)
    if not found:
        return ""
    at = found[0].location_id
    return f"Odoo has the package {f'at {at[1]}' if isinstance(at, tuple) else 'empty'}: move it in Odoo"
