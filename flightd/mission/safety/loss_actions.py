"""What was lost that flying itself does not need, and the configured action for it.  Pure."""

from __future__ import annotations

from collections.abc import Mapping

from flightd.config.hazards import LossAction
from flightd.config.schema import Config
from flightd.core.types import EventLevel
from flightd.mission.event_log import EventLog
from flightd.mission.guidance import MissionInputs
from flightd.mission.triggers import Trigger


class LossActions:
    """The action for each loss; call `ground_lost` at each tick."""

    def __init__(self, config: Config, events: EventLog) -> None:
        hazards = config.hazards
        self._ground_lost_s = config.ground.lost_s
        self._events = events
        self._silent = False
        self.on_board: Mapping[Trigger, LossAction] = {
            Trigger.RECORD_LOST: hazards.record_lost,
            Trigger.BATTERY_UNKNOWN: hazards.battery_unknown,
            Trigger.AISLE_OPEN: hazards.aisle_open,
        }
        """Of what the hazard monitor finds."""
        self.of_ground_link = config.ground.lost_action

    @property
    def ground_silent(self) -> bool:
        """The ground station that attends this flight is silent, and a start has to wait for it."""
        return self._silent and self.of_ground_link is not LossAction.CONTINUE

    def ground_lost(self, s: MissionInputs) -> bool:
        """Whether the ground link is lost; that it is, and that it is heard again, is reported once."""
        lost = s.ground_silent_s > self._ground_lost_s
        if lost is not self._silent:
            self._silent = lost
            action = self.of_ground_link.value
            text = f"silent for {s.ground_silent_s:.1f} s: {action}" if lost else "heard again"
            level = EventLevel.WARNING if lost else EventLevel.INFO
            self._events.report(s.now_ns, level, "ground_link", text)
        return lost
