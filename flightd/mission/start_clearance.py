"""What stands between a mission on the ground and its flight: the start order and the checks.  Pure."""

from __future__ import annotations

from flightd.config.schema import Config
from flightd.core.types import EventLevel
from flightd.mission.debounce_timer import DebounceTimer
from flightd.mission.event_log import EventLog
from flightd.mission.guidance import MissionInputs
from flightd.mission.orders import StartOrder
from flightd.mission.reasons import Plain, Reason, StartsIn, Unfit, in_words
from flightd.mission.safety.readiness import not_fresh, obstacles
from flightd.mission.triggers import Trigger

_AFTER_VOID_NS = 10_000_000_000
"""An arming that was asked for may succeed so long after it was given up."""
_TOLD_AGAIN_NS = 10_000_000_000
_HINDERED_S = 0.5
_UNFIT_S = 3.0
"""Parameters are still being read for about so long."""


class StartClearance:
    """Counts a start order down, and says what keeps the drone on the ground: call `wait` at each tick on
    which it waits there.  With `autostart` nobody has to order a start, until an operator has taken one
    back."""

    def __init__(self, config: Config, events: EventLog, *, autostart: bool) -> None:
        self._config = config
        self._events = events
        self.autostart = autostart
        self._order = StartOrder(config.mission)
        self._obstacle: Reason | None = Plain.NO_TELEMETRY
        self._void_ns: int | None = None
        self._tried_ns: int | None = None
        """Since when it starts by itself, again and again."""
        self._hindered = DebounceTimer()
        self.taken_back = False
        """An operator has taken the start back, and it was not voided since."""
        self._told_ns: int | None = None
        self._unfit = DebounceTimer()
        self._unfit_reported: Reason | None = None

    @property
    def is_ready(self) -> bool:
        """Nothing kept the drone on the ground when it was last looked at."""
        return self._obstacle is None

    def obstacles(
        self, s: MissionInputs, stops_left: int | None, ground_silent: bool, *, arming: bool
    ) -> tuple[Reason, ...]:
        """All that keeps the drone on the ground now, worst first; `stops_left` where it waits for a battery
        for them, the others as in `readiness.obstacles`."""
        stale = not_fresh(s, self._config, stops_left) if stops_left is not None else None
        others = obstacles(s, self._config, ground_silent, arming=arming)
        return others if stale is None else (stale, *others)

    def _counted_down(self, now_ns: int) -> bool:
        """No count-down is under way."""
        return not self._order.left_s(now_ns)

    def give(self, now_ns: int) -> bool:
        """A start is ordered: begin its count-down, or refuse it for what keeps the drone on the ground.
        Whether it was taken."""
        if self._obstacle is not None:
            text = f"start refused: {in_words(self._obstacle)}"
            self._events.report(now_ns, EventLevel.WARNING, "command", text)
            return False
        self.taken_back = False
        self._order.give(now_ns, self._config.mission.start_countdown_s)
        self._report_countdown(now_ns)
        return True

    def may_start(self, now_ns: int, obstacle: Reason | None, *, ordered: bool) -> bool:
        """Nothing keeps it on the ground, and its start is counted down: call at each tick on which it waits,
        its start `ordered` or not."""
        self._look_again(now_ns, obstacle, ordered=ordered)
        return obstacle is None and self._counted_down(now_ns)

    def while_arming(self, found: set[Trigger], s: MissionInputs, obstacle: Reason | None) -> set[Trigger]:
        """What becomes of what was `found` while the vehicle is armed for a start: it takes off only from a
        tick on which nothing speaks against that."""
        found, now_ns = set(found), s.now_ns
        if not s.aisle_closed:
            found.add(Trigger.AISLE_OPEN)
        hindered = self._is_hindered(now_ns, obstacle)
        if self.taken_back:
            found = found - {Trigger.ARMED} | {Trigger.PAUSE}  # also at the very tick on which it arms
            self.void(now_ns)
        elif self._gives_up(now_ns):
            found.add(Trigger.TIMED_OUT)
        elif hindered or self.is_void(now_ns, None):
            found.add(Trigger.START_EXPIRED)
            if obstacle is not None:
                self.report_void(now_ns, obstacle)
            self.void(now_ns)
        return found if obstacle is None else found - {Trigger.ARMED}

    def _look_again(self, now_ns: int, obstacle: Reason | None, *, ordered: bool) -> None:
        """With autostart the count-down begins once no `obstacle` keeps the drone on the ground, and anew
        after one."""
        if not (self.autostart and ordered):
            return
        if obstacle is not None:
            self._order.withdraw()
            if not self.disarms(now_ns):  # what comes up only while it arms would else begin the time anew
                self._tried_ns = None
        elif not self._order.given:
            self._tried_ns = now_ns if self._tried_ns is None else self._tried_ns
            self._order.give(now_ns, self._config.mission.autostart_countdown_s)
            if not self._counted_down(now_ns):
                self._report_countdown(now_ns)

    def report_waiting(self, now_ns: int) -> None:
        """A start is ordered where one is under way: say what it waits for."""
        waits = StartsIn(self._order.left_s(now_ns)) if self._obstacle is None else self._obstacle
        self._events.report(now_ns, EventLevel.INFO, "command", f"starts already: {in_words(waits)}")

    def _report_countdown(self, now_ns: int) -> None:
        if self._told_ns is not None and now_ns - self._told_ns < _TOLD_AGAIN_NS:
            return  # what comes and goes must not flood the events; the status shows each second
        self._told_ns = now_ns
        text = in_words(StartsIn(self._order.left_s(now_ns)))
        self._events.report(now_ns, EventLevel.WARNING, "start", text)

    def take_back(self, now_ns: int) -> None:
        """An operator takes the start back; the next one is his, too."""
        self.autostart, self.taken_back = False, True
        self.withdraw()
        self._events.report(now_ns, EventLevel.WARNING, "start", "taken back")

    def withdraw(self) -> None:
        """The start has done its work, or came to nothing: it is not kept for later."""
        self._order.withdraw()
        self._hindered = DebounceTimer()
        self._tried_ns = None

    def void(self, now_ns: int) -> None:
        """The start came to nothing."""
        self._order.withdraw()
        self._hindered = DebounceTimer()
        self._void_ns, self.taken_back = now_ns, False

    def _is_hindered(self, now_ns: int, obstacle: Reason | None) -> bool:
        """Something keeps the drone on the ground, now that it is being armed, and is no passing matter."""
        return self._hindered.step(obstacle is not None, now_ns) > _HINDERED_S

    def _gives_up(self, now_ns: int) -> bool:
        """It has started by itself again and again, and was never armed."""
        p = self._config.mission
        given_up_s = p.autostart_countdown_s + p.expert.arm_timeout_s
        return self._tried_ns is not None and (now_ns - self._tried_ns) * 1e-9 > given_up_s

    def is_void(self, now_ns: int, obstacle: Reason | None) -> bool:
        """The start has not armed in time; or it was ordered and an aisle opened: whoever closes it behind
        himself must not start the drone."""
        opened = self._order.given and not self.autostart and obstacle is Plain.AISLE_OPEN
        return opened or self._order.is_void(now_ns)

    def report_void(self, now_ns: int, obstacle: Reason | None) -> None:
        """Say that a start came to nothing, and for what."""
        why = "" if obstacle is None else f": {in_words(obstacle)}"
        self._events.report(now_ns, EventLevel.WARNING, "start", f"{Trigger.START_EXPIRED.value}{why}")

    def disarms(self, now_ns: int) -> bool:
        """A start has just come to nothing: what was asked for may still arm the vehicle, and until then the
        adapter must not let go of it."""
        return self._void_ns is not None and now_ns - self._void_ns < _AFTER_VOID_NS

    def wait(self, obstacle: Reason | None, now_ns: int) -> Reason:
        """Keep what stands against a flight at this tick; why it waits."""
        self._obstacle = obstacle
        self._report_unfit(now_ns, obstacle)
        left_s = self._order.left_s(now_ns)
        return obstacle or (StartsIn(left_s) if left_s else Plain.AWAITS_START)

    def _report_unfit(self, now_ns: int, obstacle: Reason | None) -> None:
        """Say once what was found against a flight, as soon as it is no passing matter."""
        unfit_s = self._unfit.step(isinstance(obstacle, Unfit), now_ns)
        if isinstance(obstacle, Unfit) and unfit_s > _UNFIT_S and obstacle != self._unfit_reported:
            self._unfit_reported = obstacle
            self._events.report(now_ns, EventLevel.WARNING, "unfit", str(obstacle.found))
