"""A store of somebody else, or on a medium that nobody can write, can be shown and exported all the same."""

from __future__ import annotations

import json
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

import pytest
from typer.testing import CliRunner, Result

from flightd.adapters.store.for_reading import copied_for_reading, opened_for_reading
from flightd.adapters.store.sqlite import SqliteStore
from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.cli.main import app
from flightd.core.errors import InputError
from flightd.core.inventory import LocationState, Observation, PlannedLocation
from tests.rigs.somebody_else import as_somebody_else


@pytest.fixture
def folder() -> Iterator[Path]:
    """One that everybody may enter."""
    with TemporaryDirectory() as made:
        Path(made).chmod(0o755)
        yield Path(made)


@pytest.fixture
def store(folder: Path) -> Path:
    stock = folder / "stock"
    with SqliteStore(stock) as store:
        store.plan([PlannedLocation("A-01", "A1"), PlannedLocation("A-02", "A1")])
        name = store.keep_evidence(b"\xff\xd8 a picture")
        store.commit(Observation("r", "A-01", 1, LocationState.EMPTY, 0.9, evidence=name))
    return stock


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(app, ["inventory", *map(str, words)])


def frozen(folder: Path) -> Path:
    for path in [*folder.rglob("*"), folder]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    return folder


def cut_off(store: Path) -> Path:
    """The store beside it as a power cut leaves it, with a look in its log alone."""
    cut = store.with_name("cut")
    with SqliteStore(store) as writer:
        writer.commit(Observation("r", "A-02", 2, LocationState.OCCLUDED, 0.0))
        shutil.copytree(store, cut)
    (cut / "inventory.db-shm").unlink()
    return cut


@contextmanager
def no_room() -> Iterator[None]:
    """Meanwhile no file may be written that is as large as an inventory."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def content(store: Path) -> dict[str, bytes]:
    """The database and its log; the index beside them is that of all who read in its writer's process."""
    return {path.name: path.read_bytes() for path in store.glob("inventory.db*") if path.suffix != ".db-shm"}


def states(store: SqliteStore) -> list[LocationState]:
    return [record.state for record in store.locations()]


def test_a_store_without_write_permission_is_shown_exported_and_compared(store: Path, folder: Path) -> None:
    before = sorted(path.name for path in store.iterdir())
    books = folder / "books.csv"
    books.write_text("location,code\nA-01,PALLET-1\n")
    frozen(store)
    for words in (("show", store), ("export", store), ("compare", store, books)):
        run(*words)
    with as_somebody_else():
        shown, exported = run("show", store, "--json"), run("export", store)
        compared = run("compare", store, books, "--json")
    assert [told.exit_code for told in (shown, exported, compared)] == [0, 0, 0], shown.output
    assert json.loads(shown.stdout)["states"] == {"empty": 1, "not_visited": 1}
    assert "A-01,empty" in exported.stdout
    assert json.loads(compared.stdout)["outcomes"]["empty_but_expected"] == 1
    assert sorted(path.name for path in store.iterdir()) == before


def test_what_a_power_cut_left_in_the_log_is_read_too(store: Path) -> None:
    cut = frozen(cut_off(store))
    run("show", store)
    with as_somebody_else():
        shown = run("show", cut, "--json")
    assert shown.exit_code == 0, shown.output
    assert json.loads(shown.stdout)["states"] == {"empty": 1, "occluded": 1}


def test_where_one_may_write_it_is_the_store_itself(store: Path) -> None:
    with opened_for_reading(store) as opened:
        (record, _) = opened.locations()
        assert record.observation is not None
        assert opened.evidence.path(record.observation.evidence).read_bytes() == b"\xff\xd8 a picture"
    with pytest.raises(InputError, match=r"holds no inventory\.db"), opened_for_reading(store / "none"):
        pass


def test_what_is_wrong_is_said_of_the_store_and_not_of_a_copy(store: Path) -> None:
    run("show", store)
    (store / "inventory.db").write_bytes(b"no database at all" * 100)
    frozen(store)
    with as_somebody_else():
        shown = run("show", store)
    assert isinstance(shown.exception, InputError)
    assert f"{store / 'inventory.db'}: no inventory, or a damaged one" in str(shown.exception)


def test_one_that_is_to_stay_as_it_is_takes_no_room_where_it_can_be_read_so(store: Path) -> None:
    with no_room(), opened_for_reading(store, untouched=True) as opened:
        assert states(opened) == [LocationState.EMPTY, LocationState.NOT_VISITED]
    with SqliteStore(store) as writer:
        writer.commit(Observation("r", "A-02", 2, LocationState.OCCLUDED, 0.0))
        before = content(store)
        with no_room(), opened_for_reading(store, untouched=True) as opened:
            assert states(opened) == [LocationState.EMPTY, LocationState.OCCLUDED]
        assert content(store) == before


def test_one_that_is_to_stay_as_it_is_is_copied_where_only_a_writer_can_read_it(store: Path) -> None:
    cut = cut_off(store)
    before = content(cut)
    with opened_for_reading(cut, untouched=True) as opened:
        assert states(opened) == [LocationState.EMPTY, LocationState.OCCLUDED]
    assert content(cut) == before


def test_a_copy_stays_as_it_was_while_others_write_the_store(store: Path) -> None:
    with SqliteStore(store) as writer, copied_for_reading(store) as copy:
        writer.commit(Observation("r", "A-02", 2, LocationState.OCCLUDED, 0.0))
        assert states(copy) == [LocationState.EMPTY, LocationState.NOT_VISITED]


def test_that_there_is_no_room_for_the_copy_is_told_as_that(store: Path) -> None:
    cut = cut_off(store)
    with (
        no_room(),
        pytest.raises(InventoryUnavailableError) as caught,
        opened_for_reading(cut, untouched=True),
    ):
        pytest.fail("there is room")
    told = str(caught.value)
    assert told.startswith(f"{cut}/inventory.db: no room for a copy in {gettempdir()}: ")
    assert told.endswith("; make room, or name another folder: TMPDIR=DIR")
