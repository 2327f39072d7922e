"""Drop folders over SFTP, as those of the machine; to hosts whose key is known, and to no other."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from flightd.app.log_study.finding import Study
from flightd.app.log_study.sources import log_sources
from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.shared_folder import SharedFolder
from flightd.runtime.remote_files import PASSWORD
from tests.rigs.drop_folders import check_files_come_and_go
from tests.rigs.extras import of_extra

of_extra("paramiko", "exchange")


@pytest.fixture
def connections() -> list[Any]:
    """Those that the host has at the moment."""
    return []


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, connections: list[Any]) -> Iterator[str]:
    """A URL of it, without a folder; this machine knows its key, and the password."""
    from tests.rigs import sftp_server

    known = tmp_path / ".ssh" / "known_hosts"
    known.parent.mkdir()
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv(PASSWORD, sftp_server.PASSWORD)
    with sftp_server.sftp_server(known, connections) as port:
        yield f"sftp://ann@127.0.0.1:{port}"


def folder(url: str) -> SharedFolder:
    return SharedFolder(url, Path("wms.toml"), "expected.inbox")


def test_files_come_and_go(host: str, tmp_path: Path) -> None:
    drop = tmp_path / "drop"
    drop.mkdir()
    (drop / "a.csv").write_bytes(b"a" * 100_000)
    there = folder(f"{host}{drop}")
    check_files_come_and_go(there, (drop / "a.csv").write_bytes, 100_000, b"b" * 100_001)
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


def test_pictures_of_a_store_lie_on_another_machine(host: str, tmp_path: Path) -> None:
    jpeg = b"\xff\xd8 a label"
    with opened_store(str(tmp_path / "counts.db"), f"{host}{tmp_path}/pictures") as store:
        name = store.evidence.keep(jpeg)
        assert store.evidence.keep(jpeg) == name
        (file,) = [path for path in (tmp_path / "pictures").rglob("*") if path.is_file()]
        assert (file.parent.name, file.name, file.read_bytes()) == (name[:2], f"{name}.jpg", jpeg)
        assert store.evidence.picture(name) == jpeg
        with pytest.raises(InputError, match="was not kept"):
            store.evidence.picture("0" * 64)
        with pytest.raises(InputError, match="not the name of a picture"):
            store.evidence.has("../../etc/passwd")
        file.write_bytes(jpeg[:4])  # as another program may leave it
        with pytest.raises(UnavailableError, match=f"/{name}.jpg: the picture is damaged"):
            store.evidence.picture(name)


def test_a_server_that_was_started_anew_costs_no_picture(
    host: str, tmp_path: Path, connections: list[Any]
) -> None:
    from tests.rigs.sftp_server import drop

    with opened_store(str(tmp_path / "counts.db"), f"{host}{tmp_path}/pictures") as store:
        names = [store.evidence.keep(b"\xff\xd8 first")]
        drop(connections)
        names.append(store.evidence.keep(b"\xff\xd8 second"))
        drop(connections)
        assert store.evidence.picture(names[0]) == b"\xff\xd8 first"
        drop(connections)
        assert store.missing_pictures([*names, "0" * 64]) == {"0" * 64}
        assert len(connections) == 1


def test_a_server_that_stays_away_is_one_line(host: str, tmp_path: Path, connections: list[Any]) -> None:
    from tests.rigs.sftp_server import drop

    there = folder(f"{host}{tmp_path}")
    (tmp_path / ".ssh" / "known_hosts").write_text("")  # as if it were another one now
    drop(connections)
    for _ in range(2):
        with pytest.raises(UnavailableError, match=r"looked for: .*not found in known_hosts"):
            there.has("a.csv")


def test_many_ask_for_pictures_at_once(host: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from flightd.runtime import known_host_sftp

    monkeypatch.setattr(known_host_sftp, "_WAIT_S", 2.0)
    with opened_store(str(tmp_path / "counts.db"), f"{host}{tmp_path}/pictures") as store:
        names = [store.evidence.keep(b"\xff\xd8%d" % number) for number in range(20)]
        with ThreadPoolExecutor(8) as threads:
            for _ in range(5):
                pictures = list(threads.map(store.evidence.picture, names))
                assert pictures == [b"\xff\xd8%d" % number for number in range(20)]


def test_a_place_for_pictures_that_cannot_be_had_is_one_line(tmp_path: Path) -> None:
    url = "nowhere://bucket/pictures"
    with pytest.raises(UnavailableError) as refused:
        opened_store(str(tmp_path / "counts.db"), url)
    assert str(refused.value).startswith(f"--evidence: {url}: cannot be opened: Protocol not known: nowhere")


def test_logs_to_study_are_fetched_with_the_host_in_their_names(host: str, tmp_path: Path) -> None:
    (tmp_path / "logs" / "monday").mkdir(parents=True)
    log = tmp_path / "logs" / "monday" / "flight #1?.mcap"
    log.write_bytes(b"what was flown")
    log.with_name("summary.json").write_bytes(b"{}")
    (source,) = log_sources([f"{host}{tmp_path}/logs"])
    assert source.name == f"{host}{log}"
    with source.fetched([Study.JUDGE]) as fetched:
        assert fetched.read_bytes() == b"what was flown"
        assert {path.name for path in fetched.parent.iterdir()} == {log.name, "summary.json"}
    assert log_sources([source.place]) == [source]
    (tmp_path / ".ssh" / "known_hosts").write_text("")
    with pytest.raises(UnavailableError, match="not found in known_hosts"):
        log_sources([f"{host}{tmp_path}/logs"])
