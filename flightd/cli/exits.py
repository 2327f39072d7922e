"""How every command ends: errors become one line and an exit code.

Exit 0 on success, 1 for a failed run, 2 for bad input, configuration or a resource that cannot be had,
130 when a person interrupts.
"""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path
from typing import Final, NoReturn, cast

import typer

from flightd.cli.application import InterruptedByUserError
from flightd.core.errors import FlightdError, InputError, UnavailableError, cannot_write

_CommandLineError: Final[type[Exception]] = next(
    kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException"
)
"""What typer raises for arguments that it refuses; it has no public name of its own in every version."""


_QUIET: Final = {"OPENCV_LOG_LEVEL": "SILENT", "OPENCV_FFMPEG_LOGLEVEL": "-8"}
"""OpenCV reads these when it is loaded, here and in child processes: what it cannot open is told by our own
line.  Whoever looks for a fault of its own sets them otherwise."""
_FULL: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""What the system says where no more can be written, to stdout or a file."""


def run_app(app: typer.Typer, name: str) -> NoReturn:
    """Run the command line `name`, by whatever way it was started, and leave the process."""
    for variable, level in _QUIET.items():
        os.environ.setdefault(variable, level)
    _open_what_is_closed()
    try:
        code = app(prog_name=name, standalone_mode=False)
        sys.stdout.flush()
    except _CommandLineError as err:
        _refuse(name, cast(typer.BadParameter, err))
    except (InputError, UnavailableError) as err:
        _leave(name, str(err), 2)
    except FlightdError as err:
        _leave(name, str(err), 1)
    except typer.Abort:
        _leave(name, "nobody answered the question", 1)
    except (InterruptedByUserError, KeyboardInterrupt):
        _leave(name, "interrupted", 130)
    except OSError as err:
        if err.errno not in {*_FULL, errno.EPIPE}:
            raise
        _drop_what_is_left()
        if err.errno == errno.EPIPE:  # who read it has seen enough
            raise SystemExit(1) from None
        _leave(name, str(cannot_write(err.filename or "output", err)), 2)
    raise SystemExit(code if isinstance(code, int) else 0)


def _open_what_is_closed() -> None:
    """Where a shell has closed stdout or stderr (`>&-`), what would go there goes nowhere."""
    if sys.stdout is None:
        sys.stdout = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115


def _drop_what_is_left() -> None:
    """What stdout did not take is tried again as the interpreter ends, and nobody would catch that."""
    try:
        sys.stdout.flush()
    except OSError:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _refuse(name: str, error: typer.BadParameter) -> NoReturn:
    if type(error).__name__ == "NoArgsIsHelpError":  # its text is the help that the person needs
        print(error.format_message(), file=sys.stderr)
        raise SystemExit(2)
    text = error.format_message().rstrip(".")
    _leave(name, f"{text}; see {error.ctx.command_path} --help" if error.ctx else text, 2)


def _leave(name: str, text: str, code: int) -> NoReturn:
    """One line, whatever the text holds."""
    print(f"{name}: {' '.join(text.splitlines())}", file=sys.stderr)
    raise SystemExit(code)
