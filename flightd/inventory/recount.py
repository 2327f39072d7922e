"""The mission over what must be counted again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flightd.config.schema import Config, load_table, parse_config
from flightd.core.errors import InputError, cannot_write
from flightd.core.inventory import LocationRecord
from flightd.core.replaced_output import check_replaceable
from flightd.site.site import Site
from flightd.site.site_file import load_site, site_toml

_LONGEST_RUN = 80
_HEADING = "# Counts "
"""How each re-count that was written here begins."""


@dataclass(frozen=True, slots=True)
class RecountModel:
    """What the re-count is flown like: a configuration as a table of TOML, and its site.  `file` is where it
    was read, None where its paths are absolute."""

    table: dict[str, Any]
    site: Site
    file: Path | None = None


def model_of_file(config: Path) -> RecountModel:
    """Like the flights of a configuration file.  InputError for one that is none."""
    table = load_table(config)
    return RecountModel(table, load_site(parse_config(table, config).mission.site), config)


def model_of_flight(config: Config, site: Site) -> RecountModel:
    """Like a flight that was flown: only what it has otherwise than by default."""
    return RecountModel(config.model_dump(mode="json", exclude_defaults=True, exclude_none=True), site)


@dataclass(frozen=True, slots=True)
class RecountMission:
    """What was written: its nodes in order, and the doubtful locations whose node nobody knows."""

    nodes: tuple[str, ...]
    without_node: tuple[str, ...]


def write_recount(
    out: Path, model: RecountModel, doubtful: Mapping[str, str], records: Sequence[LocationRecord]
) -> RecountMission:
    """Write a configuration like `model` whose mission visits the nodes of the doubtful locations; where its
    site is not in the file that it names any more, a site file beside `out`.

    Raises InputError when there is nothing to fly to, `out` does not stand beside the model's file (paths in
    it are taken from there), or it is anything but a new file or an earlier re-count.
    """
    if model.file is not None and (
        out.resolve().parent != model.file.resolve().parent or out.resolve() == model.file.resolve()
    ):
        raise InputError(
            f"must be a new file beside {model.file}: paths in it are taken from there", file=out
        )
    check_replaceable(out, _HEADING, "re-count")
    node_of = {record.code: record.node for record in records}
    nodes = tuple(dict.fromkeys(node for code in doubtful if (node := node_of.get(code, ""))))
    without = tuple(code for code in doubtful if not node_of.get(code))
    if not nodes:
        raise InputError("nothing to fly to: no doubtful location has a node", file=out)
    if strange := [node for node in nodes if node not in model.site.nodes]:
        raise InputError(
            f"site {model.site.name} has no node {strange[0]}",
            file=out,
            remedy="give the configuration of the site that was counted",
        )
    table = _mission_over(nodes, model.table, records)
    heading = [f"{_HEADING}{len(doubtful) - len(without)} doubtful locations again:"]
    heading += [f"# {json.dumps(code)}: {why}" for code, why in doubtful.items() if code not in without]
    try:
        if model.file is None and not _holds(Path(table["mission"]["site"]), model.site):
            site_file = out.with_name(f"{out.stem}-site.toml")
            if not _holds(site_file, model.site):
                if site_file.exists() and not out.exists():
                    raise InputError("is there already, and holds another site", file=site_file)
                site_file.write_text(site_toml(model.site), encoding="utf-8")
            table["mission"]["site"] = site_file.name
        out.write_text("\n".join(heading) + "\n\n" + _toml(table), encoding="utf-8")
    except OSError as err:
        raise cannot_write(out, err) from None
    return RecountMission(nodes, without)


def _mission_over(
    nodes: Sequence[str], table: Mapping[str, Any], records: Sequence[LocationRecord]
) -> dict[str, Any]:
    """The table with these nodes, as a count of its own: one that goes on would pass over what is counted,
    and one that resumes would fly what was left over."""
    mission = {**table.get("mission", {}), "nodes": list(nodes)}
    if mission.get("resume"):
        mission["resume"] = False
    made = {**table, "mission": mission}
    run = table.get("inventory", {}).get("run", "")
    if run:
        taken = {record.observation.run for record in records if record.observation}
        made["inventory"] = {**table["inventory"], "run": _new_run(run, taken)}
    return made


def _new_run(run: str, taken: set[str]) -> str:
    """A name for another count after `run`."""
    number = 1
    while True:
        tail = " recount" if number == 1 else f" recount {number}"
        name = run[: _LONGEST_RUN - len(tail)] + tail
        if name not in taken:
            return name
        number += 1


def _holds(file: Path, site: Site) -> bool:
    """Whether the file holds this site still."""
    try:
        return site_toml(load_site(file)) == site_toml(site)
    except InputError:
        return False


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
