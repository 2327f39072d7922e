"""Work on a log whose worker dies or fails on the way, for processes that import it by name."""

from __future__ import annotations

import os
from pathlib import Path

from flightd.app.log_study.engines import study_source
from flightd.app.log_study.finding import LogFindings, Study
from flightd.app.log_study.sources import LogSource


def dies_once(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """The first to take up a log whose folder says `dies once` is gone like one that was killed."""
    wish = Path(source.place).with_name("dies once")
    if wish.exists():
        wish.unlink()
        os._exit(9)
    return study_source(source, studies)


def always_dies(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    if Path(source.place).with_name("always dies").exists():
        os._exit(9)
    return study_source(source, studies)


def fails(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    if Path(source.place).with_name("fails").exists():
        raise ZeroDivisionError("division by zero")
    return study_source(source, studies)
