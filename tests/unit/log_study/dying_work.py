"""Work on a log whose worker dies, fails or has company on the way, for processes that import it by name."""

from __future__ import annotations

import os
import threading
from pathlib import Path

from flightd.app.log_study.engines import study_source
from flightd.app.log_study.finding import Finding, LogFindings, Outcome, Study, all_failed
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


def works_alone(source: LogSource, studies: tuple[Study, ...]) -> LogFindings:
    """Takes a while, and fails where another one is at work in the same folder."""
    mine = Path(source.place).with_name("at work")
    try:
        mine.touch(exist_ok=False)
    except FileExistsError:
        return all_failed(source.name, studies, "not alone")
    threading.Event().wait(0.2)
    mine.unlink()
    return LogFindings(source.name, {study: Finding(Outcome.SAME) for study in studies})
