"""Instant actions: which are taken, how far each is, and what of them holds the vehicle back."""

from __future__ import annotations

from collections import deque
from typing import Final

import msgspec

from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.errors import ErrorType, level_of
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionState, ActionStatus, Error, OperatingMode
from flightd.fleet.vehicle.refusals import Refusal

_KNOWN: Final = frozenset({"startPause", "stopPause", "cancelOrder", "stateRequest", "factsheetRequest"})
_ASKS: Final = frozenset({"stateRequest", "factsheetRequest"})
_CLEAR: Final = "clearInstantActions"
_IN_CONTROL: Final = frozenset({OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC})
_MOST_KEPT: Final = 64
"""Of those that are over, so many are told; the oldest go first."""
_NEARLY_FULL: Final = 48
"""From so many on that is told."""
_MOST_MET: Final = 256
"""So many are known again when they come a second time."""


class InstantBook:
    """The instant actions of a vehicle by their ids."""

    def __init__(self, version: Version) -> None:
        self._known = _KNOWN if version is Version.V2_1 else _KNOWN | {_CLEAR}
        self._clears = "a new order" if version is Version.V2_1 else _CLEAR
        self._states: dict[str, ActionState] = {}
        self._met: deque[str] = deque(maxlen=_MOST_MET)
        self._let_go = 0
        """States that are told no more though nobody cleared them."""
        self._is_paused = False
        self._stands = False
        self._state_wanted = False
        self._factsheet_wanted = False

    @property
    def pauses(self) -> bool:
        """Whether the vehicle shall not drive."""
        return self._is_paused

    @property
    def paused(self) -> bool:
        """Whether it is paused and stands."""
        return self._is_paused and self._stands

    @property
    def cancels(self) -> bool:
        """Whether an order is being cancelled."""
        return any(self._goes_on(one, "cancelOrder") for one in self._states.values())

    @staticmethod
    def _goes_on(state: ActionState, kind: str) -> bool:
        return state.action_type == kind and not state.action_status.is_over

    def knows(self, action_id: str) -> bool:
        """Whether an action came before: then it is not done again."""
        return action_id in self._states or action_id in self._met

    def states(self) -> list[ActionState]:
        """As the state tells them."""
        return list(self._states.values())

    def errors(self) -> list[Error]:
        """That there are nearly too many states, or some had to go: until they are cleared."""
        if sum(one.action_status.is_over for one in self._states.values()) < _NEARLY_FULL:
            return []
        kind = ErrorType.INSTANT_ACTION_STATES_FULL
        gone = f"; the oldest {self._let_go} are told no more" if self._let_go else ""
        what = f"of instant actions that are over {_MOST_KEPT} are told at most{gone}"
        hint = f"{self._clears} clears them"
        return [Error(error_type=kind, error_level=level_of(kind), error_description=what, error_hint=hint)]

    def refusal(self, action: Action, mode: OperatingMode, active_order: str | None) -> Refusal | None:
        """Why an action is not done.  `active_order`: the id of the order that can be cancelled, None: there
        is none."""
        kind = action.action_type
        if kind not in self._known:
            return Refusal(ErrorType.INVALID_INSTANT_ACTION, f"no instant action is called {kind!r}")
        if kind == "cancelOrder":
            named = action.parameter("orderId")
            if active_order is None:
                return Refusal(ErrorType.NO_ORDER_TO_CANCEL, "no order is active")
            if named is not None and named != active_order:
                return Refusal(ErrorType.NO_ORDER_TO_CANCEL, f"order {named!r} is not active")
        takes = mode in _IN_CONTROL or kind in _ASKS
        if not takes and not (kind == "cancelOrder" and mode is OperatingMode.INTERVENED):
            return Refusal(ErrorType.INVALID_INSTANT_ACTION, f"the operating mode is {mode}")
        return None

    def begin(self, action: Action) -> None:
        """Take an action that is not refused."""
        status = ActionStatus.FINISHED
        match action.action_type:
            case "startPause":
                self._is_paused, status = True, ActionStatus.RUNNING
            case "stopPause":
                self._is_paused = False
                self._end("startPause", ActionStatus.FAILED)  # those that did not come to stand
            case "cancelOrder":
                status = ActionStatus.RUNNING
            case "stateRequest":
                self._state_wanted = True
            case "factsheetRequest":
                self._factsheet_wanted = True
            case _:
                self.forget_over()
        self._put(action, status)

    def fail(self, action: Action) -> None:
        """Take note of one that is refused."""
        self._put(action, ActionStatus.FAILED)

    def settle(self, *, standing: bool) -> None:
        """A pause is there when the vehicle stands."""
        self._stands = standing
        if standing:
            self._end("startPause", ActionStatus.FINISHED)

    def finish_cancels(self) -> None:
        """The order is cancelled."""
        self._end("cancelOrder", ActionStatus.FINISHED)

    def forget_over(self) -> None:
        """Tell no more of those that are over."""
        self._states = {name: one for name, one in self._states.items() if not one.action_status.is_over}
        self._let_go = 0

    def take_state_request(self) -> bool:
        """Whether a state was asked for since the last call."""
        wanted, self._state_wanted = self._state_wanted, False
        return wanted

    def take_factsheet_request(self) -> bool:
        """Whether the factsheet was asked for since the last call."""
        wanted, self._factsheet_wanted = self._factsheet_wanted, False
        return wanted

    def _end(self, kind: str, status: ActionStatus) -> None:
        for name, one in self._states.items():
            if self._goes_on(one, kind):
                self._states[name] = msgspec.structs.replace(one, action_status=status)

    def _put(self, action: Action, status: ActionStatus) -> None:
        self._met.append(action.action_id)
        self._states[action.action_id] = ActionState(
            action_id=action.action_id,
            action_type=action.action_type,
            action_descriptor=action.action_descriptor,
            action_status=status,
        )
        over = [name for name, one in self._states.items() if one.action_status.is_over]
        for name in over[: max(0, len(over) - _MOST_KEPT)]:
            del self._states[name]
            self._let_go += 1
