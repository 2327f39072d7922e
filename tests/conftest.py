"""For all tests: Hypothesis repeats its examples, and no test depends on the machine's speed."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from tests.command import Command

settings.register_profile(
    "flightd", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("flightd")


@pytest.fixture
def flightd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """The command line."""
    return Command(monkeypatch, capsys)
