"""A batch taken into the tables: what is there already stays, a look's standing only rises, and what was
found printed only grows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from flightd.core.inventory import Observation, Standing
from flightd.ground.ground_store.batch import Batch, SentDecision, SentLook
from flightd.ground.ground_store.derived import Moment, Touched, renew
from flightd.ground.ground_store.engine import Engine, Session, listed
from flightd.ground.ground_store.events import EventKind, Noted
from flightd.ground.ground_store.fill_text import fill_text
from flightd.ground.ground_store.reads_text import printed_text, reads_text, says_more, undecided_text

_LOOK = f"INSERT INTO observation VALUES ({', '.join('?' * 18)}) ON CONFLICT DO NOTHING"
_TOLD = {
    "mission": "''", "outcome": "''", "verdict": "''",
    "duration_s": "NULL", "nodes_planned": "NULL", "nodes_visited": "NULL",
}  # fmt: skip
"""Each with what stands where it is not known."""
_ENDED = "('completed', 'aborted', 'taken over')"
_IS_OLDER = f"flight.outcome IN {_ENDED} AND excluded.outcome NOT IN {_ENDED}"
"""A copy of the log from before its end."""


def _told(name: str, blank: str) -> str:
    """A column of a flight whose log ended or was judged since: what is not known of it any more stays."""
    new, known = (f"nullif({of}.{name}, {blank})" for of in ("excluded", "flight"))
    return (
        f"{name} = CASE WHEN {_IS_OLDER} THEN coalesce({known}, {new}, {blank})"
        f" ELSE coalesce({new}, {known}, {blank}) END"
    )


_FLIGHT = (
    f"INSERT INTO flight VALUES ({', '.join('?' * 11)}) ON CONFLICT (id) DO UPDATE SET"
    f" {', '.join(_told(name, blank) for name, blank in _TOLD.items())},"
    f" reason = CASE WHEN {_IS_OLDER} OR excluded.reason = '' AND excluded.outcome = flight.outcome"
    " THEN flight.reason ELSE excluded.reason END"
)
_DECISION = "INSERT INTO decision VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING"
_AUDIT = "INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING"
_PERSON = (
    "INSERT INTO person VALUES (?, ?, ?, ?) ON CONFLICT (station, name)"
    " DO UPDATE SET role = excluded.role, seen_ns = excluded.seen_ns"
)


@dataclass(frozen=True, slots=True)
class Taken:
    """How many looks were new, and how many stand otherwise now, or tell more of what is printed."""

    new: int = 0
    changed: int = 0


def take_batch(engine: Engine, session: Session, batch: Batch, utc_ns: int) -> Taken:
    """Everything of the batch, in the caller's transaction, and what is derived of it."""
    taken = Taken()
    if batch.site:
        site, noted = _site(session, batch.site), Noted(session, batch.site, utc_ns)
        taken = _take_looks(engine, session, site, batch, noted)
        _take_flights(session, site, batch)
        _take_decisions(session, site, batch.decisions, noted)
        noted.write()
    session.run_many(
        _PERSON, [(batch.source, person.name, person.role, person.seen_ns) for person in batch.people]
    )
    session.run_many(
        _AUDIT,
        [(a.id, batch.source, a.utc_ns, a.person, a.act, a.target, a.outcome, a.line) for a in batch.audit],
    )
    return taken


def _take_flights(session: Session, site: int, batch: Batch) -> None:
    session.run_many(
        _FLIGHT,
        [
            (
                bytes.fromhex(f.id), site, f.drone, f.began_ns, f.duration_s, f.mission, f.outcome, f.reason,
                f.verdict, f.nodes_planned, f.nodes_visited,
            )
            for f in batch.flights
        ],
    )  # fmt: skip


def _take_decisions(session: Session, site: int, decisions: Sequence[SentDecision], noted: Noted) -> None:
    known: set[str] = set()
    for marks, part in listed([decision.id for decision in decisions]):
        known |= {row[0] for row in session.rows(f"SELECT id FROM decision WHERE id IN {marks}", *part)}
    new = {decision.id: decision for decision in decisions if decision.id not in known}.values()
    session.run_many(
        _DECISION, [(d.id, site, d.place, d.utc_ns, d.seen_ns, d.what, d.who, d.note) for d in new]
    )
    for one in new:
        noted.note(EventKind.PLACE_DECIDED, {"location": one.place, "what": one.what, "who": one.who})


def _take_looks(engine: Engine, session: Session, site: int, batch: Batch, noted: Noted) -> Taken:
    sent = _unique(batch.looks)
    kept = _kept(session, sent)
    new = {identity: look for identity, look in sent.items() if identity not in kept}
    risen = {
        identity: sent[identity] for identity in kept if sent[identity].standing > kept[identity].standing
    }
    printed = {identity: printed_text(look.observation.texts) for identity, look in sent.items()}
    fuller = [identity for identity in kept if says_more(printed[identity], kept[identity].printed)]
    printed |= {identity: kept[identity].printed for identity in kept.keys() - set(fuller)}
    places = _places(session, site, _nodes(batch, new.values()))
    _follow_plan(session, places, batch)
    runs = _runs(session, site, [look.observation for look in new.values()], noted)
    where = {identity: (before.place, before.run) for identity, before in kept.items()}
    for identity, look in new.items():
        where[identity] = places[look.observation.location], runs[look.observation.run]
    engine.make_room(session, {look.observation.utc_ns for look in new.values()})
    session.run_many(_LOOK, [_row(identity, look, *where[identity]) for identity, look in new.items()])
    session.run_many(
        "UPDATE observation SET standing = ? WHERE id = ? AND utc_ns = ?",
        [(int(one.standing), bytes.fromhex(of), one.observation.utc_ns) for of, one in risen.items()],
    )
    session.run_many(
        "UPDATE observation SET printed = ? WHERE id = ? AND utc_ns = ?",
        [(printed[of], bytes.fromhex(of), sent[of].observation.utc_ns) for of in fuller],
    )
    session.run_many(
        "UPDATE place SET printed = ? WHERE id = ? AND look = ?",
        [(printed[of], where[of][0], bytes.fromhex(of)) for of in fuller],
    )
    by_site = {site: dict(new)}
    for identity, look in risen.items():
        by_site.setdefault(kept[identity].site, {})[identity] = look
    for number, looks in by_site.items():
        told = noted if number == site else Noted(session, _site_name(session, number), noted.utc_ns)
        renew(session, _touched(looks, where, printed), told)
        if told is not noted:
            told.write()
    return Taken(len(new), len(risen.keys() | set(fuller)))


def _unique(looks: Iterable[SentLook]) -> dict[str, SentLook]:
    """Each by its id, as it stands highest."""
    unique: dict[str, SentLook] = {}
    for look in looks:
        known = unique.setdefault(identity := look.observation.id, look)
        if look.standing > known.standing:
            unique[identity] = look
    return unique


def _nodes(batch: Batch, new: Iterable[SentLook]) -> dict[str, str]:
    """The places that the batch makes known, each with its node."""
    nodes = {place.code: place.node for place in batch.places}
    for look in new:
        pose = look.observation.pose
        nodes.setdefault(look.observation.location, pose.node if pose else "")
    return nodes


def _follow_plan(session: Session, places: dict[str, int], batch: Batch) -> None:
    """Depth and node of places.  The depth is the greatest, in whatever order they come: 1 may be of who
    does not know.  The node is of the newest plan: an inventory older than the place's look does not say."""
    session.run_many(
        "UPDATE place SET pallets_deep = ? WHERE id = ? AND pallets_deep < ?",
        [(plan.pallets_deep, places[plan.code], plan.pallets_deep) for plan in batch.places],
    )
    session.run_many(
        "UPDATE place SET node = ? WHERE id = ? AND node <> ? AND coalesce(utc_ns, 0) <= ?",
        [(plan.node, places[plan.code], plan.node, batch.planned_ns) for plan in batch.places if plan.node],
    )


def _site(session: Session, name: str) -> int:
    session.run("INSERT INTO site (name) VALUES (?) ON CONFLICT DO NOTHING", name)
    return int(session.rows("SELECT id FROM site WHERE name = ?", name)[0][0])


def _site_name(session: Session, site: int) -> str:
    return str(session.rows("SELECT name FROM site WHERE id = ?", site)[0][0])


def _places(session: Session, site: int, nodes: dict[str, str]) -> dict[str, int]:
    """The id of each place; a place that is new is made."""
    ids = _place_ids(session, site, list(nodes))
    missing = sorted(nodes.keys() - ids.keys())
    if missing:
        session.run_many(
            "INSERT INTO place (site, code, node) VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
            [(site, code, nodes[code]) for code in missing],
        )
        ids |= _place_ids(session, site, missing)
    return ids


def _place_ids(session: Session, site: int, codes: Sequence[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for marks, part in listed(codes):
        rows = session.rows(f"SELECT code, id FROM place WHERE site = ? AND code IN {marks}", site, *part)
        found.update(rows)
    return found


@dataclass(frozen=True, slots=True)
class _Kept:
    """How the store has a look, and where: the site that it came first as, whatever a batch says later."""

    standing: int
    printed: str
    place: int
    run: int
    site: int


def _kept(session: Session, sent: Mapping[str, SentLook]) -> dict[str, _Kept]:
    """Those that the store has already."""
    times = [look.observation.utc_ns for look in sent.values()]
    kept: dict[str, _Kept] = {}
    for marks, part in listed([bytes.fromhex(identity) for identity in sent]):
        rows = session.rows(
            "SELECT seen.id, seen.standing, seen.printed, seen.place, seen.run, place.site"
            " FROM observation AS seen JOIN place ON place.id = seen.place"
            f" WHERE seen.id IN {marks} AND seen.utc_ns BETWEEN ? AND ?",
            *part,
            min(times),
            max(times),
        )
        kept |= {identity.hex(): _Kept(*told) for identity, *told in rows}
    return kept


def _runs(session: Session, site: int, looks: Sequence[Observation], noted: Noted) -> dict[str, int]:
    """The ids of the runs of looks that are new; how many a run has, and between when, is kept beside it."""
    by_run: dict[str, list[int]] = {}
    for look in looks:
        by_run.setdefault(look.run, []).append(look.utc_ns)
    known = _run_ids(session, site, set(by_run))
    for name, times in by_run.items():
        if name not in known:
            noted.note(EventKind.RUN_NEW, {"run": name})
        session.run(
            "INSERT INTO run (site, name, began_ns, ended_ns, looks) VALUES (?, ?, ?, ?, 0)"
            " ON CONFLICT DO NOTHING",
            site,
            name,
            min(times),
            max(times),
        )
        session.run(
            "UPDATE run SET looks = looks + ?, began_ns = CASE WHEN began_ns > ? THEN ? ELSE began_ns END,"
            " ended_ns = CASE WHEN ended_ns < ? THEN ? ELSE ended_ns END WHERE site = ? AND name = ?",
            len(times), min(times), min(times), max(times), max(times), site, name,
        )  # fmt: skip
    return _run_ids(session, site, set(by_run))


def _run_ids(session: Session, site: int, names: set[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for marks, part in listed(sorted(names)):
        rows = session.rows(f"SELECT name, id FROM run WHERE site = ? AND name IN {marks}", site, *part)
        found.update(rows)
    return found


def _row(identity: str, look: SentLook, place: int, run: int) -> tuple[object, ...]:
    seen = look.observation
    pose = seen.pose
    where = (pose.node, pose.x_m, pose.y_m, pose.height_m, pose.yaw_rad) if pose else (None,) * 5
    return (
        bytes.fromhex(identity), seen.utc_ns, place, run, seen.state.value,
        float(seen.confidence), int(look.standing), *where, bytes.fromhex(seen.evidence) or None,
        reads_text(seen.reads), fill_text(seen.fill), undecided_text(seen.undecided),
        printed_text(seen.texts), int(seen.again),
    )  # fmt: skip


def _touched(
    looks: Mapping[str, SentLook], where: Mapping[str, tuple[int, int]], printed: Mapping[str, str]
) -> list[Touched]:
    """The places at which something counts that did not, or no longer; `where` has place and run of each."""
    found: dict[int, Touched] = {}
    for identity, look in looks.items():
        seen = look.observation
        if look.standing is not Standing.PENDING:
            place, run = where[identity]
            touched = found.setdefault(place, Touched(place, seen.location))
            touched.add(
                Moment(
                    seen.utc_ns, bytes.fromhex(identity), run, seen.state.value,
                    reads_text(seen.reads), seen.confidence, bytes.fromhex(seen.evidence) or None,
                    fill_text(seen.fill), undecided_text(seen.undecided), printed[identity],
                ),
                counts=look.standing is Standing.CONFIRMED,
            )  # fmt: skip
    return list(found.values())
