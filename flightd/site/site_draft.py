"""A site file under an editor's hands: its tables as they shall be, over the text as it was.

Comments and the form in which things are written stay where nothing is changed.  An element says by `at`
which table of the text it was (the second [[aisle]]: 1), None for a new one.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from flightd.core.errors import InputError
from flightd.site.file_blocks import Block, blocks_of, changed, same, values_of, written
from flightd.site.site_tables import LISTS, known_keys

_DEEPEST = 8


@dataclass(frozen=True, slots=True)
class Element:
    """One of a list's tables."""

    values: dict[str, Any]
    at: int | None = None


@dataclass(frozen=True, slots=True)
class SiteDraft:
    """`lists` by the name of their tables; other tables of the text stay as they are."""

    site: dict[str, Any]
    lists: dict[str, tuple[Element, ...]] = field(default_factory=dict)
    text: str = ""

    def tables(self) -> dict[str, Any]:
        """As the file will hold them."""
        told: dict[str, Any] = {"site": self.site}
        for name, elements in self.lists.items():
            if elements:
                told[name] = [element.values for element in elements]
        return told


def read_draft(text: str, source: str) -> SiteDraft:
    """The text of a site file, sound or not, to be edited.  InputError where it is not even of the form."""
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as err:
        raise InputError(f"not valid TOML: {err}", file=source) from None
    except RecursionError:
        raise InputError("nested too deep", file=source) from None
    for name, told in tables.items():
        if name != "site" and name not in LISTS:
            known = ", ".join(("site", *LISTS))
            raise InputError("unknown table", file=source, key=name, remedy=f"known are {known}")
        if not _is_of_form(name, told) or not _is_plain(told):
            form = "[site]" if name == "site" else f"[[{name}]]"
            raise InputError(f"not written as {form} with plain values", file=source, key=name)
    lists = {
        name: tuple(Element(values, at) for at, values in enumerate(tables.get(name, ()))) for name in LISTS
    }
    return SiteDraft(tables.get("site", {}), lists, text)


def _is_of_form(name: str, told: Any) -> bool:
    if name == "site":
        return isinstance(told, dict)
    return isinstance(told, list) and all(isinstance(row, dict) for row in told)


def _is_plain(value: Any, depth: int = 0) -> bool:
    """Whether JSON has such a value, so that an editor can hold it."""
    if depth > _DEEPEST:
        return False
    if isinstance(value, dict):
        return all(_is_plain(one, depth + 1) for one in value.values())
    if isinstance(value, list):
        return all(_is_plain(one, depth + 1) for one in value)
    if isinstance(value, float):
        return math.isfinite(value)
    return isinstance(value, str | bool) or (isinstance(value, int) and abs(value) < 2**53)


def keeps_comments(draft: SiteDraft) -> bool:
    """Whether the text is written so that its comments can stay: as [site] and [[…]] tables."""
    return _blocks(draft.text) is not None


def draft_text(draft: SiteDraft) -> str:
    """The file that holds the draft's tables.  InputError for elements that were none of the text's."""
    _check(draft)
    if same(tomllib.loads(draft.text), draft.tables()):
        return draft.text
    ends_crlf = "\r\n" in draft.text
    blocks = _blocks(draft.text)
    text = _own_form(draft) if blocks is None else _joined(draft, blocks)
    if not same(tomllib.loads(text), draft.tables()):
        text = _own_form(draft)
    return text.replace("\n", "\r\n") if ends_crlf else text


def _check(draft: SiteDraft) -> None:
    try:
        were = tomllib.loads(draft.text)
    except (tomllib.TOMLDecodeError, RecursionError):
        raise InputError("what is edited was no site file") from None
    for name, elements in draft.lists.items():
        if name not in LISTS:
            raise InputError(f"there are no tables {name!r}")
        rows = were.get(name, [])
        there = len(rows) if isinstance(rows, list) else 0
        ats = [element.at for element in elements if element.at is not None]
        if len(set(ats)) < len(ats) or any(not 0 <= at < there for at in ats):
            raise InputError(f"the text has not these {name!r} tables")
    for values in (draft.site, *(one.values for elements in draft.lists.values() for one in elements)):
        if not _is_plain(values):
            raise InputError("a table holds what no site file can")


def _blocks(text: str) -> list[Block] | None:
    """The blocks that hold all that the text does; None where it is written otherwise."""
    text = text.replace("\r\n", "\n")
    tables = tomllib.loads(text)
    text = text if not text or text.endswith("\n") else f"{text}\n"
    blocks = blocks_of(text)
    held: dict[str, Any] = {}
    for block in blocks[1:]:
        if block.table == "site":
            held["site"] = values_of(block)
        else:
            held.setdefault(block.table, []).append(values_of(block))
    return blocks if same(held, tables) else None


def _joined(draft: SiteDraft, blocks: list[Block]) -> str:
    """The blocks with the draft's values, new ones after those that they follow in the draft."""
    left = {name: list(elements) for name, elements in draft.lists.items()}
    tables: dict[str, list[Block]] = {}
    for block in blocks[1:]:
        tables.setdefault(block.table, []).append(block)
    in_order = {name: _rises(elements) for name, elements in draft.lists.items()}
    met: dict[str, int] = {}
    joined = _Joined(blocks[0].text)
    if "site" not in tables:
        joined.put_new("site", draft.site)
    for block in blocks[1:]:
        name = block.table
        if name == "site":
            joined.put(changed(block, draft.site))
            continue
        at = met[name] = met.get(name, -1) + 1
        last = at == len(tables[name]) - 1
        waiting = left.get(name, [])
        # an element stands where it stood; all of them together where their order is another
        while waiting and (last or not in_order[name] or (waiting[0].at or 0) <= at):
            element = waiting.pop(0)
            if element.at is None:
                joined.put_new(name, element.values)
            else:
                joined.put(changed(tables[name][element.at], element.values))
    for name in LISTS:
        for element in left.get(name, ()):
            joined.put_new(name, element.values)
    return joined.text.rstrip("\n") + "\n"


def _rises(elements: tuple[Element, ...]) -> bool:
    ats = [element.at for element in elements if element.at is not None]
    return ats == sorted(ats)


class _Joined:
    """Text that grows block by block, with a blank line before and after each new one."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._after_new = False

    def put(self, block: Block) -> None:
        self._add(block.text, self._after_new)
        self._after_new = False

    def put_new(self, table: str, values: Mapping[str, Any]) -> None:
        self._add(written(table, values), True)
        self._after_new = True

    def _add(self, text: str, apart: bool) -> None:
        gap = "\n" if apart and self.text.strip("\n") and not self.text.endswith("\n\n") else ""
        self.text += gap + text


def _own_form(draft: SiteDraft) -> str:
    """All of it in the project's own form, with the comments that stood before everything."""
    comments = [line for line in draft.text.splitlines() if line.lstrip().startswith("#")]
    parts = [written("site", draft.site)]
    parts += [written(name, one.values) for name in LISTS for one in draft.lists.get(name, ())]
    head = "\n".join(comments)
    return (f"{head}\n\n" if head else "") + "\n".join(parts)


def as_measures(values: Mapping[str, Any]) -> dict[str, Any]:
    """A table with whole numbers of metres and degrees as the file writes them, 3.0, and without the keys
    that have no value."""
    given = {key: value for key, value in values.items() if value is not None}
    return {key: _measure(value) if key.endswith(("_m", "_deg")) else value for key, value in given.items()}


def _measure(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_measure(one) for one in value]
    is_whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53
    return float(value) if is_whole else value


def draft_of(tables: Mapping[str, Any]) -> SiteDraft:
    """A draft without a file yet; each table's keys in the file's order."""
    lists = {name: tuple(Element(_ordered(name, row)) for row in tables.get(name, ())) for name in LISTS}
    return SiteDraft(_ordered("site", tables["site"]), lists)


def _ordered(table: str, values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: values[key] for key in known_keys(table) if key in values}
