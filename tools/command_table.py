"""The guide's table of the phases in which each command is taken, from the mission's table of states."""

from __future__ import annotations

from flightd.core.types import CommandKind, Phase
from flightd.mission.machine import STATES, Intent, possible_commands

_ONLY = {
    (True, Intent.WAIT): "before a start is ordered",
    (True, Intent.VISIT): "once a start is ordered",
    (False, Intent.VISIT): "while the plan is flown",
}
"""What a command is bound to that is not always taken: on the ground or in the air, and the intent."""


def markdown() -> str:
    """A row for the phases that take the same commands; an empty cell: refused."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for phase in Phase:
        rows.setdefault(tuple(_cell(phase, kind) for kind in CommandKind), []).append(f"`{phase.value}`")
    lines = [f"| in phase | {' | '.join(f'`{kind.value}`' for kind in CommandKind)} |"]
    lines.append("|---" * (len(CommandKind) + 1) + "|")
    lines += [f"| {', '.join(phases)} | {' | '.join(cells)} |" for cells, phases in rows.items()]
    return "\n".join(lines) + "\n"


def _cell(phase: Phase, kind: CommandKind) -> str:
    states = [state for state in STATES if state.phase is phase]
    taken = [state for state in states if kind in possible_commands(state)]
    if len(taken) == len(states):
        return "yes"
    return ", ".join(_ONLY[state.waiting, state.intent] for state in taken)
