"""`flightd guide`: the documentation, in the terminal."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.core.errors import InputError, RunError

if TYPE_CHECKING:
    from flightd.guide.pages import GuidePage


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("guide")(guide)


def guide(
    topic: Annotated[
        str | None, typer.Argument(metavar="[TOPIC]", help="The page to print; left out: list the pages.")
    ] = None,
    word: Annotated[
        str | None, typer.Option("--search", metavar="WORD", help="Print the lines that hold this word.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
    ] = False,
) -> None:
    """Print a page of the guide, list its pages, or search it.  Needs no network.

    \b
    Examples:
      flightd guide
      flightd guide first-flight
      flightd guide --search "range finder"
      flightd guide --json
    """
    from flightd.guide import pages

    if topic is not None and word is not None:
        raise InputError("TOPIC and --search: give one of them; --search looks through every page")
    if word is not None:
        _print_hits(word, as_json=as_json)
    elif topic is None:
        _print_list(as_json=as_json)
    elif topic in pages.TOPICS:
        _print_page(pages.page(topic), as_json=as_json)
    else:
        near = pages.nearest(topic)
        remedy = f"did you mean {' or '.join(near)}?" if near else "`flightd guide` lists them"
        raise InputError(f"guide {topic}: no such page; {remedy}")


def _print_list(*, as_json: bool) -> None:
    from flightd.guide import pages

    found = pages.pages()
    if as_json:
        listed = [{"topic": page.topic, "title": page.title, "summary": page.summary} for page in found]
        print(json.dumps({"pages": listed}))
        return
    for page in found:
        print(f"{page.topic:<16} {page.summary}")


def _print_page(page: GuidePage, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(asdict(page)))
    elif sys.stdout.isatty():
        _print_markdown(page.text)
    else:
        print(page.text, end="")


def _print_markdown(text: str) -> None:
    """For a person at a terminal; what does not fit a table's cell is folded, never cut."""
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.markdown import Markdown, TableElement
    from rich.table import Table

    class Folded(TableElement):
        def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
            for part in super().__rich_console__(console, options):
                if isinstance(part, Table):
                    for column in part.columns:
                        column.overflow = "fold"
                yield part

    class Folding(Markdown):
        elements = {**Markdown.elements, "table_open": Folded}  # noqa: RUF012 - as the library declares it

    Console().print(Folding(text, hyperlinks=False))


def _print_hits(word: str, *, as_json: bool) -> None:
    from flightd.guide import pages

    hits = list(pages.search(word)) if word.strip() else []
    if as_json:
        print(json.dumps({"hits": [asdict(hit) for hit in hits]}))
    else:
        for hit in hits:
            print(f"{hit.topic}, {hit.heading}: {hit.line}")
    if not hits:
        raise RunError(f"--search {word}: no page holds it; `flightd guide` lists the pages")
