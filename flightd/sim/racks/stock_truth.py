"""What a perfect count of the simulated racks would say, and how good a count was against it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from flightd.core.inventory import LocationRecord, LocationState
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.goods import boxes_in_rows
from flightd.sim.racks.stock import StockPlace, StockSituation, stock
from flightd.site.site import Site

_UNKNOWN = {LocationState.UNREADABLE, LocationState.OCCLUDED}
"""Something is there, and nobody can say what; which of the two it is, is not held against a count."""

_SAME_FILL = 0.1


@dataclass(frozen=True, slots=True)
class LabelTruth:
    """One label that hangs at a location."""

    symbology: str
    text: str
    condition: str
    readable: bool


@dataclass(frozen=True, slots=True)
class LocationTruth:
    """One location: the state that a perfect count gives it, its labels, `fill`, the part of its
    opening that goods stand in as seen straight from before it, 0..1, and `boxes`, how many are seen in each
    row of its front, the highest first: none where there are none, or something else beside them."""

    code: str
    node: str
    state: LocationState
    situation: str
    labels: tuple[LabelTruth, ...]
    fill: float = 0.0
    boxes: tuple[int, ...] = ()

    @property
    def texts(self) -> frozenset[str]:
        """All texts that hang here, readable or not."""
        return frozenset(label.text for label in self.labels)

    @property
    def readable(self) -> frozenset[str]:
        """The texts that a perfect count reads."""
        return frozenset(label.text for label in self.labels if label.readable)


@dataclass(frozen=True, slots=True)
class StockScore:
    """One count against the truth, over the locations that were planned.

    `codes_expected` are readable labels, `codes_read` those of them found at their location, `codes_wrong`
    all texts told of a location where no such label hangs (a wrong text, or the right one at a wrong
    place).  `empty_*`: places without goods, those said to be so, and others said to be so.
    `unreadable_*`: places whose labels cannot be read (torn, too small, missing, covered), and those told
    as unreadable or occluded.  `locations_right` have exactly the state of a perfect count.  `fill_told`:
    places of which it was told how full they are, `fill_right` of these within 10 points of the truth;
    `cases_told`: those of which cases were counted, `cases_right` of these as they stand in the front."""

    locations_planned: int
    locations_visited: int
    locations_right: int
    codes_expected: int
    codes_read: int
    codes_wrong: int
    empty_expected: int
    empty_right: int
    empty_wrong: int
    unreadable_expected: int
    unreadable_told: int
    fill_told: int
    fill_right: int
    cases_told: int
    cases_right: int

    def as_summary(self) -> dict[str, int]:
        return {field.name: getattr(self, field.name) for field in fields(self)}


def stock_truth(site: Site, look: RackAppearance, focal_px: float, seed: int) -> dict[str, LocationTruth]:
    """The truth of every location of the site, by its code; `seed` is the flight's."""
    stock_seed = seed if look.seed is None else look.seed
    places = stock(site, look.shares, focal_px, stock_seed, look.in_part, look.cartons)
    return {code: _truth(place) for code, place in places.items()}


def _truth(place: StockPlace) -> LocationTruth:
    labels = tuple(
        LabelTruth(
            label.symbol.symbology.value,
            label.symbol.text,
            label.condition.value,
            label.condition.is_readable,
        )
        for label in place.labels
    )
    location = place.opening.location
    situation = place.situation
    return LocationTruth(
        location.code,
        location.node,
        situation.state,
        situation.value,
        labels,
        round(place.fill, 3),
        boxes_of(place),
    )


def boxes_of(place: StockPlace) -> tuple[int, ...]:
    """How many boxes are seen in each row of a place, the highest first."""
    goods = place.goods
    return boxes_in_rows(goods) if goods is not None and not goods.beside and not goods.covered else ()


def score_stock(
    truth: Mapping[str, LocationTruth],
    records: Iterable[LocationRecord],
    planned: Collection[str] | None = None,
) -> StockScore:
    """Score a count; `planned` are the locations it was asked for (None: all).

    A planned location without a record counts as not visited; a text told of a location that does not
    exist is wrong."""
    found = {record.code: record for record in records}
    asked = [place for code, place in truth.items() if planned is None or code in planned]
    told = {
        place.code: found[place.code].state if place.code in found else LocationState.NOT_VISITED
        for place in asked
    }
    expected = [(place.code, text) for place in asked for text in place.readable]
    nothing: frozenset[str] = frozenset()
    wrong = [
        (record.code, text)
        for record in found.values()
        for text in record.texts
        if text not in (truth[record.code].texts if record.code in truth else nothing)
    ]
    empty = [place for place in asked if place.situation == StockSituation.EMPTY]
    unknown = [place for place in asked if place.state in _UNKNOWN]
    fills = [
        (record.observation.fill, place)
        for place in asked
        if (record := found.get(place.code)) and record.observation and record.observation.fill
    ]
    shares = [(fill.share, place.fill) for fill, place in fills if fill.share is not None]
    cases = [(fill.cases, place.boxes) for fill, place in fills if fill.cases is not None]
    said_empty = [code for code, state in told.items() if state is LocationState.EMPTY]
    return StockScore(
        locations_planned=len(asked),
        locations_visited=sum(state is not LocationState.NOT_VISITED for state in told.values()),
        locations_right=sum(told[place.code] is place.state for place in asked),
        codes_expected=len(expected),
        codes_read=sum(code in found and text in found[code].texts for code, text in expected),
        codes_wrong=len(wrong),
        empty_expected=len(empty),
        empty_right=sum(told[place.code] is LocationState.EMPTY for place in empty),
        empty_wrong=sum(truth[code].state is not LocationState.EMPTY for code in said_empty),
        unreadable_expected=len(unknown),
        unreadable_told=sum(told[place.code] in _UNKNOWN for place in unknown),
        fill_told=len(shares),
        fill_right=sum(abs(share - true) <= _SAME_FILL for share, true in shares),
        cases_told=len(cases),
        cases_right=sum(boxes == (grid.columns,) * grid.rows for grid, boxes in cases),
    )


def write_truth(path: Path, truth: Mapping[str, LocationTruth], seed: int) -> None:
    """Write the truth for people, as JSON, a location to a line."""
    rows = ",\n".join(json.dumps(_row(place), ensure_ascii=False) for place in truth.values())
    path.write_text(f'{{"seed": {seed},\n"locations": [\n{rows}\n]}}\n', encoding="utf-8")


def _row(place: LocationTruth) -> dict[str, Any]:
    return {
        "code": place.code,
        "node": place.node,
        "state": place.state.value,
        "situation": place.situation,
        "fill": place.fill,
        "boxes": place.boxes,
        "labels": [
            {"symbology": label.symbology, "text": label.text, "condition": label.condition}
            for label in place.labels
        ],
    }
