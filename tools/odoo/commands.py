"""The three steps, each by hand or from a timer but the last: that is a person's."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from flightd.core.errors import FlightdError, InputError, RunError, UnavailableError
from tools.odoo.booking import Approval, Booked, book
from tools.odoo.connector_file import ConnectorFile, load_connector
from tools.odoo.counts import Station
from tools.odoo.expected_file import drop_expected
from tools.odoo.odoo import Odoo
from tools.odoo.plan import Plan, read_plan, write_plan
from tools.odoo.planning import plan_bookings
from tools.odoo.stock import read_stock

_EXAMPLES = """examples:
  python -m tools.odoo expected odoo.toml
  python -m tools.odoo plan odoo.toml plan.json
  python -m tools.odoo apply odoo.toml plan.json --by ann
  python -m tools.odoo apply odoo.toml plan.json --by ann --set-only --place AL-02-1-1

ODOO_API_KEY has the key of Odoo, FLIGHTD_STORE_KEY that of the station (scope stock)."""


def main(arguments: Sequence[str] | None = None, utc_ns: int | None = None) -> int:
    """The exit code: 0 done, 1 not all of it, 2 for bad input or a service that cannot be had."""
    asked = _parser().parse_args(arguments)
    try:
        _run(asked, load_connector(asked.config), time.time_ns() if utc_ns is None else utc_ns)
    except FlightdError as err:
        if not err.file:
            err.file = str(asked.config)
        print(f"odoo: {' '.join(str(err).splitlines())}", file=sys.stderr)
        return 2 if isinstance(err, InputError | UnavailableError) else 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tools.odoo",
        description="Connect an Odoo and a ground station.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    steps = parser.add_subparsers(dest="step", required=True)
    expected = steps.add_parser("expected", help="drop Odoo's stock where `flightd store exchange` takes it")
    plan = steps.add_parser("plan", help="what would be booked in Odoo; changes nothing")
    apply = steps.add_parser("apply", help="book in Odoo what a person has approved of a plan")
    for step in (expected, plan, apply):
        step.add_argument("config", type=Path)
    plan.add_argument("plan", type=Path, help="the file to write")
    apply.add_argument("plan", type=Path, help="the file that a person has read")
    apply.add_argument("--by", required=True, metavar="NAME", help="who approves")
    apply.add_argument(
        "--place", action="append", default=[], help="book this place of the plan alone; again for more"
    )
    apply.add_argument("--set-only", action="store_true", help="set the counted quantity, and apply nothing")
    for step in (expected, plan, apply):
        step.add_argument("--json", action="store_true", help="print one JSON document")
    return parser


def _run(asked: argparse.Namespace, file: ConnectorFile, utc_ns: int) -> None:
    approved = read_plan(asked.plan) if asked.step == "apply" else None
    odoo = Odoo(file.odoo, os.environ.get("ODOO_API_KEY", ""))
    if asked.step == "expected":
        stock = read_stock(odoo, file.odoo)
        said = drop_expected(stock, file.expected.inbox, asked.config)
        _tell(asked, {"dropped": said, "left_out": stock.left_out}, [said, *_left_out(stock.left_out)])
        return
    station = Station(file.counts, os.environ.get("FLIGHTD_STORE_KEY", ""))
    now = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=utc_ns // 1000)
    fresh = plan_bookings(file, odoo, station, read_stock(odoo, file.odoo), now)
    if approved is None:
        write_plan(fresh, asked.plan)
        _tell(asked, msgspec.to_builtins(fresh), _plan_lines(fresh))
        return
    by = _approval(asked, approved, file)
    booked = []
    for one in book(odoo, approved, fresh, by, file.counts.journal, utc_ns):
        booked.append(one)
        if not asked.json:
            print(f"{_what(one)}: {one.said}", flush=True)
    _end(asked, booked)


def _approval(asked: argparse.Namespace, approved: Plan, file: ConnectorFile) -> Approval:
    """InputError for a name of nobody, another site's plan, and places that are not in it."""
    by = " ".join(asked.by.split())
    if not by or len(by) > 60:
        raise InputError(
            "a person approves what is booked", key="--by", remedy="give a name of up to 60 letters"
        )
    if approved.site != file.counts.site:
        raise InputError(
            f"the plan is of the site {approved.site}", file=asked.plan, remedy="make one of this site"
        )
    places = {booking.place for booking in approved.bookings}
    for place in asked.place:
        if place not in places:
            raise InputError(f"the plan books nothing at {place}", file=asked.plan, key="--place")
    return Approval(by, not asked.set_only, tuple(asked.place))


def _end(asked: argparse.Namespace, booked: Sequence[Booked]) -> None:
    """RunError where not all of it was booked."""
    if asked.json:
        told = [msgspec.to_builtins(one.booking) | {"done": one.done, "said": one.said} for one in booked]
        print(json.dumps({"booked": told}))
    elif not booked:
        print("nothing to book")
    left = [one for one in booked if not one.done]
    if left:
        raise RunError(
            f"{len(left)} of {len(booked)} not booked, the first: {_what(left[0])}: {left[0].said}",
            file=asked.plan,
            remedy="make a new plan",
        )


def _plan_lines(plan: Plan) -> list[str]:
    total = (
        f"{plan.agreed} labels agree, {len(plan.bookings)} may be booked, {len(plan.untouched)} need a look"
    )
    lines = [f"{one.place} {one.code}: {one.books:g} -> {one.counted:g} ({one.why})" for one in plan.bookings]
    lines += [f"{one.place} {one.code}: not booked: {one.why}" for one in plan.untouched]
    return [*lines, f"{total}, not counted: {plan.uncounted}"]


def _what(one: Booked) -> str:
    return f"{one.booking.place} {one.booking.code} {one.booking.books:g} -> {one.booking.counted:g}"


def _left_out(lines: Sequence[str]) -> list[str]:
    return [f"left out: {line}" for line in lines]


def _tell(asked: argparse.Namespace, document: object, lines: Sequence[str]) -> None:
    if asked.json:
        print(json.dumps(document))
        return
    for line in lines:
        print(line)
