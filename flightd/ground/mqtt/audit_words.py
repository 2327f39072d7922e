"""What a fleet's manager did, as the audit has it."""

from __future__ import annotations

from flightd.fleet.vda5050.order import Order
from flightd.fleet.vehicle.signals import Decided
from flightd.ground.mqtt.order_flight import CommandNext, PlanNext


def decision_in_words(decided: Decided) -> tuple[str, str]:
    """What it ordered, and why that is refused; empty where it is not."""
    about, refusal = decided.about, decided.refusal
    if isinstance(about, Order):
        nodes = " ".join(n.node_id if n.released else f"({n.node_id})" for n in about.nodes)
        what = f"order {about.order_id}/{about.order_update_id}: {nodes}"
    else:
        what = f"{about.action_type} {about.action_id}"
    return what, "" if refusal is None else f"{refusal.error}: {refusal.what}"


def act_in_words(act: PlanNext | CommandNext) -> str:
    """What the drone was commanded for it."""
    if isinstance(act, PlanNext):
        return f"plan {', '.join(act.nodes)}"
    return f"{act.kind} {act.node} {'onto its pad' if act.lands else ''}".rstrip()
