"""`flightd inventory texts`: printed lot, dates, quantity from the pictures that are kept."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from flightd.cli.inventory.records import Folder
from flightd.cli.options import AsJson, ConfigFile


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("texts")(texts)


def texts(
    folder: Folder,
    config: ConfigFile,
    again: Annotated[
        bool, typer.Option("--again", help="Search also what was searched with these patterns before.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Read printed text in the pictures of the newest looks, by the patterns of [[scan.text]] (extra `ocr`).

    What is found is kept with the looks, and told by show, export and the rest.  Beside a GS1 code it comes
    second; what is not sure is unknown.

    \b
    Examples:
      flightd inventory texts out/inventory --config hall-flight.toml
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.config.schema import load_config
    from flightd.studies.label_texts import check_patterns, search_inventory
    from flightd.vision.shelf.text_search import TextSearch

    patterns = load_config(config).scan.text
    check_patterns(patterns, config)
    with SqliteStore(folder, create=False) as store:
        done = search_inventory(store, patterns, TextSearch(patterns), again=again)
    if as_json:
        print(json.dumps(asdict(done)))
        return
    lost = f", {done.lost} gone or broken" if done.lost else ""
    print(f"{done.searched} pictures searched, {done.before} before{lost}")
    print(f"{done.sure} values, {done.unsure} unsure")
