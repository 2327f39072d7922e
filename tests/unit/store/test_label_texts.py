"""Values of printed text stay with their look, whatever is merged in which order; they make no other look."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from decimal import Decimal
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.label_values import LabelValue, ValueKind, ValueSource, told_text
from tests.unit.store.kill_at_random import look


def text(
    value: str | date | Decimal, kind: ValueKind = ValueKind.LOT, confidence: float = 0.95
) -> LabelValue:
    return LabelValue(kind, told_text(value), "", ValueSource.TEXT, confidence)


FOUND = (text("B1"), text(date(2027, 1, 31), ValueKind.EXPIRY), text(Decimal(48), ValueKind.QUANTITY, 0.5))


def test_a_look_is_taken_out_with_what_was_found_in_it(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        for number in (1, 2):
            store.commit(look(number))
            store.keep_texts(look(number).id, FOUND, "one")
        store.forget([look(1).id])
        assert [seen.id for seen, _ in store.looks()] == [look(2).id]
        assert not store.was_searched(look(1).id, "one")


def test_what_a_search_found_is_read_back_with_its_look(tmp_path: Path) -> None:
    seen = look(1)
    with SqliteStore(tmp_path) as store:
        store.commit(seen)
        assert not store.was_searched(seen.id, "one")
        store.keep_texts(seen.id, FOUND, "one")
        store.keep_texts("of no look", FOUND, "one")
        assert store.history(seen.location) == [replace(seen, texts=FOUND)]
        assert store.history(seen.location)[0].id == seen.id
        assert (store.was_searched(seen.id, "one"), store.was_searched(seen.id, "two")) == (True, False)
        store.keep_texts(seen.id, (), "two")
        assert store.locations()[0].observation == seen
        store.commit(seen)
        assert store.was_searched(seen.id, "two")


def test_texts_are_merged_the_same_in_any_order(tmp_path: Path) -> None:
    one, two = SqliteStore(tmp_path / "one"), SqliteStore(tmp_path / "two")
    searches: tuple[tuple[LabelValue, ...], ...] = ((), FOUND, (text("B1"),), (text("B2"),))
    with one, two:
        for number, found in enumerate(searches):
            for store, mine in ((one, found), (two, searches[number - 1])):
                store.commit(look(number))
                store.keep_texts(look(number).id, mine, "one")
        two.commit(look(9))
        two.keep_texts(look(9).id, FOUND, "one")
        one.merge(two)
        two.merge(one)
        assert one.locations() == two.locations()
        texts = {seen.id: seen.texts for record in one.locations() if (seen := record.observation)}
    assert texts[look(9).id] == FOUND
    assert texts[look(0).id] == (text("B2"),), "what found something counts more than what found nothing"
