"""The inventories that lie under the station's folder: found by themselves, read and never changed."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from flightd.adapters.store.for_reading import opened_for_reading
from flightd.adapters.store.sqlite import SqliteStore
from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.core.errors import FlightdError, InputError
from flightd.core.inventory import LocationRecord, Observation, Standing
from flightd.core.topics import Document, Topic
from flightd.ground.plain_files import is_plain_file, is_plain_folder, plain_file
from flightd.ground.read_folders import ReadFolder
from flightd.ground.shown_text import shown
from flightd.inventory.elevation import Front, fronts_of
from flightd.inventory.place_view import PlaceView, place_views
from flightd.replay.log import LogReader
from flightd.site.site import Site
from flightd.site.site_file import parse_site
from flightd.vision.jpeg import MOST_PIXELS, jpeg_size
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES

_FILE, _LOG, _TRUTH = "inventory.db", "*.mcap", "truth.mcap"
_DEPTH = 4
_VIEWS_KEPT = 8
_MOST_FOLDERS, _MOST_STORES = 5_000, 500
_Stamp: TypeAlias = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class StockView:
    """A store at one moment.  `stamp` is another whenever anything in it is."""

    stamp: str
    fronts: tuple[Front, ...]
    places: tuple[PlaceView, ...]
    records: tuple[LocationRecord, ...]


class Stores:
    """Under `root`: each folder with an `inventory.db`, named by its path from there (`.`: root itself);
    below the `others` with their prefix before it.  `all_of_them`: however many there are, and however deep
    they lie; for a page a large folder is not looked at to its end.

    Safe from any thread.  Nothing that a browser says is ever made a path: names are looked up."""

    def __init__(
        self, root: Path | None, others: Sequence[ReadFolder] = (), *, all_of_them: bool = False
    ) -> None:
        self._root = root
        self._others = tuple(others)
        self._all_of_them = all_of_them
        self._known: dict[str, Path] = {}
        self._views: OrderedDict[str, StockView] = OrderedDict()
        self._sites: dict[Path, tuple[tuple[str, int, int], Site | None]] = {}
        self._site_names: dict[Path, tuple[_Stamp, str]] = {}

    @property
    def title(self) -> str:
        """The name of the folder, for people; empty where the station was told none."""
        return "" if self._root is None else shown(self._root.resolve().name) or "/"

    def names(self) -> list[tuple[str, int]]:
        """Every store and when it was written last (UTC, ns), newest first."""
        found = [(name, _written_ns(folder)) for name, folder in self._named()]
        return sorted(found, key=lambda store: (-store[1], store[0]))

    def view(self, name: str) -> StockView:
        """A store as it is now.  InputError where there is none of the name, as `SqliteStore` raises."""
        folder = self.folder(name)
        stamp = _text(_stamp(folder))
        known = self._views.get(name)
        if known is not None and known.stamp == stamp:
            return known
        with SqliteStore(folder, read_only=True) as store:
            records, looks = tuple(store.locations()), store.looks()
        codes = [record.code for record in records]
        view = StockView(stamp, fronts_of(codes, self._site(folder)), place_views(records, looks), records)
        self._views[name] = view
        while len(self._views) > _VIEWS_KEPT:
            self._views.pop(next(iter(self._views)), None)
        return view

    def site_name(self, name: str) -> str:
        """The name of the site that a store is of, as it says itself, else as the flight log beside it
        has it; empty without either.  InputError where there is no store of the name, and as `SqliteStore`
        raises: what cannot be read now is not taken for one that does not say."""
        folder, stamp = self.folder(name), _stamp(self.folder(name))
        known = self._site_names.get(folder)
        if known is None or known[0] != stamp:
            self._site_names[folder] = known = stamp, _kept_site_name(folder)
        if known[1]:
            return known[1]
        site = self._site(folder)
        return "" if site is None else site.name

    def looks(self, name: str, code: str) -> Sequence[tuple[Observation, Standing]]:
        """Every look at a place, oldest first.  InputError for one that the store does not know."""
        with SqliteStore(self.folder(name), read_only=True) as store:
            looks = store.looks(code)
            if not looks and all(record.code != code for record in store.locations()):
                raise InputError(f"there is no place {code!r}")
        return looks

    def picture(self, name: str, picture: str) -> bytes:
        """The JPEG that a look kept as evidence.  InputError where there is none."""
        if len(picture) != 64 or not set(picture) <= set("0123456789abcdef"):
            raise InputError("not the name of a picture")
        folder = self.folder(name) / "evidence"
        if is_plain_folder(folder) and is_plain_folder(folder / picture[:2]):
            jpeg = plain_file(folder / picture[:2] / f"{picture}.jpg", MOST_BYTES)
            if jpeg is not None:
                size = jpeg_size(jpeg)
                if size is not None and size[0] * size[1] > MOST_PIXELS:
                    raise InputError("this picture is larger than any camera's")
                return jpeg
        raise InputError("this picture was not kept")

    def folder(self, name: str) -> Path:
        """Where a store lies.  InputError where there is none of the name."""
        known = self._known.get(name)
        if known is None or not is_plain_file(known / _FILE):
            self._known = dict(self._named())
            if name not in self._known:
                raise InputError(f"there is no inventory {name!r}")
            known = self._known[name]
        for part in ("-wal", "-shm"):
            beside = known / f"{_FILE}{part}"
            if os.path.lexists(beside) and not is_plain_file(beside):
                raise InputError(f"the inventory {name!r} has a {beside.name} that is no plain file")
        return known

    def _named(self) -> Iterator[tuple[str, Path]]:
        if self._root is not None:
            for folder in _folders(self._root, self._all_of_them):
                yield _name(folder, self._root), folder
        for other in self._others:
            for folder in _folders(other.path, self._all_of_them):
                yield other.prefix + _name(folder, other.path), folder

    def _site(self, folder: Path) -> Site | None:
        """The map that the newest flight log beside the store was flown by; None without one."""
        logs = [log for log in folder.glob(_LOG) if log.name != _TRUTH and is_plain_file(log)]
        log = max(logs, key=_changed_ns, default=None)
        if log is None:
            return None
        stamp = (log.name, *_size_and_time(log))  # a run writes its log anew under the same name
        known = self._sites.get(folder)
        if known is None or known[0] != stamp:
            self._sites[folder] = known = stamp, _map_of(log)
        return known[1]


def _map_of(log: Path) -> Site | None:
    try:
        for entry in LogReader(log).entries({Topic.MAP, Topic.STATUS}):
            if not isinstance(entry.message, Document):
                break  # the flight has begun, and the map comes before
            return parse_site(entry.message.text, f"{log} (map)")
    except (FlightdError, OSError):
        pass  # the places are shown by their codes then
    return None


def _kept_site_name(folder: Path) -> str:
    try:
        with opened_for_reading(folder, untouched=True) as store:
            return store.site
    except OSError as err:
        raise InventoryUnavailableError(f"cannot be read: {err.strerror or err}", file=folder) from None


def _folders(root: Path, all_of_them: bool) -> Iterator[Path]:
    """Folders with a store, not those behind links."""
    found = 0
    for looked, (folder, below, files) in enumerate(os.walk(root)):
        here = Path(folder)
        if _FILE in files and is_plain_file(here / _FILE):
            yield here
            found += 1
        deep = len(here.relative_to(root).parts) >= _DEPTH and not all_of_them
        below[:] = [] if deep else sorted(n for n in below if not n.startswith(".") and n != "evidence")
        if (looked >= _MOST_FOLDERS or found >= _MOST_STORES) and not all_of_them:
            return


def _name(folder: Path, root: Path) -> str:
    return shown(folder.relative_to(root).as_posix())


def _stamp(folder: Path) -> _Stamp:
    """What changes whenever the store does: size and time of the file and of its log."""
    return tuple(_size_and_time(folder / f"{_FILE}{part}") for part in ("", "-wal"))


def _text(stamp: _Stamp) -> str:
    return "-".join(f"{size:x}.{time:x}" for size, time in stamp)


def _written_ns(folder: Path) -> int:
    return max(time for _, time in _stamp(folder))


def _changed_ns(file: Path) -> int:
    return _size_and_time(file)[1]


def _size_and_time(file: Path) -> tuple[int, int]:
    try:
        stat = file.stat()
    except OSError:
        return 0, 0
    return stat.st_size, stat.st_mtime_ns
