"""What a warehouse system asks stays until a newer look answers it, and is answered once under any cuts."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.core.inventory import Standing
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.store import GroundStore
from tests.command import Command
from tests.rigs.wms_exchange import (
    COUNTS,
    QUESTIONS,
    SITE,
    CutError,
    Cuts,
    Warehouse,
    after,
    counted,
    exchange,
    lying,
    once,
)

BOTH = QUESTIONS + COUNTS.partition("\n")[2].replace("NVE", 'BELEG = "reference", NVE')


class Clock:
    """Of the store; a run's looks are taken as if they had been seen then."""

    run = 0

    def __call__(self) -> int:
        return after(self.run)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def asked(engine: Callable[[], Engine], tmp_path: Path, clock: Clock) -> Iterator[GroundStore]:
    """A store in which places A1 to A3 were counted by a first run."""
    with GroundStore(engine(), FolderEvidence(tmp_path / "evidence"), clock) as opened:
        fly(opened, clock)
        yield opened


def fly(store: GroundStore, clock: Clock, **places: str) -> None:
    """A run of these places, or all of them as before."""
    clock.run += 1
    store.take(counted(clock.run, **(places or {"A1": "PAL-1", "A2": "", "A3": "PAL-3"})))


def drop(place: Path, text: str, name: str = "ask.csv") -> None:
    (place / "ask" / name).write_text(f"LgPla;Grund;Beleg\n{text}\n")


def test_what_was_asked_is_answered_once_though_nothing_changed(
    asked: GroundStore, place: Path, clock: Clock
) -> None:
    warehouse = Warehouse(place / "out")
    once(place, BOTH, asked)
    warehouse.take()
    told = warehouse.rows
    drop(place, "a1;pick was short;B-17\nA2;;")
    (taken,) = once(place, BOTH, asked).files
    assert (taken.taken, taken.said) == (True, "2 questions")
    assert asked.open_places(SITE) == {"A1", "A2"}
    assert once(place, BOTH, asked).sent == [], "an older look is no answer"
    fly(asked, clock, A1="PAL-1", A3="PAL-3")
    assert asked.open_places(SITE) == {"A2"}
    assert len(once(place, BOTH, asked).sent) == 1
    fly(asked, clock)
    assert len(once(place, BOTH, asked).sent) == 1
    fly(asked, clock)
    assert once(place, BOTH, asked).sent == []
    warehouse.take()
    assert warehouse.rows == [*told, "OK|A1|B-17|PAL-1", "LEER|A2||"]


def test_every_question_is_answered_exactly_once_wherever_it_is_cut(
    asked: GroundStore, place: Path, clock: Clock, cuts: Cuts
) -> None:
    warehouse = Warehouse(place / "out")
    once(place, BOTH, asked)
    warehouse.take()
    warehouse.files.clear()
    at, came = 0, True

    def cut_pass() -> bool:
        cuts.steps, cuts.at = 0, at
        try:
            once(place, BOTH, asked)
        except CutError:
            return True
        finally:
            cuts.at = 0
        return False

    while came:
        at += 1
        drop(place, f"A1;;B-{at}")
        came = cut_pass()
        fly(asked, clock)  # an answer, if it was asked before the cut: then the file is no other question
        once(place, BOTH, asked)
        fly(asked, clock)
        assert not asked.open_places(SITE)
        came |= cut_pass()
        warehouse.take()
        once(place, BOTH, asked)
        warehouse.take()
    assert at > 15
    assert warehouse.rows == [f"OK|A1|B-{number}|PAL-1" for number in range(1, at + 1)]
    assert len(asked.questions(SITE)) == at
    names = lying(place / "ask")
    assert len(names) == 2 * at
    assert all(name.startswith("done/") for name in names)


def test_what_is_open_is_not_asked_twice_and_each_who_asks_is_answered(
    asked: GroundStore, place: Path, clock: Clock
) -> None:
    erp = BOTH.replace('"wms"', '"erp"')
    for text in (BOTH, erp):
        once(place, text, asked)
    for _ in range(2):
        drop(place, "A1;;B-1\nA1;;B-1\nA1;;B-2")
        once(place, BOTH, asked)
        clock.run += 1
    assert len(asked.questions(SITE)) == 2
    drop(place, "A1;;E-1")
    once(place, erp, asked)
    fly(asked, clock)
    out = Warehouse(place / "out")
    out.take()
    out.files.clear()
    once(place, BOTH, asked)
    once(place, erp, asked)
    out.take()
    assert sorted(out.rows) == ["OK|A1|B-1, B-2|PAL-1", "OK|A1|E-1|PAL-1"]
    drop(place, "A1;;B-1")
    once(place, BOTH, asked)
    assert asked.open_places(SITE) == {"A1"}, "it was answered: this is another one"


def test_a_look_that_is_withdrawn_answers_nothing(asked: GroundStore, place: Path, clock: Clock) -> None:
    drop(place, "A1;;")
    once(place, QUESTIONS, asked)
    clock.run += 1
    (seen,) = counted(clock.run, A1="PAL-1").looks
    for standing in (Standing.PENDING, Standing.CONFIRMED, Standing.WITHDRAWN):
        asked.take(Batch(SITE, "north", looks=(SentLook(seen.observation, standing),)))
        is_answered = asked.open_places(SITE) == set()
        assert is_answered is (standing is Standing.CONFIRMED)


def test_questions_are_pages_newest_first_with_the_counts_that_answered(
    asked: GroundStore, place: Path, clock: Clock
) -> None:
    once(place, BOTH, asked)
    drop(place, "A1;pick was short;B-1")
    once(place, BOTH, asked)
    first_ns = clock()
    fly(asked, clock)
    (name,) = once(place, BOTH, asked).sent
    drop(place, "A2;;\nA3;;")
    once(place, BOTH, asked)
    rows = asked.questions(SITE, limit=2)
    assert {row["location"] for row in rows} == {"A2", "A3"}
    assert [(row["answered_ns"], row["file"]) for row in rows] == [(None, None)] * 2
    mark = Mark(rows[-1]["utc_ns"], bytes.fromhex(rows[-1]["id"]))
    (row,) = asked.questions(SITE, mark, 2)
    answered_ns = asked.history(SITE, "A1")[0]["utc_ns"]
    assert row == {
        "id": row["id"], "utc_ns": first_ns, "location": "A1", "who": "wms", "reason": "pick was short",
        "reference": "B-1", "answered_ns": answered_ns, "file": name,
    }  # fmt: skip
    fly(asked, clock)
    assert asked.questions(SITE, mark, 2) == [row], "a later look is no other answer"
    answered = [row["answered_ns"] for row in asked.questions(SITE, limit=2)]
    assert None not in answered, "though the counts are not told yet"


def test_rows_that_are_none_are_told_one_by_one(asked: GroundStore, place: Path) -> None:
    drop(place, "A1;;B-1\n;;B-2\nB-9;;B-3")
    (taken,) = once(place, QUESTIONS, asked).files
    lines = [
        "1 questions; 2 rows left out",
        "ask.csv: row 3: it says no place; fill in LgPla",
        "ask.csv: row 4: the store knows no place 'B-9'; correct it, or deliver an inventory that has it",
    ]
    assert taken.said.splitlines() == lines
    (report,) = (text for name, text in lying(place / "ask").items() if name.endswith(".txt"))
    assert report.splitlines() == lines
    assert asked.open_places(SITE) == {"A1"}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_column_of_places_is_enough(asked: GroundStore, place: Path, encoding: str) -> None:
    (place / "ask" / "ask.csv").write_bytes("LGPLA\nA1\nA2\n".encode(encoding))
    columns = '{ place = "LgPla" }'
    text = f"{QUESTIONS.partition('columns')[0]}columns = {columns}\n"
    assert [file.said for file in once(place, text, asked).files] == ["2 questions"]
    assert asked.open_places(SITE) == {"A1", "A2"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty; begin it with the names of its columns"),
        ("LgPla;Grund\nA1;x\n", "the first line has no column 'Beleg' (it says LgPla, Grund)"),
        ("LgPla;Grund;Beleg\n", "no row can be used: it has none but the heading"),
        ("LgPla;Grund;Beleg\nB-9;x;y\n", "no row can be used: ask.csv: row 2: the store knows no"),
        ("\0\0", "neither text nor a workbook"),
    ],
)  # fmt: skip
def test_what_is_of_no_use_is_refused(asked: GroundStore, place: Path, text: str, said: str) -> None:
    (place / "ask" / "ask.csv").write_text(text)
    (file,) = once(place, QUESTIONS, asked).files
    assert not file.taken
    assert file.said.startswith(said)
    assert asked.questions(SITE) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BOTH.replace(SITE, "hall 4", 1), "questions.site: counts of another site answer no question; give"),
        (QUESTIONS.replace('Grund"', 'Grund", what = 1'), "questions.columns.what: unknown key"),
        (
            f'{QUESTIONS}[expected]\ninbox = "ask"\nfolder = "x"\ncolumns = {{ place = "A", code = "B" }}',
            "questions.inbox: these files are expected stock; give another folder, or another pattern",
        ),
    ],
)
def test_a_wrong_key_is_one_line(place: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        exchange(place, text)
    assert str(refused.value).startswith(f"{place / 'wms.toml'}: {said}")


def test_questions_need_a_store_that_knows_the_site(asked: GroundStore, place: Path) -> None:
    with pytest.raises(InputError, match="questions are kept in a store; give --store"):
        once(place, QUESTIONS)
    (failure,) = exchange(place, QUESTIONS.replace(SITE, "hall 4"), asked).once().failures
    assert "questions.site: the store has no place of site 'hall 4'" in str(failure)


def test_the_command_shows_what_is_asked_for(flightd: Command, place: Path) -> None:
    from flightd.ground.ground_store.open_store import opened_store

    with opened_store(str(place / "counts.db")) as store:
        store.take(counted(1, A1="PAL-1", A2=""))
        drop(place, "A1;;\nA2;;")
        once(place, QUESTIONS, store)
    words = ("store", "show", "--store", place / "counts.db")
    assert flightd(*words).stdout.endswith("  2 places are asked for, and not looked at since\n")
    assert json.loads(flightd(*words, "--json").stdout)["asked_places"] == {SITE: ["A1", "A2"]}
