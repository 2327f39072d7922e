"""What the pages' modules say, read from their source: string literals, and texts in `html` templates."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_SKIPPED = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_QUOTED = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'')
_REGEX = re.compile(r"/(?![/*])(?:[^/\\\n\[]|\\.|\[(?:[^\]\\\n]|\\.)*\])+/[a-z]*")
_BEFORE_REGEX = re.compile(r"(?:^|[(,=:\[!&|?{};>]|\breturn)\s*$")
_TAG = re.compile(r"<[^<>]*>")
_ATTRIBUTE = re.compile(r'\b(?:aria-label|aria-valuetext|title|placeholder|alt)="([^"]*)"')
_ENTITY = re.compile(r"&[a-z]+;")
_LETTER = re.compile(r"[^\W\d_]")
_BLANK = "\0"


@dataclass(frozen=True)
class Literal:
    """A string of a module with the places of its quotes; `before` is the code up to it."""

    text: str
    start: int
    end: int
    before: str


@dataclass(frozen=True)
class Shown:
    """What stands in an `html` template as it is: a text between tags, or an attribute that is read."""

    text: str
    start: int
    end: int


@dataclass
class Module:
    """The literals and the shown texts of one source."""

    literals: list[Literal]
    shown: list[Shown]


def read_module(source: str) -> Module:
    """Every literal outside comments, and what `html` templates show without an expression around it."""
    module = Module([], [])
    _code(source, 0, module, "")
    return module


def _code(source: str, at: int, module: Module, end: str) -> int:
    """Read code from `at` on until `end` closes it; where that is."""
    depth = 0
    while at < len(source):
        sign = source[at]
        if sign == end and depth == 0:
            return at
        if skipped := _SKIPPED.match(source, at):
            at = skipped.end()
        elif quoted := _QUOTED.match(source, at):
            text = quoted.group()[1:-1].replace('\\"', '"').replace("\\u001d", "\x1d")
            module.literals.append(Literal(text, at, quoted.end(), source[max(at - 40, 0) : at]))
            at = quoted.end()
        elif sign == "`":
            at = _template(source, at, module)
        elif sign == "/" and _BEFORE_REGEX.search(source, max(at - 20, 0), at):
            found = _REGEX.match(source, at)
            at = found.end() if found else at + 1
        else:
            depth += (sign == "{") - (sign == "}")
            at += 1
    return at


def _template(source: str, start: int, module: Module) -> int:
    """Read a template from its first quote on; the place behind its last."""
    at, masked = start + 1, []
    while source[at] != "`":
        if source.startswith("${", at):
            end = _code(source, at + 2, module, "}") + 1
            masked.append(_BLANK * (end - at))
            at = end
        else:
            step = 2 if source[at] == "\\" else 1
            masked.append(source[at : at + step])
            at += step
    text = "".join(masked)
    if source[:start].endswith("html"):
        module.shown.extend(Shown(source[start + 1 + a : start + 1 + b], start + 1 + a, start + 1 + b)
                            for a, b in _shown(text))  # fmt: skip
    elif _LETTER.search(text.replace(_BLANK, "")):
        fixed = "{}".join(part for part in re.split(_BLANK + "+", text))
        module.literals.append(Literal(fixed, start, at + 1, source[max(start - 40, 0) : start]))
    return at + 1


def _shown(text: str) -> Iterator[tuple[int, int]]:
    """Where a template, its expressions blanked, shows letters."""
    at = 0
    for tag in [*_TAG.finditer(text), None]:
        until = tag.start() if tag else len(text)
        if _LETTER.search(_ENTITY.sub("", text[at:until])):
            yield at, until
        if tag is None:
            return
        for attribute in _ATTRIBUTE.finditer(tag.group()):
            if _LETTER.search(attribute.group(1)):
                yield tag.start() + attribute.start(), tag.start() + attribute.end()
        at = tag.end()
