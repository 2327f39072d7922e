"""Where the drone made for, goal by goal, and the nodes on the way there."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.replay.playback.flight import Leg, Moment
from flightd.site.site import Site
from flightd.site.ways import NoWayError


def legs_of(site: Site | None, moments: Sequence[Moment], nodes: Sequence[str]) -> tuple[Leg, ...]:
    """The goals in the order in which the mission named them, then those of the `nodes` to visit that it
    never came to."""
    goals: list[tuple[float | None, str]] = []
    for moment in moments:
        if moment.goal and (not goals or goals[-1][1] != moment.goal):
            goals.append((moment.t_s, moment.goal))
    named = {node for _, node in goals}
    goals += [(None, node) for node in nodes if node not in named]
    legs, before = [], ""
    for t_s, goal in goals:
        legs.append(Leg(t_s, _way(site, before, goal)))
        before = goal
    return tuple(legs)


def _way(site: Site | None, before: str, goal: str) -> tuple[str, ...]:
    """The nodes after `before` up to the goal; the goal alone where no way is known."""
    if site is None or before not in site.nodes or goal not in site.nodes or before == goal:
        return (goal,)
    try:
        return site.path(before, goal)[1:]
    except NoWayError:
        return (goal,)
