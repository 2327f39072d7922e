"""Why a vehicle does not do what the mission demands: a value with fields; its words are made at the edge."""

from __future__ import annotations

import abc
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Refusal(abc.ABC):
    """One reason; `str` of it is the line for people."""

    @abc.abstractmethod
    def __str__(self) -> str: ...


def words(refusal: Refusal | None) -> str:
    """What `VehicleState.refusal` tells: the reason's line, an empty text where there is none."""
    return "" if refusal is None else str(refusal)
