"""Which of the doubtful locations are counted again: all of them, or those of some aisles, nodes, states."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from flightd.core.errors import InputError
from flightd.core.inventory import KnownLocations, LocationRecord, LocationState
from flightd.inventory.comparison import ComparisonOutcome

LOW_CONFIDENCE = "confidence"
"""The reason of a match that was seen with too little of it."""
REASONS = (
    *(outcome.value for outcome in ComparisonOutcome if outcome is not ComparisonOutcome.MATCH),
    *(state.value for state in LocationState if not state.is_counted),
    LOW_CONFIDENCE,
)
"""What may speak for counting a location again, the worst first: a difference to the books, the state of one
that the books do not name, a doubtful match."""
_URGENCY = {reason: number for number, reason in enumerate(REASONS)}


@dataclass(frozen=True, slots=True)
class RecountChoice:
    """Locations that fit in everything that is named; what is empty limits nothing.  `at_most` so many, those
    with differences to the books first (None: all)."""

    aisles: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    locations: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    at_most: int | None = None

    def of(
        self, doubtful: Mapping[str, str], records: Sequence[LocationRecord], aisles: Mapping[str, str]
    ) -> dict[str, str]:
        """The chosen of the `doubtful` locations with their reasons; `aisles` gives the aisle of each node.
        InputError for a name that nothing here has."""
        known = {record.code: record for record in records}
        _check("--aisles", self.aisles, set(aisles.values()))
        _check("--nodes", self.nodes, {record.node for record in records})
        locations = frozenset(map(KnownLocations(known).spelled, self.locations))
        _check("--locations", sorted(locations), known)
        _check("--states", self.states, [state.value for state in LocationState])
        _check("--reasons", self.reasons, REASONS)
        chosen = {
            code: why
            for code, why in doubtful.items()
            if not locations or code in locations
            if self._fits(why, known.get(code), aisles)
        }
        if self.at_most is None:
            return chosen
        by_urgency = sorted(chosen, key=lambda code: _URGENCY[_kind(chosen[code])])
        kept = set(by_urgency[: self.at_most])
        return {code: why for code, why in chosen.items() if code in kept}

    def _fits(self, why: str, record: LocationRecord | None, aisles: Mapping[str, str]) -> bool:
        node = record.node if record else ""
        state = record.state.value if record else ""
        tests = (
            (self.aisles, aisles.get(node, "")),
            (self.nodes, node),
            (self.states, state),
            (self.reasons, _kind(why)),
        )
        return all(not wanted or value in wanted for wanted, value in tests)


def _kind(why: str) -> str:
    """A reason without its figure."""
    return why.split(" ", maxsplit=1)[0]


def _check(option: str, given: Sequence[str], known: Collection[str]) -> None:
    for name in given:
        if name not in known:
            shown = sorted(filter(None, known))
            more = f" and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
            remedy = f"there are {', '.join(shown[:_SHOWN])}{more}" if shown else ""
            raise InputError("unknown here", key=f"{option} {name}", remedy=remedy)


_SHOWN = 12
