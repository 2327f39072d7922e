"""Which drone goes to which dock: by when it would be ready again, not by what is near or free."""

from __future__ import annotations

from flightd.fleet.traffic.dock_queue import docks_of
from flightd.fleet.traffic.docks import Dock, DockKind, Waiting, chosen_docks

SWAP = Dock("S", 1, DockKind.SWAP, 90.0)
CONTACT = Dock("C", 2, DockKind.CONTACT, 1800.0)
FREE = {"S": 0, "C": 0}


def _chosen(free_ms: dict[str, int], *waiting: Waiting) -> dict[str, str]:
    return {drone: dock.name for drone, dock in chosen_docks((SWAP, CONTACT), free_ms, waiting).items()}


def test_a_swap_takes_the_same_whatever_is_left_and_contacts_what_is_missing() -> None:
    assert (SWAP.service_ms(0.1), SWAP.service_ms(0.8)) == (90_000, 90_000)
    assert (CONTACT.service_ms(0.5), CONTACT.service_ms(1.0)) == (900_000, 0)


def test_a_far_swap_is_chosen_before_near_contacts_where_little_is_left() -> None:
    assert _chosen(FREE, Waiting("a", 0.3, {"S": 120_000, "C": 10_000})) == {"a": "S"}
    assert _chosen(FREE, Waiting("a", 0.88, {"S": 240_000, "C": 10_000})) == {"a": "C"}


def test_waiting_for_a_swap_is_better_than_charging_long_until_the_queue_is() -> None:
    near = {"S": 10_000, "C": 20_000}
    assert _chosen({"S": 90_000, "C": 0}, Waiting("a", 0.3, near)) == {"a": "S"}
    queue = [Waiting(f"drone-{i:02}", 0.3, near) for i in range(20)]
    chosen = _chosen(FREE, *queue)
    at_contacts = [drone for drone, dock in chosen.items() if dock == "C"]
    assert at_contacts == ["drone-14"], "as late as it is ready sooner there than behind 14 swaps"


def test_who_reaches_one_dock_alone_takes_that_and_who_reaches_none_is_sent_nowhere() -> None:
    assert _chosen(FREE, Waiting("a", 0.2, {"C": 5_000}), Waiting("b", 0.2, {})) == {"a": "C"}


def test_swaps_are_spread_among_the_docks() -> None:
    docks = docks_of([(f"P{i}", i) for i in range(6)], swaps=2, swap_s=90.0, charge_s=1800.0)
    assert [dock.kind.value for dock in docks] == ["contact", "contact", "swap"] * 2
    assert {dock.full_s for dock in docks if dock.kind is DockKind.SWAP} == {90.0}
    assert docks_of([], swaps=0, swap_s=90.0, charge_s=1800.0) == ()
