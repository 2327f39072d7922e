from __future__ import annotations

import io
import json
import logging
import re
import sys
from pathlib import Path

import pytest

from flightd.adapters.journal import JournalFormatter, JournalMonitor, goes_to_journal, line
from flightd.core.types import Event, EventLevel, Phase
from tests.unit.service.vitals import MS, START_NS, vitals

_FIELD = re.compile(r'(\w+)=("(?:[^"\\]|\\.)*"|[^ "]+)')


def parsed(text: str) -> dict[str, str]:
    assert re.fullmatch(rf"<\d>{_FIELD.pattern}( {_FIELD.pattern})*", text), text
    return {key: json.loads(value) if value[0] == '"' else value for key, value in _FIELD.findall(text)}


@pytest.mark.parametrize("value", ["plain", "", 'with "quotes" and = signs', "two\nlines", "käfer", "a b"])
def test_any_value_comes_back_from_its_one_line(value: str) -> None:
    text = line(6, event="x", text=value)
    assert "\n" not in text
    assert parsed(text) == {"event": "x", "text": value}


@pytest.mark.parametrize(
    ("level", "priority"), [(EventLevel.INFO, 6), (EventLevel.WARNING, 4), (EventLevel.ERROR, 3)]
)
def test_an_event_has_its_priority(level: EventLevel, priority: int) -> None:
    out = io.StringIO()
    JournalMonitor(out).event(Event(1, level, "phase", "follow -> hover: arrived"))
    assert out.getvalue() == f'<{priority}>event=phase text="follow -> hover: arrived"\n'


def test_the_status_is_told_each_ten_seconds_and_at_a_change_of_phase() -> None:
    out = io.StringIO()
    monitor = JournalMonitor(out)
    for tenth in range(205):
        phase = Phase.FOLLOW if tenth < 150 else Phase.HOVER
        monitor.tell(vitals(START_NS + tenth * 100 * MS, phase=phase))
    told = [parsed(text) for text in out.getvalue().splitlines()]
    assert [fields["status"] for fields in told] == ["follow", "follow", "hover"]
    assert told[0]["nodes"] == "1/12"
    assert told[0]["dropped"] == "2"


def test_the_programs_own_log_takes_the_same_form() -> None:
    record = logging.LogRecord(
        "flightd.adapters.x", logging.WARNING, "", 1, "taken over by %s", ("LAND",), None
    )
    assert JournalFormatter().format(record) == '<4>logger=adapters.x text="taken over by LAND"'
    try:
        int("broken")
    except ValueError:
        failed = logging.LogRecord("flightd", logging.ERROR, "", 1, "failed", (), sys.exc_info())
    text = JournalFormatter().format(failed)
    assert text.startswith("<3>")
    assert "ValueError: invalid literal" in parsed(text)["text"]


def test_the_journal_is_known_by_its_stream(tmp_path: Path) -> None:
    with (tmp_path / "out").open("w") as stream:
        found = (tmp_path / "out").stat()
        assert goes_to_journal(stream, f"{found.st_dev}:{found.st_ino}")
        assert not goes_to_journal(stream, f"{found.st_dev}:{found.st_ino + 1}")
        assert not goes_to_journal(stream, "")
    assert not goes_to_journal(io.StringIO(), "1:2")
