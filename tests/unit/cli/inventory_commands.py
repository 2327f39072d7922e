"""`flightd inventory` as a test calls it, and an inventory to call it with."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from flightd.adapters.store.sqlite import SqliteStore
from flightd.cli.main import app
from flightd.core.errors import InputError
from flightd.core.inventory import CountPose, LocationState, Observation, PlannedLocation
from flightd.core.types import CodeRead

RUNNER = CliRunner()


def run(*arguments: object) -> str:
    """Standard output of a command that must succeed."""
    result = RUNNER.invoke(app, ["inventory", *map(str, arguments)])
    assert result.exit_code == 0, result.output + repr(result.exception)
    return result.stdout


def error_of(*arguments: object) -> str:
    """The one line of a command that must refuse its input."""
    result = RUNNER.invoke(app, ["inventory", *map(str, arguments)])
    assert isinstance(result.exception, InputError), result.output + repr(result.exception)
    text = str(result.exception)
    assert "\n" not in text
    return text


def look(location: str, number: int, *reads: CodeRead, state: str = "") -> Observation:
    texts = {read.text for read in reads}
    chosen = state or ("read" if len(texts) == 1 else "several")
    pose = CountPose("A2", 1.5, 0.0, 1.6, 0.0)
    return Observation("flight-1", location, 10**18 + number, LocationState(chosen), 0.9, reads, pose)


def code(text: str, symbology: str = "QR Code", **gs1: str) -> CodeRead:
    return CodeRead(symbology, text, (), True, 1, 1.0, tuple((key[1:], value) for key, value in gs1.items()))


def counted_store(folder: Path) -> Path:
    """Eight places, six of them counted: codes of every kind, an empty and an occluded one."""
    with SqliteStore(folder) as store:
        store.plan([PlannedLocation(f"A-{n:02d}", "A2") for n in range(1, 9)])
        store.commit(look("A-01", 1, code("=HYPERLINK(1)")))
        store.commit(look("A-02", 2, code("0109501101530003", "Code 128", a01="09501101530003", a10="B/1")))
        store.commit(look("A-03", 3, code("x", "Data Matrix", a01="09501101530003", a21="S 1")))
        store.commit(
            look("A-04", 4, code("y", "Code 128", a00="395011010013000129"), code("036602301467", "UPC-A"))
        )
        store.commit(look("A-05", 5, state="empty"))
        store.commit(look("A-06", 6, state="occluded"))
    return folder
