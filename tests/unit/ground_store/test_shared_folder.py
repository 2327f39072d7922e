"""A folder that several programs write into."""

from __future__ import annotations

import errno
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from flightd.core.errors import UnavailableError
from flightd.ground.shared_folder import SharedFolder


def test_who_writes_the_same_file_at_once_leaves_it_whole(tmp_path: Path) -> None:
    folders = [SharedFolder(str(tmp_path), "wms.toml", "address") for _ in range(4)]
    content = b"picture" * 200_000

    def write(folder: SharedFolder) -> set[int]:
        sizes = set()
        for _ in range(20):
            folder.write("ab/one.jpg", content, alone=False)
            sizes.add(len(folder.read("ab/one.jpg", 10**7)))
        return sizes

    with ThreadPoolExecutor(len(folders)) as threads:
        assert list(threads.map(write, folders)) == [{len(content)}] * len(folders)
    assert [path.name for path in (tmp_path / "ab").iterdir()] == ["one.jpg"]


def test_on_a_full_disk_no_half_picture_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    for _ in range(3):
        with pytest.raises(UnavailableError, match=r"one\.jpg cannot be written: No space left on device"):
            SharedFolder(str(tmp_path), "wms.toml", "address").write("one.jpg", b"picture", alone=False)
    assert list(tmp_path.iterdir()) == []
