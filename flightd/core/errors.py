"""Errors by what the caller can do about them."""

from __future__ import annotations

from pathlib import Path


class FlightdError(Exception):
    """Base of every error that flightd raises on purpose.

    The fields say it piece by piece, "" where there is nothing to say: `file` and `key` are where it is
    (a file, a link, a folder; in it a configuration key, an option, a line), `what` is the matter, `remedy`
    what the caller can do.  `str` makes one line for a person of them: FILE: KEY: WHAT; REMEDY.
    """

    def __init__(self, what: str, *, file: Path | str = "", key: str = "", remedy: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.file = str(file)
        self.key = key
        self.remedy = remedy

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.file, self.key, self.what) if part)
        return f"{where}; {self.remedy}" if self.remedy else where


class InputError(FlightdError):
    """Bad input (config, map, image, log, argument): names the file, the key and the remedy.  Exit 2."""


class UnavailableError(FlightdError):
    """A device, port, link or optional package cannot be had now; says which and what to check.  Exit 2."""


class TransientError(FlightdError):
    """A part that is not critical failed; its supervisor restarts it."""


class RunError(FlightdError):
    """The run itself failed: an aborted mission, a tolerance exceeded.  Exit 1."""


def cannot_write(path: Path | str, err: OSError) -> InputError:
    """The error of an output that the system refuses."""
    return InputError(f"cannot write: {err.strerror or err}", file=path)
