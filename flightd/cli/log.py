"""`flightd log`: look into, export and mend flight logs.  What it does is imported when it runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

from flightd.core.errors import InputError

Log: TypeAlias = Annotated[Path, typer.Argument(metavar="LOG", help="A flight log (flight.mcap).")]
AsJson: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
]


def register(app: typer.Typer) -> None:
    """Hang `log` with its commands on `app`."""
    commands = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
    commands.command("info")(info)
    commands.command("export")(export)
    commands.command("repair")(mend)
    app.add_typer(commands, name="log", help="Look into, export and mend flight logs.")


def info(log: Log, as_json: AsJson = False) -> None:
    """Tell what a log holds: its topics, how long it is, whether it is whole.

    \b
    flightd log info out/flight.mcap
    """
    told = _info(log)
    if as_json:
        print(json.dumps(told))
        return
    size = f"{told['bytes'] / 1e6:.1f} MB, {told['duration_s']:.1f} s, {told['messages']} messages"
    print(f"{log}: {size}, {told['damage'] or 'whole'}")
    for key, value in told["metadata"].items():
        print(f"  {key}: {value}")
    for topic, row in told["topics"].items():
        print(f"  {topic:<12}{row['messages']:>9}  {row['hz']:8.1f} Hz")


def _info(log: Path) -> dict[str, Any]:
    from flightd.core.topics import RETAINED
    from flightd.replay.log import LogReader

    reader = LogReader(log)
    counts: dict[str, int] = {}
    first_ns: dict[str, int] = {}
    last_ns: dict[str, int] = {}
    for entry in reader.entries():
        counts[entry.topic] = counts.get(entry.topic, 0) + 1
        first_ns[entry.topic] = min(first_ns.get(entry.topic, entry.stamp_ns), entry.stamp_ns)
        last_ns[entry.topic] = max(last_ns.get(entry.topic, entry.stamp_ns), entry.stamp_ns)
    streams = [topic for topic in counts if topic not in RETAINED]
    span_ns = max((last_ns[t] for t in streams), default=0) - min((first_ns[t] for t in streams), default=0)

    def rate_hz(topic: str) -> float:
        span_s = (last_ns[topic] - first_ns[topic]) / 1e9
        return round((counts[topic] - 1) / span_s, 2) if span_s > 0 else 0.0

    return {
        "path": str(log),
        "bytes": log.stat().st_size,
        "damage": reader.damage,
        "duration_s": round(span_ns / 1e9, 3),
        "messages": sum(counts.values()),
        "metadata": reader.metadata,
        "topics": {topic: {"messages": counts[topic], "hz": rate_hz(topic)} for topic in sorted(counts)},
    }


def export(
    log: Log,
    csv: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write one CSV file for each topic here.")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(metavar="F.mp4", help="Write the pictures with their lines here.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Turn a log into tables or a video.

    \b
    flightd log export out/flight.mcap --csv out/tables
    flightd log export out/flight.mcap --video out/flight.mp4
    """
    if csv is None and video is None:
        raise InputError("say what to export: --csv DIR, --video F.mp4 or both")
    written: list[Path] = []
    if csv is not None:
        from flightd.core.topics import FOR_PEOPLE
        from flightd.replay.export import export_csv
        from flightd.replay.log import read_log

        written += export_csv(read_log(log, FOR_PEOPLE), csv)
    if video is not None:
        from flightd.studies.flight_video import export_video

        export_video(log, video)
        written.append(video)
    if as_json:
        print(json.dumps({"written": [str(path) for path in written]}))
    else:
        print(*written, sep="\n")


def mend(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG…", help="Flight logs that were cut off.")],
    as_json: AsJson = False,
) -> None:
    """Make logs whole that a kill, a full disk or a loss of power cut off; whole ones stay as they are.

    Not for the log of a flight in progress.

    \b
    flightd log repair /var/lib/flightd/flights/*/flight.mcap
    """
    from flightd.adapters.recorder.mcap_file import repair

    for log in logs:
        repair(log)
    if as_json:
        print(json.dumps({"repaired": [str(log) for log in logs]}))
    else:
        print(*(f"{log}: whole" for log in logs), sep="\n")
