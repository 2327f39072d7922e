"""The texts that the program hands to a page for a person to read: refusals, findings, troubles, events.

Read from the source: what is raised, answered as a refusal, or named as a problem, with its fields as {}.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import flightd
from flightd.site.site_tables import SiteTablesError, site_of

ROOT = Path(flightd.__file__).parent
SOURCES = (
    "adapters/ground_link/client.py",
    "adapters/ground_link/link.py",
    "adapters/ground_link/maintenance_desk.py",
    "adapters/ground_link/maintenance_rules.py",
    "adapters/ground_link/plan_answers.py",
    "adapters/ground_link/request_handler.py",
    "adapters/vehicle/ardrone/refusal.py",
    "adapters/vehicle/mavlink/pose_parameters.py",
    "adapters/vehicle/mavlink/refusal.py",
    "adapters/vehicle/mavlink/required_parameters.py",
    "app/maintenance",
    "config/exposure_keys.py",
    "config/remote_change.py",
    "core/errors.py",
    "core/exposure.py",
    "core/extras.py",
    "core/paint.py",
    "doctor/beside_daemon.py",
    "doctor/calibration.py",
    "doctor/exposure.py",
    "doctor/machine.py",
    "doctor/pose.py",
    "fleet/schedule",
    "ground",
    "inventory/stock_columns.py",
    "inventory/stock_table.py",
    "inventory/uploaded_stock.py",
    "mission",
    "replay/log.py",
    "replay/log_chunks.py",
    "replay/log_skim.py",
    "replay/playback",
    "site",
    "vision/lens_calibration.py",
    "vision/training/colour_training.py",
)
"""Where a page's texts come from."""
NO_PAGE = {
    "ground/drone_names.py": "options of the command line",
    "ground/foxglove_view": "options of the command line, and Foxglove's own connection",
    "ground/access/key_book.py": "of the command line",
    "ground/ground_store": "of the command line, of programs that deliver, and of the station's start",
    "ground/shared_folder.py": "of the command line: the pictures of a store, and exchange with a WMS",
    "ground/store_api": "for programs, which are told in English",
    "ground/guide_pages/rendering.py": "markup of the guide, which is English",
    "ground/mqtt": "options of the command line, and the broker's own connection",
    "ground/server.py": "options of the command line",
    "ground/station_lock.py": "of the station's start",
    "ground/tls.py": "options of the command line",
    "ground/wms_exchange": "of the command line, and of the notes beside files that were dropped",
    "mission/machine.py": "errors of ours",
    "mission/safety/hazard_table.py": "the table of hazards in the guide, which is English",
    "site/aisle_grid.py": "lines of a site file",
    "site/exchange/lif_losses.py": "notes of the command line",
    "site/exchange/lif_onto.py": "refusals of the command line",
    "site/floor_plan_svg.py": "the floor plan as a document",
}
"""What of that no page shows."""
STAYS_ENGLISH = {
    "{}, to hold at the last": "of a plan that no page asks for: a fleet's",
    "a plan that waits at its end has nodes": "told to programs: no page asks for it",
    "send it as Content-Type: application/json": "told to programs: a page says so",
    "the counts of a goto are of its own node, here {}": "told to programs: no page asks for it",
    "only goto and a plan over nodes end by waiting": "told to programs: no page asks for it",
    "only a goto that does not wait lands on another pad": "told to programs: no page asks for it",
    "nodes and aisles are given": "told to programs: no page asks for it",
    "leave one out": "the end of that",
    "no pad at {}": "told to programs: no page asks for it",
    "no role is set for {}: add it to route_roles.py": "an error of ours: the station does not start",
    "{}: it takes every method; name those that it has": "an error of ours: the station does not start",
    "expected {}": "an option of the command line",
    "is not for keys with scopes": "told to programs",
    "needs the scope {}": "told to programs",
    "this {}; {} has {}": "told to programs",
    "belong together: yours, and the daemon's public one": "an option of the command line",
    "ground.listen {}, {} {}: {}; give an address of this machine and a free port": "at its start",
    "a {} is not read from a log": "an error of ours",
    "{} -m pip install {}": "a command to type",
    "{} trouble": "the name of a topic",
    "ceiling_m = {}": "a line of a site file",
    "flightd ground --folder out": "a command to type",
    "SELECT data FROM expected_stock WHERE store = ?": "a question to the book",
    "interlock = true": "a line of a site file",
    "unattended_start = true": "a line of a site file",
    "manual_exposure = true": "a line of the configuration",
    "{} ({} cameras take it)": "the end of a refusal, which has its German as a whole",
    "{}, and leave the key out": "the middle of that",
    "by {} ({})": "the end of what was done, which has its German as a whole",
    "by {}": "the end of what was done, which has its German as a whole",
    "settings changed: ": "the beginning of what was done, which has its German as a whole",
    "{} in flight": "the middle of an emergency, which has its German with it",
    "{}s {} and {}": "aisles and levels, which have their German together",
}
"""Texts without German, and why."""
EXAMPLES = {
    "the {} camera delivers no picture": "the down camera delivers no picture",
    "this flight uses no {} camera": "this flight uses no front camera",
    "{} places: {}": "48 places: labels cannot be read",
}
"""Texts whose fields are no names."""

_AISLE: Mapping[str, Any] = {"id": "A", "x_m": 0.0, "y_m": 0.0, "spacing_m": [2.0]}
_PAD = {"id": "home", "node": "A1"}
_SOUND: Mapping[str, Any] = {"site": {"name": "hall"}, "aisle": [_AISLE], "pad": [_PAD]}
_BROKEN: tuple[Mapping[str, Any], ...] = (
    {"site": {"name": ""}},
    {"site": {"name": "x" * 81}},
    {"site": {"name": 3}},
    {"site": {"name": "hall", "line_width_m": 1.0}},
    {"site": {"name": "hall", "ceiling_m": 0.0}},
    {"site": {"name": "hall", "ceiling_m": float("inf")}},
    {"site": {"name": "hall", "interlock": 3}},
    {"site": {"name": "hall", "line_colour": "mud"}},
    {"site": 3},
    {"site": {}},
    {"aisle": []},
    {"aisle": {}},
    {"aisle": [{**_AISLE, "x_m": None}]},
    {"aisle": [{**_AISLE, "y_m": -1e9}]},
    {"aisle": [{**_AISLE, "id": "abcd"}]},
    {"aisle": [{**_AISLE, "shelves": ["up"]}]},
    {"cross": [{"nodes": ["A1", "A2", "A3"]}]},
    {"marker": [{"id": 1.5, "dictionary": "x", "x_m": 0.0, "y_m": 0.0}]},
    {"marker": [{"id": "x", "dictionary": "aruco_4x4_50", "x_m": 0.0, "y_m": 0.0}]},
)
"""Site files that are wrong in a value each."""

_ERRORS = re.compile(r"(?!Type|Runtime|Assertion)\w*Error")
_CALLS = frozenset(
    {"Check", "Event", "Objection", "Room", "Rule", "SiteMistake", "Threads", "__init__", "_finding", "_read",
     "_refuse", "answered", "append", "close", "decoded", "error", "json_body", "kill", "missing_extra",
     "note", "ok", "parse_site", "read_draft", "reader", "refusal", "report", "said", "unseen",
     "warning", "withdraw"}
)  # fmt: skip
"""What is called with texts for a person."""
_NAMES = frozenset(
    {"alone", "by_hand", "calibrate", "cannot", "checks", "emergency_causes", "figure", "fixed_keys",
     "fixed_sections", "form", "holds", "lamps", "left", "limit_words", "map_error", "missing", "most",
     "needed", "note", "notes", "over", "place", "problem", "problems", "reason", "reasons", "refusal",
     "refused", "remedy", "settings", "shown", "still", "text", "theirs", "told", "top", "trouble",
     "unshown", "what", "where", "why", "words"}
)  # fmt: skip
"""Names, arguments, attributes and keys that hold such texts."""
_PLACED = frozenset({"file", "key", "source", "path"})
"""Arguments of an error that say where it is."""
_WORDS = re.compile(r"[a-z]{2}\S* |[a-z] \S*[a-z]{2}|\} [a-z]")
"""A path, a name, a unit has none."""
_KEY = re.compile(r"\w+(?:\[\{\}\])? \(\{\}\)(?:\.\w+)?")
"""A key of a site file."""


@dataclass(frozen=True, slots=True)
class Refused:
    """A text as the source has it; `fields` are {} in it."""

    text: str
    where: str

    @property
    def example(self) -> str:
        """The text with its fields filled in."""
        return EXAMPLES.get(self.text, self.text.replace("{}", "X7"))


def refused_texts() -> list[Refused]:
    """All that pages may show of what the program says, in the order of the source."""
    paths = [ROOT / one for one in SOURCES]
    modules = [one for path in paths for one in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]
    skipped = tuple(str(ROOT / one) for one in NO_PAGE)
    return [one for path in modules if not str(path).startswith(skipped) for one in _of(path)]


def value_mistakes() -> list[str]:
    """What the check of a map says of a value that it does not take."""
    found = []
    for broken in _BROKEN:
        try:
            site_of({**_SOUND, **broken})
        except SiteTablesError as err:
            found += [one.problem for one in err.mistakes]
    return found


def _of(path: Path) -> Iterator[Refused]:
    tree = ast.parse(path.read_text())
    known = {
        _name(node.targets[0]): node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
    }
    seen: set[str] = set()
    for node in ast.walk(tree):
        for expression in _texts_of(node):
            for text, line in _literals(expression, known):
                whole = f"{{}}{text}" if text.startswith(" ") else text
                if _WORDS.search(whole) and not _KEY.fullmatch(whole) and whole not in seen:
                    seen.add(whole)
                    yield Refused(whole, f"{path.relative_to(ROOT)}:{line}")


def _texts_of(node: ast.AST) -> Iterator[ast.expr]:
    """Expressions whose texts are for a person."""
    match node:
        case ast.Call():
            yield from _arguments(node)
        case ast.arguments(args=args, defaults=defaults):
            named = zip(reversed(args), reversed(defaults), strict=False)
            yield from (value for argument, value in named if argument.arg in _NAMES)
        case ast.Dict(keys=keys, values=values):
            told = zip(keys, values, strict=True)
            yield from (value for key, value in told if isinstance(key, ast.Constant) and key.value in _NAMES)
        case ast.Assign(targets=[target], value=value) | ast.AnnAssign(target=target, value=value):
            if value is not None and _name(target).lower().lstrip("_") in _NAMES:
                yield value
        case ast.ClassDef(bases=bases, body=body) if any("Enum" in ast.unparse(base) for base in bases):
            yield from (one.value for one in body if isinstance(one, ast.Assign))
        case ast.For(iter=ast.Tuple() as value):
            yield value
        case ast.Return(value=ast.expr() as value) | ast.Yield(value=ast.expr() as value):
            yield value


def _arguments(call: ast.Call) -> Iterator[ast.expr]:
    match call.func:
        case ast.Attribute(value=ast.Name(id="_LOG")):
            return
        case ast.Name(id=name) | ast.Attribute(attr=name) if _ERRORS.fullmatch(name) or name in _CALLS:
            yield from call.args
            yield from (one.value for one in call.keywords if one.arg not in _PLACED)
        case _:
            yield from (one.value for one in call.keywords if one.arg in _NAMES)


def _name(target: ast.expr) -> str:
    match target:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _literals(expression: ast.expr, known: Mapping[str, object]) -> Iterator[tuple[str, int]]:
    """The texts that the expression can be, or is made of, with their lines; `known`: constants."""

    def inner(*others: ast.expr) -> Iterator[tuple[str, int]]:
        for one in others:
            yield from _literals(one, known)

    match expression:
        case ast.Constant(value=str(text)):
            yield text, expression.lineno
        case ast.JoinedStr(values=values):
            yield "".join(_part(one, known) for one in values), expression.lineno
            yield from inner(*(one.value for one in values if isinstance(one, ast.FormattedValue)))
        case ast.IfExp(body=body, orelse=other):
            yield from inner(body, other)
        case (
            ast.BoolOp(values=values)
            | ast.Tuple(elts=values)
            | ast.List(elts=values)
            | ast.Dict(values=values)
        ):
            yield from inner(*values)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            yield from inner(left, right)


def _part(part: ast.expr, known: Mapping[str, object]) -> str:
    match part:
        case ast.Constant(value=text):
            return str(text)
        case ast.FormattedValue(value=ast.Name(id=name)) if isinstance(known.get(name), str):
            return str(known[name])
    return "{}"
