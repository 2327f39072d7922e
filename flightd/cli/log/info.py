"""`flightd log info`: what a log holds."""

from __future__ import annotations

import json

import typer

from flightd.cli.options import AsJson, Log


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("info")(info)


def info(log: Log, as_json: AsJson = False) -> None:
    """Tell what a log holds: its topics, how long it is, whether it is whole.

    \b
    Examples:
      flightd log info out/flight.mcap
    """
    from flightd.replay.log_summary import summary_of

    told = summary_of(log)
    if as_json:
        print(json.dumps(told))
        return
    size = f"{told['bytes'] / 1e6:.1f} MB, {told['duration_s']:.1f} s, {told['messages']} messages"
    print(f"{log}: {size}, {told['damage'] or 'whole'}")
    for key, value in told["metadata"].items():
        print(f"  {key}: {value}")
    for topic, row in told["topics"].items():
        print(f"  {topic:<12}{row['messages']:>9}  {row['hz']:8.1f} Hz")
