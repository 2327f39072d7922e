"""What outlives a station that flies a drone as a vehicle, and what the next one makes of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import Phase
from flightd.ground.mqtt.safe_return import Standing
from flightd.mission.machine import FLYING


@dataclass(frozen=True, slots=True)
class KeptSession:
    """What is known of a drone since its daemon began: the plans that were handed to it, what it told where
    it stood, its newest event, and whether a person has it."""

    session: str = ""
    plans: tuple[str, ...] = ()
    standing: Standing | None = None
    event_seq: int = 0
    taken: bool = False


class StationBefore:
    """What the station before knew of a drone; nothing, if there was none."""

    def __init__(self) -> None:
        self.kept = KeptSession()
        self._ordered: Counter[str] = Counter()
        self.flies_on = False
        """The drone flies what that station ordered, to its end: nobody here knows that order."""

    def recall(self, kept: KeptSession, ordered: Iterable[str]) -> None:
        """It is known before the drone is heard; these commands may have been given last, each once."""
        self.kept, self._ordered = kept, Counter(ordered)

    def greet(self, session: str) -> KeptSession | None:
        """The drone is heard, in this session: what holds in it."""
        kept, self.kept = self.kept, KeptSession()
        if kept.session == session:
            self.flies_on = True
            return kept
        self._ordered.clear()
        self.flies_on = False
        return None

    def gave(self, command: str) -> bool:
        """Whether that station may have given a command that the drone tells of, with what it did since."""
        if self._ordered[command] <= 0:
            return False
        self._ordered[command] -= 1
        return True

    def is_past(self) -> None:
        """The drone told what it did meanwhile."""
        self._ordered.clear()

    def see(self, status: StatusReport) -> None:
        """Until it holds, or is on the ground."""
        self.flies_on &= status.phase in FLYING and status.phase is not Phase.HOLD
