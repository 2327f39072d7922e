"""`flightd evaluate`: all methods on a labelled folder.  What it does is imported when it runs."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import METHODS, PROFILE_HELP, AsJson, check_methods
from flightd.cli.tables import stdout


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("evaluate")(evaluate)


def evaluate(
    dataset: Annotated[Path, typer.Argument(help="A folder with images and a labels.json.")],
    methods: Annotated[
        list[str] | None, typer.Option("--method", help="Only this method; repeatable. Default: all four.")
    ] = None,
    profile: Annotated[
        str | None, typer.Option(help=f"{PROFILE_HELP} Default: each picture's own colour.")
    ] = None,
    gate_rho: Annotated[float, typer.Option(min=0.01, help="Farthest match, percent of the width.")] = 5.0,
    gate_theta: Annotated[float, typer.Option(min=0.01, max=90.0, help="Farthest match, degrees.")] = 5.0,
    exposure: Annotated[
        float, typer.Option(min=0.01, help="Brighten or darken every picture by this factor first.")
    ] = 1.0,
    warmth: Annotated[
        float, typer.Option(min=0.1, max=10.0, help="Turn the white balance: factor of red over blue.")
    ] = 1.0,
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write each picture that went wrong here.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure all methods on a labelled folder: the paper's Table II.

    A detection matches a labelled line when it passes within the gate of the middle of its visible span;
    the errors are those of rho (about the image centre) and theta.  `minor` lines are neither missed nor
    false; false lines are counted on pictures labelled `complete`, as a part of the detections there.
    Two labels of which one continues the other's band are one line: a detection within 2 % of the width
    and 3 degrees of both finds both.

    \b
    labels.json: {"images": [{"file": "a.jpg", "width": 1920, "height": 1080, "line_colour": "yellow",
      "complete": true, "negative": false, "lines": [{"x1": 0, "y1": 188.5, "x2": 102.4, "y2": 120.4,
      "thickness": 11.5, "grade": "main"}], "nodes": [{"x": 231.2, "y": 157.1, "kind": "+"}]}]}
    Points are pixels from the centre of the top-left pixel; grade main or minor; kind +, T, L, end, bend.

    \b
    Examples:
      flightd evaluate photographs/
      flightd evaluate out/hard --method combined --overlay out/failures
      flightd evaluate out/clean --exposure 0.25 --warmth 1.5
    """
    wanted = tuple(methods or METHODS)
    check_methods(wanted)
    from flightd.studies import evaluate as command
    from flightd.vision.training.line_score import Gate

    gate = Gate(gate_rho / 100.0, math.radians(gate_theta))
    light = command.LightLevel(exposure, warmth)
    scores, failures, count = command.evaluate(dataset, wanted, profile, gate, overlay, light)
    if as_json:
        sys.stdout.write(command.as_json(dataset, gate, scores, failures, count) + "\n")
    else:
        command.print_table(dataset, scores, count, stdout())
