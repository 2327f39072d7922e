"""The outcome of one check."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from flightd.core.refusal import Refusal


class CheckLevel(StrEnum):
    """OK, WARNING (flies, but look at it), ERROR (not fit to fly), or UNSEEN: not looked at here."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"
    UNSEEN = "unseen"


@dataclass(frozen=True, slots=True)
class Check:
    """One line: what was looked at, what was found, and what a person can do about it ("" if nothing)."""

    name: str
    level: CheckLevel
    text: str
    remedy: str = ""
    fix: str = ""
    """The parameter that the drone can set right itself; empty where it cannot."""


@dataclass(frozen=True, slots=True)
class FailedChecks(Refusal):
    """What speaks against a flight: checks that came out as errors."""

    checks: tuple[Check, ...]

    def __str__(self) -> str:
        return "; ".join(f"{check.text} ({check.remedy})" for check in self.checks)


def ok(name: str, text: str) -> Check:
    return Check(name, CheckLevel.OK, text)


def warning(name: str, text: str, remedy: str) -> Check:
    return Check(name, CheckLevel.WARNING, text, remedy)


def error(name: str, text: str, remedy: str) -> Check:
    return Check(name, CheckLevel.ERROR, text, remedy)


def unseen(name: str, text: str, remedy: str) -> Check:
    return Check(name, CheckLevel.UNSEEN, text, remedy)
