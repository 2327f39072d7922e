"""`flightd calibrate`: the down camera's lens from pictures of a chessboard."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson, Pictures
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.vision.lens_calibration import Board

EXAMPLES = """Examples:
  flightd calibrate boards/                     8 or more pictures of a 9x6 chessboard
  flightd calibrate walk.mp4 --board 7x5 --json

Print the board, glue it to something flat, and fill every part of the picture with it, tilted and turned.
"""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("calibrate", epilog=EXAMPLES)(calibrate)


def calibrate(
    paths: Pictures,
    board: Annotated[str, typer.Option(help="Inner corners, COLUMNSxROWS.")] = "9x6",
    as_json: AsJson = False,
) -> None:
    """Calibrate the down camera; prints the `[camera]` keys for the configuration."""
    from flightd.studies.calibrate import calibrate_lens

    found = calibrate_lens(paths, _board(board))
    if as_json:
        print(json.dumps(found.document(), indent=2))
        return
    print(f"# {found.boards} boards in {found.pictures} pictures, error {found.error_px:.3f} px")
    print("[camera]")
    for key, value in found.keys.items():
        print(f"{key} = {value}")


def _board(text: str) -> Board:
    from flightd.vision.lens_calibration import Board

    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None or min(map(int, match.groups())) < 3 or max(map(int, match.groups())) > 50:
        remedy = "expected inner corners as COLUMNSxROWS, 3 to 50 each, for example 9x6"
        raise InputError(remedy, key=f"--board {text}")
    return Board(int(match[1]), int(match[2]))
