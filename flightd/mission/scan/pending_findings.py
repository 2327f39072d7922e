"""Findings that are not proven yet, by the node at which they were made.  Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from flightd.core.scanning import Settled
from flightd.core.types import Event, EventLevel


@dataclass(slots=True)
class _AtNode:
    """What was found at one node; `stops` counts the nodes reached since."""

    node: str
    locations: list[str] = field(default_factory=list)
    stops: int = 0


class PendingFindings:
    """Call `arrive` at each node that is scanned, `add` for what is found there.  What is confirmed keeps the
    node that is `present`: more may be found there."""

    def __init__(self, confirm_stops: int, revisits: int) -> None:
        """Proven by so many stops further on; a node is due again at most `revisits` times in a flight."""
        self._confirm_stops = confirm_stops
        self._revisits = revisits
        self._nodes: list[_AtNode] = []
        self._settled: list[Settled] = []
        self._due: list[str] = []
        self._recalled: list[str] = []
        self._again: Counter[str] = Counter()
        self._reached = ""

    def arrive(self, node: str) -> None:
        """What is found from now on is found here."""
        if not self._nodes or self._nodes[-1].node != node:
            self._nodes.append(_AtNode(node))

    def add(self, location: str) -> None:
        """Something was found at the node arrived at."""
        self._nodes[-1].locations.append(location)

    def add_at(self, node: str, location: str) -> None:
        """Something was found at a node in passing."""
        at = next((at for at in self._nodes if at.node == node), None)
        if at is None:
            at = _AtNode(node)
            self._nodes.append(at)
        at.locations.append(location)
        at.stops = 0

    def recall(self, node_of: Mapping[str, str]) -> None:
        """What was found at these locations counts no more, whether or not it is confirmed; their nodes are
        due again, however often they were."""
        for at in self._nodes:
            at.locations = [code for code in at.locations if code not in node_of]
        self._settled.append(Settled(tuple(node_of), confirmed=False, booked=True))
        self._recalled += node_of.values()

    def reached(self, node: str, present: str) -> None:
        """Another certain stop: it proves what lies far enough back.  The same again proves no more."""
        for at in self._nodes:
            at.stops += at.node != node != self._reached
        self._reached = node
        self._confirm([at for at in self._nodes if at.stops >= self._confirm_stops], present)

    def confirm_at(self, node: str) -> None:
        """A label proves the place at `node`, where the drone is."""
        self._confirm([at for at in self._nodes if at.node == node], node)

    def confirm_all(self, present: str) -> None:
        """The whole way is proven."""
        self._confirm(self._nodes, present)

    def withdraw(self) -> tuple[str, ...]:
        """Nothing of it counts; its nodes are due again.  The locations it was found at."""
        codes = tuple(code for at in self._nodes for code in at.locations)
        if codes:
            self._settled.append(Settled(codes, confirmed=False))
        self._due += [at.node for at in self._nodes if at.locations and at.node not in self._due]
        self._nodes.clear()
        return codes

    @property
    def nodes(self) -> tuple[str, ...]:
        """Those whose findings are not proven yet, and those that are due again, in the order of their first
        visit as far as it is known."""
        pending = (at.node for at in self._nodes if at.locations)
        return tuple(dict.fromkeys((*pending, *self._due, *self._recalled)))

    def again(self, node: str) -> None:
        """This node is due again, as one whose findings were withdrawn."""
        if node not in self._due:
            self._due.append(node)

    def take_due(self) -> tuple[str, ...]:
        """The nodes to fly to once more, in the order of their first visit."""
        due = [node for node in self._due if self._again[node] < self._revisits]
        self._again.update(due)
        due = list(dict.fromkeys([*due, *self._recalled]))
        self._due.clear()
        self._recalled.clear()
        return tuple(due)

    def tell(self, now_ns: int) -> list[Event]:
        """What is not proven at the end: it stays pending in the inventory."""
        findings = sum(len(at.locations) for at in self._nodes)
        if not findings:
            return []
        nodes = ", ".join(at.node for at in self._nodes if at.locations)
        text = f"{findings} findings are not proven and stay pending, at {nodes}"
        return [Event(now_ns, EventLevel.WARNING, "unproven", text)]

    def begin(self) -> None:
        """Another flight: its way proves nothing that was found before, no node is due, and each may be
        again."""
        self._nodes.clear()
        self._due.clear()
        self._recalled.clear()
        self._again.clear()
        self._reached = ""

    def drain(self) -> tuple[Settled, ...]:
        """What was confirmed and withdrawn since the last call."""
        settled, self._settled = tuple(self._settled), []
        return settled

    def _confirm(self, proven: list[_AtNode], present: str) -> None:
        codes = [code for at in proven for code in at.locations]
        if codes:
            self._settled.append(Settled(tuple(codes), confirmed=True))
        for at in proven:
            at.locations.clear()
        self._nodes = [at for at in self._nodes if at.locations or at.node == present]
