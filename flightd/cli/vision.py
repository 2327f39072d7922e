"""The vision commands.  What they do is imported when they run, so that `--help` is quick."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from flightd.core.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

_METHODS = ("centroid", "skeleton", "combined", "naive")
_TABLE_ORDER = ("naive", "centroid", "skeleton", "combined")
_NARROWEST = 170

_PROFILE_HELP = "Colour profile: yellow, white, red, blue, green, black, or a file of `flightd train-colour`."

AsJson: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
]


def register(app: typer.Typer) -> None:
    """Hang the vision commands on `app`."""
    app.command("detect")(detect)
    app.command("evaluate")(evaluate)
    app.command("codes")(codes)
    app.command("bench")(bench)
    app.command("train-colour")(train_colour)


def _stdout() -> Console:
    """Where tables go; wide enough for them when it is a file or a pipe."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=_NARROWEST)


def _check_methods(methods: tuple[str, ...]) -> None:
    for method in methods:
        if method not in _METHODS:
            raise InputError(f"--method {method}: unknown; choose one of {', '.join(_METHODS)}")


def detect(
    paths: Annotated[
        list[Path], typer.Argument(metavar="PATH…", help="Images, folders of them, and videos.")
    ],
    method: Annotated[str, typer.Option(help="centroid, skeleton, combined or naive.")] = "combined",
    profile: Annotated[str, typer.Option(help=_PROFILE_HELP)] = "yellow",
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write each picture with its lines here.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the painted lines in pictures.

    rho is measured from the image centre, theta is the normal's angle (x right, y down).

    \b
    flightd detect floor.jpg
    flightd detect frames/ flight.mp4 --profile white --overlay out/
    flightd detect floor.jpg --method skeleton --json
    """
    _check_methods((method,))
    from flightd.studies import detect as command

    found = command.detect(paths, method, profile, overlay)
    if as_json:
        sys.stdout.write(command.as_json(list(found)) + "\n")
        return
    console = _stdout()
    for entry in found:
        command.print_found(entry, console)


def evaluate(
    dataset: Annotated[Path, typer.Argument(help="A folder with images and a labels.json.")],
    methods: Annotated[
        list[str] | None, typer.Option("--method", help="Only this method; repeatable. Default: all four.")
    ] = None,
    profile: Annotated[
        str | None, typer.Option(help=f"{_PROFILE_HELP} Default: each picture's own colour.")
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
    flightd evaluate photographs/
    flightd evaluate out/hard --method combined --overlay out/failures
    flightd evaluate out/clean --exposure 0.25 --warmth 1.5
    """
    wanted = tuple(methods or _TABLE_ORDER)
    _check_methods(wanted)
    from flightd.studies import evaluate as command
    from flightd.vision.training.line_score import Gate

    gate = Gate(gate_rho / 100.0, math.radians(gate_theta))
    light = command.LightLevel(exposure, warmth)
    scores, failures, count = command.evaluate(dataset, wanted, profile, gate, overlay, light)
    if as_json:
        sys.stdout.write(command.as_json(dataset, gate, scores, failures, count) + "\n")
    else:
        command.print_table(dataset, scores, count, _stdout())


def codes(
    paths: Annotated[
        list[Path], typer.Argument(metavar="PATH…", help="Images, folders of them, and videos.")
    ],
    labels: Annotated[
        Path | None, typer.Option(metavar="F", help="Compare with the texts that this JSON file expects.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Read the QR codes and barcodes in pictures.

    Every symbology; GS1 element strings come with their parts.  A text is told only when the code's own
    checksum vouches for it or two ways of looking at the picture agree; the rest is counted as doubtful.

    \b
    F: {"codes": [{"file": "a.jpg", "text": "9780804816632"}]}

    \b
    flightd codes label.jpg
    flightd codes shelf/ --json
    flightd codes photographs/ --labels photographs/codes.json
    """
    from flightd.studies import codes as command

    expected = command.read_expected(labels) if labels else None
    pages = command.read(paths)
    if as_json:
        sys.stdout.write(command.as_json(list(pages), expected) + "\n")
        return
    console = _stdout()
    shown = []
    for page in pages:
        command.print_page(page, console)
        shown.append(page)
    if expected is not None:
        command.print_verdict(command.compare(shown, expected), console)


def bench(
    seconds: Annotated[float, typer.Option(min=0.02, help="Time for each figure.")] = 1.0,
    one_core: Annotated[bool, typer.Option("--one-core", help="Leave out the run on all cores.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure how fast the methods are here: the paper's Table I.

    Beside them run what one would pick instead: the textbook ways on every pixel, OpenCV's line segment
    detector with merging, scikit-image's skeleton with Hough (extra `bench`).  One unit is one
    cvtColor(BGR2HSV) of the frame, measured in the same run.

    \b
    flightd bench
    flightd bench --seconds 3 --json
    """
    from flightd.studies import bench as command

    timings = command.bench(seconds, all_cores=not one_core)
    if as_json:
        sys.stdout.write(command.as_json(timings) + "\n")
    else:
        command.print_table(timings, _stdout())


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
    flightd train-colour photographs/ --colour orange --out orange.npz
    flightd detect floor.jpg --profile orange.npz
    """
    from flightd.studies import train as command

    trained = command.train_colour(datasets, colour, out, name or out.stem, seed)
    print(command.as_json(trained, out) if as_json else command.as_text(trained, out))
