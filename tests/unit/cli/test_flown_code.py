"""Which code a flight is evidence of."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from flightd import __version__
from flightd.app.simulation.flown_code import flown_code


def git(folder: Path, *arguments: str) -> str:
    who = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    done = subprocess.run(["git", "-C", folder, *who, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_checkout_is_told_by_its_commit_and_whether_files_differ(tmp_path: Path) -> None:
    git(tmp_path, "init")
    (tmp_path / "a").write_text("1")
    git(tmp_path, "add", "a")
    git(tmp_path, "commit", "-m", "one")
    commit = git(tmp_path, "rev-parse", "--short", "HEAD")
    assert flown_code(tmp_path) == commit
    (tmp_path / "a").write_text("2")
    assert flown_code(tmp_path) == f"{commit}-dirty"


def test_without_a_checkout_of_its_own_it_is_the_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert flown_code(tmp_path) == __version__
    git(tmp_path, "init")
    (tmp_path / "site-packages").mkdir()
    assert flown_code(tmp_path / "site-packages") == __version__
    monkeypatch.setenv("PATH", "")
    assert flown_code(tmp_path) == __version__
