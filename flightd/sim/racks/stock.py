"""What stands in the simulated racks, and what a perfect count would say of it.

A pure function of the site, the shares, the camera's focal length (labels are as large as it needs) and
the seed; every place is drawn from its own code, so it does not depend on which others there are.
"""

from __future__ import annotations

import enum
import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from flightd.core.inventory import LocationState
from flightd.sim.racks.cartons import carton_stack
from flightd.sim.racks.code_symbols import Symbol, Symbology, modules
from flightd.sim.racks.label_texts import (
    Numbers,
    gtin_13,
    gtin_with_serial,
    lot,
    own_number,
    pallet_name,
    sscc,
)
from flightd.sim.racks.rack_layout import Opening, openings
from flightd.sim.racks.stacks import Goods, in_stacks
from flightd.site.site import Site

_LINEAR_PX = (2.75, 3.3)
_MATRIX_PX = (3.0, 4.2)
_TOO_SMALL_PX = (0.6, 0.8)
"""Pixels for each module at the distance of the node: readable needs 2.5, nothing is read below one."""
_LINEAR_BAR_M = 0.07
_TEXT_M = 0.022
"""Height of the line of text below a code."""
_EDGE_M = 0.012
"""Least distance of a label from the edges of the goods."""
_MOST_TURN_RAD = math.radians(15.0)
_LEAST_TURN_PART = 0.4
_BARS_CROSSED = 0.5
"""A linear code is tilted so far that a level line still crosses all its bars within half their height."""

_DARK_PART = 0.08
"""Part of all other goods that are dark and matte, too."""

_KINDS: tuple[tuple[Symbology, Callable[[int], str], float], ...] = (
    (Symbology.QR, pallet_name, 0.20),
    (Symbology.QR, gtin_with_serial, 0.10),
    (Symbology.DATA_MATRIX, sscc, 0.20),
    (Symbology.CODE_128, own_number, 0.15),
    (Symbology.CODE_128, lot, 0.10),
    (Symbology.CODE_128, sscc, 0.10),
    (Symbology.EAN_13, gtin_13, 0.15),
)
"""What is printed, and how often."""


class Condition(enum.StrEnum):
    """How a label is; only the first three are readable."""

    CLEAN = "clean"
    TILTED = "tilted"
    GLOSSY = "glossy"
    TORN = "torn"
    TOO_SMALL = "too_small"
    COVERED = "covered"

    @property
    def is_readable(self) -> bool:
        return self in {Condition.CLEAN, Condition.TILTED, Condition.GLOSSY}


class StockSituation(enum.StrEnum):
    """How a place is; each has a share in `StockShares`, what is left over is `clean`.

    `missing` has goods without a label, and so has `dark`, whose goods are dark and matte besides."""

    EMPTY = "empty"
    CLEAN = "clean"
    TILTED = "tilted"
    GLOSSY = "glossy"
    SEVERAL = "several"
    TORN = "torn"
    TOO_SMALL = "too_small"
    MISSING = "missing"
    OCCLUDED = "occluded"
    DARK = "dark"

    @property
    def state(self) -> LocationState:
        """What a perfect count says."""
        return _STATES.get(self, LocationState.READ)


_STATES = {
    StockSituation.EMPTY: LocationState.EMPTY,
    StockSituation.SEVERAL: LocationState.SEVERAL,
    StockSituation.TORN: LocationState.UNREADABLE,
    StockSituation.TOO_SMALL: LocationState.UNREADABLE,
    StockSituation.MISSING: LocationState.UNREADABLE,
    StockSituation.OCCLUDED: LocationState.OCCLUDED,
    StockSituation.DARK: LocationState.UNREADABLE,
}
_UNLABELLED = {StockSituation.MISSING, StockSituation.DARK}
_CONDITIONS = {
    StockSituation.TILTED: Condition.TILTED,
    StockSituation.GLOSSY: Condition.GLOSSY,
    StockSituation.TORN: Condition.TORN,
    StockSituation.TOO_SMALL: Condition.TOO_SMALL,
    StockSituation.OCCLUDED: Condition.COVERED,
}


@dataclass(frozen=True, slots=True)
class StockShares:
    """Shares of all places, 0..1, together at most 1."""

    empty: float = 0.12
    tilted: float = 0.08
    glossy: float = 0.06
    several: float = 0.05
    torn: float = 0.03
    too_small: float = 0.02
    missing: float = 0.03
    occluded: float = 0.03
    dark: float = 0.03

    def __post_init__(self) -> None:
        each = [getattr(self, name) for name in self.names()]
        if min(each) < 0.0 or math.fsum(each) > 1.0 + 1e-9:
            raise ValueError(f"the shares of places are {math.fsum(each):g} together, at most 1 is possible")

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The situations that have a share."""
        return tuple(field.name for field in fields(cls))

    def situation(self, draw: float) -> StockSituation:
        """The situation for a number drawn from 0..1."""
        for name in self.names():
            draw -= getattr(self, name)
            if draw < 0.0:
                return StockSituation(name)
        return StockSituation.CLEAN


@dataclass(frozen=True, slots=True)
class Label:
    """One label on the goods: its middle `right_m` of the opening's middle as seen from the aisle, and
    `height_m` above the floor; turned clockwise by `turn_rad`."""

    symbol: Symbol
    condition: Condition
    module_m: float
    right_m: float
    height_m: float
    turn_rad: float

    @property
    def code_size_m(self) -> tuple[float, float]:
        """Width and height of the code alone, without its quiet zone."""
        rows, columns = modules(self.symbol).shape
        height_m = _LINEAR_BAR_M if self.symbol.symbology.is_linear else rows * self.module_m
        return columns * self.module_m, height_m

    @property
    def paper_size_m(self) -> tuple[float, float]:
        """Width and height of the paper."""
        return _paper_m(self.symbol, self.module_m)


@dataclass(frozen=True, slots=True)
class StockPlace:
    """One location with what is there; `goods` None is an empty place."""

    opening: Opening
    situation: StockSituation
    goods: Goods | None
    labels: tuple[Label, ...]

    @property
    def code(self) -> str:
        return self.opening.location.code

    @property
    def fill(self) -> float:
        """The part of the opening's front, 0..1, that goods stand in."""
        return self.goods.share_of(self.opening) if self.goods is not None else 0.0

    @property
    def readable(self) -> tuple[str, ...]:
        """The texts that a perfect count reads here."""
        return tuple(label.symbol.text for label in self.labels if label.condition.is_readable)


def stock(
    site: Site,
    shares: StockShares,
    focal_px: float,
    seed: int,
    in_part: float = 0.0,
    cartons: float = 0.0,
) -> Mapping[str, StockPlace]:
    """What is at every location of the site, by its code, in the order of the map; `in_part` is the part of
    the places with goods that they fill only in part, `cartons` that of the others, in the light, where
    cartons of one kind are stacked."""
    found = {}
    order = {code: number for number, code in enumerate(site.locations)}
    numbers = Numbers(seed)
    for opening in openings(site):
        location = opening.location
        distance_m = max(abs(location.y_m - site.nodes[location.node].y_m), 0.1)
        rng = np.random.default_rng([seed, zlib.crc32(location.code.encode()), 0x73746F63])
        serial = numbers.of(order[location.code])
        found[location.code] = _place(opening, shares, focal_px / distance_m, serial, rng, in_part, cartons)
    return {code: found[code] for code in site.locations}


def _place(
    opening: Opening,
    shares: StockShares,
    px_per_m: float,
    serial: tuple[int, int],
    rng: np.random.Generator,
    in_part: float,
    cartons: float,
) -> StockPlace:
    situation = shares.situation(float(rng.random()))
    if situation is StockSituation.EMPTY:
        return StockPlace(opening, situation, None, ())
    several = situation is StockSituation.SEVERAL
    width_m = opening.width_m * float(rng.uniform(0.86, 0.95))
    height_m = opening.level.height_m * float(rng.uniform(0.78, 0.93))
    right_m = float(rng.uniform(-0.4, 0.4)) * (opening.width_m - width_m)
    recess_m = float(rng.uniform(0.0, 0.05))
    looks = int(rng.integers(2**31))
    covered, dark = situation is StockSituation.OCCLUDED, situation is StockSituation.DARK or _is_dark(looks)
    goods = Goods(width_m, height_m, right_m, recess_m, covered, looks, dark)
    fills = np.random.default_rng([looks, 0x66696C6C])  # of its own: the rest of the place stays as it is
    if fills.random() < in_part:
        goods = in_stacks(goods, opening, fills)
    elif not dark and fills.random() < cartons:
        goods = replace(goods, cartons=carton_stack((goods.width_m, goods.load_m), fills))
    if situation in _UNLABELLED:
        return StockPlace(opening, situation, goods, ())
    condition = _CONDITIONS.get(situation, Condition.CLEAN)
    if several:
        symbols = [
            Symbol(Symbology.QR, pallet_name(serial[0])),
            Symbol(Symbology.DATA_MATRIX, sscc(serial[1])),
        ]
    else:
        symbols = [_symbol(serial[0], goods.width_m, px_per_m, rng)]
    labels = tuple(
        _label(symbol, condition, goods, opening, px_per_m, side, rng)
        for symbol, side in zip(symbols, (-1, 1) if several else (0,), strict=True)
    )
    if not all(_fits(label, goods) for label in labels):  # nobody puts a label where there is no room for it
        return StockPlace(opening, situation if covered else StockSituation.MISSING, goods, ())
    return StockPlace(opening, situation, goods, labels)


def _fits(label: Label, goods: Goods) -> bool:
    half_x, half_y = _half_extent(label.paper_size_m, label.turn_rad)
    return 2 * half_x <= goods.width_m and 2 * half_y <= goods.height_m


def _is_dark(looks: int) -> bool:
    return bool(np.random.default_rng([looks, 0x6461726B]).random() < _DARK_PART)


def _symbol(serial: int, room_m: float, px_per_m: float, rng: np.random.Generator) -> Symbol:
    """A symbol that fits `room_m` of goods with modules of a readable size."""
    symbology, make, _ = _KINDS[int(rng.choice(len(_KINDS), p=[share for *_, share in _KINDS]))]
    symbol = Symbol(symbology, make(serial))
    if _paper_m(symbol, _LINEAR_PX[1] / px_per_m)[0] > room_m - 2 * _EDGE_M:
        return Symbol(Symbology.DATA_MATRIX, sscc(serial))
    return symbol


def _label(
    symbol: Symbol,
    condition: Condition,
    goods: Goods,
    opening: Opening,
    px_per_m: float,
    side: int,
    rng: np.random.Generator,
) -> Label:
    sizes = _LINEAR_PX if symbol.symbology.is_linear else _MATRIX_PX
    module_m = float(rng.uniform(*(_TOO_SMALL_PX if condition is Condition.TOO_SMALL else sizes))) / px_per_m
    turn_rad = float(rng.normal(0.0, math.radians(0.7)))
    if condition is Condition.TILTED:
        most_rad = _MOST_TURN_RAD
        if symbol.symbology.is_linear:
            bars_m = modules(symbol).shape[1] * module_m
            most_rad = min(most_rad, math.atan(_BARS_CROSSED * _LINEAR_BAR_M / bars_m))
        turn_rad = float(rng.choice((-1.0, 1.0)) * rng.uniform(_LEAST_TURN_PART, 1.0)) * most_rad
    paper_m = _paper_m(symbol, module_m)
    half_x, half_y = _half_extent(paper_m, turn_rad)
    deck_m = opening.level.deck_m
    room_x = max(goods.width_m / 2 - half_x - _EDGE_M, 0.0)
    low, high = deck_m + half_y + _EDGE_M, deck_m + goods.height_m - half_y - _EDGE_M
    height_m = opening.location.height_m + float(rng.uniform(-0.03, 0.03))
    right_m = side * room_x * 0.9 if side else float(rng.uniform(-0.5, 0.5)) * min(room_x, 0.2)
    return Label(
        symbol,
        condition,
        module_m,
        goods.right_m + right_m,
        min(max(height_m, low), max(high, low)),
        turn_rad,
    )


def _paper_m(symbol: Symbol, module_m: float) -> tuple[float, float]:
    rows, columns = modules(symbol).shape
    quiet_m = symbol.symbology.quiet_modules * module_m
    linear = symbol.symbology.is_linear
    height_m = _LINEAR_BAR_M + 0.02 if linear else rows * module_m + 2 * quiet_m
    return columns * module_m + 2 * quiet_m, height_m + _TEXT_M


def _half_extent(size_m: tuple[float, float], turn_rad: float) -> tuple[float, float]:
    c, s = abs(math.cos(turn_rad)), abs(math.sin(turn_rad))
    width_m, height_m = size_m
    return (width_m * c + height_m * s) / 2, (width_m * s + height_m * c) / 2
