"""What one study says of one log."""

from __future__ import annotations

import enum
import traceback
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from flightd.core.errors import FlightdError

_FLIGHTD: Final = Path(__file__).parents[2]


class Study(enum.StrEnum):
    """What is done with each log: see what its pictures show, decide again, read the kept labels again, judge
    by the truth beside it, fit its sensors."""

    DETECT = "detect"
    REPLAY = "replay"
    CODES = "codes"
    JUDGE = "judge"
    CALIBRATE = "calibrate"


class Outcome(enum.StrEnum):
    """SAME as was recorded, within what the study allows; DIFFERENT; NOTHING there to compare (no picture, no
    truth); FAILED: the log could not be studied."""

    SAME = "same"
    DIFFERENT = "different"
    NOTHING = "nothing"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Finding:
    """`text` says in a line what differs, is missing or went wrong; "" for `Outcome.SAME`."""

    outcome: Outcome
    text: str = ""
    figures: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LogFindings:
    """All that was asked of one log, in the order in which it was asked."""

    log: str
    findings: dict[Study, Finding]

    @property
    def passed(self) -> bool:
        return all(f.outcome in {Outcome.SAME, Outcome.NOTHING} for f in self.findings.values())

    def document(self) -> dict[str, Any]:
        """As JSON has it: the same for the same log, on whatever it was worked out."""
        told = {
            study.value: {
                "outcome": found.outcome.value,
                "text": found.text,
                "figures": _short(found.figures),
            }
            for study, found in self.findings.items()
        }
        return {"log": self.log, "passed": self.passed, "studies": told}


def all_failed(log: str, studies: Iterable[Study], text: str) -> LogFindings:
    """Of a log that none of the studies came to."""
    return LogFindings(log, {study: Finding(Outcome.FAILED, text) for study in studies})


def first_line(err: BaseException) -> str:
    """Of what an error says; empty where it says nothing."""
    return next((line.strip() for line in str(err).splitlines() if line.strip()), "")


def told_in_line(err: BaseException) -> str:
    """What went wrong with a log, in one line: of what flightd did not foresee, where in it that was, too."""
    if isinstance(err, FlightdError):
        return str(err)
    text = first_line(err)
    told = f"{type(err).__name__}: {text}" if text else type(err).__name__
    frames = traceback.extract_tb(err.__traceback__)
    at = next((frame for frame in reversed(frames) if Path(frame.filename).is_relative_to(_FLIGHTD)), None)
    return told if at is None else f"{told} ({Path(at.filename).name}, line {at.lineno})"


def same_or(text: str, figures: dict[str, Any]) -> Finding:
    """SAME where nothing is complained of."""
    return Finding(Outcome.DIFFERENT if text else Outcome.SAME, text, figures)


def _short(value: Any) -> Any:
    """Floats to nine digits: other processors' kernels end in other last ones."""
    if isinstance(value, float):
        return float(f"{value:.9g}")
    if isinstance(value, dict):
        return {name: _short(one) for name, one in value.items()}
    return [_short(one) for one in value] if isinstance(value, list | tuple) else value
