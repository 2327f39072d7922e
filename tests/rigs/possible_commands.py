"""What an operator may order in a phase, whatever it is for."""

from __future__ import annotations

from flightd.core.types import CommandKind, Phase
from flightd.mission.machine import STATES, possible_commands


def possible_in(phase: Phase) -> frozenset[CommandKind]:
    return frozenset().union(*(possible_commands(state) for state in STATES if state.phase is phase))
