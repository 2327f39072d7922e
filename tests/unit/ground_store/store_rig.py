"""Looks as a drone counts and sends them, and what a store says of them."""

from __future__ import annotations

from typing import Any

from flightd.core.inventory import (
    CountPose,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    Standing,
    UndecidedCode,
)
from flightd.core.types import CodeRead
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.store import GroundStore

NS = 1_000_000_000
DAY = 86_400 * NS
BEGIN = 1_760_000_000 * NS
SITE = "hall 3"


def read(text: str) -> CodeRead:
    return CodeRead("QR Code", text, (), True, 3, 1.0, (("00", "340123450002439853"),))


def look(
    location: str = "A-1",
    *texts: str,
    run: str = "monday",
    at_ns: int = BEGIN,
    standing: Standing = Standing.CONFIRMED,
    state: LocationState | None = None,
    evidence: str = "",
    fill: PlaceFill | None = None,
    undecided: tuple[UndecidedCode, ...] = (),
) -> SentLook:
    known = (LocationState.EMPTY, LocationState.READ, LocationState.SEVERAL)[min(len(texts), 2)]
    pose = CountPose("A1", 0.25, -1.0, 0.9, -1.57)
    reads = tuple(map(read, texts))
    looked = run, location, at_ns, state or known, 0.875, reads, pose, evidence
    seen = Observation(*looked, fill=fill, undecided=undecided)
    return SentLook(seen, standing)


def batch(*looks: SentLook, places: tuple[PlannedLocation, ...] = (), site: str = SITE) -> Batch:
    return Batch(site, "drone-1", places, looks)


def places_of(store: GroundStore) -> dict[str, tuple[str, list[str], str | None]]:
    return {row["location"]: (row["state"], row["texts"], row["run"]) for row in store.stock(SITE)}


def rows_of(opened: Engine, question: str) -> list[tuple[Any, ...]]:
    """What a database says, read past the store."""
    try:
        with opened.reading() as session:
            return [tuple(row) for row in session.rows(question)]
    finally:
        opened.close()


def seen(number: int, evidence: str = "") -> Observation:
    """Ten places are counted over and over, a run each month."""
    reads = (CodeRead("QR Code", f"PAL-{number % 7}", (), True, 3, 1.0),) if number % 4 else ()
    state = LocationState.READ if reads else LocationState.EMPTY
    at_ns = BEGIN + number // 10 * 30 * 86_400 * NS + number * NS
    return Observation(f"run {number // 10}", f"A-{number % 10}", at_ns, state, 0.5, reads, None, evidence)
