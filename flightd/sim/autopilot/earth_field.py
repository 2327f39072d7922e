"""The earth's magnetic field as a compass feels it: a dipole, within some tens of milligauss."""

from __future__ import annotations

import math

_EQUATOR_MGAUSS = 298.0
_POLE_RAD = (math.radians(80.9), math.radians(-72.7))
"""Latitude and longitude of the geomagnetic north pole."""


def earth_field_mgauss(latitude_deg: float, longitude_deg: float) -> tuple[float, float, float]:
    """North, east and down at a place."""
    lat, east = math.radians(latitude_deg), math.radians(longitude_deg) - _POLE_RAD[1]
    pole = _POLE_RAD[0]
    sin_magnetic = math.sin(lat) * math.sin(pole) + math.cos(lat) * math.cos(pole) * math.cos(east)
    north = math.cos(lat) * math.sin(pole) - math.sin(lat) * math.cos(pole) * math.cos(east)
    level = -math.cos(pole) * math.sin(east)
    return _EQUATOR_MGAUSS * north, _EQUATOR_MGAUSS * level, 2.0 * _EQUATOR_MGAUSS * sin_magnetic
