"""The mission over what must be counted again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from flightd.config.schema import load_table, parse_config
from flightd.core.errors import InputError, cannot_write
from flightd.core.inventory import LocationRecord


def write_recount(
    out: Path, config: Path, doubtful: Mapping[str, str], records: Sequence[LocationRecord]
) -> list[str]:
    """Write a configuration like `config` whose mission visits the nodes of the doubtful locations.

    Returns the doubtful locations whose node nobody knows.  Raises InputError when there is nothing to
    fly to, or `out` does not stand beside `config` (paths in it are taken from there).
    """
    table = load_table(config)
    parse_config(table, config)
    if out.resolve().parent != config.resolve().parent or out.resolve() == config.resolve():
        raise InputError(f"must be a new file beside {config}: paths in it are taken from there", file=out)
    node_of = {record.code: record.node for record in records}
    nodes = list(dict.fromkeys(node for code in doubtful if (node := node_of.get(code, ""))))
    without = [code for code in doubtful if not node_of.get(code)]
    if not nodes:
        raise InputError("nothing to fly to: no doubtful location has a node", file=out)
    table.setdefault("mission", {})["nodes"] = nodes
    heading = [f"# Counts {len(doubtful) - len(without)} doubtful locations again:"]
    heading += [f"# {json.dumps(code)}: {why}" for code, why in doubtful.items() if code not in without]
    try:
        out.write_text("\n".join(heading) + "\n\n" + _toml(table), encoding="utf-8")
    except OSError as err:
        raise cannot_write(out, err) from None
    return without


def _toml(table: Mapping[str, Any], name: str = "") -> str:
    """A table of strings, numbers, booleans, arrays and tables as TOML."""
    plain = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    parts = [f"[{name}]"] if name and plain else []
    # a JSON value of these kinds is a TOML value but for the DEL character
    parts += [
        f"{_key(key)} = {json.dumps(value, ensure_ascii=False)}".replace("\x7f", "\\u007f")
        for key, value in plain.items()
    ]
    text = "\n".join(parts) + ("\n\n" if parts else "")
    for key, value in table.items():
        if isinstance(value, Mapping):
            text += _toml(value, f"{name}.{_key(key)}" if name else _key(key))
    return text


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else json.dumps(key, ensure_ascii=False)
