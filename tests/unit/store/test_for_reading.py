"""A store of somebody else, or on a medium that nobody can write, can be shown and exported all the same."""

from __future__ import annotations

import json
import resource
import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

import pytest
from typer.testing import CliRunner, Result

from flightd.adapters.store.for_reading import opened_for_reading
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


def test_what_a_power_cut_left_in_the_log_is_read_too(store: Path, folder: Path) -> None:
    cut = folder / "cut"
    with SqliteStore(store) as writer:
        writer.commit(Observation("r", "A-02", 2, LocationState.OCCLUDED, 0.0))
        shutil.copytree(store, cut)
    (cut / "inventory.db-shm").unlink()
    frozen(cut)
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


def test_that_there_is_no_room_for_the_copy_is_told_as_that(store: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(InventoryUnavailableError) as caught, opened_for_reading(store, untouched=True):
            pytest.fail("there is room")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    told = str(caught.value)
    assert told.startswith(f"{store}/inventory.db: no room for a copy in {gettempdir()}: ")
    assert told.endswith("; make room, or name another folder: TMPDIR=DIR")
