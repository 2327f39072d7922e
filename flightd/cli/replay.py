"""`flightd replay`: a recorded flight through today's code.  What it does is imported when it runs."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson, Log
from flightd.cli.tables import stdout
from flightd.core.errors import RunError
from flightd.replay.tolerances import LAST_DIGITS, MOST_PIXELS

if TYPE_CHECKING:
    from flightd.replay.decision_compare import Comparison
    from flightd.replay.perception_compare import PerceptionDrift


def register(app: typer.Typer) -> None:
    """Hang `replay` on `app`."""
    app.command("replay")(replay)


def replay(
    log: Log,
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Largest difference of a decision's number that is no failure.")
    ] = LAST_DIGITS,
    pixels: Annotated[
        float,
        typer.Option(min=0.0, help="Most that 95 % of the lines in the compressed pictures may move."),
    ] = MOST_PIXELS,
    as_json: AsJson = False,
) -> None:
    """Take a recorded flight through today's code and compare every decision with the record.

    The pilot gets every recorded tick, the detector every recorded picture.  Exit 0 if every decision's
    numbers agree within --tolerance, 95 % of the lines lie within --pixels of the recorded ones, and no more
    lines are gone or new than compression tips over (2 % and room for chance; the printed line says how
    many).  Else 1, with the figure that is too large.

    \b
    Examples:
      flightd replay out/flight.mcap
      flightd replay out/flight.mcap --tolerance 1e-6 --json
    """
    from flightd.app.build import detector_of, pilot_of
    from flightd.app.recording import SETTING_TOPICS, recorded_setting
    from flightd.core.topics import Topic
    from flightd.replay.decision_compare import comparison_document, replay_decisions
    from flightd.replay.log import read_log
    from flightd.replay.perception_compare import replay_pictures
    from flightd.studies.progress_bar import watched

    recorded = read_log(log, {Topic.TICK, Topic.DECISION, *SETTING_TOPICS})
    flown = recorded_setting(recorded)
    ticks = sum(entry.topic == Topic.TICK for entry in recorded.entries)
    with watched(
        pilot_of(flown.config, flown.site, flown.order, flown.learnt).step, "deciding", ticks
    ) as step:
        decisions = replay_decisions(recorded, step)
    with watched(detector_of(flown.config, flown.site)().detect, "seeing") as detect:
        seen = replay_pictures(log, detect)
    passed = decisions.within(tolerance) and seen.within(pixels)
    if as_json:
        pictures = asdict(seen) | {"may_tip": seen.may_tip}
        print(json.dumps(comparison_document(decisions) | {"pictures": pictures, "passed": passed}))
    else:
        _print(decisions, tolerance)
        _print_seen(seen, pixels)
    if not passed:
        raise RunError(_complaint(decisions, tolerance, seen, pixels), file=log)


def _complaint(decisions: Comparison, tolerance: float, seen: PerceptionDrift, pixels: float) -> str:
    told = seen.complaint(pixels)
    found = decisions.complaint(tolerance), told and f"the pictures are seen differently: {told}"
    return "; ".join(filter(None, found))


def _print_seen(seen: PerceptionDrift, pixels: float) -> None:
    """Each figure that is judged, with what is allowed of it."""
    if not seen.pictures:
        print("no recorded picture to see again")
        return
    print(
        f"{seen.pictures} pictures seen again: 95 % of {seen.pairs} lines within {seen.rho_p95_px:.3f} px "
        f"({pixels:g} allowed) and {seen.theta_p95_deg:.2f} degrees, the farthest {seen.rho_max_px:.2f} px; "
        f"{seen.gone} gone and {seen.new} new ({seen.may_tip} together allowed)"
    )


def _print(comparison: Comparison, tolerance: float) -> None:
    if comparison.within(tolerance):
        to = "" if comparison.identical else f", to {tolerance:g}"
        print(f"{comparison.ticks} ticks replayed: every decision is the same{to}")
        return
    from rich.table import Table

    table = Table(title=f"{comparison.differing} of {comparison.ticks} decisions drift")
    for heading in ("field", "ticks", "from", "largest", "recorded", "replayed"):
        table.add_column(heading, justify="right" if heading in {"ticks", "from", "largest"} else "left")
    for drift in sorted(comparison.drifts, key=lambda drift: (drift.first_s, drift.field)):
        largest = f"{drift.largest:.3g}" if math.isfinite(drift.largest) else ""
        table.add_row(
            drift.field, str(drift.ticks), f"{drift.first_s:.2f} s", largest, drift.recorded, drift.replayed
        )
    stdout().print(table)
