"""What is delivered to the store: batches, the same whenever they are made of the same."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

from flightd.core.errors import InputError
from flightd.core.inventory import Observation, PlannedLocation, Standing
from flightd.ground.ground_store.reads_text import printed_text

MOST_LOOKS = 500
"""In one batch."""
_MOST_NAME_CHARS = 300
"""Of what is looked up by an index: PostgreSQL refuses entries of more than 2,704 bytes."""
_MOST = 1 << 63
"""Whole numbers are below it, as both databases keep them."""
MOST_BATCH_BYTES = 4 << 20
"""Of one batch as JSON; a station takes no more."""


@dataclass(frozen=True, slots=True)
class SentLook:
    """A look and how it stands at its sender."""

    observation: Observation
    standing: Standing


@dataclass(frozen=True, slots=True)
class SentFlight:
    """A flight that is over; `id` is the SHA-256 of the beginning of its log."""

    id: str
    drone: str
    began_ns: int
    duration_s: float | None
    mission: str
    outcome: str
    reason: str
    verdict: str
    nodes_planned: int | None
    nodes_visited: int | None


@dataclass(frozen=True, slots=True)
class SentDecision:
    """What a person decided about a place."""

    id: str
    place: str
    utc_ns: int
    seen_ns: int
    what: str
    who: str
    note: str


@dataclass(frozen=True, slots=True)
class SentPerson:
    """Somebody whom a station knows, without password and key."""

    name: str
    role: str
    seen_ns: int


@dataclass(frozen=True, slots=True)
class SentLine:
    """A line of a station's audit, as it was written."""

    utc_ns: int
    person: str
    act: str
    target: str
    outcome: str
    line: str

    @property
    def id(self) -> bytes:
        return hashlib.sha256(self.line.encode()).digest()


@dataclass(frozen=True, slots=True)
class Batch:
    """All of one `site` ("" where it says nothing of one); `source` is who sends it, for people."""

    site: str
    source: str
    places: tuple[PlannedLocation, ...] = ()
    looks: tuple[SentLook, ...] = ()
    flights: tuple[SentFlight, ...] = ()
    decisions: tuple[SentDecision, ...] = ()
    people: tuple[SentPerson, ...] = ()
    audit: tuple[SentLine, ...] = ()
    planned_ns: int = 0
    """Of the newest look of the inventory whose plan the `places` are; 0 where that is not said.  No part of
    the `id`."""

    @property
    def is_plan(self) -> bool:
        """Places alone: the same again may be news, where another plan came in between."""
        return not (self.looks or self.flights or self.decisions or self.people or self.audit)

    @property
    def id(self) -> bytes:
        """The same for the same content, whoever sends it."""
        digest = hashlib.sha256(self.site.encode("utf-8", "surrogatepass"))
        for part in (self.places, self.flights, self.decisions, self.people, self.audit):
            digest.update(repr(part).encode("utf-8", "surrogatepass"))
        for look in self.looks:
            digest.update(f"{look.observation.id}{look.standing:d}".encode())
            if look.observation.texts:
                digest.update(printed_text(look.observation.texts).encode())
        return digest.digest()

    def check(self) -> None:
        """InputError for what no database keeps: texts with NUL or half a character in them, names too long
        for an index, numbers and ids that are none, looks without a site, and too much at once."""
        if len(self.looks) > MOST_LOOKS:
            raise InputError(f"a batch of {len(self.looks)} looks", remedy=f"send at most {MOST_LOOKS}")
        if not self.site and (self.places or self.looks or self.flights or self.decisions):
            raise InputError("of no site", file=self.source, remedy="say which: --site NAME")
        for look in self.looks:
            if not 0 <= look.observation.utc_ns < _MOST:
                raise InputError(f"{look.observation.location}: a look at no time", file=self.source)
        for name in self._names():
            if len(name) > _MOST_NAME_CHARS:
                raise InputError(f"{name[:40]}…: a name of {len(name)} characters", file=self.source,
                                 remedy=f"give at most {_MOST_NAME_CHARS}")  # fmt: skip
        for text in (*self._names(), *self._texts()):
            if "\0" in text or not _is_text(text):
                raise InputError(f"the name {text[:200]!r} is no text", file=self.source)
        for what, digest in self._digests():
            if not is_sha256(digest):
                raise InputError(f"{what} {digest[:80]!r} is no SHA-256 in hexadecimal", file=self.source)
        for what, number in self._numbers():
            if number is not None and not 0 <= number < _MOST:
                raise InputError(f"{what} is out of range", file=self.source)

    def _names(self) -> Iterator[str]:
        """What stands in an index."""
        yield from (self.site, self.source)
        yield from (place.code for place in self.places)
        for look in self.looks:
            yield from (look.observation.run, look.observation.location)
        for decision in self.decisions:
            yield from (decision.id, decision.place)
        yield from (person.name for person in self.people)

    def _texts(self) -> Iterator[str]:
        yield from (place.node for place in self.places)
        yield from (look.observation.pose.node for look in self.looks if look.observation.pose)
        for flight in self.flights:
            yield from (flight.drone, flight.mission, flight.outcome, flight.reason, flight.verdict)
        for decision in self.decisions:
            yield from (decision.what, decision.who, decision.note)
        yield from (person.role for person in self.people)
        for line in self.audit:
            yield from (line.person, line.act, line.target, line.outcome, line.line)

    def _digests(self) -> Iterator[tuple[str, str]]:
        yield from (("the flight", flight.id) for flight in self.flights)
        yield from (
            ("the picture", look.observation.evidence) for look in self.looks if look.observation.evidence
        )

    def _numbers(self) -> Iterator[tuple[str, float | None]]:
        for flight in self.flights:
            yield from (("began_ns", flight.began_ns), ("duration_s", flight.duration_s))
            yield from (("nodes_planned", flight.nodes_planned), ("nodes_visited", flight.nodes_visited))
        for decision in self.decisions:
            yield from (
                ("utc_ns of a decision", decision.utc_ns),
                ("seen_ns of a decision", decision.seen_ns),
            )
        yield from (("seen_ns of a person", person.seen_ns) for person in self.people)
        yield from (("utc_ns of an audit line", line.utc_ns) for line in self.audit)
        yield ("planned_ns", self.planned_ns)
        yield from (("pallets_deep", place.pallets_deep << 32) for place in self.places)  # 32 bits


@dataclass(frozen=True, slots=True)
class Receipt:
    """What is in the store now, through to its disk: `new` looks, `changed` in their standing, and those that
    it had `already`.  Not there are those `ahead` of its clock.  `store` is the store's own id."""

    store: str
    batch: str
    new: int
    changed: int
    already: int
    ahead: int = 0


def _is_text(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def is_sha256(text: str) -> bool:
    """In hexadecimal."""
    return len(text) == 64 and set(text) <= set("0123456789abcdef")
