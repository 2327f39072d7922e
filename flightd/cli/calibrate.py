"""`flightd calibrate`: the down camera's lens from pictures of a chessboard."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.vision.lens_calibration import Board

EXAMPLES = """Examples:

  flightd calibrate boards/                     8 or more pictures of a 9x6 chessboard
  flightd calibrate walk.mp4 --board 7x5 --json

Print the board, glue it to something flat, and fill every part of the picture with it, tilted and turned.
"""
_MOST_VIEWS = 60


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("calibrate", epilog=EXAMPLES)(calibrate)


def calibrate(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Pictures, folders, videos.")],
    board: Annotated[str, typer.Option(help="Inner corners, COLUMNSxROWS.")] = "9x6",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Calibrate the down camera; prints the `[camera]` keys for the configuration."""
    from flightd.studies.frame_files import list_files, pictures
    from flightd.vision import lens_calibration as calibration

    chessboard = _board(board)
    views, sizes, looked = [], set[tuple[int, int]](), 0
    for path in list_files(paths):
        for picture in pictures(path):
            looked += 1
            corners = calibration.find_board(picture.bgr, chessboard)
            if corners is not None:
                views.append(corners)
                sizes.add((picture.bgr.shape[1], picture.bgr.shape[0]))
    if len(sizes) > 1:
        raise InputError(f"the pictures differ in size ({', '.join(f'{w}x{h}' for w, h in sorted(sizes))})")
    width, height = sizes.pop() if sizes else (0, 0)
    step = max(len(views) // _MOST_VIEWS, 1)
    result = calibration.calibrate(views[::step], chessboard, width, height)
    keys = {
        "width_px": width,
        "height_px": height,
        "fx_px": round(result.lens.fx_px, 2),
        "fy_px": round(result.lens.fy_px, 2),
        "cx_px": round(result.lens.cx_px, 2),
        "cy_px": round(result.lens.cy_px, 2),
        "distortion": [round(value, 6) for value in result.lens.distortion],
    }
    if as_json:
        found = {"pictures": looked, "boards": len(views), "error_px": round(result.error_px, 4)}
        print(
            json.dumps({**found, "sigma_focal_px": round(result.sigma_focal_px, 3), "camera": keys}, indent=2)
        )
        return
    print(f"# {len(views)} boards in {looked} pictures, error {result.error_px:.3f} px")
    print("[camera]")
    for key, value in keys.items():
        print(f"{key} = {value}")


def _board(text: str) -> Board:
    from flightd.vision.lens_calibration import Board

    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None or min(map(int, match.groups())) < 3 or max(map(int, match.groups())) > 50:
        raise InputError(
            f"--board {text}: expected inner corners as COLUMNSxROWS, 3 to 50 each, for example 9x6"
        )
    return Board(int(match[1]), int(match[2]))
