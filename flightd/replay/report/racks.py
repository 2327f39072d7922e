"""The racks as someone in front of them sees them: bays, levels and places, coloured by state."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

from flightd.core.inventory import LocationRecord, LocationState
from flightd.replay.report.markup import element, text
from flightd.replay.report.stock import CountedStock, cases_text, fill_text, share, undecided_text
from flightd.site.site import Location, Side, Site

_HALF_COLUMNS = 30
"""More places beside each other than this take the page's whole width."""

STATE_NAMES = {
    LocationState.READ: "read",
    LocationState.SEVERAL: "several codes",
    LocationState.EMPTY: "empty",
    LocationState.UNREADABLE: "unreadable",
    LocationState.OCCLUDED: "occluded",
    LocationState.NOT_VISITED: "not visited",
}


def racks_section(count: CountedStock, site: Site | None) -> str:
    """One front for each side of each aisle, and a list of what the map does not know."""
    records = {record.code: record for record in count.records}
    outcomes = {code: outcome.value for code, outcome in count.outcomes().items()}
    fronts: defaultdict[tuple[str, Side], list[Location]] = defaultdict(list)
    for location in site.locations.values() if site is not None else ():
        if location.code in records:
            fronts[location.aisle, location.side].append(location)
    drawn = [_front(aisle, side, places, records, outcomes) for (aisle, side), places in fronts.items()]
    on_map = {location.code for places in fronts.values() for location in places}
    others = [record for record in count.records if record.code not in on_map]
    if others:
        drawn.append(_others(others, outcomes, "Not on the map" if drawn else "All locations"))
    return _legend(count) + element("div", *drawn, class_="racks")


def _legend(count: CountedStock) -> str:
    states = count.states()
    keys = [
        element(
            "span",
            element("i", class_=f"cell {state.value}"),
            f"{text(name)} {element('b', f'{states[state]:,}')}",
            class_="key",
        )
        for state, name in STATE_NAMES.items()
        if states[state]
    ]
    if count.outcomes():
        keys.append(element("span", element("i", class_="cell differs"), "not as expected", class_="key"))
    return element("p", *keys, class_="tones states")


def _front(
    aisle: str,
    side: Side,
    places: Sequence[Location],
    records: Mapping[str, LocationRecord],
    outcomes: Mapping[str, str],
) -> str:
    """Bays beside each other, the highest level on top, as someone in the aisle sees them: who looks along x
    and turns to the front on his right has x running to the left."""
    bays: defaultdict[int, list[Location]] = defaultdict(list)
    for place in places:
        bays[place.bay].append(place)
    levels = sorted({place.level for place in places}, reverse=True)
    mirrored = side is Side.RIGHT
    columns = [
        _bay(number, bays[number], levels, mirrored, records, outcomes)
        for number in sorted(bays, reverse=mirrored)
    ]
    names = element("div", *(element("span", str(level)) for level in levels), class_="levels")
    done = sum(records[place.code].state.is_counted for place in places)
    title = element(
        "h3", f"Aisle {text(aisle)}, {side.value}", element("small", f"{done:,} of {len(places):,} counted")
    )
    rack = element("div", names, *columns, class_="rack")
    wide = sum(len({place.position for place in there}) for there in bays.values()) > _HALF_COLUMNS
    name = "front long" if wide else "front"
    return element("article", title, element("div", rack, class_="scroll"), class_=name)


def _bay(
    number: int,
    places: Sequence[Location],
    levels: Sequence[int],
    mirrored: bool,
    records: Mapping[str, LocationRecord],
    outcomes: Mapping[str, str],
) -> str:
    by_place = {(place.level, place.position): place for place in places}
    positions = sorted({place.position for place in places}, reverse=mirrored)
    cells = []
    for level in levels:
        for position in positions:
            place = by_place.get((level, position))
            cells.append(
                element("i") if place is None else cell(records[place.code], outcomes.get(place.code, ""))
            )
    grid = element("div", *cells, class_="cells", style=f"--positions:{len(positions)}")
    return element("div", grid, element("b", str(number)), class_="bay")


def _others(records: Sequence[LocationRecord], outcomes: Mapping[str, str], title: str) -> str:
    cells = [cell(record, outcomes.get(record.code, "")) for record in records]
    heading = element("h3", title, element("small", f"{len(records):,} locations"))
    return element("article", heading, element("div", *cells, class_="loose"), class_="front long")


def cell(record: LocationRecord, outcome: str) -> str:
    """One place: its colour, its text on hover; the script opens the picture."""
    seen = record.observation
    parts = [record.code, STATE_NAMES[record.state], *record.texts]
    if seen is not None:
        if seen.undecided:
            parts.append(f"undecided: {undecided_text(seen.undecided)}")
        parts.append(share(seen.confidence))
        if seen.fill is not None and seen.fill.share is not None:
            parts.append(f"{fill_text(seen.fill)} filled")
        if cases := cases_text(seen.fill):
            parts.append(f"cases: {cases}")
    if outcome:
        parts.append(outcome.replace("_", " "))
    return element(
        "button",
        class_=f"cell {record.state.value}" + (" differs" if outcome else ""),
        type="button",
        title=" · ".join(parts),
        data_code=record.code,
    )
