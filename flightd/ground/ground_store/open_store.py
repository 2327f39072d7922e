"""A store by its address: a file, or the URL of PostgreSQL."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.core.extras import missing_extra
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import Evidence, FolderEvidence, NoEvidence, SharedEvidence
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore

_POSTGRES = ("postgresql://", "postgres://")


def opened_store(address: str, evidence: str | None = None) -> GroundStore:
    """Made where it is not there yet.  Pictures lie in `evidence`, a folder or a URL that fsspec knows;
    unless that is given, in `FILE-evidence` beside a file's store.

    InputError for an address or a store that is none, or is newer, UnavailableError where it cannot be
    had."""
    if address.startswith(_POSTGRES):
        return GroundStore(_postgres(address), NoEvidence() if evidence is None else _evidence(evidence))
    if "://" in address:
        raise InputError(
            "neither a file nor a URL of PostgreSQL",
            key="--store",
            remedy="give FILE or postgresql://USER@HOST/DATABASE",
        )
    file = Path(address)
    if file.is_dir():
        raise InputError("is a folder", key=f"--store {address}", remedy="give a file in it")
    beside = str(file.with_name(f"{file.name}-evidence")) if evidence is None else evidence
    return GroundStore(SqliteEngine(file), _evidence(beside))


def _evidence(place: str) -> Evidence:
    return SharedEvidence(place) if "://" in place else FolderEvidence(Path(place))


def _postgres(url: str) -> Engine:
    try:
        from flightd.ground.ground_store.postgres_engine import PostgresEngine
    except ModuleNotFoundError:
        raise missing_extra("postgres", "--store postgresql://…") from None
    return PostgresEngine(url)
