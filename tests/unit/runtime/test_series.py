from __future__ import annotations

import pytest

from flightd.runtime.bounded_series import Series


def test_quantiles_are_those_of_the_newest_and_the_memory_is_bounded() -> None:
    series = Series(keep=1000)
    assert (len(series), series.quantile(0.5)) == (0, 0.0)
    for value in range(10_000):
        series.add(float(value))
        assert len(series) < 2000
    assert series.quantile(1.0) == 9999.0
    assert series.quantile(0.0) >= 8000.0


def test_quantiles() -> None:
    series = Series()
    for value in range(101):
        series.add(value * 0.1)
    assert series.quantile(0.5) == pytest.approx(5.0)
    assert series.quantile(0.99) == pytest.approx(9.9)
