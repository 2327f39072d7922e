"""`flightd ground people` and `flightd ground audit`: who may come in, and what they did."""

from __future__ import annotations

import errno
import io
import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from flightd.adapters.ground_link.audit import AuditLog
from flightd.cli.main import main
from flightd.ground.access.audit import StationEntry, audit_file
from flightd.ground.access.passwords import PasswordCheck, hashed_secret
from flightd.ground.access.people_book import PeopleBook, Session

WORDS = "correct horse battery"
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Exit code, stdout and stderr of `flightd ground`, with a line on standard input."""
    monkeypatch.setenv("FLIGHTD_GROUND_STATE", str(tmp_path / "state"))

    def run(*words: str, typed: str = "") -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["flightd", "ground", *words])
        monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return int(ended.value.code or 0), printed.out, printed.err

    return run


def test_people_are_added_listed_changed_and_removed(run: Run, tmp_path: Path) -> None:
    assert run("people", "list")[1] == "nobody yet: flightd ground people add NAME --role admin\n"
    added = run("people", "add", "ann", "--role", "admin", typed=f"{WORDS}\n")
    assert added == (0, "ann may come in as admin\n", "")
    code, key, said = run("people", "add", "export", "--role", "viewer", "--key")
    assert code == 0
    assert "shown this once" in said
    book = PeopleBook(tmp_path / "state")
    ann, export = book.people()
    assert PasswordCheck().fits(WORDS, ann.password)
    assert export.key == hashed_secret(key.strip())
    assert run("people", "role", "ann", "operator")[1] == "the role of ann is operator now\n"
    listed = run("people", "list")[1].splitlines()
    assert [line.split() for line in listed] == [["ann", "operator", "password"], ["export", "viewer", "key"]]
    assert json.loads(run("people", "list", "--json")[1])["people"][0]["name"] == "ann"
    assert book.begin(Session(b"one", "ann", 0.0, 0.0), ann.password)
    assert run("people", "password", "ann", typed="another horse here\n")[0] == 0
    assert book.read()[1] == []
    new = json.loads(run("people", "key", "export", "--json")[1])["key"]
    assert book.people()[1].key == hashed_secret(new) != export.key
    assert run("people", "remove", "ann")[1] == "ann is removed\n"
    assert [person.name for person in book.people()] == ["export"]


@pytest.mark.parametrize(
    ("words", "typed", "said"),
    [
        (("add", "ann", "--role", "captain"), WORDS, "--role captain: expected viewer, operator, admin"),
        (("add", "ann"), "", "there is no password on standard input; type it at a terminal"),
        (("add", "ann"), "short", "a password has 10 to 200 characters"),
        (("add", "ann b"), WORDS, "'ann b' is no name here; take up to 60 letters"),
        (("role", "ann", "admin"), "", "there is no 'ann' here; see flightd ground people list"),
        (("password", "ann"), WORDS, "there is no 'ann' here; see flightd ground people list"),
    ],
)
def test_wrong_input_is_one_line(run: Run, words: tuple[str, ...], typed: str, said: str) -> None:
    code, out, err = run("people", *words, typed=f"{typed}\n" if typed else "")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"flightd: {said}")


@pytest.mark.parametrize("words", [("people", "list"), ("keys", "list"), ("audit",)])
def test_a_state_folder_that_is_none_is_one_line_and_not_nobody(
    run: Run, tmp_path: Path, words: tuple[str, ...]
) -> None:
    (tmp_path / "state").write_text("a file, no folder", encoding="utf-8")
    code, out, err = run(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"flightd: {tmp_path / 'state'}")
    assert "Not a directory" in err


@pytest.mark.parametrize("words", [("people", "list"), ("keys", "list")])
def test_another_users_state_folder_is_one_line_and_not_nobody(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    stat = Path.stat

    def kept_out(path: Path, **options: bool) -> os.stat_result:
        if path.parent == tmp_path / "state":
            raise PermissionError(errno.EACCES, "Permission denied")
        return stat(path, **options)

    monkeypatch.setattr(Path, "stat", kept_out)
    code, out, err = run(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "Permission denied; be the user that the station runs as" in err


def test_at_a_terminal_the_password_is_typed_twice_and_not_shown(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "flightd", "ground", "people", "add", "ann", "--state", str(tmp_path)]
    main_end, terminal = pty.openpty()
    process = subprocess.Popen(
        command, stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
        cwd=Path(__file__).parents[3],
    )  # fmt: skip
    shown = b""
    with os.fdopen(main_end, "r+b", buffering=0) as person:
        for asks in (b"Password for ann: ", b"Again: "):
            while asks not in shown:
                shown += person.read(1)
            person.write(f"{WORDS}\n".encode())
        while b"ann may come in" not in shown:
            shown += person.read(1)
        assert process.wait(60) == 0, "before the terminal goes away"
    os.close(terminal)
    assert WORDS.encode() not in shown


def test_the_audit_is_shown_newest_last_of_one_or_all(run: Run, tmp_path: Path) -> None:
    assert run("audit")[1] == "nothing yet\n"
    state = tmp_path / "state"
    log = AuditLog(audit_file(state), rotate_bytes=600)
    for number in range(4):
        name = "ann" if number % 2 else "bob"
        act = f"stop {number}"
        log.write(StationEntry(name, "operator", "password", "10.0.0.2", act, "demo", "accepted"))
    log.close()
    with audit_file(state).open("ab") as file:
        file.write(b'{"time": "cut o')
    lines = run("audit", "--last", "3")[1].splitlines()
    assert [line.split("stop ")[1].split()[0] for line in lines] == ["1", "2", "3"], "over both files"
    assert "ann (operator, 10.0.0.2)  stop 3 demo  accepted" in lines[-1]
    found = json.loads(run("audit", "--person", "BOB", "--json")[1])["entries"]
    assert [entry["act"] for entry in found] == ["stop 0", "stop 2"]
