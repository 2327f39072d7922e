"""A map that is being drawn, laid out and checked: the findings of `flightd map check`, each with its place.

Runs in a process of its own, with arguments and answers that can be pickled.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import msgspec

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.ground.site_page.drafts import CameraSetting
from flightd.site.ambiguity import alike
from flightd.site.coverage import Coverage, FrontView, check_coverage, coverage_facts
from flightd.site.facts import site_facts
from flightd.site.site import ASSUMED_CEILING_M, Location, Site
from flightd.site.site_draft import SiteDraft
from flightd.site.site_tables import SiteMistake, SiteTablesError, site_of

_CROSSINGS: Final = 2
"""As `flightd map check` has it."""
_MOST_FINDINGS: Final = 60
_MOST_LOST: Final = 2_000
_Finding = dict[str, Any]


def checked(draft: SiteDraft, camera: CameraSetting | None) -> bytes:
    """JSON: `sound`, `findings` and, of a sound map, its `floor`, `facts`, `bays`, `codes` and `coverage`."""
    try:
        site = site_of(draft.tables())
    except SiteTablesError as err:
        return msgspec.json.encode({"sound": False, "findings": [_mistake(one) for one in err.mistakes]})
    reach = None if camera is None else _reach(site, camera)
    findings = [*_remarks(site), *(_coverage_findings(reach) if reach else ())]
    more = len(findings) - _MOST_FINDINGS
    if more > 0:
        findings = [*findings[:_MOST_FINDINGS], _finding("note", f"and {more} more")]
    return msgspec.json.encode(
        {
            "sound": True,
            "findings": findings,
            "floor": floor_status(site),
            "facts": site_facts(site),
            "bays": list(_bays(site)),
            "codes": _codes(site),
            "coverage": None if reach is None else _coverage(site, reach),
        }
    )


def _reach(site: Site, camera: CameraSetting) -> Coverage:
    view = FrontView(
        math.radians(camera.fov_deg), camera.width_px, camera.exposure_ms / 1e3, camera.module_mm / 1e3
    )
    return check_coverage(site, view, camera.speed_mps)


def _finding(kind: str, text: str, **place: Any) -> _Finding:
    """`kind`: error (no map), problem (labels are not read) or note; `place`: table, index, field, nodes."""
    return {"kind": kind, "text": text, **place}


def _mistake(one: SiteMistake) -> _Finding:
    return _finding("error", str(one), table=one.table, index=one.index, field=one.field)


def _remarks(site: Site) -> Iterator[_Finding]:
    """What a sound map makes harder than it need be."""
    if not site.ceiling_given:
        text = f"no ceiling_m is given: {ASSUMED_CEILING_M:g} m is assumed, and nothing is flown above 2 m"
        yield _finding("note", text, table="site", field="ceiling_m")
    cut_off = [node for node in site.nodes if node in site.cut_off]
    if cut_off:
        yield _finding("note", f"cut off from {site.home.node}: {_listed(cut_off)}", nodes=cut_off)
    for group in alike(site, _CROSSINGS):
        text = f"look alike within {_CROSSINGS} crossings: {_listed(group)}"
        yield _finding("note", text, nodes=list(group))


def _listed(nodes: Sequence[str]) -> str:
    return " ".join(nodes[:6]) + (f" and {len(nodes) - 6} more" if len(nodes) > 6 else "")


def _coverage_findings(reach: Coverage) -> Iterator[_Finding]:
    gaps = {str(gap): gap for gap in reach.gaps}
    for problem in reach.problems:
        gap = gaps.get(problem)
        if gap is None:
            yield _finding("problem", problem)
        else:
            place = {"aisle": gap.aisle, "side": gap.side, "from_m": gap.from_m, "to_m": gap.to_m}
            yield _finding("problem", problem, **place)


def _coverage(site: Site, reach: Coverage) -> dict[str, Any]:
    facts = coverage_facts(reach)
    lost = [site.locations[code] for code in (*reach.unseen, *reach.unreadable)][:_MOST_LOST]
    return {
        **{key: value for key, value in facts.items() if not isinstance(value, list)},
        "unseen": len(reach.unseen),
        "unreadable": len(reach.unreadable),
        "lost": [(place.code, place.x_m, place.y_m) for place in lost],
    }


def _bays(site: Site) -> Iterator[tuple[float, float, float]]:
    """Each bay on a front: (x from, x to, y), metres."""
    widths = {
        (aisle, side): rack.bay_width_m for rack in site.racks for aisle in rack.aisles for side in rack.sides
    }

    def bay(place: Location) -> tuple[str, str, int]:
        return place.aisle, place.side, place.bay

    for _, group in itertools.groupby(site.locations.values(), key=bay):
        places = list(group)
        first = places[0]
        width_m = widths[first.aisle, first.side]
        positions = {place.position for place in places}
        from_m = first.x_m - width_m / len(positions) / 2
        yield from_m, from_m + width_m, first.y_m


def _codes(site: Site) -> list[dict[str, Any]]:
    """Of each rack: how many places it makes, with their first and last code."""
    fronts = {
        (aisle, side): i for i, rack in enumerate(site.racks) for aisle in rack.aisles for side in rack.sides
    }
    told: list[dict[str, Any]] = [{"places": 0, "first": "", "last": "", "bays": 0} for _ in site.racks]
    bays: list[set[tuple[str, str, int]]] = [set() for _ in site.racks]
    for code, place in site.locations.items():
        i = fronts[place.aisle, place.side]
        told[i]["places"] += 1
        told[i]["first"] = told[i]["first"] or code
        told[i]["last"] = code
        bays[i].add((place.aisle, place.side, place.bay))
    for one, counted in zip(told, bays, strict=True):
        one["bays"] = len(counted)
    return told
