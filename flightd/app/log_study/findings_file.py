"""The findings of a study in a file: each as it comes, for a study lasts hours; all in order at its end."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, TextIO

from flightd.app.log_study.finding import LogFindings
from flightd.core.errors import FlightdError, cannot_write
from flightd.core.replaced_output import check_replaceable
from flightd.runtime.durable_files import replace_file

_BEGINS: Final = '{"log": '
_DEVICES: Final = Path("/dev")
"""Where a shell's stdout is, which nothing may take the place of."""


def as_json(document: dict[str, Any]) -> str:
    """On one line.  What no text can hold of a file's name is escaped, as JSON does it."""
    text = json.dumps(document, ensure_ascii=False)
    return text.encode(errors="backslashreplace").decode()


class FindingsFile:
    """Lines of JSON at `path`, in place of those of an earlier study from the first finding on; what is no
    file there but a pipe gets them all at the end.  InputError where it cannot be written, or holds something
    else.

    What the disk refuses later costs no finding: `trouble` says so."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._in_order = True
        self._count = 0
        self.trouble: FlightdError | None = None
        if path.is_file() and path.stat().st_size:
            check_replaceable(path, _BEGINS, "findings of a study")
        try:
            self._is_new = not path.exists()
            self._file: TextIO = path.open("a", encoding="utf-8")
        except OSError as err:
            raise cannot_write(path, err) from None
        self._as_they_come = path.is_file() and _DEVICES not in path.absolute().parents

    def append(self, number: int, found: LogFindings) -> None:
        """What is found in the log of that number."""
        if not self._as_they_come or self.trouble is not None:
            return
        self._in_order &= number == self._count
        try:
            if not self._count:
                self._file.truncate(0)
            self._file.write(_line(found))
            self._file.flush()
        except OSError as err:
            self.trouble = cannot_write(self._path, err)
        self._count += 1

    def end(self, ordered: Sequence[LogFindings]) -> None:
        """All of them, by the order of their logs."""
        is_whole = self._in_order and self.trouble is None
        path = self._path.resolve()
        beside = path.with_name(f"{path.name}.new")
        self.trouble = None
        try:
            with contextlib.closing(self._file):
                if not self._as_they_come:
                    self._file.writelines(map(_line, ordered))
            if self._as_they_come and not is_whole:
                replace_file(path, beside, "".join(map(_line, ordered)).encode())
            if self._is_new and not ordered:
                path.unlink(missing_ok=True)
        except OSError as err:
            self.trouble = cannot_write(self._path, err)
            with contextlib.suppress(OSError):
                beside.unlink(missing_ok=True)


def _line(found: LogFindings) -> str:
    return as_json(found.document()) + "\n"
