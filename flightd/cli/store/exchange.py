"""`flightd store exchange`: drop folders for a warehouse management system."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson
from flightd.cli.store.options import opened
from flightd.core.errors import RunError

if TYPE_CHECKING:
    from flightd.ground.wms_exchange.exchange import Exchange, Exchanged


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("exchange")(exchange)


def exchange(
    config: Annotated[
        Path,
        typer.Argument(metavar="CONFIG", help="What is exchanged between which folders: a TOML file."),
    ],
    store: Annotated[
        str,
        typer.Option(
            metavar="FILE|URL",
            envvar="FLIGHTD_STORE",
            help="The store that keeps questions and counts, as of the other commands.",
            show_default=False,
        ),
    ] = "",
    every: Annotated[
        float,
        typer.Option(metavar="SECONDS", min=0.0, max=86_400.0, help="Go on, with so long a pause.  0: once."),
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Take expected stock and questions out of drop folders, and put counts that changed, and answers, into
    another, as CSV.

    Folders are here, or URLs such as sftp://USER@HOST/FOLDER; it needs the extra `exchange`.  However often
    it is cut and begun again, no file is taken twice, no count is lost, and the same name has the same
    content.  A file that is refused lies in refused/ with the reason beside it; a single pass ends with
    exit 1 then.

    \b
    Examples:
      flightd store exchange wms.toml --store counts.db
      flightd store exchange wms.toml --store counts.db --every 60
    """
    from contextlib import nullcontext

    from flightd.core.extras import missing_extra

    try:
        from flightd.ground.wms_exchange.exchange import Exchange, alone
        from flightd.ground.wms_exchange.exchange_file import load_exchange
    except ModuleNotFoundError:
        raise missing_extra("ground", "flightd store") from None
    asked = load_exchange(config)
    with alone(config), opened(store, None) if store else nullcontext() as found:
        passes = Exchange(config, asked, found)
        if every:
            _go_on(passes, every, as_json)
        done = passes.once()
    _tell(done, as_json)
    if done.failures:
        raise done.failures[0]
    refused = [file for file in done.files if not file.taken]
    if refused:
        raise RunError(f"{len(refused)} of {len(done.files)} files refused, the first: {refused[0].said}",
                       file=refused[0].name)  # fmt: skip


def _go_on(passes: Exchange, every_s: float, as_json: bool) -> None:
    """Until interrupted.  What fails is told once, and tried again."""
    told: set[str] = set()
    while True:
        done = passes.once()
        if done.files or done.sent:
            _tell(done, as_json)
        failing = {str(failure) for failure in done.failures}
        for line in sorted(failing - told):
            print(f"flightd: {line}", file=sys.stderr, flush=True)
        told = failing
        time.sleep(every_s)


def _tell(done: Exchanged, as_json: bool) -> None:
    if as_json:
        files = [{"file": file.name, "taken": file.taken, "said": file.said} for file in done.files]
        print(json.dumps({"files": files, "sent": done.sent}), flush=True)
        return
    for file in done.files:
        print(f"{file.name} {'taken' if file.taken else 'refused'}: {file.said}", flush=True)
    for name in done.sent:
        print(f"{name} written", flush=True)
    if not done.files and not done.sent and not done.failures:
        print("nothing new")
