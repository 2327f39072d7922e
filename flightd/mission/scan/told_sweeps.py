"""What is flown past on a flight and how, and what is not and why, in words and numbers.  Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from flightd.core.planned_flight import PlannedSweep
from flightd.mission.scan.legibility import LEGIBILITY_WORDS
from flightd.mission.scan.sweep_planner import JudgedLane, Lane, SweepPlanner
from flightd.mission.scan.sweep_speed import Limit, StopCause
from flightd.site.coverage import MIN_PX_PER_MODULE, Legibility, too_small

_LIMIT_WORDS = {
    Limit.BLUR: "the blur",
    Limit.OVERLAP: "the frame rate",
    Limit.CRUISE: "mission.speed_mps",
    Limit.CONFIGURED: "scan.sweep.speed_mps",
}


def told_runs(
    planner: SweepPlanner, runs: Iterable[Sequence[str]], places_at: Callable[[str], Iterable[str]]
) -> tuple[PlannedSweep, ...]:
    """The lanes past what hangs at the nodes of `runs`; what hangs at several is told with the first."""
    lanes: list[JudgedLane] = []
    before: frozenset[str] = frozenset()
    for run in runs:
        codes = frozenset(code for node in run for code in places_at(node)) - before
        lanes += planner.judged(run, codes, 0.0, 0.0)
        before |= codes
    return told(lanes)


def told(lanes: Iterable[JudgedLane]) -> tuple[PlannedSweep, ...]:
    """Lanes that are alike in many aisles are told once."""
    alike: dict[tuple[object, ...], list[JudgedLane]] = {}
    for judged in lanes:
        lane = judged.lane
        key = lane.levels, round(lane.height_m, 2), round(lane.distance_m, 2), round(lane.speed.speed_mps, 3)
        alike.setdefault((*key, lane.speed.limit, judged.stops_for), []).append(judged)
    return tuple(_told([one.lane for one in group], group[0].stops_for) for group in alike.values())


def _told(lanes: Sequence[Lane], stops_for: StopCause | None) -> PlannedSweep:
    lane, speed = lanes[0], lanes[0].speed
    aisles = tuple(dict.fromkeys(lane.aisle for lane in lanes))
    what = f"{_named('aisle', aisles)}, {_named('level', lane.levels)}"
    if stops_for is None:
        text = f"{what}: {_passing(lane)}"
    else:
        text = f"{what}: by stopping; {_why(lane, stops_for)}"
    return PlannedSweep(
        aisles=aisles,
        levels=lane.levels,
        places=sum(len(lane.places) for lane in lanes),
        height_m=round(lane.height_m, 3),
        distance_m=round(lane.distance_m, 3),
        speed_mps=round(speed.speed_mps, 3),
        limit=speed.limit.value,
        limits_mps={limit.value: round(value, 3) for limit, value in speed.limits_mps},
        exposure=round(speed.exposure, 3),
        blur_modules=round(speed.blur_modules, 3),
        px_per_module=round(speed.px_per_module, 2),
        views=round(speed.views, 1),
        fps=round(speed.fps, 2),
        needed_fps=round(speed.needed_fps, 2),
        swept=stops_for is None,
        stops_for=stops_for or "",
        text=text,
    )


def _passing(lane: Lane) -> str:
    speed = lane.speed
    return (
        f"{speed.speed_mps:.2f} m/s at {lane.height_m:.2f} m, {lane.distance_m:.2f} m from the shelf,"
        f" {speed.views:.1f} whole views at {speed.fps:g} frames a second,"
        f" {speed.px_per_module:.2f} px per module, a blur of {speed.blur_modules:.2f} in"
        f" {speed.exposure_s * 1e3:.2g} ms; no faster because of {_LIMIT_WORDS[speed.limit]}"
    )


def _why(lane: Lane, stops_for: StopCause) -> str:
    match stops_for:
        case StopCause.LABELS:
            px = lane.speed.px_per_module
            small = too_small(px, px * lane.distance_m / MIN_PX_PER_MODULE)
            lost = lane.legibility is not Legibility.SURE
            return f"{LEGIBILITY_WORDS[lane.legibility]}; {small}" if lost else small
        case StopCause.WIDTH:
            return "passed at a crawl: its places are as wide as the picture, or it is read too seldom"
        case StopCause.LINE:
            return "the line is not open and clear both ways"
        case StopCause.NODES:
            return "it is before one node only"


def _named(kind: str, names: Sequence[object]) -> str:
    texts = list(map(str, names))
    return f"{kind} {texts[0]}" if len(texts) == 1 else f"{kind}s {', '.join(texts[:-1])} and {texts[-1]}"
