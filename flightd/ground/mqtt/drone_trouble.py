"""What keeps a drone from going on with its order, as its fleet's manager is told."""

from __future__ import annotations

from flightd.core.errors import FlightdError, InputError, RunError
from flightd.fleet.vda5050.errors import ErrorType, level_of
from flightd.fleet.vda5050.state import Error, Reference
from flightd.ground.mqtt.order_flight import CommandNext, PlanNext


def unreachable(node: str, what: str) -> Error:
    """It does not get to a node (empty: to one of several)."""
    return _error(ErrorType.NODE_UNREACHABLE, what, node)


def of_refusal(act: PlanNext | CommandNext, err: FlightdError) -> Error | None:
    """What a refusal of `act` says of the order; None where nobody knows whether it was taken."""
    what = str(err).removeprefix("refused: ")
    nodes = act.nodes if isinstance(act, PlanNext) else (act.node,)
    if isinstance(err, InputError) and any(nodes):
        return unreachable(nodes[0] if len(nodes) == 1 else "", what)
    return _error(ErrorType.COMMAND_REFUSED, what) if isinstance(err, InputError | RunError) else None


def _error(kind: ErrorType, what: str, node: str = "") -> Error:
    about = [Reference(reference_key="nodeId", reference_value=node)] if node else None
    return Error(error_type=kind, error_level=level_of(kind), error_references=about, error_description=what)
