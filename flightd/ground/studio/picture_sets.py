"""The picture sets of the page Studio: folders below `studio/` of the station's own, each a dataset with the
`labels.json` that `flightd train-colour` and `flightd evaluate` read, too."""

from __future__ import annotations

import hashlib
import re
import threading
from dataclasses import dataclass
from pathlib import Path

import msgspec

from flightd.core.errors import InputError, UnavailableError
from flightd.core.paint import PROFILE_NAME, checked_paint
from flightd.ground.plain_files import is_plain_file, is_plain_folder, plain_file
from flightd.runtime.durable_files import replace_file
from flightd.vision.training.labelled_frames import LABELS_NAME, LabelledImage, Labels, labels_text

FOLDER = "studio"
MOST_SETS, MOST_PICTURES = 100, 400
MOST_PICTURE_BYTES = 8 << 20
_MOST_LABELS_BYTES = 16 << 20
_NAME = re.compile(PROFILE_NAME)
_PICTURE = re.compile(r"[A-Za-z0-9][A-Za-z0-9-]{0,79}\.jpg")


@dataclass(frozen=True, slots=True)
class PictureSet:
    """`paint` is the `line_colour` of its pictures."""

    name: str
    paint: str
    labels: tuple[LabelledImage, ...]


class PictureSets:
    """The sets below a folder.  Safe from any thread.

    InputError for a name, a picture or a file that is none; UnavailableError where the disk refuses."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / FOLDER
        self._lock = threading.Lock()

    def names(self) -> list[str]:
        """Of every set there is."""
        if not is_plain_folder(self._folder):
            return []
        found = (entry.name for entry in self._folder.iterdir() if _NAME.fullmatch(entry.name))
        return sorted(name for name in found if is_plain_file(self._folder / name / LABELS_NAME))[:MOST_SETS]

    def folder_of(self, name: str) -> Path:
        """Where a set lies."""
        if not _NAME.fullmatch(name):
            raise InputError(
                f"{name!r} is no name of a set",
                remedy="use small letters, digits and hyphens, 40 at most",
            )
        return self._folder / name

    def make(self, name: str, paint: str) -> PictureSet:
        """A new, empty set for pictures of that paint."""
        folder = self.folder_of(name)
        try:
            made = PictureSet(name, checked_paint(paint), ())
        except ValueError as err:
            raise InputError(str(err), key="paint") from None
        with self._lock:
            if is_plain_file(folder / LABELS_NAME):
                raise InputError(f"there is a set {name} already", remedy="open it, or take another name")
            if len(self.names()) >= MOST_SETS:
                raise InputError(f"there are {MOST_SETS} sets already", remedy="put some of them aside")
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as err:
                raise _refused(folder, err) from err
            self._write(made)
        return made

    def read(self, name: str) -> PictureSet:
        """A set as it is now."""
        file = self.folder_of(name) / LABELS_NAME
        text = plain_file(file, _MOST_LABELS_BYTES)
        if text is None:
            raise InputError(f"there is no set {name}")
        try:
            labels = msgspec.json.decode(text, type=Labels)
        except (msgspec.DecodeError, UnicodeDecodeError) as err:
            raise InputError(f"{file.name}: {err}", remedy="see flightd train-colour --help") from None
        return PictureSet(name, str(labels.about.get("paint", "none")), tuple(labels.images))

    def picture(self, name: str, file: str) -> Path:
        """Where a picture of a set lies."""
        path = self.folder_of(name) / file
        if not _PICTURE.fullmatch(file) or not is_plain_file(path):
            raise InputError("there is no such picture")
        return path

    def add(self, name: str, jpeg: bytes, width: int, height: int, origin: str) -> str:
        """Take a picture in; its name, the same for the same picture."""
        file = f"{hashlib.sha256(jpeg).hexdigest()[:20]}.jpg"
        with self._lock:
            known = self.read(name)
            if any(label.file == file for label in known.labels):
                return file
            if len(known.labels) >= MOST_PICTURES:
                raise InputError(f"the set has {MOST_PICTURES} pictures", remedy="take some out first")
            _replace(self.folder_of(name) / file, jpeg)
            label = LabelledImage(
                file=file, width=width, height=height, line_colour=known.paint, tags=[origin[:200]]
            )
            self._write(PictureSet(name, known.paint, (*known.labels, label)))
        return file

    def label(self, name: str, label: LabelledImage) -> None:
        """What is shown in a picture, in place of what was said of it before."""
        with self._lock:
            known = self.read(name)
            if all(one.file != label.file for one in known.labels):
                raise InputError("there is no such picture")
            labels = tuple(label if one.file == label.file else one for one in known.labels)
            self._write(PictureSet(name, known.paint, labels))

    def take_out(self, name: str, file: str) -> None:
        """Take a picture out, with all that was said of it."""
        with self._lock:
            known = self.read(name)
            path = self.picture(name, file)
            labels = tuple(one for one in known.labels if one.file != file)
            self._write(PictureSet(name, known.paint, labels))
            path.unlink(missing_ok=True)

    def _write(self, written: PictureSet) -> None:
        labels = Labels(images=list(written.labels), about={"paint": written.paint})
        _replace(self.folder_of(written.name) / LABELS_NAME, labels_text(labels).encode())


def _replace(path: Path, content: bytes) -> None:
    """Write a file, all of it or nothing."""
    try:
        replace_file(path, path.with_name(f".{path.name}.part"), content)
    except OSError as err:
        raise _refused(path, err) from err


def _refused(path: Path, err: OSError) -> UnavailableError:
    return UnavailableError(
        f"cannot write {path.name}: {err.strerror or err}", remedy="may this station write there?"
    )
