"""`flightd study`: many flight logs through today's code.  What it does is imported when it runs."""

from __future__ import annotations

import contextlib
import enum
import os
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.cli.options import AsJson
from flightd.core.errors import FlightdError, InputError, RunError

if TYPE_CHECKING:
    from flightd.app.log_study.finding import LogFindings, Study
    from flightd.app.log_study.sources import LogSource

EXAMPLES = """Examples:
  flightd study flights/ --with replay              would today's code decide the same?
  flightd study flights/ --with detect,codes,judge --json
  flightd study /var/lib/flightd/flights --with codes --inventory /var/lib/flightd/inventory
  flightd study s3://hall-3/2026/ --with detect --engine ray --address ray://head:10001
"""


class Engine(enum.StrEnum):
    """Who does the work."""

    LOCAL = "local"
    RAY = "ray"


def register(app: typer.Typer) -> None:
    """Hang `study` on `app`."""
    app.command("study", epilog=EXAMPLES)(study)


def study(
    paths: Annotated[
        list[str], typer.Argument(metavar="PATH…", help="Flight logs, folders of them, and URLs of either.")
    ],
    studies: Annotated[
        str, typer.Option("--with", metavar="NAME,…", help="detect, replay, codes, judge, calibrate.")
    ] = "replay,detect",
    engine: Annotated[Engine, typer.Option(help="All cores of this computer, or Ray.")] = Engine.LOCAL,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Logs at a time; as many as there are cores.")
    ] = None,
    address: Annotated[
        str, typer.Option(metavar="URL", help="The Ray cluster; RAY_ADDRESS, or one started for this.")
    ] = "",
    inventory: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            exists=True,
            file_okay=False,
            show_default=False,
            help="What the flights counted into, for codes.  Default: what lies beside each log.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="F", help="Write the findings there as they come, a line of JSON a log."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Take flight logs, thousands if need be, through today's code: what would be seen, decided, read and
    judged now, and what differs from what was recorded.

    \b
    detect      the recorded pictures seen again, as `flightd replay` compares them
    replay      every decision made again
    codes       the labels' pictures that the inventory keeps of the flight's run, read again
    judge       a simulated flight judged again by the truth beside it
    calibrate   the sensors fitted by the flight; what differs is told and no failure

    Exit 0 if nothing differs, else 1.  A log that cannot be studied is told, and costs the others nothing.
    """
    from flightd.app.log_study.findings_file import FindingsFile
    from flightd.app.log_study.findings_file import as_json as line_of_json
    from flightd.app.log_study.sources import log_sources
    from flightd.app.log_study.studies import chosen_studies

    if address and engine is Engine.LOCAL:
        raise InputError("is for --engine ray alone", key="--address")
    chosen, sources = chosen_studies(studies), log_sources(paths)
    if inventory is not None:
        sources = _counted_into(inventory, sources, chosen)
    file = None if out is None else FindingsFile(out)
    found: dict[int, LogFindings] = {}
    ended: BaseException | None = None
    try:
        # on the output Ray tells of a worker that died, whatever it is asked
        with contextlib.redirect_stdout(sys.stderr):
            for number, one in _studied(sources, chosen, engine, workers, address):
                found[number] = one
                if file is not None:
                    file.append(number, one)
    except (FlightdError, KeyboardInterrupt) as err:
        ended = err  # what was found until then was hours of work
    ordered = [found[number] for number in sorted(found)]
    if file is not None:
        file.end(ordered)
    failed = sum(not log.passed for log in ordered)
    if ordered and as_json:
        print(line_of_json(_document(ordered, chosen, of=len(sources))))
    elif ordered:
        _print(ordered, chosen)
    if ended is not None:
        raise ended
    if file is not None and file.trouble is not None:
        raise file.trouble
    if failed:
        raise RunError(f"{failed} of {len(ordered)} logs differ or could not be studied")


def _counted_into(inventory: Path, sources: list[LogSource], studies: tuple[Study, ...]) -> list[LogSource]:
    """InputError for a folder that is none of an inventory, or that nobody would read."""
    from flightd.app.log_study.finding import Study

    if Study.CODES not in studies:
        raise InputError("is for the study codes alone", key="--inventory", remedy="add it: --with codes")
    found = [replace(source, inventory=str(inventory.resolve())) for source in sources]
    if not os.access(found[0].inventory_file, os.R_OK):
        what, remedy = "holds no inventory.db that can be read", "give the folder that flights counted into"
        raise InputError(what, file=inventory, key="--inventory", remedy=remedy)
    return found


def _studied(
    sources: list[LogSource], chosen: tuple[Study, ...], engine: Engine, workers: int | None, address: str
) -> Iterator[tuple[int, LogFindings]]:
    from flightd.app.log_study.engines import run_local
    from flightd.app.log_study.ray_engine import run_ray
    from flightd.studies.progress_bar import track

    with contextlib.closing(
        run_local(sources, chosen, min(workers or os.cpu_count() or 1, len(sources)))
        if engine is Engine.LOCAL
        else run_ray(sources, chosen, workers, address=address)
    ) as running:
        yield from track(running, "studying", len(sources))


def _document(found: list[LogFindings], studies: tuple[Study, ...], of: int) -> dict[str, Any]:
    outcomes = {
        study.value: dict(sorted(Counter(log.findings[study].outcome.value for log in found).items()))
        for study in studies
    }
    return {
        "passed": len(found) == of and all(log.passed for log in found),
        "outcomes": outcomes,
        "logs": [log.document() for log in found],
    }


def _print(found: list[LogFindings], studies: tuple[Study, ...]) -> None:
    from rich.table import Table

    from flightd.cli.tables import stdout
    from flightd.core.terminal_text import visible

    table = Table()
    table.add_column("log", overflow="fold")
    for study in studies:
        table.add_column(study.value, overflow="fold")
    for log in found:
        cells = (log.findings[study] for study in studies)
        table.add_row(visible(log.log), *(visible(cell.text or cell.outcome.value) for cell in cells))
    stdout().print(table)
