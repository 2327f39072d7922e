"""Which store a command is about."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from flightd.core.errors import InputError, UnavailableError

if TYPE_CHECKING:
    from flightd.ground.ground_store.sender import Target
    from flightd.ground.ground_store.store import GroundStore

Store: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="FILE|URL",
        envvar="FLIGHTD_STORE",
        help="The store: a file, or postgresql://USER@HOST/DATABASE.",
        show_default=False,
    ),
]
Pictures: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--evidence",
        metavar="DIR|URL",
        help="Where the store's pictures lie: a folder, or sftp://USER@HOST/FOLDER, s3://BUCKET/FOLDER."
        "  Default: FILE-evidence; with PostgreSQL there is none.",
        show_default=False,
    ),
]


StoreOrStation: TypeAlias = Annotated[
    str,
    typer.Option(
        "--store",
        metavar="FILE|URL",
        envvar="FLIGHTD_STORE",
        help="The store: a file, made where it is not there, postgresql://USER@HOST/DATABASE, or the station"
        " that has it, https://HOST:PORT, with a key in FLIGHTD_STORE_KEY.",
        show_default=False,
    ),
]

Unless: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--unless",
        metavar="FILE",
        help="Do nothing while there is this file, and stop as it comes: /run/flightd/armed is there while"
        " the motors of a drone on this computer may turn.",
        show_default=False,
    ),
]


@contextmanager
def between_flights(
    store: str, evidence: str | None, unless: Path | None, *, made: bool = True
) -> Iterator[Target]:
    """As `target`; FlightBeganError where there is a file `unless`."""
    with target(store, evidence, made=made) as into:
        if unless is None:
            yield into
            return
        from flightd.ground.ground_store.between_flights import BetweenFlights

        yield BetweenFlights(into, unless)


@contextmanager
def target(store: str, evidence: str | None, *, made: bool = True) -> Iterator[Target]:
    """A store that is opened meanwhile, and `made` where it is not there, or a station.  Errors as `opened`,
    `opened_to_read` and `StationTarget`."""
    if store.startswith(("http://", "https://")):
        from flightd.ground.ground_store.station_target import StationTarget

        yield StationTarget(store, os.environ.get("FLIGHTD_STORE_KEY", ""))
        return
    with (opened if made else opened_to_read)(store, evidence) as found:
        yield found


def opened_to_read(store: str, evidence: str | None) -> GroundStore:
    """As `opened`, but a file that is not there is a mistyped one, and none is made."""
    if store and "://" not in store:
        try:
            Path(store).stat()  # `exists` raises for another user's folder, or tells that nothing is there
        except (FileNotFoundError, NotADirectoryError):
            remedy = "give that of one, or deliver into it"
            raise InputError("there is no such file", key=f"--store {store}", remedy=remedy) from None
        except OSError as err:
            remedy = "may flightd read file and folder?"
            raise UnavailableError(f"{err.strerror}", file=store, remedy=remedy) from None
    return opened(store, evidence)


def opened(store: str, evidence: str | None) -> GroundStore:
    """InputError, UnavailableError as `opened_store`."""
    try:
        from flightd.ground.ground_store.open_store import opened_store
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd store") from None
    return opened_store(store, evidence)
