"""Pictures, drop folders and logs in a bucket of S3."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from flightd.app.log_study.finding import Study
from flightd.app.log_study.sources import log_sources
from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.shared_folder import SharedFolder
from tests.rigs.drop_folders import check_files_come_and_go
from tests.rigs.extras import of_extra
from tests.rigs.wms_exchange import EXPECTED, kept, once

of_extra("s3fs", "s3")


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    from tests.rigs.s3_server import s3_server

    with s3_server() as url:
        yield url


@pytest.fixture
def files(bucket: str) -> Any:
    """What is in the bucket, as another program sees it."""
    import s3fs

    return s3fs.S3FileSystem(skip_instance_cache=True)


def test_pictures_of_a_store_lie_in_a_bucket(bucket: str, files: Any, tmp_path: Path) -> None:
    jpeg = b"\xff\xd8 a label"
    with opened_store(str(tmp_path / "counts.db"), f"{bucket}/pictures") as store:
        name = store.evidence.keep(jpeg)
        assert store.evidence.keep(jpeg) == name
        (there,) = files.find("hall-3/pictures")  # and nothing half written beside it
        assert there == f"hall-3/pictures/{name[:2]}/{name}.jpg"
        assert store.evidence.picture(name) == jpeg
        with pytest.raises(InputError, match="was not kept"):
            store.evidence.picture("0" * 64)
        files.pipe_file(there, jpeg[:4])  # as another program may leave it
        with pytest.raises(UnavailableError, match=f"/{name}.jpg: the picture is damaged"):
            store.evidence.picture(name)


def test_files_of_a_drop_folder_come_and_go(bucket: str, files: Any) -> None:
    files.pipe_file("hall-3/drop/a.csv", b"a" * 100)
    there = SharedFolder(f"{bucket}/drop", Path("wms.toml"), "expected.inbox")
    # of the same size, within the second that S3 tells
    check_files_come_and_go(there, lambda data: files.pipe_file("hall-3/drop/a.csv", data), 100, b"b" * 100)
    assert files.find("hall-3/drop") == ["hall-3/drop/done/a.csv.txt", "hall-3/drop/taking/a.csv"]
    assert files.cat_file("hall-3/drop/done/a.csv.txt") == b"then"


def test_a_drop_that_was_claimed_by_half_is_taken_once(bucket: str, files: Any, place: Path) -> None:
    stock, claimed = "hall-3/in/stock.csv", "hall-3/in/taking/stock.csv"
    text = EXPECTED.replace('inbox = "in"', f'inbox = "{bucket}/in"')
    files.pipe_file(stock, b"LGPLA;NVE;MENGE\nA-1;PAL-1;1\n")
    files.cp_file(stock, claimed)  # a bucket renames by copying, and then it was cut
    assert [file.said for file in once(place, text).files] == ["1 rows"]
    assert once(place, text).files == []
    files.pipe_file(claimed, b"LGPLA;NVE;MENGE\nA-1;PAL-3;1\n")
    files.pipe_file(stock, b"LGPLA;NVE;MENGE\nA-1;PAL-4;1\n")  # dropped while another one is claimed
    assert len(once(place, text).files) == 2
    assert b"PAL-4" in kept(place)[1]
    assert len(files.find("hall-3/in")) == 2 * 3


def test_no_bucket_is_made(bucket: str, files: Any, tmp_path: Path) -> None:
    with pytest.raises(
        UnavailableError, match=r"--evidence: s3://hall-4/pictures: cannot be opened: Not Found"
    ):
        opened_store(str(tmp_path / "counts.db"), "s3://hall-4/pictures")
    assert not files.exists("hall-4")


def test_logs_are_fetched_from_a_bucket_with_what_lies_beside_them(bucket: str, files: Any) -> None:
    for name in ("flight.mcap", "summary.json", "evidence/ab/abcd.jpg", "notes.txt"):
        files.pipe_file(f"hall-3/2026/monday/{name}", f"what is in {name}".encode())
    (source,) = log_sources([f"{bucket}/2026"])
    assert source.name == f"{bucket}/2026/monday/flight.mcap"
    with source.fetched([Study.CODES, Study.JUDGE]) as log:
        assert log.read_text() == "what is in flight.mcap"
        here = {str(path.relative_to(log.parent)) for path in log.parent.rglob("*") if path.is_file()}
        assert here == {"flight.mcap", "summary.json", "evidence/ab/abcd.jpg"}
    with source.fetched([Study.REPLAY]) as log:
        assert [path.name for path in log.parent.iterdir()] == ["flight.mcap"]
    files.rm("hall-3/2026", recursive=True)
    with (
        pytest.raises(UnavailableError, match=r"monday/flight.mcap: cannot be fetched: "),
        source.fetched([Study.REPLAY]),
    ):
        pass


def test_a_server_that_is_gone_is_one_line(
    bucket: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setattr(s3fs.S3FileSystem, "retries", 1)
    for opened in (
        lambda: opened_store(str(tmp_path / "counts.db"), f"{bucket}/pictures"),
        lambda: log_sources([f"{bucket}/2026"]),
    ):
        with pytest.raises(UnavailableError, match="Could not connect to the endpoint URL"):
            opened()
