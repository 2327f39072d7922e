"""What Odoo says lies where, in the words of a count: places and the codes on labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from flightd.core.errors import InputError
from flightd.vision.shelf.code_equality import code_key
from tools.odoo.connector_file import Naming, OdooSection
from tools.odoo.odoo import PAGE, Domain, Odoo, Record

Named: TypeAlias = tuple[int, str] | bool
"""A record of another model with its name; false where there is none."""
Text: TypeAlias = str | bool


class Location(Record, frozen=True):
    """`location_id` is the one that it lies below."""

    name: str
    complete_name: str
    barcode: Text
    location_id: Named = False


class Product(Record, frozen=True):
    barcode: Text
    tracking: str


class Quant(Record, frozen=True):
    """So many of a product at a location, of one lot, in one package, of one owner."""

    location_id: tuple[int, str]
    product_id: tuple[int, str]
    lot_id: Named
    package_id: Named
    quantity: float
    reserved_quantity: float
    inventory_quantity: float
    inventory_quantity_set: bool


@dataclass(frozen=True, slots=True)
class Lying:
    """What one label stands for: quants of one code at one place."""

    place: str
    code: str
    quants: tuple[Quant, ...]

    @property
    def quantity(self) -> float | None:
        """None where it is of several products."""
        alone = len({quant.product_id[0] for quant in self.quants}) == 1
        return sum(quant.quantity for quant in self.quants) if alone else None


@dataclass(frozen=True, slots=True)
class OdooStock:
    """`places` are all locations by what a count calls them, `lying` what has a label; `left_out` says in a
    line each what of Odoo's stock no count can be compared with."""

    places: Mapping[str, Location]
    lying: tuple[Lying, ...]
    left_out: tuple[str, ...]
    untold: frozenset[str]
    """The places of what is left out: that nothing else may be there is not known of them."""
    aliases: Mapping[str, str]
    """The codes of labels by what else may be printed there: the key of a lot's bare name."""

    @property
    def expected(self) -> dict[str, list[str]]:
        """The codes of every place; an empty place has none."""
        found: dict[str, list[str]] = {place: [] for place in self.places if place not in self.untold}
        for one in self.lying:
            if any(quant.quantity > 0 for quant in one.quants):
                found.setdefault(one.place, []).append(one.code)
        return found


def read_stock(odoo: Odoo, asked: OdooSection) -> OdooStock:
    """InputError where Odoo has not the location, or no places below it."""
    root = _root(odoo, asked)
    places, others = _places(odoo, asked, root)
    named = {location.id: place for place, location in places.items()}
    goods = list(odoo.records("stock.quant", Quant, _goods_below(root)))
    left_out = [_told_of(kind, locations, goods) for kind, locations in others.items() if locations]
    quants = [quant for quant in goods if quant.location_id[0] in named]
    products = _products(odoo, quants)
    found: dict[tuple[str, str], list[Quant]] = {}
    named_so: dict[str, set[str]] = {}
    untold: set[str] = set()
    for quant in quants:
        place = named[quant.location_id[0]]
        code = label_of(quant, products[quant.product_id[0]], asked.labels)
        if not code or quant.quantity < 0:
            untold.add(place)
        if not code:
            left_out.append(
                f"{quant.product_id[1]} at {place}: no label names it; give the product a barcode"
            )
        elif quant.quantity < 0:
            left_out.append(f"{quant.product_id[1]} at {place}: Odoo has {quant.quantity:g} of it")
        else:
            found.setdefault((place, code), []).append(quant)
            if isinstance(quant.lot_id, tuple) and not isinstance(quant.package_id, tuple):
                named_so.setdefault(code_key(quant.lot_id[1]), set()).add(code)
    lying = tuple(Lying(place, code, tuple(there)) for (place, code), there in found.items())
    aliases = {key: codes.pop() for key, codes in named_so.items() if len(codes) == 1}
    return OdooStock(places, lying, tuple(left_out), frozenset(untold), aliases)


def label_of(quant: Quant, product: Product, labels: Iterable[Naming]) -> str:
    """The code that is read off its label; "" where it has none."""
    for naming in labels:
        if naming == "package" and isinstance(quant.package_id, tuple):
            return quant.package_id[1]
        if naming == "lot" and isinstance(quant.lot_id, tuple):
            return _lot_label(quant.lot_id[1], product)
        if naming == "product" and isinstance(product.barcode, str):
            return product.barcode
    return ""


def barcodes_of(gtin: str) -> list[str]:
    """As Odoo may have a GTIN of 14 digits: without its leading zeros, too."""
    lengths = (14, 13, 12, 8)
    return [gtin[-length:] for length in lengths if not gtin[:-length].strip("0")]


def _lot_label(name: str, product: Product) -> str:
    """Article and lot or serial number, as GS1 has them; the number alone, where the article has no GTIN."""
    key = code_key(str(product.barcode or ""))
    if not key.startswith("gs1:(01)"):
        return name
    label = f"{key.removeprefix('gs1:')}({'21' if product.tracking == 'serial' else '10'}){name}"
    return label if code_key(label).startswith("gs1:") else name


def _root(odoo: Odoo, asked: OdooSection) -> int:
    """The location that is the warehouse, or the part of it."""
    roots = odoo.first("stock.location", Location, [["complete_name", "=", asked.location]], 2)
    if len(roots) != 1:
        there = "several locations" if roots else "no location"
        raise InputError(
            f"Odoo has {there} {asked.location!r} that the key's user may see",
            key="odoo.location",
            remedy='give its complete name as in Odoo, such as "WH/Stock"',
        )
    return roots[0].id


def _places(odoo: Odoo, asked: OdooSection, root: int) -> tuple[dict[str, Location], dict[str, set[int]]]:
    """Locations by what a count calls them, and those that are no places, by their kind.  One with others
    below it is an area, as that of a warehouse, to which Odoo itself gives a barcode."""
    below: Domain = [["id", "child_of", root], ["usage", "=", "internal"]]
    found = list(odoo.records("stock.location", Location, below))
    above = {one.location_id[0] for one in found if isinstance(one.location_id, tuple)}
    areas = {one.id for one in found if one.id in above}
    places: dict[str, Location] = {}
    nameless: set[int] = set()
    for location in (one for one in found if one.id not in above):
        place = getattr(location, asked.place)
        if not isinstance(place, str) or not place.strip():
            nameless.add(location.id)
        elif place in places:
            both = f"{places[place].complete_name} and {location.complete_name}"
            raise InputError(
                f"{both} have the same {asked.place} {place!r}",
                key="odoo.place",
                remedy="give each location its own in Odoo, or choose complete_name",
            )
        else:
            places[place] = location
    if not places:
        raise InputError(
            f"no internal location below {asked.location} has a {asked.place}",
            key="odoo.place",
            remedy="set them in Odoo, or choose another of barcode, name, complete_name",
        )
    return places, {
        "locations with others below them": areas,
        f"locations without a {asked.place}": nameless,
    }


def _told_of(kind: str, locations: set[int], goods: Iterable[Quant]) -> str:
    """How many locations of a kind there are, and how many quants lie in them themselves."""
    there = sum(quant.location_id[0] in locations for quant in goods)
    told = f"{kind}: {len(locations)}"
    return f"{told}; quants that lie in them, not compared: {there}" if there else told


def _goods_below(root: int) -> Domain:
    """Also those of which a counted quantity waits to be applied."""
    below: Domain = [["location_id", "child_of", root], ["location_id.usage", "=", "internal"]]
    return [*below, "|", ["quantity", "!=", 0], ["inventory_quantity_set", "=", True]]


def _products(odoo: Odoo, quants: Iterable[Quant]) -> dict[int, Product]:
    """InputError where one is not there any more."""
    wanted = sorted({quant.product_id[0] for quant in quants})
    found: dict[int, Product] = {}
    for first in range(0, len(wanted), PAGE):
        some: Domain = [["id", "in", wanted[first : first + PAGE]], ["active", "in", [True, False]]]
        for product in odoo.first("product.product", Product, some, PAGE):
            found[product.id] = product
    missing = [number for number in wanted if number not in found]
    if missing:
        raise InputError(
            f"Odoo tells of stock of product {missing[0]}, and not of the product",
            remedy="may the key's user see it? Else something changed just now: run the command again",
        )
    return found
