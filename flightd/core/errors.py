"""Errors by what the caller can do about them."""

from __future__ import annotations


class FlightdError(Exception):
    """Base of every error that flightd raises on purpose; its text is one line for a person."""


class InputError(FlightdError):
    """Bad input (config, map, image, log, argument): names the file, the key and the remedy.  Exit 2."""


class UnavailableError(FlightdError):
    """A device, port or link cannot be had now; the text says which and what to check.  Exit 2."""


class TransientError(FlightdError):
    """A part that is not critical failed; its supervisor restarts it."""


class RunError(FlightdError):
    """The run itself failed: an aborted mission, a tolerance exceeded.  Exit 1."""
