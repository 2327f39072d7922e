"""`flightd train-colour`: a colour profile from labelled pictures.  What it does is imported when it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("train-colour")(train_colour)


def train_colour(
    datasets: Annotated[list[Path], typer.Argument(metavar="DATASET…", help="Folders with a labels.json.")],
    colour: Annotated[str, typer.Option(help="The `line_colour` to learn; other colours count as floor.")],
    out: Annotated[Path, typer.Option(help="The profile file to write, .npz.")],
    name: Annotated[str | None, typer.Option(help="The profile's name. Default: the file's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Which pixels are drawn.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Train a colour profile on labelled pictures.

    A support vector machine learns paint from floor, pixel by pixel, and is baked into a lookup table.
    Each picture teaches by its `mask` (white paint, black floor, grey not told), else by its `regions`
    (boxes and strokes), else by its `lines` (inside is paint; beside is floor if `complete`).

    \b
    labels.json: {"images": [{"file": "a.jpg", "line_colour": "orange", "mask": "a-mask.png"},
      {"file": "b.jpg", "line_colour": "orange", "regions": [
        {"paint": true, "stroke": [[120, 40], [130, 900]], "width": 30},
        {"paint": false, "box": [400, 0, 300, 1080]}]}]}

    \b
    Examples:
      flightd train-colour photographs/ --colour orange --out orange.npz
      flightd detect floor.jpg --profile orange.npz
    """
    from flightd.studies import train as command

    trained = command.train_colour(datasets, colour, out, name or out.stem, seed)
    print(command.as_json(trained, out) if as_json else command.as_text(trained, out))
