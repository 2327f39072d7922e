"""Where the time of a flight past shelves goes: its log's phases, by what they were for.

python -m tools.sweep_time LOG…     (flight.mcap, or the folder it is in)
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from flightd.core.topics import Topic
from flightd.core.types import Event, Phase
from flightd.replay.log import read_log

_STOPS = " to stop at"
_LEGS = {
    Phase.FOLLOW.value: "legs past shelves",
    Phase.HOVER.value: "at the end of a leg",
    Phase.TURN.value: "from leg to leg: climbs and turns",
}
_LEFT = {
    Phase.FOLLOW.value: "to what was left open: ways",
    Phase.HOVER.value: "to what was left open: arriving",
    Phase.TURN.value: "to what was left open: turns",
    Phase.CLIMB.value: "stops before what was left open",
    Phase.SCAN.value: "stops before what was left open",
}
_WAYS = {
    Phase.FOLLOW.value: "ways between aisles and to the pad",
    Phase.HOVER.value: "ways: at corners and nodes",
    Phase.TURN.value: "ways: turns",
    Phase.CLIMB.value: "nodes that are not flown past",
    Phase.SCAN.value: "nodes that are not flown past",
}
_ANYWHERE = {
    Phase.TAKE_OFF.value: "take-off",
    Phase.ACQUIRE.value: "take-off",
    Phase.LAND.value: "landing",
    Phase.HOLD.value: "held",
    Phase.RELOCATE.value: "held",
}


def spent(events: Iterable[Event]) -> dict[str, tuple[float, int]]:
    """Seconds in the air by what they were for, and how many phases they were."""
    seconds: dict[str, float] = defaultdict(float)
    count: dict[str, int] = defaultdict(int)
    now, next_, left = _WAYS, _WAYS, set[str]()
    phase, since_ns = "", 0
    for event in events:
        if event.name == "swept" and next_ is _LEGS:
            next_ = _WAYS
        elif event.name == "sweep":  # it comes before the phase that it leads to
            stops = event.text.endswith(_STOPS)
            next_ = _LEFT if stops else _LEGS
            left = set(event.text.removesuffix(_STOPS).split(", ")) if stops else set()
        elif event.name == "visited" and next_ is _LEFT:
            left.discard(event.text)
            next_ = _LEFT if left else _WAYS
        elif event.name == "phase":
            after = event.text.partition(":")[0].partition(" -> ")[2]
            kind = {**_ANYWHERE, **now}.get(phase)
            if kind:
                seconds[kind] += (event.stamp_ns - since_ns) * 1e-9
                count[kind] += 1
            phase, since_ns, now = after, event.stamp_ns, next_
    return {kind: (seconds[kind], count[kind]) for kind in sorted(seconds, key=seconds.__getitem__)[::-1]}


def table(rows: Mapping[str, tuple[float, int]]) -> str:
    """The same for people."""
    total_s = sum(seconds for seconds, _ in rows.values())
    lines = [f"{total_s:.0f} s in the air", "| for | s | share | times | each, s |", "|---|---|---|---|---|"]
    for kind, (seconds, count) in rows.items():
        lines.append(
            f"| {kind} | {seconds:.0f} | {seconds / total_s:.0%} | {count} | {seconds / count:.2f} |"
        )
    return "\n".join(lines)


def main() -> None:
    for name in sys.argv[1:]:
        path = Path(name)
        path = path / "flight.mcap" if path.is_dir() else path
        print(f"{path}: {table(spent(read_log(path, {Topic.EVENT}).messages(Event)))}")


if __name__ == "__main__":
    main()
