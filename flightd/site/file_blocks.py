"""A site file as blocks of text: each table with the comments that belong to it, so that tables are changed,
taken out and put in while the rest stays as a person wrote it."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array

from flightd.site.site_tables import known_keys

_HEADER: Final = re.compile(r"[ \t]*(\[\[|\[)[ \t]*(\w+)[ \t]*\]{1,2}[ \t]*(#.*)?\n?")


@dataclass(frozen=True, slots=True)
class Block:
    """A table of a file: `lead` are the comments directly above its header, `core` runs from there to its
    last key, `tail` are the blank lines and comments after it.  Without a `table`: what comes before them."""

    table: str
    lead: str
    core: str
    tail: str

    @property
    def text(self) -> str:
        return self.lead + self.core + self.tail


def blocks_of(text: str) -> list[Block]:
    """The blocks of a file (valid TOML, lines end with a line feed); joined they are the file."""
    lines = text.splitlines(keepends=True)
    heads: list[tuple[int, int, str]] = [(0, 0, "")]
    for i, line in enumerate(lines):
        header = _HEADER.fullmatch(line)
        if header is None or not _is_whole("".join(lines[heads[-1][1] : i])):
            continue
        first = i
        while first > heads[-1][1] + bool(heads[-1][2]) and lines[first - 1].lstrip().startswith("#"):
            first -= 1
        heads.append((first, i, header[2]))
    ends = [head[0] for head in heads[1:]] + [len(lines)]
    return [_block(lines, *head, end) for head, end in zip(heads, ends, strict=True)]


def _block(lines: list[str], first: int, header: int, table: str, end: int) -> Block:
    last = end
    while last > header + bool(table) and not lines[last - 1].partition("#")[0].strip():
        last -= 1
    return Block(table, "".join(lines[first:header]), "".join(lines[header:last]), "".join(lines[last:end]))


def _is_whole(text: str) -> bool:
    """Whether a header may follow: this is no half of a value over several lines."""
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True


def values_of(block: Block) -> Any:
    """What the table holds, were it alone in its file; None for what is none."""
    try:
        told = tomllib.loads(block.core).get(block.table)
    except tomllib.TOMLDecodeError:
        return None
    return told[0] if isinstance(told, list) and len(told) == 1 else told


def changed(block: Block, values: Mapping[str, Any]) -> Block:
    """The block with these values: what is equal stays as it is written, and comments stay."""
    if same(values_of(block), values):
        return block
    core = _edited(block, values)
    if core is None:  # written in a way that cannot be edited: the table anew, and its comments before it
        comments = [f"{line.strip()}\n" for line in block.core.splitlines() if line.lstrip().startswith("#")]
        core = "".join(comments) + written(block.table, values)
    return Block(block.table, block.lead, core, block.tail)


def _edited(block: Block, values: Mapping[str, Any]) -> str | None:
    """The core with these values, in place; None where that gives others."""
    try:
        document = tomlkit.parse(block.core)
        found: Any = document[block.table]
        table = found[0] if isinstance(found, list) else found
        for key in [key for key in table if key not in values]:
            table.remove(key)
        for key, value in values.items():
            if key not in table:
                table.append(key, tomlkit.item(value))
            elif not same(_plain(table[key]), value):
                _replace(table, key, value)
        core = tomlkit.dumps(document)
    except (TOMLKitError, AttributeError, LookupError, TypeError, ValueError):
        return None
    core = core if core.endswith("\n") else f"{core}\n"
    return core if same(values_of(Block(block.table, "", core, "")), values) else None


def _replace(table: Any, key: str, value: Any) -> None:
    old = table[key]
    if isinstance(old, Array) and isinstance(value, list):
        for i, one in enumerate(value[: len(old)]):  # in place, so that comments between the numbers stay
            if not same(_plain(old[i]), one):
                old[i] = one
        for one in value[len(old) :]:
            old.append(one)
        while len(old) > len(value):
            old.pop()
        if same(_plain(old), value):
            return
    new = tomlkit.item(value)
    new.trivia.indent, new.trivia.comment_ws = old.trivia.indent, old.trivia.comment_ws
    new.trivia.comment, new.trivia.trail = old.trivia.comment, old.trivia.trail
    table[key] = new


def _plain(value: Any) -> Any:
    return value.unwrap() if hasattr(value, "unwrap") else value


def same(a: Any, b: Any) -> bool:
    """Equal values of a file: 1 and 1.0 are, 1 and true are not."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return isinstance(a, bool) == isinstance(b, bool) and bool(a == b)


def written(table: str, values: Mapping[str, Any]) -> str:
    """A table in the project's own form, its keys in their order."""
    order = {key: i for i, key in enumerate(known_keys(table))}
    lines = [f"[{table}]" if table == "site" else f"[[{table}]]"]
    for key in sorted(values, key=lambda key: order.get(key, len(order))):
        name = key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else quoted(key)
        lines.append(f"{name} = {_literal(values[key])}")
    return "\n".join(lines) + "\n"


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{quoted(key)} = {_literal(one)}" for key, one in value.items()) + "}"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return repr(value)


def quoted(text: str) -> str:
    """A basic string of TOML."""
    # a JSON string is one, but TOML wants the DEL character escaped too
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
