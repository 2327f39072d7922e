"""Which column of an uploaded table has the places, which the codes, which the quantities: a good guess."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from flightd.core.errors import InputError
from flightd.inventory.stock_table import StockTable
from flightd.vision.shelf.code_equality import code_key

_PLACE_WORDS = (
    "location", "loc", "place", "bin", "slot", "storagebin", "storagelocation", "shelf", "cell", "address",
    "lagerplatz", "stellplatz", "platz", "lagerort", "regalplatz", "fach", "lgpla",
    "emplacement", "ubicacion", "ubicazione", "locatie", "lagerplats", "plats", "lokalizacja", "miejsce",
)  # fmt: skip
_CODE_WORDS = (
    "sscc", "nve", "lpn", "licenseplate", "licenceplate", "handlingunit", "hu", "pallet", "palette",
    "barcode", "code", "label", "gtin", "ean", "upc", "sku", "item", "itemnumber", "article", "articlenumber",
    "artikel", "artikelnummer", "artikelnr", "material", "materialnummer", "matnr", "product",
    "produkt", "codebarres", "codigo", "articulo", "articolo", "artikelkod", "streepjescode",
)  # fmt: skip
_QUANTITY_WORDS = (
    "quantity", "qty", "amount", "onhand", "stock", "count", "pieces", "pcs", "units", "menge", "bestand",
    "anzahl", "stueck", "stuck", "quantite", "cantidad", "quantita", "aantal", "antal", "ilosc",
)  # fmt: skip
_BY_WHOLE_NAME, _BY_PART = 3.0, 1.5
_BY_CONTENT = 8.0
_TRIED_ROWS = 200
_QUANTITY = re.compile(r"-?[\d.,' ]*\d")


@dataclass(frozen=True, slots=True)
class StockColumns:
    """The columns of a table by their number from 0; `heading`: the first row names them."""

    place: int
    code: int
    quantity: int | None = None
    heading: bool = True

    def checked(self, table: StockTable) -> StockColumns:
        """InputError where a column is not there, or is taken for two things."""
        used = [self.place, self.code, *([] if self.quantity is None else [self.quantity])]
        if not all(0 <= column < table.width for column in used):
            raise InputError(f"the table has {table.width} columns")
        if len(set(used)) < len(used):
            raise InputError("places, codes and quantities stand in different columns")
        return self


def guess_columns(table: StockTable, places: Collection[str], codes: Collection[str]) -> StockColumns:
    """Columns by their names, and by how many of their cells are `places` and `codes` of the count."""
    names = [_plain(cell) for cell in table.rows[0]]
    tried = list(zip(*table.rows[:_TRIED_ROWS], strict=True))
    known_places, known_codes = {place.casefold() for place in places}, {code_key(code) for code in codes}

    def is_place(cell: str) -> bool:
        return cell.casefold() in known_places

    def is_code(cell: str) -> bool:
        return code_key(cell) in known_codes

    def is_key(cell: str) -> bool:
        return code_key(cell).startswith("gs1:")

    by_place = [
        _score(n, _PLACE_WORDS) + _BY_CONTENT * _share(c, is_place) for n, c in zip(names, tried, strict=True)
    ]
    by_code = [
        _score(n, _CODE_WORDS) + _BY_CONTENT * _share(c, is_code) + _share(c, is_key)
        for n, c in zip(names, tried, strict=True)
    ]
    by_quantity = [
        _score(n, _QUANTITY_WORDS) * _share(c[1:], _is_quantity) for n, c in zip(names, tried, strict=True)
    ]
    place = _best(by_place, ())
    code = _best(by_code, (place,))
    quantity = _best(by_quantity, (place, code)) if table.width > 2 else None
    if quantity is not None and not by_quantity[quantity]:
        quantity = None
    first = table.rows[0]
    named = any(_score(n, words) for n in names for words in (_PLACE_WORDS, _CODE_WORDS, _QUANTITY_WORDS))
    heading = not is_place(first[place]) and not is_code(first[code]) and (named or not is_key(first[code]))
    return StockColumns(place, code, quantity, heading)


def _plain(cell: str) -> str:
    """The letters of a name, without accents and case."""
    letters = unicodedata.normalize("NFKD", cell.casefold().replace("ß", "ss"))
    return "".join(letter for letter in letters if letter.isascii() and letter.isalnum())


def _score(name: str, words: Sequence[str]) -> float:
    """How surely a name is one of these; words that stand first count a little more."""
    early = 1.0 / (len(words) + 1)
    for i, word in enumerate(words):
        if name == word:
            return _BY_WHOLE_NAME - i * early
    parts = [i for i, word in enumerate(words) if len(word) > 2 and word in name]
    return _BY_PART - min(parts) * early if parts else 0.0


def _share(cells: Sequence[str], test: Callable[[str], bool]) -> float:
    filled = [cell for cell in cells if cell]
    return sum(map(test, filled)) / len(filled) if filled else 0.0


def _is_quantity(cell: str) -> bool:
    return _QUANTITY.fullmatch(cell) is not None


def _best(scores: Sequence[float], but: Collection[int]) -> int:
    return max((i for i in range(len(scores)) if i not in but), key=lambda i: (scores[i], -i))
