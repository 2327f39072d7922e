"""Outputs take the place of an earlier one of their kind alone: a slip of the hand must not cost a log."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError, cannot_write


def check_replaceable(out: Path, begins: str, what: str) -> None:
    """InputError where `out` is there already and does not begin as `what` does: it may be an input, or
    somebody's configuration."""
    if not out.exists():
        return
    try:
        with out.open("rb") as file:
            alike = file.read(len(begins.encode())) == begins.encode()
    except OSError as err:
        raise cannot_write(out, err) from None
    if not alike:
        raise InputError(f"is there already, and no {what}", file=out, remedy="give the name of a new file")
