"""A Ray cluster that was there before: its nodes are looked at, and what is wrong with it is one line."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from flightd import __version__
from flightd.app.log_study import ray_engine
from flightd.app.log_study.finding import LogFindings, Study
from flightd.app.log_study.ray_engine import run_ray
from flightd.app.log_study.sources import LogSource, log_sources
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.runtime.free_ports import free_port
from tests.rigs.extras import of_extra
from tests.unit.log_study.dying_work import fails

of_extra("ray", "ray")
pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def cluster() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """The address of a head with one core, and its process."""
    port = free_port(socket.SOCK_STREAM)
    with TemporaryDirectory(prefix="ray-") as folder:  # its sockets' paths have to be short
        command = [
            sys.executable, "-c", "from ray.scripts.scripts import main; main()", "start", "--head",
            "--block",
            f"--port={port}", "--node-ip-address=127.0.0.1", "--num-cpus=1", "--include-dashboard=false",
            "--disable-usage-stats", f"--temp-dir={folder}",
        ]  # fmt: skip
        quiet = {"RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0", "PYTHONPATH": str(ROOT)}
        head = subprocess.Popen(
            command, env=os.environ | quiet, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        try:
            assert head.stdout is not None
            assert any(b"--address" in line for line in head.stdout), "it did not begin"
            yield f"127.0.0.1:{port}", head
        finally:
            head.terminate()
            head.wait()
            if head.stdout is not None:
                head.stdout.close()


def found(sources: list[LogSource], address: str) -> dict[int, LogFindings]:
    return dict(run_ray(sources, (Study.REPLAY,), 1, fails, address=address))


def test_logs_are_studied_there_and_work_that_fails_is_told_of_its_log(
    cluster: tuple[str, subprocess.Popen[bytes]], tmp_path: Path
) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "flight.mcap").write_bytes(b"no log at all")
    (tmp_path / "b" / "fails").touch()
    sources = log_sources([str(tmp_path)])
    texts = [one.findings[Study.REPLAY].text for _, one in sorted(found(sources, cluster[0]).items())]
    assert "died" not in " ".join(texts)
    assert texts[0].startswith("flight.mcap: not a flight log")
    assert texts[1] == "ZeroDivisionError: division by zero"


def test_another_flightd_and_a_folder_that_is_not_there_are_one_line(
    cluster: tuple[str, subprocess.Popen[bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusal(kind: type[FlightdError]) -> str:
        with pytest.raises(kind) as refused:
            found([LogSource("gone", str(tmp_path / "gone.mcap"))], cluster[0])
        return str(refused.value)

    told = refusal(InputError)
    assert told.startswith(f"{tmp_path}/gone.mcap: is not on node ")
    assert told.endswith(" of the Ray cluster; give a URL, or a folder that each node has at the same place")
    monkeypatch.setattr(ray_engine, "__version__", "9.0")
    told = refusal(UnavailableError)
    assert re.match(rf"--address {cluster[0]}: node \S+ has flightd {__version__};", told)
    assert told.endswith("; install flightd 9.0 there, where `ray start` runs")


def test_a_head_that_dies_is_one_line_and_no_finding(
    cluster: tuple[str, subprocess.Popen[bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ray_engine, "_LOOKS_S", 0.5)
    monkeypatch.setattr(ray_engine, "_GONE_S", 1.0)
    address, head = cluster
    (tmp_path / "flight.mcap").write_bytes(b"no log at all")
    sources = [LogSource(f"{number}", str(tmp_path / "flight.mcap")) for number in range(100)]
    texts: list[str] = []

    def study() -> None:
        for _, one in run_ray(sources, (Study.REPLAY,), 1, fails, address=address):
            texts.append(one.findings[Study.REPLAY].text)
            if len(texts) == 1:
                head.terminate()
                head.wait()

    with pytest.raises(UnavailableError) as refused:
        study()
    assert str(refused.value).startswith(f"--address {address}: the Ray cluster is gone: ")
    assert {text.partition(":")[0] for text in texts} == {"flight.mcap"}
