"""A configuration's file and its older versions, on a real disk."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from flightd.adapters.store.settings_file import KEPT, MOST_BYTES, Change, SettingsFile, Version, tag_of
from flightd.core.errors import InputError, RunError, UnavailableError

SAID = Version(0, "2026-01-02T03:04:05Z", "ann", "Ann", (Change("mission.height_m", 1.6, 1.8),))


@pytest.fixture
def file(tmp_path: Path) -> SettingsFile:
    (tmp_path / "flightd.toml").write_text("a = 1\n")
    (tmp_path / "flightd.toml").chmod(0o640)
    return SettingsFile(tmp_path / "flightd.toml")


def test_what_stood_there_is_kept_with_who_changed_it(file: SettingsFile) -> None:
    file.replace("a = 1\n", "a = 2\n", SAID)
    file.replace("a = 2\n", "a = 3\n", SAID)
    assert file.read() == "a = 3\n"
    assert [version.number for version in file.versions()] == [2, 1]
    assert file.versions()[0].changes == SAID.changes
    assert [file.text_of(number) for number in (1, 2)] == ["a = 1\n", "a = 2\n"]
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o640


def test_a_file_that_was_changed_meanwhile_is_left_alone(file: SettingsFile) -> None:
    file.path.write_text("a = 5\n")
    with pytest.raises(RunError, match="changed meanwhile"):
        file.replace("a = 1\n", "a = 2\n", SAID)
    assert file.read() == "a = 5\n"
    assert file.versions() == []


def test_only_so_many_versions_are_kept_and_numbers_are_not_used_again(file: SettingsFile) -> None:
    for number in range(KEPT + 3):
        file.replace(f"a = {number + 1}\n", f"a = {number + 2}\n", SAID)
    numbers = [version.number for version in file.versions()]
    assert numbers == list(range(KEPT + 3, 3, -1))
    with pytest.raises(InputError, match="no version 3"):
        file.text_of(3)


def test_settings_by_which_no_daemon_comes_up_are_taken_back_at_the_next_start(file: SettingsFile) -> None:
    file.replace("a = 1\n", "a = 2\n", SAID)
    file.confirm()  # of the daemon that ran when they were changed
    assert file.begin() == ""
    assert file.read() == "a = 2\n"
    assert "before change 1 are back" in file.begin()
    assert file.read() == "a = 1\n"
    assert file.begin() == ""


def test_settings_by_which_a_daemon_came_up_stay(file: SettingsFile) -> None:
    file.replace("a = 1\n", "a = 2\n", SAID)
    file.begin()
    file.confirm()
    assert [file.begin(), file.begin()] == ["", ""]
    assert file.read() == "a = 2\n"


def test_what_is_no_version_of_ours_is_left_out(file: SettingsFile) -> None:
    file.replace("a = 1\n", "a = 2\n", SAID)
    folder = file.path.with_name("flightd.toml.versions")
    (folder / "000007.json").write_text("{}")
    (folder / "000008.json").write_bytes(b"\xff")
    (folder / "trial").write_bytes(b"\xff")
    assert file.begin() == ""
    (folder / "000001.toml").rename(folder / "gone")
    assert file.versions() == []


def test_a_link_leads_to_the_file_that_is_changed(tmp_path: Path, file: SettingsFile) -> None:
    link = tmp_path / "elsewhere" / "flightd.toml"
    link.parent.mkdir()
    link.symlink_to(file.path)
    SettingsFile(link).replace("a = 1\n", "a = 2\n", SAID)
    assert link.is_symlink()
    assert file.read() == "a = 2\n"


def test_what_cannot_be_read_says_so(tmp_path: Path) -> None:
    with pytest.raises(UnavailableError, match="No such file"):
        SettingsFile(tmp_path / "none.toml").read()
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="UTF-8"):
        SettingsFile(tmp_path / "binary.toml").read()
    (tmp_path / "large.toml").write_text("#" * (MOST_BYTES + 1))
    with pytest.raises(InputError, match="too large"):
        SettingsFile(tmp_path / "large.toml").read()


def test_contents_have_one_name_each() -> None:
    assert tag_of("a = 1\n") == tag_of("a = 1\n") != tag_of("a = 2\n")
