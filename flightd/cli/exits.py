"""How every command ends: errors become one line and an exit code.

Exit 0 on success, 1 for a failed run, 2 for bad input, configuration or a resource that cannot be had.
"""

from __future__ import annotations

import sys
from typing import NoReturn

import typer

from flightd.core.errors import FlightdError, InputError, UnavailableError


def run_app(app: typer.Typer, name: str) -> NoReturn:
    """Run the command line and leave the process."""
    try:
        app()
    except (InputError, UnavailableError) as err:
        _leave(f"{name}: {err}", 2)
    except FlightdError as err:
        _leave(f"{name}: {err}", 1)
    except KeyboardInterrupt:
        _leave(f"{name}: interrupted", 130)
    raise SystemExit(0)


def _leave(line: str, code: int) -> NoReturn:
    print(line, file=sys.stderr)
    raise SystemExit(code)
