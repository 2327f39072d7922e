"""What one parameter of an autopilot may be, and what is wrong with it as it was read."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeAlias

Names: TypeAlias = tuple[str, ...]
"""One parameter under the names it has had, oldest first."""

Read: TypeAlias = Callable[[Names], tuple[str, float] | None]
"""What was read of a parameter: the name that answered and its value."""


@dataclass(frozen=True, slots=True)
class Rule:
    """One parameter (under the names it has had), what it may be, in words too, and why."""

    names: Names
    fits: Callable[[float], bool]
    expected: str
    reason: str
    better: float | None = None
    newer: float | None = None
    """`better` under its newest name, where that has another unit than what `fits` takes."""
    optional: bool = False
    """Versions that do not have it do as they should."""
    advised: bool = False
    """It flies without, less well."""


@dataclass(frozen=True, slots=True)
class ParameterFinding:
    """A parameter that is unsafe or wrong for this job."""

    name: str
    value: float
    expected: str
    reason: str
    better: float | None
    advised: bool = False
    """It flies without, less well."""

    def __str__(self) -> str:
        return f"{self.name} is {self.value:g}, expected {self.expected}: {self.reason}"


def one_of(*values: float) -> Callable[[float], bool]:
    return lambda value: value in values


def within(low: float, high: float) -> Callable[[float], bool]:
    return lambda value: low <= value <= high + 1e-6


def has_bits(bits: int) -> Callable[[float], bool]:
    return lambda value: int(value) & bits == bits


def judge(rule: Rule, found: tuple[str, float] | None) -> ParameterFinding | None:
    """What is wrong with a parameter as it was read; None when nothing is, or it does not exist."""
    if found is None:
        return None
    name, value = found
    better, unit = rule.better, 1.0
    if better is not None and rule.newer is not None and name == rule.names[-1]:
        better, unit = rule.newer, better / rule.newer
    if rule.fits(value * unit):
        return None
    return ParameterFinding(name, value, rule.expected, rule.reason, better, rule.advised)


def judge_all(rules: Iterable[Rule], read: Read) -> list[ParameterFinding]:
    """What is wrong with those that were read, each parameter once: by the first rule that it breaks."""
    judged = (judge(rule, read(rule.names)) for rule in rules)
    findings: dict[str, ParameterFinding] = {}
    for finding in judged:
        if finding is not None:
            findings.setdefault(finding.name, finding)
    return list(findings.values())
