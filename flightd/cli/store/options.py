"""Which store a command is about."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

if TYPE_CHECKING:
    from flightd.ground.ground_store.store import GroundStore

Store: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="FILE|URL",
        envvar="FLIGHTD_STORE",
        help="The store: a file, made where it is not there, or postgresql://USER@HOST/DATABASE.",
        show_default=False,
    ),
]
Pictures: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--evidence",
        metavar="DIR",
        help="Where the store's pictures lie.  Default: FILE-evidence; in PostgreSQL there is none.",
        show_default=False,
    ),
]


def opened(store: str, evidence: Path | None) -> GroundStore:
    """InputError, UnavailableError as `opened_store`."""
    try:
        from flightd.ground.ground_store.open_store import opened_store
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd store") from None
    return opened_store(store, evidence)
