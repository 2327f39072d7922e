"""Colour profiles that were sent, as files beside a configuration on a real disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.adapters.store.sent_profiles import MOST_KEPT, SentProfiles, sent_name
from flightd.core.errors import InputError, UnavailableError


def test_each_content_has_a_file_of_its_own_and_is_written_once(tmp_path: Path) -> None:
    kept, first, second = SentProfiles(tmp_path), sent_name("hall", b"1"), sent_name("hall", b"2")
    assert first != second
    assert [kept.keep(first, b"1"), kept.keep(second, b"2"), kept.keep(first, b"1")] == [True, True, False]
    assert ((tmp_path / first).read_bytes(), (tmp_path / second).read_bytes()) == (b"1", b"2")
    (tmp_path / first).write_bytes(b"spoilt since")
    assert kept.keep(first, b"1")
    assert (tmp_path / first).read_bytes() == b"1"
    kept.withdraw(first)
    kept.withdraw(first)
    assert [path.name for path in tmp_path.iterdir()] == [second]


def test_only_so_many_are_kept_and_a_disk_that_refuses_says_so(tmp_path: Path) -> None:
    for number in range(MOST_KEPT):
        (tmp_path / sent_name("hall", b"%d" % number)).touch()
    with pytest.raises(InputError, match="remove on the drone"):
        SentProfiles(tmp_path).keep(sent_name("hall", b"another"), b"another")
    with pytest.raises(UnavailableError, match="No such file"):
        SentProfiles(tmp_path / "nowhere").keep("hall-0.npz", b"")
