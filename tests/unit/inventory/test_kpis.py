"""The figures over time: paces without breaks, rates of what is there, changes that both runs saw."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flightd.adapters.store.sqlite import SqliteStore
from flightd.cli.main import app
from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord, LocationState, Observation, PlannedLocation, Standing
from flightd.core.types import CodeRead
from flightd.inventory.kpis.document import kpi_document, kpis_of
from flightd.inventory.kpis.read_rates import ReadRate, module_class, read_rates
from flightd.inventory.kpis.run_changes import ChangeKind, PlaceChange, run_changes
from flightd.inventory.kpis.run_figures import counted_of_run, run_figures
from flightd.inventory.place_view import Look

SECOND = 10**9


def code(text: str, symbology: str = "QR Code", module_px: float | None = None) -> CodeRead:
    return CodeRead(symbology, text, (), True, 1, 1.0, module_px=module_px)


def seen(place: str, at_s: float, *texts: str | CodeRead, state: str = "", run: str = "one") -> Observation:
    reads = tuple(text if isinstance(text, CodeRead) else code(text) for text in texts)
    chosen = state or {0: "empty", 1: "read"}.get(len(reads), "several")
    return Observation(run, place, round(at_s * SECOND), LocationState(chosen), 0.9, reads)


def counts(*looks: Observation) -> list[Look]:
    return [(look, Standing.CONFIRMED) for look in looks]


def test_a_run_has_its_pace_without_the_breaks_and_its_retakes() -> None:
    looks = counts(*(seen(f"A-{n}", 10 * n, "X") for n in range(10)))
    looks += counts(seen("A-3", 1000, "X"), seen("A-10", 1010))
    looks.append((seen("A-11", 95, "X"), Standing.WITHDRAWN))
    (run,) = run_figures(looks)
    assert (run.locations, run.looks, run.withdrawn, run.looked_again) == (11, 13, 1, 1)
    assert run.hours == pytest.approx(105 / 3600), "90 s, 5 s and 10 s; the battery was changed for 905 s"
    assert run.locations_per_hour == pytest.approx(11 / 105 * 3600)
    assert run.states == {LocationState.READ: 10, LocationState.EMPTY: 1}
    assert run_figures(counts(seen("A", 1)))[0].locations_per_hour is None


def test_what_was_flown_past_and_left_open_was_looked_at_again_by_its_one_look_at_a_stop() -> None:
    looks = [replace(seen(f"A-{n}", 10 * n, "X"), again=n < 3) for n in range(10)]
    (run,) = run_figures(counts(*looks))
    assert (run.looked_again, run.retake_share) == (3, 0.3)


def test_runs_stand_in_the_order_of_their_last_looks() -> None:
    looks = counts(seen("A", 5, run="late"), seen("A", 2, run="early"), seen("B", 1, run="late"))
    assert [run.run for run in run_figures(looks)] == ["early", "late"]


def test_a_label_is_to_be_read_again_until_it_has_gone() -> None:
    small, large = code("S", "EAN-13", 2.5), code("L", "QR Code", 5.0)
    looks = counts(
        seen("A", 1, small), seen("A", 2, state="unreadable"), seen("A", 3, small), seen("A", 4, "other"),
        seen("A", 5, state="unreadable"),
        seen("B", 1, large), seen("B", 2), seen("B", 3, state="unreadable"),
    )  # fmt: skip
    looks.append((seen("B", 4, "elsewhere"), Standing.WITHDRAWN))
    rates = read_rates(looks)
    assert rates.by_symbology == {
        "EAN-13": ReadRate(codes=1, looks=2, read=1),
        "QR Code": ReadRate(codes=2, looks=1, read=0),  # the other one, unread once; L was gone at once
    }
    assert rates.by_module == {
        "2 to 2.75 px": ReadRate(1, 2, 1), "4 to 6 px": ReadRate(1, 0, 0),
    }  # fmt: skip
    assert (rates.by_module["4 to 6 px"].share, rates.by_symbology["EAN-13"].share) == (None, 0.5)


@pytest.mark.parametrize(
    ("module_px", "name"),
    [(0.5, "0 to 2 px"), (2.75, "2.75 to 4 px"), (6, "6 px and more"), (80, "6 px and more")],
)
def test_module_sizes_are_classed(module_px: float, name: str) -> None:
    assert module_class(module_px) == name


def test_changes_are_said_only_of_places_that_both_runs_saw() -> None:
    before = counts(
        seen("A", 1, "X"), seen("B", 1), seen("C", 1, "Y"), seen("D", 1, "Z"), seen("E", 1, "04006381333931"),
        seen("F", 1, "W"),
    )  # fmt: skip
    after = counts(*(
        replace(look, run="two")
        for look in (
            seen("A", 9), seen("B", 9, "X"), seen("C", 9, "Q"), seen("D", 9, state="occluded"),
            seen("E", 9, "4006381333931"), seen("G", 9, "W"),
        )
    ))  # fmt: skip
    looks = before + after
    changes = run_changes(counted_of_run(looks, "one"), counted_of_run(looks, "two"))
    assert changes == (
        PlaceChange("A", ChangeKind.EMPTIED, ("X",), moved_to=(("X", "B"),)),
        PlaceChange("B", ChangeKind.FILLED, (), ("X",), moved_from=(("X", "A"),)),
        PlaceChange("C", ChangeKind.REPLACED, ("Y",), ("Q",)),
        PlaceChange("D", ChangeKind.UNKNOWN, ("Z",)),
        PlaceChange("E", ChangeKind.SAME, ("04006381333931",), ("4006381333931",)),
        PlaceChange("F", ChangeKind.UNKNOWN, ("W",)),
        PlaceChange("G", ChangeKind.UNKNOWN, (), ("W",)),
    )


def test_a_code_that_came_to_two_places_has_moved_to_none() -> None:
    looks = counts(seen("A", 1, "X"), seen("B", 1), seen("C", 1))
    looks += counts(
        *(seen(place, 9, *texts, run="two") for place, texts in {"A": [], "B": ["X"], "C": ["X"]}.items())
    )
    changes = run_changes(counted_of_run(looks, "one"), counted_of_run(looks, "two"))
    assert all(not change.moved_to and not change.moved_from for change in changes)


def test_the_age_of_a_count_is_since_somebody_saw_what_is_there() -> None:
    counted, hidden = seen("A", 0, "X"), seen("A", 3600, state="occluded")
    records = [LocationRecord("A", "N", hidden), LocationRecord("B", "N", None)]
    kpis = kpis_of(records, counts(counted, hidden), 7200 * SECOND)
    assert [(age.seen_ns, age.counted_ns, age.age_s) for age in kpis.ages] == [
        (3600 * SECOND, 0, 7200.0), (None, None, None),
    ]  # fmt: skip
    assert kpi_document(kpis)["age"] == {"never_counted": 1, "median_h": 2.0, "oldest_h": 2.0}
    assert kpi_document(kpis)["changes"] is None, "there is only one run"


def test_the_newest_two_runs_are_compared_unless_others_are_asked_for() -> None:
    looks = counts(*(seen("A", n, run=run) for n, run in enumerate(("mo", "tu", "we"))))
    options: tuple[tuple[str | None, ...], ...] = ((), ("mo",), (None, "tu"), (None, "mo"))
    assert [kpis_of([], looks, 0, *asked).compared for asked in options] == [
        ("tu", "we"), ("mo", "we"), ("mo", "tu"), None,
    ]  # fmt: skip
    with pytest.raises(InputError, match=r"--from th: is no run of this inventory; known: mo, tu, we"):
        kpis_of([], looks, 0, "th")


def test_the_command_tells_it(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        store.plan([PlannedLocation("C", "N")])
        for look in (seen("A", 1, "X"), seen("B", 3, "Y")):
            store.commit(look)
        for look in (seen("A", 9, run="two"), seen("B", 9, "X", run="two")):
            store.commit(look)
    told = CliRunner().invoke(app, ["inventory", "kpis", str(tmp_path)])
    assert told.exit_code == 0, told.output
    assert "one                  2 locations, 2 looks, 3,600 an hour, 0.0% looked at again" in told.stdout
    assert "A                emptied   X -> - (X to B)" in told.stdout
    assert "1 never counted" in told.stdout
    document = json.loads(CliRunner().invoke(app, ["inventory", "kpis", str(tmp_path), "--json"]).stdout)
    assert document["changes"]["counts"] == {
        "same": 0, "filled": 0, "emptied": 1, "replaced": 1, "unknown": 0,
    }  # fmt: skip
    assert [place["location"] for place in document["places"]] == ["A", "B", "C"]
