"""Location labels against the map: contradicting the drone's place, hanging wrong, unmapped.  Pure."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.core.types import Event, EventLevel
from flightd.mission.scan.code_assignment import ShelfLook, Sighting

_SAME_OFF_M = 0.3
"""A label seen so near to where it was found to hang wrong still hangs there."""


class LabelChecks:
    """Contradicting labels put the place in doubt; where it proves right after all they hang wrong, and are
    dismissed from then on."""

    def __init__(self) -> None:
        self._contradicting: dict[str, float] = {}
        self._dismissed: dict[str, float] = {}
        self._unmapped: set[str] = set()

    @property
    def contradict(self) -> bool:
        """Labels contradict the place, and it has not been trusted since."""
        return bool(self._contradicting)

    def unknown(self, look: ShelfLook, where: str) -> list[Event]:
        """The labels in a picture taken at `where` that are not on the map, each told once."""
        new = [text for text in dict.fromkeys(look.unmapped) if text not in self._unmapped]
        self._unmapped.update(new)
        words = [f"label {text}, seen from {where}, is not on the map: not counted as stock" for text in new]
        return [Event(look.pose.stamp_ns, EventLevel.WARNING, "unknown_location", text) for text in words]

    def against(self, sightings: Iterable[Sighting]) -> Sighting | None:
        """The first of these labels to contradict the place; all that do are kept."""
        found = [seen for seen in sightings if seen.contradicts and not self._is_dismissed(seen)]
        if found:
            self._contradicting = {seen.location: seen.off_m for seen in found}
        return found[0] if found else None

    def agree(self, locations: Iterable[str]) -> None:
        """These labels hang where the map says."""
        for location in locations:
            self._dismissed.pop(location, None)

    def trust(self, *, moved: bool) -> None:
        """The place is known again: another one (`moved`), and the labels were right, or the same, and those
        that contradict it hang wrong."""
        if not moved:
            self._dismissed |= self._contradicting
        self._contradicting.clear()

    def _is_dismissed(self, seen: Sighting) -> bool:
        """Whether this label has contradicted in the same way before, and the place proved right."""
        known_m = self._dismissed.get(seen.location)
        return known_m is not None and abs(known_m - seen.off_m) < _SAME_OFF_M
