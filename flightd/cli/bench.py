"""`flightd bench`: how fast the methods are here.  What it does is imported when it runs."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from flightd.cli.options import AsJson
from flightd.cli.tables import stdout


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("bench")(bench)


def bench(
    seconds: Annotated[
        float,
        typer.Option(min=0.02, help="Time for each figure on all cores, and at most for each of the others."),
    ] = 1.0,
    frames: Annotated[int, typer.Option(min=4, help="Frames of each size, of all levels alike many.")] = 60,
    one_core: Annotated[bool, typer.Option("--one-core", help="Leave out the run on all cores.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure how fast the methods are here: the paper's Table I.

    Each method takes each frame once, cold, of the levels clean, perturbed, hard and rough in turn (the
    floor of the simulator's rough world); "combined, in flight" is all that a flight asks of a frame.
    Beside them run what one would pick instead: the textbook ways on every pixel, OpenCV's line segment
    detector with merging, scikit-image's skeleton with Hough (extra `bench`).  One unit is one
    cvtColor(BGR2HSV) of the frame, measured in the same run.

    \b
    Examples:
      flightd bench
      flightd bench --seconds 3 --json
    """
    from flightd.studies import bench as command

    timings = command.bench(seconds, all_cores=not one_core, frames=frames)
    if as_json:
        sys.stdout.write(command.as_json(timings) + "\n")
    else:
        command.print_table(timings, stdout())
