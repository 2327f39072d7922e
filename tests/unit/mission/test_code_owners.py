"""At which places one thing was found, and what that contradicts."""

from __future__ import annotations

from flightd.core.inventory import LocationState
from flightd.core.scanning import Finding, Settled
from flightd.core.types import CodeRead
from flightd.mission.scan.code_owners import CodeOwners
from flightd.mission.scan.pending_findings import PendingFindings


def found(place: str, *texts: str) -> Finding:
    reads = tuple(CodeRead("Code 128", text, (), True, 2, 1.0) for text in texts)
    return Finding(1, place, LocationState.READ, 0.99, reads, "", "A1", 0.0, 0.0, 1.0, 0.0)


def test_both_are_looked_at_again_and_what_hangs_at_both_is_asked_about_no_more() -> None:
    owners = CodeOwners()
    assert owners.take(found("A", "t")) is None
    first = owners.take(found("B", "t"))
    assert first is not None
    assert (first.others, first.again) == (("A",), frozenset({"A", "B"}))
    assert owners.take(found("A", "t")) is None
    second = owners.take(found("B", "t"))
    assert second is not None
    assert (second.others, second.again) == (("A",), frozenset())
    assert owners.take(found("C", "t")) is None
    other = owners.take(found("D", "t", "u")), owners.take(found("E", "t", "u"))
    assert other[0] is None
    assert other[1] is not None
    assert (other[1].others, other[1].again) == (("D",), frozenset({"D", "E"})), "and by another code it is"


def test_one_thing_is_at_two_places_however_its_labels_write_it_and_whatever_else_they_say() -> None:
    owners = CodeOwners()
    assert owners.take(found("A", "00340123450002439853")) is None
    content = owners.take(found("B", "003401234500024398530204006381333931375"))
    assert content is not None
    assert content.others == ("A",)
    assert owners.take(found("C", "PAL-7/L1")) is None
    assert owners.take(found("D", "pal-7/l1")) is not None
    assert owners.take(found("E", "003401234500024398461")) is None, "no SSCC of nearly its digits"


def test_a_place_that_is_taken_back_is_due_however_often_its_node_was() -> None:
    pending = PendingFindings(confirm_stops=2, revisits=0)
    for place in ("one", "two", "three"):
        pending.recall({place: "N", f"{place}'s other": "M"})
        assert pending.take_due() == ("N", "M")
        assert pending.drain() == (Settled((place, f"{place}'s other"), confirmed=False, booked=True),)
    pending.recall({"four": "N"})
    pending.begin()
    assert pending.take_due() == ()


def test_the_same_node_again_proves_no_more() -> None:
    pending = PendingFindings(confirm_stops=2, revisits=0)
    pending.arrive("M")
    pending.add("place")
    for node in ("N", "N"):
        pending.reached(node, node)
    assert pending.drain() == ()
    pending.reached("O", "O")
    assert pending.drain() == (Settled(("place",), confirmed=True),)
