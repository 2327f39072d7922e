"""What changed is told once in the other program's columns, under any cuts; mistakes are one line each."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import Standing
from flightd.ground.ground_store import outbox
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.wms_exchange.exchange import alone
from tests.command import Command
from tests.rigs.wms_exchange import (
    COUNTS,
    EXPECTED,
    SITE,
    CutError,
    Cuts,
    Warehouse,
    counted,
    exchange,
    once,
)


def test_what_changed_is_told_once_in_the_columns_that_are_asked_for(
    store: GroundStore, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox, "MOST_PLACES", 2)
    warehouse = Warehouse(place / "out")
    store.take(counted(1, A1="PAL-1", A2="", A3="PAL-3 PAL-4"))
    assert len(once(place, COUNTS, store).sent) == 2
    warehouse.take()
    assert next(iter(warehouse.files.values())).splitlines()[0] == b"STATUS;PLATZ;NVE"
    told = ["OK|A1|PAL-1", "LEER|A2|", "several|A3|PAL-3", "several|A3|PAL-4"]
    assert warehouse.rows == told
    store.take(counted(2, A1="PAL-1", A2="PAL-9", A3="PAL-4 pal-3"))
    assert len(once(place, COUNTS, store).sent) == 1
    assert once(place, COUNTS, store).sent == []
    warehouse.take()
    assert warehouse.rows == [*told, "OK|A2|PAL-9"]
    store.take(counted(3, A1="PAL-1"))
    assert once(place, COUNTS, store).sent == []
    assert len(once(place, COUNTS.replace("[counts]", "[counts]\nrecounts = true"), store).sent) == 1
    other = COUNTS.replace('"wms"', '"erp"')
    assert len(once(place, other, store).sent) == 2  # whoever is new is told all


def test_a_count_that_is_withdrawn_is_told(store: GroundStore, place: Path) -> None:
    warehouse = Warehouse(place / "out")
    (seen,) = counted(1, A1="PAL-1").looks
    store.take(Batch(SITE, "north", looks=(seen,)))
    once(place, COUNTS, store)
    gone = SentLook(seen.observation, Standing.WITHDRAWN)
    store.take(Batch(SITE, "north", looks=(gone,)))
    once(place, COUNTS, store)
    warehouse.take()
    assert warehouse.rows == ["OK|A1|PAL-1", "not_visited|A1|"]


def test_nothing_that_is_told_is_lost_or_doubled_by_cuts(
    store: GroundStore, place: Path, cuts: Cuts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox, "MOST_PLACES", 1)
    warehouse = Warehouse(place / "out")
    expected: list[str] = []
    came = True
    run = 0
    while came:
        run += 1
        store.take(counted(run, A1=f"PAL-{run}", A2=f"CASE-{run}"))
        expected += [f"OK|A1|PAL-{run}", f"OK|A2|CASE-{run}"]
        cuts.steps, cuts.at = 0, run
        try:
            once(place, COUNTS, store)
            came = False
        except CutError:
            pass
        warehouse.take()
        cuts.at = 0
        once(place, COUNTS, store)
        warehouse.take()
    assert run > 15
    assert warehouse.rows == expected
    assert list((place / "out").iterdir()) == []


def test_folders_may_be_wherever_fsspec_finds_them(place: Path, store: GroundStore) -> None:
    import fsspec

    memory = fsspec.filesystem("memory")
    for name in ("in", "out"):
        memory.makedirs(f"/{place.name}/{name}", exist_ok=True)
    memory.pipe(f"/{place.name}/in/stock.csv", b"LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    text = (EXPECTED + COUNTS.partition("\n")[2]).replace('= "in"', f'= "memory://{place.name}/in"')
    store.take(counted(1, A1="PAL-1"))
    done = once(place, text.replace('= "out"', f'= "memory://{place.name}/out"'), store)
    assert [file.taken for file in done.files] == [True]
    (name,) = done.sent
    assert memory.cat(f"/{place.name}/out/{name}") == b"STATUS;PLATZ;NVE\r\nOK;A1;PAL-1\r\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = 'wms'", "nothing is exchanged; add a table [expected], [questions] or [counts]"),
        (EXPECTED.replace("inbox", "inbx"), "expected.inbx: unknown key; did you mean inbox?"),
        (EXPECTED.replace('code = "NVE",', ""), "expected.columns.code: is missing; add it"),
        (COUNTS.replace('"code"', '"codes"'), "counts.columns.NVE: "),
        (COUNTS.replace('NVE = "code"', 'X = "run"'), 'counts: no column is "code"'),
        (COUNTS.replace("states = { read", "states = { full"), "counts.states.full"),
        (COUNTS + 'encoding = "latin"', "counts.encoding: expected one of"),
    ],
)  # fmt: skip
def test_a_wrong_key_is_one_line(place: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        exchange(place, text)
    assert str(refused.value).startswith(f"{place / 'wms.toml'}: {said}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (EXPECTED.replace('"in"', '"none"'), "expected.inbox: {}/none: there is no such folder; make it"),
        (EXPECTED.replace('"station"', '"in"'), "expected.inventory: {}/in: there is no inventory '.'"),
        (EXPECTED.replace('"in"', '"odd://x/y"'), "expected.inbox: odd://x/y: cannot be opened: "),
        (EXPECTED.replace('"in"', '"sftp://a:b@x/y"'), "expected.inbox: a password does not belong"),
        (COUNTS.replace(SITE, "hall 4"), "counts.site: there is no site 'hall 4'; flightd store show"),
        (COUNTS.replace('"out"', '"none"'), "counts.outbox: {}/none: there is no such folder"),
    ],
)  # fmt: skip
def test_what_cannot_be_had_is_one_line(place: Path, text: str, said: str, tmp_path: Path) -> None:
    from flightd.ground.ground_store.open_store import opened_store

    with opened_store(str(tmp_path / "s.db")) as store:
        (failure,) = exchange(place, text, store).once().failures
    assert str(failure).startswith(f"{place / 'wms.toml'}: {said.format(place)}")


def test_a_text_that_the_encoding_has_not_is_refused_and_told_later(store: GroundStore, place: Path) -> None:
    store.take(counted(1, A1="PAL-\N{SNOWMAN}"))
    narrow = COUNTS.replace("[counts]", '[counts]\nencoding = "cp1252"')
    (failure,) = exchange(place, narrow, store).once().failures
    assert "counts.encoding: cp1252 has no" in str(failure)
    assert len(once(place, COUNTS, store).sent) == 1


def test_two_exchanges_by_one_file_do_not_meet(place: Path) -> None:
    exchange(place, EXPECTED)
    path = place / "wms.toml"
    with alone(path), pytest.raises(UnavailableError, match="another process"), alone(path):
        pass


def test_the_command_says_what_it_did(flightd: Command, place: Path) -> None:
    from flightd.ground.ground_store.open_store import opened_store

    exchange(place, EXPECTED + COUNTS.partition("\n")[2])
    with opened_store(str(place / "counts.db")) as store:
        store.take(counted(1, A1="PAL-1"))
    (place / "in" / "stock.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    words = ("store", "exchange", place / "wms.toml", "--store", place / "counts.db")
    ended = flightd(*words)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.splitlines()[0] == "stock.csv taken: 1 rows"
    assert ended.stdout.splitlines()[1].endswith("-000001.csv written")
    assert flightd(*words).stdout == "nothing new\n"
    (place / "in" / "stock.csv").write_text("LGPLA;MENGE\nA-1;1\n")
    ended = flightd(*words, "--json")
    assert ended.returncode == 1
    assert json.loads(ended.stdout)["files"][0]["taken"] is False
    assert ended.stderr.startswith(
        "flightd: stock.csv: 1 of 1 files refused, the first: the first line has no"
    )
    ended = flightd(*words[:3])
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.endswith("wms.toml: counts: counts come out of a store; give --store\n")
