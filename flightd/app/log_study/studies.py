"""The studies: one log through today's code, and what differs from what was recorded."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import cv2

from flightd.adapters.store.evidence_pictures import EvidenceFolder
from flightd.adapters.store.for_reading import opened_for_reading
from flightd.app.build import detector_of, pilot_of
from flightd.app.log_study.finding import (
    Finding,
    LogFindings,
    Outcome,
    Study,
    same_or,
    told_in_line,
)
from flightd.app.log_study.recorded_simulation import recorded_simulation
from flightd.app.recording import SETTING_TOPICS, recorded_setting
from flightd.app.simulation.judgement import judge_flight
from flightd.core.errors import InputError
from flightd.core.inventory import KnownLocations, Observation, Standing
from flightd.core.topics import Topic
from flightd.core.types import Image
from flightd.replay.decision_compare import comparison_document, replay_decisions
from flightd.replay.log import read_log
from flightd.replay.log_skim import skim
from flightd.replay.perception_compare import replay_pictures
from flightd.replay.tolerances import LAST_DIGITS, MOST_PIXELS
from flightd.studies.flight_calibration import calibrate_by_flight
from flightd.vision.jpeg import decoded_jpeg
from flightd.vision.shelf.code_reader import read_codes

_LOST_SHARE: Final = 0.02
"""Labels that the compression of the kept picture may cost."""
_NEIGHBOURS_M: Final = 2.0
"""Between where two places were seen from: wider a picture of a shelf is not."""
_JUDGED_WITHIN: Final = 1e-6


def study_log(path: Path, name: str, studies: Sequence[Study], inventory: str = "") -> LogFindings:
    """Do each study with one log; what goes wrong with one is its finding, and costs the others nothing.
    What the flight counted is in the folder `inventory`, or beside the log."""
    cv2.setNumThreads(1)  # the cores are shared out among the logs
    findings: dict[Study, Finding] = {}
    for study in studies:
        try:
            if study is Study.CODES:
                findings[study] = _codes(path, Path(inventory or path.parent))
            else:
                findings[study] = _STUDIES[study](path)
        except Exception as err:  # noqa: BLE001 - today's code may fail over a log: that is what is asked
            findings[study] = Finding(Outcome.FAILED, told_in_line(err).replace(f"{path.parent}/", ""))
    return LogFindings(name, findings)


def _detect(path: Path) -> Finding:
    flown = recorded_setting(read_log(path, SETTING_TOPICS))
    seen = replay_pictures(path, detector_of(flown.config, flown.site)().detect)
    if not seen.pictures:
        return Finding(Outcome.NOTHING, "no recorded picture to see again")
    return same_or(seen.complaint(MOST_PIXELS), asdict(seen) | {"may_tip": seen.may_tip})


def _replay(path: Path) -> Finding:
    recorded = read_log(path, {Topic.TICK, Topic.DECISION, *SETTING_TOPICS})
    if not any(entry.topic == Topic.TICK for entry in recorded.entries):
        return Finding(Outcome.NOTHING, "holds no ticks to replay")
    flown = recorded_setting(recorded)
    step = pilot_of(flown.config, flown.site, flown.order, flown.learnt).step
    decisions = replay_decisions(recorded, step)
    complaint = decisions.complaint(LAST_DIGITS)
    if complaint and not decisions.missing:
        first = min(decisions.drifts, key=lambda drift: (drift.first_s, drift.field))
        complaint += f", first {first.field} at {first.first_s:.2f} s"
    return same_or(complaint, comparison_document(decisions))


def _codes(path: Path, folder: Path) -> Finding:
    if folder == path.parent and not (folder / "inventory.db").exists():
        return Finding(Outcome.NOTHING, "no inventory beside it; say where it is: --inventory FOLDER")
    run = skim(path).metadata.get("run", "")
    with opened_for_reading(folder, untouched=True) as inventory:  # a release on trial takes none over
        found = inventory.looks_of_run(run) if run else inventory.looks()  # an old log does not say its run
        looks = [seen for seen, standing in found if standing is Standing.CONFIRMED]
        evidence, places = inventory.evidence, inventory.locations()
    if not looks:
        return Finding(Outcome.NOTHING, f"the inventory has no confirmed look of its run {run}".rstrip())
    newest = {seen.location: seen for seen in looks}
    nodes = {place.code: place.node for place in places}
    known = KnownLocations(nodes)
    pictures = gone = same = more = left_out = 0
    lost: list[str] = []
    other: list[str] = []
    for seen in newest.values():
        before, picture = {read.text for read in seen.reads}, _kept(evidence, seen.evidence)
        if picture is None:
            gone += bool(before)
            continue
        pictures += 1
        read = {read.text for read in read_codes(picture) if read.believed}
        # the picture shows the place's own label, too, and may show a neighbour's goods
        strange = {text for text in read - before if known.spelled(text) not in nodes}
        others = _of_others(strange, before - read, seen, newest.values(), nodes) if strange else set()
        now = (read & before) | (strange - others)
        left_out += len(others)
        if not before:
            more += bool(now)
        elif now == before:
            same += 1
        else:
            (lost if now <= before else other).append(seen.location)
    if not pictures:
        return Finding(Outcome.NOTHING, "no label's picture of it is kept")
    allowed = math.ceil(_LOST_SHARE * (same + len(lost)))
    told = []
    if other:
        told.append(f"{len(other)} places read otherwise, first {other[0]}")
    if len(lost) > allowed:
        told.append(f"{len(lost)} places not read again, {allowed} allowed, first {lost[0]}")
    figures = {
        "pictures": pictures, "without_picture": gone, "same": same, "newly_read": more, "left_out": left_out,
        "lost": sorted(lost), "otherwise": sorted(other),
    }  # fmt: skip
    return same_or("; ".join(told), figures)


def _of_others(
    strange: set[str],
    missed: set[str],
    seen: Observation,
    looks: Iterable[Observation],
    nodes: Mapping[str, str],
) -> set[str]:
    """Of the `strange` codes in a look's picture those that hang beside its place, or were too little to
    count beside its own; none that may be a part of a `missed` one."""
    told = _beside(seen, looks, nodes)
    if seen.reads:
        told |= {code.text for code in seen.undecided}
    return {text for text in strange & told if not any(text in whole for whole in missed)}


def _beside(seen: Observation, looks: Iterable[Observation], nodes: Mapping[str, str]) -> set[str]:
    """What the flight told of other places that the picture of a look may show, undecided or not."""
    near = [one for one in looks if one.location != seen.location and _may_show(seen, one, nodes)]
    read = {read.text for one in near for read in one.reads}
    return read | {code.text for one in near for code in one.undecided}


def _may_show(seen: Observation, other: Observation, nodes: Mapping[str, str]) -> bool:
    """Whether two places are so near that a picture of one may show goods of the other."""
    if nodes.get(seen.location) == nodes.get(other.location):
        return True
    a, b = seen.pose, other.pose
    return (
        a is not None
        and b is not None
        and math.dist((a.x_m, a.y_m, a.height_m), (b.x_m, b.y_m, b.height_m)) < _NEIGHBOURS_M
    )


def _kept(evidence: EvidenceFolder, name: str) -> Image | None:
    """The picture of a look, None where it has or keeps none, or it cannot be read."""
    try:
        return decoded_jpeg(evidence.path(name).read_bytes()) if name else None
    except (OSError, ValueError):
        return None


def _judge(path: Path) -> Finding:
    recorded = recorded_simulation(path)
    if recorded is None:
        return Finding(Outcome.NOTHING, "no truth of a simulator beside it")
    simulation, summary = recorded
    judged = judge_flight(simulation)
    today = asdict(judged.score) | {
        "verdict": judged.verdict,
        "faults": [asdict(fault) for fault in judged.faults],
    }
    differing = {
        name: {"recorded": summary[name], "today": value}
        for name, value in today.items()
        if name in summary and not _alike(summary[name], value)
    }
    return same_or(_named(differing), {"today": today, "differing": differing})


def _named(differing: Mapping[str, Mapping[str, Any]]) -> str:
    if not differing:
        return ""
    name, values = next(iter(differing.items()))
    more = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
    return f"{name} {values['recorded']} is {values['today']} today{more}"


def _alike(recorded: Any, today: Any) -> bool:
    if isinstance(recorded, int | float) and isinstance(today, int | float):
        return math.isclose(recorded, today, rel_tol=_JUDGED_WITHIN, abs_tol=_JUDGED_WITHIN)
    if isinstance(recorded, list) and isinstance(today, list | tuple):
        return len(recorded) == len(today) and all(map(_alike, recorded, today))
    if isinstance(recorded, dict) and isinstance(today, dict):
        return recorded.keys() == today.keys() and all(_alike(recorded[k], today[k]) for k in recorded)
    return bool(recorded == today)


def _calibrate(path: Path) -> Finding:
    """What differs surely from what is configured is told; no log is worse for that."""
    fitted = calibrate_by_flight(path)
    text = ", ".join(f"{key} = {value}" for key, value in fitted.keys.items())
    return Finding(Outcome.SAME, f"configure {text}" if text else "", fitted.document())


_STUDIES: Mapping[Study, Callable[[Path], Finding]] = MappingProxyType(
    {
        Study.DETECT: _detect,
        Study.REPLAY: _replay,
        Study.JUDGE: _judge,
        Study.CALIBRATE: _calibrate,
    }
)


def chosen_studies(text: str) -> tuple[Study, ...]:
    """Those named in a list with commas, each once.  InputError for one that there is not, or none."""
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    known = ", ".join(Study)
    for name in names:
        if name not in set(Study):
            raise InputError("no such study", key=f"--with {name}", remedy=f"choose of {known}")
    if not names:
        raise InputError("names no study", key="--with", remedy=f"choose of {known}")
    return tuple(Study(name) for name in names)
