"""Files out of a drop folder, each taken once.

A file is claimed by moving it to `taking/`, so that one of the same name that comes meanwhile is another;
it ends in `done/` or `refused/`, with what is to be said about it beside it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import Protocol

from flightd.core.errors import InputError
from flightd.ground.drop import Drop
from flightd.ground.shared_folder import SharedFolder, Stamp
from flightd.ground.wms_exchange.exchange_file import InboxSection
from flightd.inventory.stock_table import MOST_BYTES

_TAKING, _DONE, _REFUSED = "taking", "done", "refused"


@dataclass(frozen=True, slots=True)
class TakenFile:
    """What became of a file, for whoever dropped it: in a line, and one for each row that was left out where
    these are told one by one."""

    name: str
    taken: bool
    said: str


class Taker(Protocol):
    """Keeps what files say, and that it does, in one transaction."""

    def dropped(self, inbox: str) -> Drop | None:
        """What is noted of a file that may lie in the inbox still."""
        ...

    def moved(self, inbox: str) -> None:
        """That file lies there no more: one of the same name and content is another from now on."""
        ...

    def judged(self, name: str, data: bytes) -> Judged:
        """What a file says.  InputError where it is of no use."""
        ...


@dataclass(frozen=True, slots=True)
class Judged:
    """What is `said` of a file that is of use; `keep` keeps it, with a note of the drop."""

    said: str
    keep: Callable[[Drop], None]


class Inbox:
    """Has the files of `folder` taken as `asked` says."""

    def __init__(self, folder: SharedFolder, asked: InboxSection, taker: Taker) -> None:
        self._folder = folder
        self._asked = asked
        self._taker = taker
        self._id = f"{asked.inbox}/{asked.pattern}"

    def take(self, sleep: Callable[[float], None]) -> Iterator[TakenFile]:
        """What was begun before, then what is new, oldest first; what is written still stays."""
        for name in sorted(self._listed(_TAKING)):
            self._folder.end_move(name, f"{_TAKING}/{name}")
            yield self._finish(name)
        self._taker.moved(self._id)
        before = self._listed()
        if not before:
            return
        sleep(self._asked.settle_s)
        whole = {name: stamp for name, stamp in self._listed().items() if before.get(name) == stamp}
        for name in sorted(whole, key=lambda name: (whole[name][1], name)):
            self._folder.move(name, f"{_TAKING}/{name}")
            yield self._finish(name)

    def _listed(self, below: str = "") -> dict[str, Stamp]:
        pattern = self._asked.pattern.casefold()
        return {
            name: stamp
            for name, stamp in self._folder.listed(below).items()
            if fnmatchcase(name.casefold(), pattern)
        }

    def _finish(self, name: str) -> TakenFile:
        """A claimed file, wherever it was cut before."""
        data = self._folder.read(f"{_TAKING}/{name}", MOST_BYTES + 1)
        digest = hashlib.sha256(data).hexdigest()
        known = self._taker.dropped(self._id)
        if known is not None and (known.name, known.sha256) == (name, digest):
            taken = TakenFile(name, True, known.said)
        else:
            taken = self._taken(name, data, digest)
        path = PurePosixPath(name)
        to = f"{_DONE if taken.taken else _REFUSED}/{path.stem}-{digest[:8]}{path.suffix}"
        self._folder.write(f"{to}.txt", f"{taken.said}\n".encode())
        self._folder.move(f"{_TAKING}/{name}", to)
        return taken

    def _taken(self, name: str, data: bytes, digest: str) -> TakenFile:
        """Keep it, if it is of use."""
        try:
            judged = self._taker.judged(name, data)
        except InputError as err:
            return TakenFile(name, False, str(err))
        judged.keep(Drop(self._id, name, digest, judged.said))
        return TakenFile(name, True, judged.said)
