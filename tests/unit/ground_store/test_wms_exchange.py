"""Drop folders: a warehouse system's files are taken once, and it is told what changed, under any cuts."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationState, Observation, PlannedLocation, Standing
from flightd.core.types import CodeRead
from flightd.ground.expected_stock_book import ExpectedStock, ExpectedStockBook
from flightd.ground.ground_store import outbox
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.uploaded_comparison import column_words, compare_upload
from flightd.ground.wms_exchange import drop_folder
from flightd.ground.wms_exchange.exchange import Exchange, Exchanged, alone
from flightd.ground.wms_exchange.exchange_file import load_exchange
from tests.command import Command

_BEGIN = 1_760_000_000_000_000_000
SITE = "hall 3"
EXPECTED = """name = "wms"
[expected]
inbox = "in"
folder = "station"
settle_s = 0
columns = { place = "LgPla", code = "NVE", quantity = "Menge" }
"""
COUNTS = f"""name = "wms"
[counts]
outbox = "out"
site = "{SITE}"
columns = {{ STATUS = "state", PLATZ = "place", NVE = "code" }}
states = {{ read = "OK", empty = "LEER" }}
"""


class CutError(Exception):
    """A kill."""


class Cuts:
    """The process is killed at the step of this number: before, after or amid what it does outside."""

    def __init__(self, at: int = 0) -> None:
        self.at = at
        self.steps = 0
        self.done: list[str] = []

    def step(self) -> None:
        self.steps += 1
        if self.steps == self.at:
            raise CutError

    def around(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def done(*given: object, **named: object) -> Any:
            self.step()
            answer = work(*given, **named)
            self.done.append(work.__name__)
            self.step()
            return answer

        return done


class CutStream:
    """A file that is written by halves."""

    def __init__(self, stream: Any, cuts: Cuts) -> None:
        self._stream = stream
        self._cuts = cuts

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, data: bytes) -> None:
        self._stream.write(data[: len(data) // 2])
        self._cuts.step()
        self._stream.write(data[len(data) // 2 :])


class CutFiles:
    """A file system that is cut."""

    def __init__(self, files: Any, cuts: Cuts) -> None:
        self._files = files
        self._cuts = cuts

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._files, name)
        return self._cuts.around(found) if name in {"mv", "makedirs", "ls"} else found

    def open(self, path: str, mode: str) -> Any:
        self._cuts.step()
        stream = self._files.open(path, mode)
        return CutStream(stream, self._cuts) if mode == "wb" else stream


@pytest.fixture
def cuts(monkeypatch: pytest.MonkeyPatch) -> Cuts:
    """Of every file system and every transaction of an exchange from now on."""
    cuts, opened = Cuts(), drop_folder.file_system

    def cut_files(address: str, file: Path, key: str) -> tuple[Any, str]:
        files, path = opened(address, file, key)
        return CutFiles(files, cuts), path

    monkeypatch.setattr(drop_folder, "file_system", cut_files)
    for kind, name in (
        (GroundStore, "next_file"), (GroundStore, "file_lies_there"), (ExpectedStockBook, "keep"),
        (ExpectedStockBook, "moved"),
    ):  # fmt: skip
        monkeypatch.setattr(kind, name, _cut_method(getattr(kind, name), cuts))
    return cuts


def _cut_method(method: Callable[..., Any], cuts: Cuts) -> Callable[..., Any]:
    def cut(own: object, *given: object, **named: object) -> Any:
        return cuts.around(method)(own, *given, **named)

    return cut


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A station with an inventory of three places, and empty folders."""
    for name in ("in", "out", "station"):
        (tmp_path / name).mkdir()
    with SqliteStore(tmp_path / "station") as inventory:
        inventory.plan(PlannedLocation(code, "A1") for code in ("A-1", "A-2", "Ä-3"))
    return tmp_path


def exchange(place: Path, text: str, store: GroundStore | None = None, **given: Any) -> Exchange:
    path = place / "wms.toml"
    path.write_text(text, encoding="utf-8")
    given.setdefault("sleep", lambda _: None)
    return Exchange(path, load_exchange(path), store, **given)


def once(place: Path, text: str, store: GroundStore | None = None, **given: Any) -> Exchanged:
    done = exchange(place, text, store, **given).once()
    assert done.failures == []
    return done


def counted(run: int, **places: str) -> Batch:
    """Each place with its codes."""
    looks = []
    for number, (place, texts) in enumerate(places.items()):
        reads = tuple(CodeRead("QR Code", text, (), True, 3, 1.0) for text in texts.split())
        state = (LocationState.EMPTY, LocationState.READ, LocationState.SEVERAL)[min(len(reads), 2)]
        seen = Observation(f"run {run}", place, _BEGIN + 100 * run + number, state, 0.9, reads)
        looks.append(SentLook(seen, Standing.CONFIRMED))
    return Batch(SITE, "north", looks=tuple(looks))


class Warehouse:
    """A WMS that takes files of the outbox away, each name once; the same name has the same content."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.files: dict[str, bytes] = {}

    def take(self) -> None:
        for file in sorted(self._folder.glob("*.csv")):
            data = file.read_bytes()
            assert self.files.setdefault(file.name, data) == data
            file.unlink()

    @property
    def rows(self) -> list[str]:
        """In the order of the files, without their headings."""
        return [
            "|".join(row)
            for name in sorted(self.files)
            for row in list(csv.reader(self.files[name].decode().splitlines(), delimiter=";"))[1:]
        ]


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


def kept(place: Path) -> tuple[ExpectedStock, bytes]:
    book = ExpectedStockBook(place / "station")
    upload, data = book.kept("."), book.data(".")
    assert upload is not None
    assert data is not None
    return upload, data


def lying(folder: Path) -> dict[str, str]:
    """Every file below it."""
    return {
        str(file.relative_to(folder)): file.read_text()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


@pytest.mark.parametrize(
    ("heading", "encoding"),
    [("nve;MENGE;lgpla", "cp1252"), ("Menge,LGPLA,NVE", "utf-8-sig"), ("LgPla\tNVE\tMenge", "utf-16")],
)
def test_files_are_read_however_they_are_written(place: Path, heading: str, encoding: str) -> None:
    separator = next(mark for mark in ";,\t" if mark in heading)
    row = {"lgpla": "ä-3", "nve": "PAL-1", "menge": "4"}
    names = heading.split(separator)
    text = f"{heading}\n{separator.join(row[name.casefold()] for name in names)}\n"
    (place / "in" / "Stock.CSV").write_bytes(text.encode(encoding))
    (taken,) = once(place, EXPECTED).files
    assert (taken.taken, taken.said) == (True, "1 rows")
    upload, data = kept(place)
    assert data == text.encode(encoding)
    assert (upload.name, upload.who) == ("Stock.CSV", "wms")
    asked = [
        names[n].casefold() for n in (upload.columns.place, upload.columns.code, upload.columns.quantity or 0)
    ]
    assert asked == ["lgpla", "nve", "menge"]


def test_the_newest_file_is_kept_and_one_that_comes_again_is_taken_again(place: Path) -> None:
    for text in ("A-1;PAL-1;1", "A-1;PAL-2;1", "A-1;PAL-1;1"):
        (place / "in" / "stock.csv").write_text(f"LGPLA;NVE;MENGE\n{text}\n")
        assert [file.taken for file in once(place, EXPECTED).files] == [True]
        assert kept(place)[1].decode().splitlines()[1] == text
    assert len(lying(place / "in")) == 4
    assert once(place, EXPECTED).files == []
    upload, data = kept(place)
    other = data.replace(b"PAL-1", b"PAL-3")
    ExpectedStockBook(place / "station").keep(".", upload, other)  # somebody, at the page
    (place / "in" / "stock.csv").write_bytes(data)
    assert once(place, EXPECTED).files[0].taken
    assert kept(place)[1] == data


def test_the_page_compares_with_what_was_dropped(place: Path) -> None:
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\na-1;PAL-1;12\n")
    once(place, EXPECTED)
    upload, data = kept(place)
    (place / "s.csv").write_bytes(data)
    told = json.loads(
        compare_upload(place / "station", place / "s.csv", column_words(upload.columns)).content
    )
    assert (told["rows"], told["unknown_places"], told["outcome_counts"]["uncounted"]) == (1, [], 1)


def test_a_file_that_is_written_still_is_left_alone(place: Path) -> None:
    file = place / "in" / "stock.csv"
    names = ("stock.csv.part", ".stock.csv", "x.tmp", "readme.pdf")
    for name in names:
        (place / "in" / name).touch()
    file.write_text("LGPLA;NVE;MENGE\n")

    def written_on(_: float) -> None:
        with file.open("a") as stream:
            stream.write("A-1;PAL-1;1\n")

    assert once(place, EXPECTED, sleep=written_on).files == []
    assert [taken.said for taken in once(place, EXPECTED).files] == ["1 rows"]
    assert {name for name in lying(place / "in") if "/" not in name} == set(names)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("LGPLA;SSCC;MENGE\nA-1;PAL-1;1\n", "the first line has no column 'NVE' (it says LGPLA,"),
        ("LGPLA;NVE;NVE;MENGE\nA-1;P;Q;1\n", "the first line has 2 columns 'NVE'"),
        ("LGPLA;NVE;MENGE\n", "no row can be used: it has none but the heading"),
        ("LGPLA;NVE;MENGE\nA-1;1.2E+17;1\n", "no row can be used: row 2: 1.2E+17: the spreadsheet"),
        ("LGPLA;NVE;MENGE\nB-7;PAL-1;1\n", "the inventory knows none of its places, of which the first"),
        ("\0\0", "neither text nor a workbook"),
        ('LGPLA;NVE;MENGE\n"A-1;PAL-1;1\n', "not CSV:"),
    ],
)  # fmt: skip
def test_what_is_of_no_use_is_refused_with_one_line_beside_it(place: Path, text: str, said: str) -> None:
    (place / "in" / "stock.csv").write_text(text)
    (file,) = once(place, EXPECTED).files
    assert not file.taken
    assert file.said.startswith(said)
    (refused, line) = lying(place / "in").items()
    assert refused[1] == text
    assert line == (f"{refused[0]}.txt", f"{file.said}\n")
    assert refused[0].startswith("refused/stock-")
    assert ExpectedStockBook(place / "station").kept(".") is None


def test_an_inventory_that_the_station_reads_elsewhere_has_its_prefix(place: Path) -> None:
    (place / "station").rename(place / "drones")
    (place / "station").mkdir()
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    elsewhere = EXPECTED.replace("settle_s", 'flights = ["drones"]\nsettle_s')
    (failure,) = exchange(place, elsewhere).once().failures
    assert str(failure).endswith("there is no inventory '.'; choose among drones:.")
    assert once(place, elsewhere.replace("settle_s", 'inventory = "drones:."\nsettle_s')).files[0].taken
    assert ExpectedStockBook(place / "station").kept("drones:.") is not None


def test_what_is_left_out_is_said(place: Path) -> None:
    (place / "in" / "s.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\nA-2;PAL-2;many\nB-1;PAL-3;1\n")
    (file,) = once(place, EXPECTED).files
    assert file.said == (
        "3 rows; 1 left out: row 3: 'many' is no quantity; 1 places that the inventory does not know: B-1"
    )


def test_a_file_is_taken_once_wherever_it_is_cut(place: Path, cuts: Cuts) -> None:
    at, came = 0, True
    while came:
        at += 1
        text = f"LGPLA;NVE;MENGE\nA-1;PAL-{at};1\n"
        (place / "in" / "stock.csv").write_text(text)
        (place / "in" / "wrong.csv").write_text(f"{at}\n")
        cuts.steps, cuts.at, cuts.done = 0, at, []
        try:
            once(place, EXPECTED)
            came = False
        except CutError:
            pass
        cuts.at = 0
        once(place, EXPECTED)
        assert (cuts.done.count("keep"), kept(place)[1].decode()) == (1, text)
        lies = lying(place / "in")
        assert sorted(lies.values()).count(text) == 1
        assert len(lies) == 4 * at, lies
        assert not [name for name in lies if not name.startswith(("done/", "refused/"))]
    assert at > 20


def test_a_file_of_the_same_name_that_comes_while_one_is_claimed_is_another(place: Path, cuts: Cuts) -> None:
    (place / "in" / "stock.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    while lying(place / "in").keys() != {"taking/stock.csv"}:
        cuts.steps, cuts.at = 0, cuts.at + 1
        with pytest.raises(CutError):
            once(place, EXPECTED)
    cuts.at = 0
    (place / "in" / "stock.csv").write_text("LGPLA;NVE;MENGE\nA-1;PAL-2;1\n")
    assert len(once(place, EXPECTED).files) == 2
    assert "PAL-2" in kept(place)[1].decode()


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
        ("name = 'wms'", "nothing is exchanged; add a table [expected], [counts], or both"),
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
