"""What a client asks on the command port of the flight: orders, plans, pictures, the count."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from flightd.adapters.ground_link.messages.base import ClientRequest
from flightd.adapters.ground_link.messages.counts import Counts
from flightd.core.planned_flight import MOST_NODES
from flightd.core.preview import CameraName
from flightd.core.types import CommandKind

_Node = Annotated[str, Meta(max_length=64, description="node of the map, only with goto")]


class Hello(ClientRequest, frozen=True, tag="hello"):
    """First of all: do we speak the same protocol, who am I, where does what fly?  Answer: `welcome`."""

    client: Annotated[str, Meta(max_length=64, description="name of the client program, for the log")] = ""


class Order(ClientRequest, frozen=True, tag="command", omit_defaults=True):
    """A command to the mission; operators only.  Answer: `accepted`, or `refused`."""

    command: Annotated[
        CommandKind, Meta(description=", ".join(CommandKind) + " (plan: by `plan_flight`, not here)")
    ]
    node: _Node = ""
    plan: Annotated[
        str,
        Meta(
            max_length=64,
            description="only with start: id of the order of the plan that it is for; where another one "
            "stands, it does not start",
        ),
    ] = ""
    session: Annotated[
        str, Meta(max_length=64, description="from `welcome`; given, a daemon started since then refuses")
    ] = ""
    seen_ns: Annotated[
        int,
        Meta(
            ge=0,
            description="`stamp_ns` of the newest status that the person had; by one older than 5 s only "
            "stop, land and pause are taken: the order may have lain in a queue",
        ),
    ] = 0
    waits: Annotated[
        bool, Meta(description="only with goto: hold there until another order, rather than fly home")
    ] = False
    lands: Annotated[
        bool,
        Meta(description="only with goto: land on the pad of that node, and wait there for another flight"),
    ] = False
    counts: Annotated[
        Counts,
        Meta(
            description="only with goto: of all that its node sees only this is counted; null: as the plan's "
            "levels say"
        ),
    ] = None


class PlanFlight(ClientRequest, frozen=True, tag="plan_flight", omit_defaults=True):
    """The nodes that the next start flies, for a drone that stands disarmed and was given no start; it does
    not start by that.  Checked by the drone against its map and its battery.  Operators only, but with `dry`.
    Answer: `planned`, or `refused`."""

    nodes: Annotated[
        tuple[Annotated[str, Meta(max_length=64)], ...],
        Meta(max_length=MOST_NODES, description="nodes to visit; none: again what the configuration says"),
    ] = ()
    levels: Annotated[
        tuple[Annotated[int, Meta(ge=1, le=99)], ...],
        Meta(max_length=99, description="shelf levels that are counted there; none: all"),
    ] = ()
    counts: Annotated[
        Counts,
        Meta(
            description="of all that the nodes see only this is counted, whatever `levels` says, and nothing "
            "at a node that is not named; null: by `levels`"
        ),
    ] = None
    best_order: Annotated[
        bool, Meta(description="in the quickest order (many nodes: aisle by aisle), not as listed")
    ] = False
    dry: Annotated[bool, Meta(description="only say what it would be; by viewers, too")] = False
    waits: Annotated[
        bool, Meta(description="hold at the last node until another order, rather than fly home")
    ] = False
    session: Annotated[
        str, Meta(max_length=64, description="from `welcome`; given, a daemon started since then refuses")
    ] = ""
    seen_ns: Annotated[
        int, Meta(ge=0, description="`stamp_ns` of the newest status; by one older than 5 s it is refused")
    ] = 0


class AskPlan(ClientRequest, frozen=True, tag="plan"):
    """The plan that is flown, or would be with the next start, and what is left of it.  Answer: `plan`."""


class AskStatus(ClientRequest, frozen=True, tag="status"):
    """The newest status report.  Answer: `status`."""


class AskPicture(ClientRequest, frozen=True, tag="picture", omit_defaults=True):
    """A camera's next picture.  Answer: `picture`, with the JPEG as a second frame."""

    camera: Annotated[CameraName, Meta(description="down or front, of those in `welcome`")] = CameraName.DOWN


class AskInventory(ClientRequest, frozen=True, tag="inventory"):
    """What has been counted.  Answer: `inventory`, or `refused` where no store is kept."""


class Attend(ClientRequest, frozen=True, tag="attend"):
    """ "I watch this flight": operators only, to be repeated at least once a second.  When all who attend
    fall silent for `ground.lost_s`, the ground link counts as lost.  Answer: `accepted`."""

    leave: Annotated[bool, Meta(description="true: I stop watching, my silence means nothing")] = False
