"""A time of day on a calendar day, as an instant: over both changes of daylight saving, too."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from flightd.core.errors import InputError

_EXACT = timedelta(seconds=1)


def zone_of(name: str) -> ZoneInfo:
    """The IANA zone of a name.  InputError where there is none."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):  # OSError: the name of a folder
        raise InputError(
            f"{name!r} is no time zone that this machine knows", remedy="give one like Europe/Berlin"
        ) from None


def instant_of(day: date, at: time, zone: ZoneInfo) -> datetime:
    """When the clocks of the zone show this, UTC.  What they show twice is the first time; what they skip is
    the instant at which they skip it."""
    wall = datetime.combine(day, at)
    later = wall.replace(tzinfo=zone).astimezone(UTC)
    if _wall(later, zone) == wall:
        return later
    earlier = wall.replace(tzinfo=zone, fold=1).astimezone(UTC)
    while later - earlier > _EXACT:  # clocks change at a whole second
        middle = earlier + (later - earlier) // 2
        middle -= timedelta(microseconds=middle.microsecond)
        if _wall(middle, zone) < wall:
            earlier = max(middle, earlier + _EXACT)
        else:
            later = middle
    return later


def _wall(instant: datetime, zone: ZoneInfo) -> datetime:
    return instant.astimezone(zone).replace(tzinfo=None, fold=0)
