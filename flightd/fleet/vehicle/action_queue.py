"""The actions of an order: which wait, which run beside each other, which keep the vehicle from driving."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from flightd.fleet.vda5050.order import Edge, Node
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionState, ActionStatus
from flightd.fleet.vehicle.abilities import ABILITIES
from flightd.fleet.vehicle.signals import Abort, Begin, Output, PauseAction, ResumeAction

_GOING = frozenset(
    {ActionStatus.INITIALIZING, ActionStatus.RUNNING, ActionStatus.PAUSED, ActionStatus.RETRIABLE}
)


@dataclass(slots=True)
class _Tracked:
    action: Action
    status: ActionStatus = ActionStatus.WAITING
    result: str | None = None


class ActionQueue:
    """All actions of one order by their ids, and those of the nodes that are reached in their sequence."""

    def __init__(self) -> None:
        self._all: dict[str, _Tracked] = {}
        self._due: list[str] = []

    @property
    def ids(self) -> frozenset[str]:
        """The ids of all that are known."""
        return frozenset(self._all)

    @property
    def is_over(self) -> bool:
        """Whether all are finished or failed."""
        return all(one.status.is_over for one in self._all.values())

    def is_over_of(self, action_id: str) -> bool:
        """Whether one is finished or failed, or not known."""
        tracked = self._all.get(action_id)
        return tracked is None or tracked.status.is_over

    def failure_of(self, action_id: str) -> str | None:
        """Why one failed, as far as that was told; None where it did not."""
        tracked = self._all.get(action_id)
        if tracked is None or tracked.status is not ActionStatus.FAILED:
            return None
        return tracked.result or ""

    @property
    def runs(self) -> bool:
        """Whether one is going on."""
        return any(one.status in _GOING for one in self._all.values())

    @property
    def due(self) -> tuple[Action, ...]:
        """Those of the nodes that are reached, as far as they are not over."""
        return tuple(self._all[one].action for one in self._due)

    @property
    def stops_driving(self) -> bool:
        """Whether the vehicle has to stand still for one that is due."""
        return any(self._all[one].action.blocking_type.stops_driving for one in self._due)

    def states(self) -> list[ActionState]:
        """As the state tells them."""
        return [
            ActionState(
                action_id=one.action.action_id,
                action_type=one.action.action_type,
                action_descriptor=one.action.action_descriptor,
                action_status=one.status,
                action_result=one.result,
            )
            for one in self._all.values()
        ]

    def clear(self) -> None:
        """Forget the order before."""
        self._all.clear()
        self._due.clear()

    def add(self, parts: Iterable[Node | Edge]) -> None:
        """Let the actions of these wait."""
        for part in parts:
            for action in part.actions:
                self._all[action.action_id] = _Tracked(action)

    def remove(self, parts: Iterable[Node | Edge]) -> None:
        """Take away those of a horizon that is no more."""
        for part in parts:
            for action in part.actions:
                self._all.pop(action.action_id, None)

    def reach(self, node: Node) -> None:
        """The actions of a node are due."""
        self._due += [action.action_id for action in node.actions]

    def start(self) -> Iterator[Output]:
        """Begin what may begin now, in sequence: HARD and SINGLE alone, the others beside each other."""
        running = [one for one in self._due if self._all[one].status in _GOING]
        for name in self._due:
            tracked = self._all[name]
            if tracked.status is not ActionStatus.WAITING:
                continue
            alone = tracked.action.blocking_type.alone
            if running and (alone or any(self._all[one].action.blocking_type.alone for one in running)):
                return
            tracked.status = ActionStatus.RUNNING
            running.append(name)
            yield Begin(tracked.action)

    def progress(self, action_id: str, status: ActionStatus, result: str | None) -> None:
        """What the vehicle tells of one; what is over stays as it is."""
        tracked = self._all.get(action_id)
        if tracked is None or tracked.status.is_over or tracked.status is ActionStatus.WAITING:
            return
        tracked.status, tracked.result = status, result
        if status.is_over:
            self._due.remove(action_id)

    def fail(self) -> Iterator[Output]:
        """Give up all that wait, and those that go on and can be left off."""
        for name, tracked in self._all.items():
            if tracked.status is ActionStatus.WAITING:
                tracked.status = ActionStatus.FAILED
            elif tracked.status in _GOING and self._can(tracked, lambda ability: ability.cancellable):
                tracked.status = ActionStatus.FAILED
                yield Abort(name)
        self._due = [name for name in self._due if not self._all[name].status.is_over]

    def pause(self) -> Iterator[Output]:
        """Pause those that go on and can be paused."""
        for name, tracked in self._all.items():
            if tracked.status is ActionStatus.RUNNING and self._can(
                tracked, lambda ability: ability.pausable
            ):
                tracked.status = ActionStatus.PAUSED
                yield PauseAction(name)

    def resume(self) -> Iterator[Output]:
        """Go on with those that are paused."""
        for name, tracked in self._all.items():
            if tracked.status is ActionStatus.PAUSED:
                tracked.status = ActionStatus.RUNNING
                yield ResumeAction(name)

    @staticmethod
    def _can(tracked: _Tracked, what: Callable[..., bool]) -> bool:
        ability = ABILITIES.get(tracked.action.action_type)
        return ability is None or what(ability)


def stops_at(nodes: Sequence[Node]) -> int:
    """How many of these nodes can be flown along before the vehicle has to stand still for an action."""
    for i, node in enumerate(nodes, start=1):
        if any(action.blocking_type.stops_driving for action in node.actions):
            return i
    return len(nodes)
