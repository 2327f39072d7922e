"""What the store needs of a database: transactions, rows, and room for looks of any month."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol, TypeAlias

Row: TypeAlias = tuple[Any, ...]
MOST_IN_LIST = 500
"""Values of one `IN (…)`."""


class Session(Protocol):
    """One transaction.  SQL is written with `?` for values, and what both databases understand."""

    def rows(self, sql: str, *values: object) -> list[Row]:
        """What a question is answered."""
        ...

    def run(self, sql: str, *values: object) -> None:
        """Do one statement."""
        ...

    def run_many(self, sql: str, rows: Sequence[Sequence[object]]) -> None:
        """Do one statement for each row."""
        ...


class Engine(Protocol):
    """A database.  Safe from any thread.

    Whatever the database refuses is an UnavailableError, InputError what is no ground store."""

    @property
    def kind(self) -> str:
        """`sqlite` or `postgres`: the folder of its migrations."""
        ...

    @property
    def shown(self) -> str:
        """Where it is, for people: without a password."""
        ...

    def writing(self) -> AbstractContextManager[Session]:
        """A transaction of the one who writes; others wait.  It is committed through to the disk when the
        block ends, and rolled back when that raises."""
        ...

    def reading(self) -> AbstractContextManager[Session]:
        """A transaction that sees one moment."""
        ...

    def version(self, session: Session) -> int:
        """Of the tables, 0 where there are none.  InputError where the database is another program's."""
        ...

    def set_version(self, session: Session, version: int) -> None:
        """Note what the tables are now."""
        ...

    def script(self, session: Session, text: str) -> None:
        """Do the statements of a migration."""
        ...

    def make_room(self, session: Session, utc_ns: Iterable[int]) -> None:
        """For looks at these times."""
        ...

    def close(self) -> None:
        """Close every connection."""
        ...


def listed(values: Sequence[object]) -> Iterator[tuple[str, Sequence[object]]]:
    """`(?, ?, …)` for an IN, with its values, as often as it takes."""
    for begin in range(0, len(values), MOST_IN_LIST):
        part = values[begin : begin + MOST_IN_LIST]
        yield f"({', '.join('?' * len(part))})", part
