"""Markdown tables of every key that a pydantic model takes: unit, range, default, meaning.

It reads the model's JSON schema, so any model will do: nested sections, lists of tables, plain dataclasses.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from pydantic import PydanticUserError, TypeAdapter
from pydantic.json_schema import PydanticJsonSchemaWarning

Schema: TypeAlias = Mapping[str, Any]

UNITS = {
    "m": "m", "mm": "mm", "s": "s", "ms": "ms", "px": "px", "deg": "°", "rad": "rad", "mps": "m/s",
    "mps2": "m/s²", "mps3": "m/s³", "degps": "°/s", "degps2": "°/s²", "radps": "rad/s", "fps": "1/s",
    "hz": "Hz", "gb": "GB", "wh": "Wh", "w": "W", "ah": "Ah",
}  # fmt: skip
"""The last word of a key says its unit, where its schema names none."""
_MOST_DEFAULT = 60


@dataclass(frozen=True, slots=True)
class Row:
    """One key, its cells ready to print."""

    key: str
    unit: str
    values: str
    default: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Table:
    """A section: its dotted name, whether the file may hold several of it, what it is for, its keys."""

    name: str
    repeated: bool
    about: str
    rows: tuple[Row, ...]

    def markdown(self) -> str:
        """Heading, text and table; a column that says nothing is left out."""
        heading = f"[[{self.name}]]" if self.repeated else f"[{self.name}]"
        columns = ["key", "unit", "values", "default", "meaning"]
        cells = [[f"`{row.key}`", row.unit, row.values, row.default, row.meaning] for row in self.rows]
        kept = [i for i in range(len(columns)) if any(row[i] for row in cells)]
        lines = [f"### `{heading}`", ""]
        if self.about:
            lines += [self.about, ""]
        if cells:
            lines.append("| " + " | ".join(columns[i] for i in kept) + " |")
            lines.append("|" + "---|" * len(kept))
            lines += ["| " + " | ".join(row[i].replace("|", "\\|") for i in kept) + " |" for row in cells]
            lines.append("")
        return "\n".join(lines)


def tables_of(model: Any) -> list[Table]:
    """Every section of the file that `model` checks, in its order, each before the sections inside it."""
    try:
        adapter = TypeAdapter(model)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PydanticJsonSchemaWarning)  # a default that JSON cannot say: inf
            schema = adapter.json_schema()
    except PydanticUserError as err:
        raise SystemExit(f"{model}: {err}") from err
    return [table for table in _tables("", schema, schema, {}, repeated=False) if table.name]


def _tables(
    name: str, section: Schema, root: Schema, given: Schema, *, repeated: bool, about: str = ""
) -> Iterator[Table]:
    """`given` are the defaults that this use of the section overrides."""
    rows: list[Row] = []
    inside: list[Table] = []
    for key, spec in section.get("properties", {}).items():
        inner, is_list = _section_in(spec, root)
        if inner is None:
            rows.append(_row(key, spec, root, key in section.get("required", []), given))
            continue
        default = spec.get("default")
        path = f"{name}.{key}".strip(".")
        inside += _tables(
            path,
            inner,
            root,
            default if isinstance(default, Mapping) else {},
            repeated=is_list,
            about=spec.get("description", ""),
        )
    text = " ".join((about or section.get("description", "")).split())
    yield Table(name, repeated, text, tuple(rows))
    yield from inside


def _section_in(spec: Schema, root: Schema) -> tuple[Schema | None, bool]:
    """The section that a key holds, and whether it holds a list of them; None for a value."""
    plain = _without_null(_resolved(spec, root), root)
    if plain.get("type") == "array" and isinstance(items := plain.get("items"), Mapping):
        element = _resolved(items, root)
        return (element, True) if "properties" in element else (None, False)
    return (plain, False) if "properties" in plain else (None, False)


def _row(key: str, spec: Schema, root: Schema, required: bool, given: Schema) -> Row:
    needed = required and key not in given
    default = "**required**" if needed else _default(given.get(key, spec.get("default")))
    values = _values(_resolved(spec, root), root)
    unit = spec.get("unit", UNITS.get(key.rpartition("_")[2], ""))
    return Row(key, unit, values, default, " ".join(spec.get("description", "").split()))


def _resolved(spec: Schema, root: Schema) -> Schema:
    """The schema behind references, with what stands beside the reference laid over it."""
    for inner in [spec] if "$ref" in spec else spec.get("allOf", []):
        target: Any = root
        for part in inner["$ref"].removeprefix("#/").split("/"):
            target = target[part]
        beside = {key: value for key, value in spec.items() if key not in {"$ref", "allOf"}}
        return _resolved({**target, **beside}, root)
    return spec


def _without_null(spec: Schema, root: Schema) -> Schema:
    options = [option for option in spec.get("anyOf", []) if option.get("type") != "null"]
    return _resolved(options[0], root) if len(options) == 1 else spec


def _values(spec: Schema, root: Schema) -> str:
    """What may be written, for a person."""
    plain = _without_null(spec, root)
    if "const" in plain or "enum" in plain:
        return ", ".join(f"`{_toml(value)}`" for value in plain.get("enum", [plain.get("const")]))
    if "anyOf" in plain:
        return " or ".join(_values(_resolved(option, root), root) for option in plain["anyOf"])
    match plain.get("type", ""):
        case "boolean":
            text = "`true`, `false`"
        case "integer" | "number" as kind:
            text = _range(plain) or ("whole number" if kind == "integer" else "number")
        case "array":
            text = _list(plain, root)
        case "string":
            text = {"path": "file or folder"}.get(plain.get("format", ""), "text")
        case kind:
            text = str(kind)
    return text


def _list(spec: Schema, root: Schema) -> str:
    elements = [_values(_resolved(element, root), root) for element in spec.get("prefixItems", [])]
    if elements:
        same = len(set(elements)) == 1
        return f"{len(elements)} values, each {elements[0]}" if same else ", ".join(elements)
    items = spec.get("items")
    return f"list of {_values(_resolved(items, root), root)}" if isinstance(items, Mapping) else "list"


def _range(spec: Schema) -> str:
    low, above = spec.get("minimum"), spec.get("exclusiveMinimum")
    high, below = spec.get("maximum"), spec.get("exclusiveMaximum")
    start = f"{low:g}" if low is not None else f"above {above:g}" if above is not None else ""
    end = f"{high:.10g}" if high is not None else f"below {below:g}" if below is not None else ""
    if start and end:
        return f"{start} to {end}"
    return f"{start} or more" if low is not None else start or (f"up to {end}" if high is not None else end)


def _default(value: object) -> str:
    if value is None:
        return "none"
    text = _toml(value)
    return f"`{text}`" if len(text) <= _MOST_DEFAULT else "see above"


def _toml(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case float():
            short = f"{value:.6g}"
            return short if any(mark in short for mark in ".ein") else f"{short}.0"
        case str():
            return f'"{value}"'
        case list() | tuple():
            return f"[{', '.join(map(_toml, value))}]"
        case _:
            return str(value)
