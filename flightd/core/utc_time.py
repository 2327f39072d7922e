"""Points in time as text."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta
from typing import Final

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def utc_text(utc_ns: int) -> str:
    """ISO 8601 with milliseconds and Z."""
    return utc_time(utc_ns).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def utc_day(utc_ns: int) -> date:
    """The day in UTC."""
    return utc_time(utc_ns).date()


def utc_time(utc_ns: int) -> datetime:
    """To the microsecond below."""
    return _EPOCH + timedelta(microseconds=utc_ns // 1000)
