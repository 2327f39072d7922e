"""PostgreSQL as a private cluster on a socket of its own, for as long as the tests want it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

_USER = "postgres"
"""Made by the package; initdb refuses root."""
_FAST = (
    "-c fsync=off -c synchronous_commit=off -c full_page_writes=off -c autovacuum=off -c max_connections=20"
)


@contextmanager
def postgres() -> Iterator[str]:
    """The URL of a cluster that runs meanwhile."""
    programs = _programs()
    if programs is None:
        assert os.environ.get("CI", "") != "true", "CI has PostgreSQL: tools/test installs it"
        pytest.skip("PostgreSQL is not installed: sudo apt install postgresql")
    folder = Path(tempfile.mkdtemp(prefix="flightd-pg-"))
    data = folder / "data"
    try:
        if os.getuid() == 0:
            shutil.chown(folder, _USER)
        made = ("--username=flightd", "--auth=trust", "--encoding=UTF8", "--locale=C", "--no-sync")
        _run(folder, [str(programs / "initdb"), f"--pgdata={data}", *made])
        options = f"-c listen_addresses='' -c unix_socket_directories={folder} {_FAST}"
        control = [str(programs / "pg_ctl"), f"--pgdata={data}", "--wait"]
        _run(folder, [*control, f"--log={folder / 'log'}", f"--options={options}", "start"])
        try:
            yield f"postgresql://flightd@/postgres?host={folder}"
        finally:
            _run(folder, [*control, "--mode=immediate", "stop"])
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _programs() -> Path | None:
    """The folder of initdb: Debian keeps each version's apart."""
    found = shutil.which("initdb")
    if found is not None:
        return Path(found).resolve().parent
    known = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    return known[-1].parent if known else None


def _run(folder: Path, command: Sequence[str]) -> None:
    as_user = ["runuser", "-u", _USER, "--"] if os.getuid() == 0 else []
    done = subprocess.run([*as_user, *command], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command[0]}: {done.stderr}"
