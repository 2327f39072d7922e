"""What is wrong with a Ray cluster is one line; its head may be away for a while."""

from __future__ import annotations

import contextlib
import socket
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd import __version__
from flightd.app.log_study.finding import Study
from flightd.app.log_study.ray_cluster import Head, NodeLook, check_node
from flightd.app.log_study.ray_engine import run_ray
from flightd.app.log_study.sources import LogSource
from flightd.core.errors import FlightdError, InputError, UnavailableError
from tests.command import Command
from tests.rigs.extras import of_extra

_KEY = "--address ray://head:10001"


def test_the_extra_brings_what_speaks_to_a_cluster_at_an_address() -> None:
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    (ray,) = project["optional-dependencies"]["ray"]
    assert ray.startswith("ray[client]"), "without it Ray refuses every ray://HOST:PORT"


@pytest.mark.parametrize(
    ("look", "is_log", "kind", "said"),
    [
        (
            NodeLook("10.0.0.2", "", "/srv/a.mcap"),
            True,
            UnavailableError,
            f"{_KEY}: node 10.0.0.2 has no flightd; install flightd {__version__} there, "
            "where `ray start` runs",
        ),
        (
            NodeLook("10.0.0.2", "0.1", ""),
            True,
            UnavailableError,
            f"{_KEY}: node 10.0.0.2 has flightd 0.1; install flightd {__version__} there, "
            "where `ray start` runs",
        ),
        (
            NodeLook("10.0.0.3", __version__, "/srv/a.mcap"),
            True,
            InputError,
            "/srv/a.mcap: is not on node 10.0.0.3 of the Ray cluster; give a URL, or a folder that each node "
            "has at the same place",
        ),
        (
            NodeLook("10.0.0.3", __version__, "/srv/stock/inventory.db"),
            False,
            InputError,
            "/srv/stock/inventory.db: --inventory: is not on node 10.0.0.3 of the Ray cluster; give a folder "
            "that each node has at the same place",
        ),
    ],
)
def test_what_a_node_lacks_is_one_line_with_the_remedy(
    look: NodeLook, is_log: bool, kind: type[FlightdError], said: str
) -> None:
    with pytest.raises(kind) as refused:
        check_node(look, _KEY, is_log=is_log)
    assert str(refused.value) == said


def test_a_node_that_has_all_is_let_work() -> None:
    check_node(NodeLook("10.0.0.2", __version__, ""), _KEY, is_log=True)


def test_what_keeps_ray_from_beginning_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    of_extra("ray", "ray")
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    monkeypatch.setenv("RAY_TMPDIR", "/dev/null")
    with pytest.raises(UnavailableError) as refused:
        next(run_ray([LogSource("a", "/a.mcap")], (Study.REPLAY,), 1))
    assert str(refused.value).startswith("--engine ray: no Ray can be started here: ")
    assert "Not a directory" in str(refused.value)


def test_without_ray_there_is_one_line_with_what_to_do(
    flightd: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "flight.mcap").touch()
    monkeypatch.setitem(sys.modules, "ray", None)
    said = "Ray is not installed; pip install -e '.[ray]' in the checkout, or take --engine local"
    ended = flightd("study", tmp_path, "--engine", "ray")
    assert ended == (2, "", f"flightd: --engine ray: {said}\n")


@contextlib.contextmanager
def listening(port: int = 0) -> Iterator[int]:
    """A head, as far as one can be reached, and its port."""
    with socket.create_server(("127.0.0.1", port)) as server:
        yield int(server.getsockname()[1])


def test_a_head_that_comes_back_was_away_and_one_that_does_not_is_gone() -> None:
    waited: list[float] = []
    with contextlib.ExitStack() as again:

        def begun_anew(seconds: float) -> None:
            waited.append(seconds)
            again.enter_context(listening(port))

        with listening() as port:
            head = Head(f"127.0.0.1:{port}", sleep=begun_anew)
            assert head.is_there()
            assert not head.was_away()
        assert not head.is_there()
        assert waited == []
        assert head.was_away()
        assert len(waited) == 1
        assert head.is_there()
    with pytest.raises(ConnectionError, match=rf"^127\.0\.0\.1:{port}: Connection refused$"):
        Head(f"127.0.0.1:{port}", gone_s=0.0).was_away()


def test_of_a_head_behind_rays_client_nothing_is_asked() -> None:
    assert Head("").is_there()
    assert not Head("").was_away()
