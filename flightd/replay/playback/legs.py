"""Where the drone made for, goal by goal, and the nodes on the way there."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.replay.playback.flight import Leg
from flightd.site.site import Site
from flightd.site.ways import NoWayError


def legs_of(
    site: Site | None, told: Iterable[tuple[float, str]], nodes: Iterable[str] = ()
) -> tuple[Leg, ...]:
    """The goals in the order in which the mission `told` them (when, and which), then those of the `nodes` to
    visit that it never came to."""
    goals: list[tuple[float | None, str]] = []
    for t_s, goal in told:
        if goal and (not goals or goals[-1][1] != goal):
            goals.append((t_s, goal))
    named = {node for _, node in goals}
    goals += [(None, node) for node in nodes if node not in named]
    legs, before = [], ""
    for begun_s, goal in goals:
        legs.append(Leg(begun_s, way_to(site, before, goal)))
        before = goal
    return tuple(legs)


def way_to(site: Site | None, before: str, goal: str) -> tuple[str, ...]:
    """The nodes after `before` up to the goal; the goal alone where no way is known."""
    if site is None or before not in site.nodes or goal not in site.nodes or before == goal:
        return (goal,)
    try:
        return site.path(before, goal)[1:]
    except NoWayError:
        return (goal,)
