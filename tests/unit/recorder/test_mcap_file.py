from __future__ import annotations

import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from flightd.adapters.recorder import mcap_file
from flightd.adapters.recorder.mcap_file import McapFile
from flightd.adapters.recorder.mcap_repair import repair
from flightd.core.errors import InputError
from flightd.replay.log import read_log


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of three chunks with ten messages each on two channels."""
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    file = McapFile.create(path)
    file.add_metadata("flightd", {"version": "1"})
    file.add_channel(1, "/a", "A", '{"type":"object"}')
    for chunk in range(3):
        if chunk == 1:
            file.add_channel(2, "/b", "B", '{"type":"object"}')
        for index in range(10):
            stamp_ns = chunk * 10 + index
            file.add_message(1 + (chunk > 0 and index % 2), stamp_ns, b'{"i":%d}' % stamp_ns)
        file.flush()
    file.close()
    return path


def _numbers(path: Path) -> list[int]:
    numbers = []
    for entry in read_log(path).entries:
        assert isinstance(entry.message, dict)
        numbers.append(entry.message["i"])
    return numbers


def test_a_whole_file_is_not_changed_by_repair(whole: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    shutil.copy(whole, copy)
    repair(copy)
    assert copy.read_bytes() == whole.read_bytes()


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_file_cut_anywhere_is_mended_up_to_its_last_whole_chunk(
    whole: Path, tmp_path: Path, data: st.DataObject
) -> None:
    content = whole.read_bytes()
    cut = data.draw(st.integers(0, len(content)))
    path = tmp_path / "cut.mcap"
    path.write_bytes(content[:cut])
    before = _numbers(path) if cut >= 8 else []
    repair(path)
    after = _numbers(path)
    assert after == before
    assert after == list(range(len(after)))
    assert len(after) % 10 == 0
    assert read_log(path).damage == ""
    with path.open("rb") as stream:
        summary = make_reader(stream, validate_crcs=True).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(after)
        stream.seek(0)
        found = [message.log_time for *_, message in make_reader(stream).iter_messages(topics=["/a", "/b"])]
        assert found == after


def test_a_resumed_file_holds_both_parts(whole: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole.read_bytes()[:-100])
    file = McapFile.resume(path)
    assert file.messages == 30
    file.add_channel(1, "/a", "A", '{"type":"object"}')
    file.add_message(1, 30, b'{"i":30}')
    file.close()
    assert _numbers(path) == list(range(31))


def test_a_damaged_chunk_does_not_cost_the_others(whole: Path, tmp_path: Path) -> None:
    content = bytearray(whole.read_bytes())
    second = content.index(b"zstd", content.index(b"zstd") + 1)
    content[second + 30] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content)
    file = McapFile.resume(path)
    assert file.messages == 20
    file.close()


@pytest.mark.parametrize("content", [b"hello, world: not a log", b"\x89PNG\r\n\x1a\n"])
def test_a_file_that_is_no_log_is_refused_and_left_alone(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a flight log"):
        repair(path)
    assert path.read_bytes() == content


def test_a_log_of_another_program_is_refused_and_left_alone(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.finish()
    content = path.read_bytes()
    with pytest.raises(InputError, match="another program"):
        repair(path)
    assert path.read_bytes() == content


@contextmanager
def _full_disk(path: Path) -> Iterator[None]:
    """No file of this process grows beyond the present size of `path`, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_disk_that_is_full_for_a_while_costs_nothing(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    file = McapFile.create(path)
    file.add_channel(1, "/a", "A", '{"type":"object"}')
    file.add_message(1, 0, b'{"i":0}')
    file.flush()
    with _full_disk(path):
        for number in (1, 2):
            file.add_message(1, number, b'{"i":%d}' % number)
            with pytest.raises(OSError, match="too large"):
                file.flush()
    assert (file.messages, file.pending) == (1, 2)
    file.add_message(1, 3, b'{"i":3}')
    file.flush()
    assert (file.messages, file.pending) == (4, 0)
    file.close()
    assert _numbers(path) == [0, 1, 2, 3]


def test_a_disk_that_stays_full_costs_the_oldest_of_what_waits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_file, "KEPT_BYTES", 100_000)
    path = tmp_path / "flight.mcap"
    file = McapFile.create(path)
    file.add_channel(1, "/a", "A", '{"type":"object"}')
    file.flush()
    with _full_disk(path):
        for number in range(30):
            file.add_message(1, number, b'{"i":%d,"text":"%s"}' % (number, b"x" * 10_000))
            with pytest.raises(OSError, match="too large"):
                file.flush()
            assert file.pending <= 10
    kept = file.pending
    file.close()
    assert _numbers(path) == list(range(30 - kept, 30))
