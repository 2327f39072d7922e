"""What stands at places and what differs between runs follows from the looks, in whatever order they come."""

from __future__ import annotations

import random

import pytest

from flightd.core.inventory import LocationState, Observation, Standing
from flightd.ground.ground_store import derived
from flightd.ground.ground_store.batch import SentLook
from flightd.ground.ground_store.engine import Session
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import BEGIN, DAY, SITE, batch, look


def test_a_run_differs_where_the_count_before_it_said_otherwise(store: GroundStore) -> None:
    before = [look("A-1", "PAL-1"), look("A-2"), look("A-3", "PAL-3"), look("A-4", "x-4"), look("A-5", "5")]
    after = [
        look("A-1", run="tuesday", at_ns=BEGIN + DAY),
        look("A-2", "PAL-2", run="tuesday", at_ns=BEGIN + DAY),
        look("A-3", "PAL-33", run="tuesday", at_ns=BEGIN + DAY),
        look("A-4", "X-4", run="tuesday", at_ns=BEGIN + DAY),  # the same code
        look("A-5", run="tuesday", at_ns=BEGIN + DAY, state=LocationState.OCCLUDED),
        look("A-6", "PAL-6", run="tuesday", at_ns=BEGIN + DAY),  # never counted before
    ]
    store.take(batch(*after))
    assert store.differences(SITE, "tuesday") == []
    store.take(batch(*before))  # late
    found = {row["location"]: row["change"] for row in store.differences(SITE, "tuesday")}
    assert found == {"A-1": "gone", "A-2": "appeared", "A-3": "replaced", "A-5": "unseen"}
    (third,) = store.differences(SITE, "tuesday", after="A-2", limit=1)
    assert (third["texts"], third["before_texts"], third["before_run"]) == (["PAL-33"], ["PAL-3"], "monday")
    assert store.differences(SITE, "monday") == []


def _simulated(draw: random.Random) -> list[SentLook]:
    """Looks of some runs over three months at few places, in every state and standing."""
    unread = [LocationState.UNREADABLE, LocationState.OCCLUDED]
    looks = []
    for number in range(draw.randint(5, 40)):
        texts = draw.choice([(), ("a",), ("A",), ("b",), ("a", "b")])
        state = draw.choice(unread) if not texts and draw.random() < 0.3 else None
        run = draw.randrange(4)
        at_ns = BEGIN + (run * 20 + draw.randrange(25)) * DAY + draw.choice([0, number])
        standing = draw.choices(list(Standing), (1, 4, 1))[0]
        place = f"A-{draw.randrange(3)}"
        looks.append(look(place, *texts, run=f"run {run}", at_ns=at_ns, standing=standing, state=state))
    return looks


def _expected(looks: list[SentLook]) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """What stands and what differs, from all looks at once."""
    standing: dict[str, SentLook] = {}
    for one in looks:
        known = standing.setdefault(one.observation.id, one)
        if one.standing > known.standing:
            standing[one.observation.id] = one
    order = sorted(standing.values(), key=lambda one: (one.observation.utc_ns, one.observation.id))
    counting = [one.observation for one in order if one.standing is Standing.CONFIRMED]
    places: dict[str, object] = {one.observation.location: "not_visited" for one in looks}
    places |= {seen.location: (seen.state.value, seen.run) for seen in counting}
    differ: dict[str, dict[str, object]] = {one.observation.run: {} for one in looks}
    for run, differs in differ.items():
        for place in places:
            here = [seen for seen in counting if seen.location == place]
            own = [i for i, seen in enumerate(here) if seen.run == run]
            if own:
                earlier = [s for s in here[: own[-1]] if s.run != run and s.state.is_counted]
                now = here[own[-1]]
                if earlier and _says(earlier[-1]) != _says(now):
                    differs[place] = earlier[-1].run
    return places, differ


def _says(seen: Observation) -> object:
    return {read.text.casefold() for read in seen.reads} if seen.state.is_counted else None


@pytest.mark.parametrize("seed", range(12))
def test_the_order_of_delivery_changes_nothing(store: GroundStore, seed: int) -> None:
    draw = random.Random(seed)
    looks = _simulated(draw)
    sent = looks * 2
    draw.shuffle(sent)
    while sent:
        size = draw.randint(1, 12)
        store.take(batch(*sent[:size]))
        del sent[:size]
    places, differ = _expected(looks)
    stands = {
        row["location"]: (row["state"], row["run"]) if row["run"] else row["state"]
        for row in store.stock(SITE)
    }
    assert stands == places
    told = {
        run["run"]: {row["location"]: row["before_run"] for row in store.differences(SITE, run["run"])}
        for run in store.runs(SITE)
    }
    assert told == differ
    assert store.counts()["looks"] == len({one.observation.id for one in looks})


def test_a_late_delivery_asks_no_more_the_more_runs_came_after_it(
    store: GroundStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    for run in range(1, 31):
        seen = look("A-1", f"PAL-{run % 3}", run=f"run {run}", at_ns=BEGIN + run * DAY)
        store.take(batch(seen))
    asked: list[str] = []
    one = derived._one  # noqa: SLF001

    def noted(session: Session, question: str, *values: object) -> object:
        asked.append(question)
        return one(session, question, *values)

    monkeypatch.setattr(derived, "_one", noted)
    store.take(batch(look("A-1", "PAL-0", run="late")))
    assert len(asked) <= 2
    assert [row["before_run"] for row in store.differences(SITE, "run 1")] == ["late"]
