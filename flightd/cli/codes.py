"""`flightd codes`: QR codes and barcodes in pictures.  What it does is imported when it runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson, Pictures
from flightd.cli.tables import stdout
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.studies.label_texts import PictureTexts


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("codes")(codes)


def codes(
    paths: Pictures,
    labels: Annotated[
        Path | None, typer.Option(metavar="F", help="Compare with what this JSON file expects.")
    ] = None,
    text: Annotated[bool, typer.Option("--text", help="Read printed lines, too (extra `ocr`).")] = False,
    config: Annotated[
        Path | None, typer.Option(metavar="F", help="Configuration whose [[scan.text]] says what lines mean.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Read the QR codes and barcodes in pictures.

    Every symbology; GS1 codes and Digital Links come with their parts.  A text is told only when the code's
    own checksum vouches for it or two ways of looking at the picture agree; the rest is counted as doubtful.

    \b
    F: {"codes": [{"file": "a.jpg", "text": "9780804816632"}],
        "texts": [{"file": "a.jpg", "kind": "expiry", "value": "2026-12-31", "group": "dot matrix"}]}

    \b
    Examples:
      flightd codes label.jpg
      flightd codes shelf/ --json
      flightd codes photographs/ --labels photographs/codes.json
      flightd codes photographs/ --text --config hall-flight.toml
    """
    from flightd.studies import codes as command

    if config is not None and not text:
        raise InputError("says what printed lines mean", key="--config", remedy="add --text")
    texts = _texts(config) if text else None
    expected = command.read_labels(labels) if labels else None
    if labels and expected and expected.texts and config is None:
        raise InputError('has "texts"', file=labels, remedy="add --text --config F")
    pictures = command.read(paths, texts)
    if as_json:
        sys.stdout.write(command.as_json(list(pictures), expected) + "\n")
        return
    console = stdout()
    shown = []
    for picture in pictures:
        command.print_picture(picture, console)
        shown.append(picture)
    if expected is not None and expected.codes is not None:
        command.print_verdict(command.compare(shown, expected.codes), console)
    if expected is not None and expected.texts:
        command.print_texts_verdict(command.compared_texts(shown, expected.texts), console)


def _texts(config: Path | None) -> PictureTexts:
    """What reads printed lines, by the patterns of a configuration if one is given."""
    from flightd.config.schema import load_config
    from flightd.studies.label_texts import PictureTexts, check_patterns

    patterns = load_config(config).scan.text if config else ()
    if config is not None:
        check_patterns(patterns, config)
    return PictureTexts(patterns)
