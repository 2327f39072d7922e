"""`flightd calibrate`: the down camera's lens by a board, or all of a drone's sensors by a flight."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.studies.sensor_fit_document import SensorRow
    from flightd.vision.lens_calibration import Target

EXAMPLES = """Examples:
  flightd calibrate boards/                     8 or more pictures of a 9x6 chessboard
  flightd calibrate walk.mp4 --board 7x5 --json
  flightd calibrate boards/ --board 11x7 --charuco 4X4_50
  flightd calibrate --from-log out/sim/flight.mcap

Print the board, glue it to something flat, and fill every part of the picture with it, tilted and turned.
A chessboard counts where all of it is seen, a ChArUco board where a part is: it tells the edges better.

A flight tells the camera's delay and mount, too: best one that hovers, goes fast, and turns by 90 degrees.
"""


_CHESSBOARD = "9x6"


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("calibrate", epilog=EXAMPLES)(calibrate)


def calibrate(
    paths: Annotated[
        list[Path] | None, typer.Argument(metavar="PATH…", help="Images, folders of them, and videos.")
    ] = None,
    board: Annotated[
        str | None, typer.Option(help="Inner corners, COLUMNSxROWS (default: 9x6).", show_default=False)
    ] = None,
    charuco: Annotated[
        str,
        typer.Option(
            metavar="DICTIONARY", help="The board is a ChArUco one with these markers.", show_default=False
        ),
    ] = "",
    from_log: Annotated[
        Path | None, typer.Option(metavar="LOG", help="A flight log: estimate delay, mount and more by it.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Calibrate the down camera; prints the `[camera]` keys for the configuration."""
    from flightd.studies.calibrate import calibrate_lens

    if bool(paths or charuco) is (from_log is not None):
        raise InputError("give pictures of a board, or --from-log LOG")
    if from_log is not None and board is not None:
        raise InputError("a flight shows no board", key="--board", remedy="leave it out, or --from-log")
    if from_log is not None:
        _by_flight(from_log, as_json=as_json)
        return
    found = calibrate_lens(paths or [], _board(board or _CHESSBOARD, charuco))
    if as_json:
        print(json.dumps(found.document(), indent=2))
        return
    print(f"# {found.boards} boards in {found.pictures} pictures, error {found.error_px:.3f} px")
    print("[camera]")
    for key, value in found.keys.items():
        print(f"{key} = {value}")


def _by_flight(path: Path, *, as_json: bool) -> None:
    """The sensors of the drone that flew it, and what to configure."""
    from flightd.studies.flight_calibration import calibrate_by_flight

    fitted = calibrate_by_flight(path)
    if as_json:
        print(json.dumps({"log": str(path), **fitted.document()}, indent=2))
        return
    _print(fitted.rows, fitted.found.frames)
    if not fitted.keys:
        print("# nothing differs surely from what is configured")
        return
    print("[camera]")
    for key, value in fitted.keys.items():
        print(f"{key} = {value}")


def _print(rows: list[SensorRow], frames: int) -> None:
    from rich.table import Table

    from flightd.cli.tables import stdout

    def number(value: float | None, sigma: float | None) -> str:
        return "" if value is None else f"{value:.4g}" + (f" ± {sigma:.2g}" if sigma is not None else "")

    table = Table(title=f"{frames} frames", title_justify="left")
    for heading in ("sensor", "configured", "in flight", "fitted", "note"):
        table.add_column(heading, justify="left" if heading in {"sensor", "note"} else "right")
    for row in rows:
        fitted = number(row.fitted, row.sigma)
        seen = number(row.online, row.online_sigma)
        table.add_row(f"{row.name}, {row.unit}", f"{row.configured:.4g}", seen, fitted, row.note)
    stdout().print(table)


def _board(text: str, dictionary: str) -> Target:
    from flightd.vision.charuco_board import CharucoBoard
    from flightd.vision.lens_calibration import Board

    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None or min(map(int, match.groups())) < 3 or max(map(int, match.groups())) > 50:
        remedy = "expected inner corners as COLUMNSxROWS, 3 to 50 each, for example 9x6"
        raise InputError(remedy, key=f"--board {text}")
    columns, rows = int(match[1]), int(match[2])
    try:
        return CharucoBoard(columns, rows, dictionary) if dictionary else Board(columns, rows)
    except InputError as err:
        raise InputError(str(err), key=f"--charuco {dictionary}") from None
