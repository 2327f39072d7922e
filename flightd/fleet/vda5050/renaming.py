"""JSON objects under other names: tables that say what keys and values of one version are in another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

Object = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Key:
    """What becomes of a key of the model: its `name` on the wire, the table of what is `inside` it (an object
    or each of a list), and how a value is written and read.  Without a name it is not on the wire."""

    name: str | None
    inside: Table | None = None
    write: Callable[[Any], Any] | None = None
    read: Callable[[Any], Any] | None = None


@dataclass(frozen=True, slots=True)
class Table:
    """What becomes of an object's keys; those that are not in `keys` stay as they are.  `finish` and `start`
    change a whole object: after it is written, before it is read."""

    keys: Mapping[str, Key] = field(default_factory=dict)
    finish: Callable[[Object], Object] | None = None
    start: Callable[[Object], Object] | None = None

    def written(self, told: Object) -> Object:
        """The object of the model as it is on the wire."""
        found: Object = {}
        for key, value in told.items():
            rule = self.keys.get(key)
            if rule is None:
                found[key] = value
            elif rule.name is not None:
                inside = _each(rule.inside.written, value) if rule.inside else value
                found[rule.name] = rule.write(inside) if rule.write else inside
        return self.finish(found) if self.finish else found

    def read(self, told: Any) -> Any:
        """What is on the wire as the model has it; what is no object stays, to be refused by the model."""
        if not isinstance(told, dict):
            return told
        told = self.start(dict(told)) if self.start else told
        rules = {rule.name: (key, rule) for key, rule in self.keys.items() if rule.name is not None}
        found: Object = {}
        for name, value in told.items():
            key, rule = rules.get(name, (name, None))
            read = rule.read(value) if rule and rule.read else value
            found[key] = _each(rule.inside.read, read) if rule and rule.inside else read
        return found

    def wire_name(self, key: str) -> str:
        """What a key of the model is called on the wire, at any depth below this table."""
        for name, rule in self.keys.items():
            if name == key and rule.name:
                return rule.name
            if rule.inside is not None and (inner := rule.inside.wire_name(key)) != key:
                return inner
        return key


def _each(change: Callable[[Any], Any], value: Any) -> Any:
    return [change(one) for one in value] if isinstance(value, list) else change(value)


def named(**names: str) -> dict[str, Key]:
    """Keys that are only called otherwise."""
    return {key: Key(name) for key, name in names.items()}


def dropped(*keys: str) -> dict[str, Key]:
    """Keys that the version does not have."""
    return {key: Key(None) for key in keys}


def values(name: str, on_wire: Mapping[Any, Any]) -> Key:
    """A key whose values are called otherwise: those of the model by `on_wire`, and the first that gives a
    value when it is read."""
    back: dict[Any, Any] = {}
    for model, wire in on_wire.items():
        back.setdefault(wire, model)
    return Key(name, None, lambda value: on_wire.get(value, value), lambda value: _looked_up(back, value))


def _looked_up(table: Mapping[Any, Any], value: Any) -> Any:
    return table.get(value, value) if isinstance(value, str | bool) else value
