"""What the sections of every file that people write have in common."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """Frozen once read; a key that it does not know is refused.

    Keys whose names do not end in a unit name it: `Field(..., json_schema_extra=unit("share"))`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    files: ClassVar[tuple[str, ...]] = ()
    """The keys that name files relative to the configuration's own folder."""

    def with_values(self, **values: Any) -> Self:
        """The same with other values, checked as those of a file; a table's by a dict of its keys:
        `config.with_values(mission={"nodes": ("A2",)})`.  ValidationError where one is out of range."""
        given = dict(self)
        for key, value in values.items():
            inner = given.get(key)
            if isinstance(inner, Section) and isinstance(value, dict):
                given[key] = inner.with_values(**value)
            else:
                given[key] = value
        return type(self)(**given)

    def beside(self, folder: Path) -> Self:
        """The same with its files' relative paths taken from `folder`."""
        given = {key: getattr(self, key) for key in self.files}
        return self.model_copy(
            update={key: (folder / path).resolve() for key, path in given.items() if path is not None}
        )


def unit(name: str) -> dict[str, Any]:
    """The unit of a key whose name tells none."""
    return {"unit": name}
