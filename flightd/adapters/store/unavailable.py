"""The error of an inventory that cannot be had, told from that of whoever is given what it holds."""

from __future__ import annotations

from flightd.core.errors import UnavailableError


class InventoryUnavailableError(UnavailableError):
    """The file of an inventory cannot be had now; another one's may."""
