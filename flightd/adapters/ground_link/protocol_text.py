"""The ground link's protocol as text for people, made from the messages themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from flightd.adapters.ground_link.protocol import ANSWERS, PARTS, PUBLISHED, REQUESTS

_CHAPTERS = (
    ("Published on the status port", PUBLISHED),
    ("Requests on the command port", REQUESTS),
    ("Answers", ANSWERS),
    ("Parts of messages", PARTS),
)


class FieldDoc(NamedTuple):
    """One field for a reader: its name, its JSON type, what it means."""

    name: str
    kind: str
    text: str


def fields_of(message: type[msgspec.Struct]) -> Iterator[FieldDoc]:
    """The documentation of a message, field by field, in the order of the JSON."""
    schema = msgspec.json.schema(message)
    own = schema["$defs"][message.__name__]
    for name, spec in own["properties"].items():
        yield FieldDoc(name, _kind(spec), spec.get("description", ""))


def _kind(spec: dict[str, object]) -> str:
    if "const" in spec or "enum" in spec:
        values = spec.get("enum", [spec.get("const")])
        assert isinstance(values, list)
        return " or ".join(f'"{value}"' for value in values)
    if "$ref" in spec:
        return str(spec["$ref"]).rpartition("/")[2]
    if "anyOf" in spec:
        options = spec["anyOf"]
        assert isinstance(options, list)
        return " or ".join(_kind(option) for option in options)
    if "prefixItems" in spec:
        parts = spec["prefixItems"]
        assert isinstance(parts, list)
        return f"({', '.join(_kind(part) for part in parts)})"
    if spec.get("type") == "array":
        items = spec.get("items", {})
        assert isinstance(items, dict)
        return f"list of {_kind(items)}"
    return str(spec.get("type", "any"))


def markdown() -> str:
    """Every message and field as Markdown tables."""
    lines: list[str] = []
    for title, messages in _CHAPTERS:
        lines += [f"### {title}", ""]
        for message in messages:
            lines += [
                f"**{message.__name__}**: {_first_paragraph(message)}",
                "",
                "| field | type | |",
                "|---|---|---|",
            ]
            lines += [f"| `{name}` | {kind} | {text} |" for name, kind, text in fields_of(message)]
            lines.append("")
    return "\n".join(lines)


def schema() -> dict[str, object]:
    """The same as one JSON Schema, its messages under `$defs`."""
    _, definitions = msgspec.json.schema_components([m for _, messages in _CHAPTERS for m in messages])
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$defs": definitions}


def _first_paragraph(message: type[msgspec.Struct]) -> str:
    return " ".join((message.__doc__ or "").split())
