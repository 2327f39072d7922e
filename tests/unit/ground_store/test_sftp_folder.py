"""Drop folders over SFTP, as those of the machine; to hosts whose key is known, and to no other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd.core.errors import UnavailableError
from flightd.ground.wms_exchange.drop_folder import PASSWORD, DropFolder

pytest.importorskip("paramiko", reason="folders over SFTP need it: pip install -e '.[exchange]'")


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A URL of it, without a folder; this machine knows its key, and the password."""
    from tests.rigs import sftp_server

    known = tmp_path / ".ssh" / "known_hosts"
    known.parent.mkdir()
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv(PASSWORD, sftp_server.PASSWORD)
    with sftp_server.sftp_server(known) as port:
        yield f"sftp://ann@127.0.0.1:{port}"


def folder(url: str) -> DropFolder:
    return DropFolder(url, Path("wms.toml"), "expected.inbox")


def test_files_come_and_go(host: str, tmp_path: Path) -> None:
    drop = tmp_path / "drop"
    drop.mkdir()
    (drop / "a.csv").write_bytes(b"a" * 100_000)
    there = folder(f"{host}{drop}")
    (size, time) = there.listed()["a.csv"]
    assert (size, there.listed("done")) == (100_000, {})
    (drop / "a.csv").write_bytes(b"b" * 100_001)
    assert there.listed()["a.csv"] != (size, time)
    assert there.read("a.csv", 100_001) == b"b" * 100_001
    there.move("a.csv", "taking/a.csv")
    for content in (b"first", b"then"):
        there.write("done/a.csv.txt", content)
    with pytest.raises(
        UnavailableError, match=r"wms.toml: expected.inbox: sftp://.*: a.csv cannot be read: "
    ):
        there.read("a.csv", 1)
    there.close()
    found = {str(file.relative_to(drop)) for file in drop.rglob("*") if file.is_file()}
    assert found == {"taking/a.csv", "done/a.csv.txt"}
    assert (drop / "done" / "a.csv.txt").read_bytes() == b"then"


def test_a_host_whose_key_is_not_known_is_refused(host: str, tmp_path: Path) -> None:
    (tmp_path / ".ssh" / "known_hosts").write_text("")
    with pytest.raises(UnavailableError, match="not found in known_hosts"):
        folder(f"{host}{tmp_path}")


def test_a_wrong_password_is_one_line(host: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PASSWORD, "of another hall")
    with pytest.raises(UnavailableError, match="cannot be opened: Authentication failed"):
        folder(f"{host}{tmp_path}")
