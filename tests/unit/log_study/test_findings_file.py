"""What a study finds is kept as it comes, whatever ends it or refuses it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from flightd.app.log_study import engines
from flightd.app.log_study.finding import Finding, LogFindings, Outcome, Study
from flightd.app.log_study.findings_file import FindingsFile
from flightd.core.errors import InputError
from tests.command import Command

FOUND = [LogFindings(f"{name}.mcap", {Study.REPLAY: Finding(Outcome.SAME)}) for name in "abcd"]


def lines(*found: LogFindings) -> str:
    return "".join(json.dumps(one.document()) + "\n" for one in found)


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """A folder of logs that nobody reads."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for one in FOUND:
        (folder / one.log).write_bytes(b"")
    return folder


def engine_finds(patched: pytest.MonkeyPatch, *numbers: int, ends: BaseException | None = None) -> None:
    """These findings in this order, and what ends the study then."""

    def run(*_: Any) -> Iterator[tuple[int, LogFindings]]:
        for number in numbers:
            yield number, FOUND[number]
        if ends is not None:
            raise ends

    patched.setattr(engines, "run_local", run)


def test_each_finding_stands_there_as_it_comes_and_all_in_order_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "found.jsonl"
    path.write_text(lines(FOUND[3]))
    file = FindingsFile(path)
    assert path.read_text() == lines(FOUND[3]), "nothing is found yet"
    for number in (2, 0, 1):
        file.append(number, FOUND[number])
    assert path.read_text() == lines(FOUND[2], FOUND[0], FOUND[1])
    file.end(FOUND[:3])
    assert (path.read_text(), file.trouble) == (lines(*FOUND[:3]), None)
    assert [*tmp_path.iterdir()] == [path]


def test_where_nothing_was_found_the_file_is_as_it_was(tmp_path: Path) -> None:
    old, new = tmp_path / "old.jsonl", tmp_path / "new.jsonl"
    old.write_text(lines(FOUND[3]))
    for path in (old, new):
        FindingsFile(path).end([])
    assert old.read_text() == lines(FOUND[3])
    assert not new.exists()


def test_a_log_is_no_place_for_findings(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    log.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(InputError, match=r"flight\.mcap: is there already, and no findings of a study"):
        FindingsFile(log)
    assert log.read_bytes() == b"\x89MCAP0\r\n"


def test_a_pipe_gets_them_in_order(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    file = FindingsFile(Path(f"/dev/fd/{writing}"))
    os.close(writing)
    for number in (1, 0):
        file.append(number, FOUND[number])
    file.end(FOUND[:2])
    with os.fdopen(reading) as stream:
        assert stream.read() == lines(*FOUND[:2])


def test_what_was_found_until_it_is_interrupted_is_told_and_kept(
    flightd: Command, logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine_finds(monkeypatch, 2, 0, ends=KeyboardInterrupt())
    out = tmp_path / "found.jsonl"
    ended = flightd("study", logs, "--out", out, "--with", "replay")
    assert (ended.returncode, ended.stderr) == (130, "flightd: interrupted\n")
    assert out.read_text() == lines(FOUND[0], FOUND[2])
    assert all(FOUND[number].log in ended.stdout for number in (0, 2))
    ended = flightd("study", logs, "--with", "replay", "--json")
    document = json.loads(ended.stdout)
    assert (document["passed"], len(document["logs"])) == (False, 2)


def test_a_file_that_cannot_be_made_is_noticed_before_the_work(
    flightd: Command, logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "run_local", lambda *_: pytest.fail("the work was begun"))
    ended = flightd("study", logs, "--out", tmp_path / "none" / "found.jsonl")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "found.jsonl: cannot write: No such file or directory" in ended.stderr


def test_findings_that_the_disk_refuses_are_printed(
    flightd: Command, logs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine_finds(monkeypatch, 0, 1, 2, 3)
    ended = flightd("study", logs, "--out", "/dev/full", "--with", "replay")
    assert (ended.returncode, ended.stderr) == (
        2,
        "flightd: /dev/full: cannot write: No space left on device\n",
    )
    assert all(one.log in ended.stdout for one in FOUND)


def test_a_name_that_is_no_text_is_told_and_written(flightd: Command, tmp_path: Path) -> None:
    name = os.fsdecode(b"caf\xe9.mcap")
    (tmp_path / name).write_bytes(b"no log")
    out = tmp_path / "found.jsonl"
    ended = flightd("study", tmp_path, "--out", out, "--json", "--workers", 1)
    assert ended.returncode == 1
    (log,) = json.loads(ended.stdout)["logs"]
    assert log["log"] == str(tmp_path / name)
    assert json.loads(out.read_text(encoding="utf-8")) == log
    assert "caf" in flightd("study", tmp_path / name).stdout
