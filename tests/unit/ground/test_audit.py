"""The audit log on disk."""

from __future__ import annotations

import errno
import json
import os
import threading
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.ground_link.audit import AuditEntry, AuditLog
from flightd.core.errors import UnavailableError


def entry(number: int) -> AuditEntry:
    return AuditEntry("ann", "operator", "10.0.0.2", f"id-{number}", "land", "", "accepted", "")


def test_every_command_is_a_line_and_old_lines_stay(tmp_path: Path) -> None:
    path = tmp_path / "log" / "audit.jsonl"
    for start in (0, 3):
        log = AuditLog(path)
        for number in range(start, start + 3):
            log.write(entry(number))
        log.close()
        assert log.dropped == 0
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["id"] for line in lines] == [f"id-{number}" for number in range(6)]
    assert lines[0]["client"] == "ann"
    assert lines[0]["time"].endswith("Z")


def test_a_full_file_is_put_aside_once(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, rotate_bytes=1000)
    for number in range(20):
        log.write(entry(number))
    log.close()
    assert path.stat().st_size <= 1000
    assert (tmp_path / "audit.jsonl.1").stat().st_size <= 1000
    assert "id-19" in path.read_text()


def test_a_new_file_that_could_not_be_made_is_made_for_the_next_entry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "audit.jsonl"
    log, opened = AuditLog(path, rotate_bytes=1000), os.open

    def refuses_once(*words: Any) -> int:
        monkeypatch.setattr("os.open", opened)
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.open", refuses_once)
    for number in range(20):
        log.write(entry(number))
    log.close()
    assert log.dropped == 1
    assert "id-19" in path.read_text()


def test_a_disk_that_hangs_costs_entries_never_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = AuditLog(tmp_path / "audit.jsonl", waiting=5)
    mended = threading.Event()
    monkeypatch.setattr("os.fsync", lambda _: mended.wait())
    for number in range(100):
        log.write(entry(number))
    assert log.dropped >= 94
    mended.set()
    log.close()
    assert len((tmp_path / "audit.jsonl").read_text().splitlines()) == 100 - log.dropped


def test_an_audit_log_that_cannot_be_written_stops_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match=r"file/audit\.jsonl"):
        AuditLog(tmp_path / "file" / "audit.jsonl")
