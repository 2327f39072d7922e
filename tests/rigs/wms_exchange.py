"""Drop folders of a station and a warehouse system, and a process that is killed at any step."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import LocationState, Observation, PlannedLocation, Standing
from flightd.core.types import CodeRead
from flightd.ground import shared_folder
from flightd.ground.expected_stock_book import ExpectedStock, ExpectedStockBook
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.wms_exchange.exchange import Exchange, Exchanged
from flightd.ground.wms_exchange.exchange_file import load_exchange
from flightd.runtime import remote_files

_BEGIN = 1_760_000_000_000_000_000
_RUN_NS = 100
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
QUESTIONS = f"""name = "wms"
[questions]
inbox = "ask"
site = "{SITE}"
settle_s = 0
columns = {{ place = "LgPla", reason = "Grund", reference = "Beleg" }}
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


def cut_exchanges(monkeypatch: pytest.MonkeyPatch) -> Cuts:
    """Of every file system and every transaction of an exchange from now on."""
    cuts, opened = Cuts(), remote_files.file_system

    def cut_files(address: str, file: Path | str, key: str, what: str) -> tuple[Any, str]:
        files, path = opened(address, file, key, what)
        return CutFiles(files, cuts), path

    monkeypatch.setattr(shared_folder, "file_system", cut_files)
    for kind, name in (
        (GroundStore, "next_file"), (GroundStore, "file_lies_there"), (ExpectedStockBook, "keep"),
        (ExpectedStockBook, "moved"), (GroundStore, "ask"), (GroundStore, "moved"),
    ):  # fmt: skip
        monkeypatch.setattr(kind, name, _cut_method(getattr(kind, name), cuts))
    return cuts


def _cut_method(method: Callable[..., Any], cuts: Cuts) -> Callable[..., Any]:
    def cut(own: object, *given: object, **named: object) -> Any:
        return cuts.around(method)(own, *given, **named)

    return cut


def make_place(folder: Path) -> Path:
    """A station with an inventory of three places, and empty folders."""
    for name in ("in", "ask", "out", "station"):
        (folder / name).mkdir()
    with SqliteStore(folder / "station") as inventory:
        inventory.plan(PlannedLocation(code, "A1") for code in ("A-1", "A-2", "Ä-3"))
    return folder


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
        seen = Observation(f"run {run}", place, _BEGIN + _RUN_NS * run + number, state, 0.9, reads)
        looks.append(SentLook(seen, Standing.CONFIRMED))
    return Batch(SITE, "north", looks=tuple(looks))


def after(run: int) -> int:
    """A time (UTC, ns) between a run's looks and the next one's."""
    return _BEGIN + _RUN_NS * run + _RUN_NS // 2


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
