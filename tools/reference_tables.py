"""Markdown tables of every key that a file takes: unit, values, default, meaning; read off its sections."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel

from flightd.config.reference import Row, Table, rows, tables

_COLUMNS = ("key", "unit", "values", "default", "meaning")


def markdown(model: type[BaseModel]) -> str:
    """A heading, a sentence and a table for each section of the file that `model` checks."""
    keys = rows(model)
    return "\n".join(
        _section(table, [row for row in keys if row.section == table.name]) for table in tables(model)
    )


def _section(table: Table, keys: Sequence[Row]) -> str:
    heading = f"[[{table.name}]]" if table.repeated else f"[{table.name}]"
    lines = [f"### `{heading}`", ""]
    lines += [table.description, ""] if table.description else []
    cells = [_cells(row) for row in keys]
    kept = [i for i in range(len(_COLUMNS)) if any(row[i] for row in cells)]  # a column that says something
    if kept:
        lines += [_line([_COLUMNS[i] for i in kept]), "|" + "---|" * len(kept)]
        lines += [_line([row[i] for i in kept]) for row in cells]
        lines.append("")
    return "\n".join(lines)


def _cells(row: Row) -> tuple[str, str, str, str, str]:
    values = (
        ", ".join(f'`"{value}"`' for value in row.range.split(", ")) if row.type == "choice" else row.range
    )
    default = {"required": "**required**", "": "none"}.get(row.default, f"`{row.default}`")
    return f"`{row.key}`", row.unit, values or row.type, default, row.description


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
