"""Printed text on labels, read by the networks of rapidocr (PP-OCR), whose models come with the package.

Lines are found by its detector and cut out here: its own boxes end at the last stroke, and half a letter is
read as another one with great confidence.  They are looked for on everything that looks like a label, and
then in all of the picture: dates are printed on the goods' own wrapping, too.  Dots of a printer that stand
apart are a line only from afar, so smaller pictures are searched, too.  Each line is read with little room
around it; what is worth it is looked at again in other ways.
Needs the extra `ocr`; nothing of it is imported before the first picture.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import UnavailableError
from flightd.core.extras import missing_extra
from flightd.core.geometry import Matrix
from flightd.core.label_text import TextLine, TextLook
from flightd.core.types import Image
from flightd.vision.shelf.label_regions import Box, label_regions

_LONGEST_SIDE_PX: Final = 1280
"""Larger regions are shrunk for finding lines, not for reading them."""
_MOST_LINES: Final = 96
"""Of one picture: what is written on goods is much, and a date stands below it."""
_LINE_PX: Final = 48
"""Height at which the network reads."""
_SCALES: Final = (1.0, 0.5, 0.25)
"""Of the pictures that are searched for lines, largest first."""
_SAME_PLACE: Final = 0.35
_SAME_END: Final = 0.5
"""A line that was found before lies within this part of its height across, and ends within this along."""
_TURNED: Final = 3.0
"""What is so much higher than wide is no single letter but a line that runs up or down."""
_ILL_READ: Final = 0.9
"""Mean probability of the characters below which a line may be upside down."""
_UPSIDE_DOWN: Final = 0.9
_JOINED_GAP: Final = 1.2
"""Pieces nearer to each other than this part of their height are one line."""
_END: Final = 0.15
"""Part of the height beyond each end of a line that must be plain paper."""
_BURNT: Final = 252
_SMOOTH_PX: Final = 1.5
_WHITE: Final = 245
_LOST_END_PX: Final = 10
_LOST_PX: Final = 12
"""So many columns in a row, at an end or within, that have nothing darker (grey levels, noise smoothed) are
where glare may have taken characters."""
_LETTER_PX: Final = 24
_FAINT: Final = 0.5
_FAINT_GLARE: Final = 0.1
"""Where the glare of a line is more, it ends in glare if the ink of its last character is fainter than that
part of all ink's: what came after it may be burnt out altogether."""


Wanted: TypeAlias = Callable[[tuple[TextLook, ...]], bool]
"""Whether a line that was looked at so is worth another look."""


def _two_looks(looks: tuple[TextLook, ...]) -> bool:
    return len(looks) < 2


def needs_extra() -> UnavailableError | None:
    """Why printed text is not read on this machine, if it is not."""
    if importlib.util.find_spec("rapidocr") and importlib.util.find_spec("onnxruntime"):
        return None
    return missing_extra("ocr", "[[scan.text]]: printed text is not read, it")


class TextReader:
    """Reads pictures one after the other, in one thread.  UnavailableError where the extra is missing."""

    def __init__(self) -> None:
        try:
            from rapidocr import RapidOCR  # noqa: PLC0415 - an extra, and slow to import
        except ImportError:
            raise missing_extra("ocr", "reading text") from None
        one_thread = {f"EngineConfig.onnxruntime.{pool}_op_num_threads": 1 for pool in ("intra", "inter")}
        sizes = {"Det.limit_type": "max", "Det.limit_side_len": _LONGEST_SIDE_PX}
        self._engine: Any = RapidOCR(
            params={**one_thread, **sizes, "Global.log_level": "critical", "Global.text_score": 0.0}
        )

    def read(self, bgr: Image, wanted: Wanted = _two_looks) -> tuple[TextLine, ...]:
        """The lines in a picture, (H, W, 3) BGR, those on labels first, each looked at in one more way as
        long as that is `wanted` and there is one."""
        height, width = bgr.shape[:2]
        labels = label_regions(bgr)
        found: list[TextLine] = []
        for box in dict.fromkeys((*labels, (0, 0, width, height))):
            strips = self._strips(bgr, box)
            if box not in labels:
                strips = [strip for strip in strips if not any(_is_inside(strip, label) for label in labels)]
            found += [self._line(bgr, strip, wanted) for strip in strips[: _MOST_LINES - len(found)]]
        return tuple(line for line in found if any(look.text for look in line.looks))

    def _strips(self, bgr: Image, box: Box) -> list[_Strip]:
        """The lines in a box of the picture."""
        x0, y0, x1, y1 = box
        region = np.ascontiguousarray(bgr[y0:y1, x0:x1])
        found: list[_Strip] = []
        for part in _SCALES:
            scale = part * min(1.0, _LONGEST_SIDE_PX / max(region.shape[:2]))
            smaller = cv2.resize(region, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
            if min(smaller.shape[:2]) < _LINE_PX // 2:
                break
            boxes = self._engine(smaller, use_det=True, use_cls=False, use_rec=False).boxes
            corners = [] if boxes is None else [np.asarray(box) / scale + (x0, y0) for box in boxes]
            strips = sorted(map(_Strip.of, corners), key=lambda strip: (strip.middle[1], strip.middle[0]))
            lines = _joined(strips)
            found += [line for line in lines if not any(other.covers(line) for other in found)]
        return found

    def _line(self, bgr: Image, strip: _Strip, wanted: Wanted) -> TextLine:
        looks = [self._look(strip, bgr, _WAYS[0])]
        if np.mean(looks[0].sure or (0.0,)) < _ILL_READ and self._is_upside_down(strip, bgr):
            strip = strip.turned_round()
            looks = [self._look(strip, bgr, _WAYS[0])]
        for way in _WAYS[1:]:
            if not wanted(tuple(looks)):
                break
            looks.append(self._look(strip, bgr, way))
        doubts = strip.doubts(bgr)
        cx, cy = (bgr.shape[1] - 1) / 2, (bgr.shape[0] - 1) / 2
        corners = tuple((round(x - cx, 1), round(y - cy, 1)) for x, y in strip.corners())
        return TextLine(corners, tuple(looks), doubts.left, doubts.right, doubts.gap, round(doubts.glare, 3))

    def _is_upside_down(self, strip: _Strip, bgr: Image) -> bool:
        line = strip.cut_out(bgr, _WAYS[0].along, _WAYS[0].across)
        out = self._engine(line, use_det=False, use_cls=True, use_rec=False)
        ((label, sure),) = out.cls_res
        return bool(label == "180" and sure >= _UPSIDE_DOWN)

    def _look(self, strip: _Strip, bgr: Image, way: _Way) -> TextLook:
        line = way.shown(strip.cut_out(bgr, way.along, way.across))
        out = self._engine(line, use_det=False, use_cls=False, use_rec=True, return_word_box=True)
        if out is None or not out.txts or not out.word_results:
            return TextLook("", ())
        text, sure = out.txts[0], out.word_results[0].confs
        if len(text) != len(sure):  # what cannot be told apart is sure to nobody
            return TextLook(text, (0.0,) * len(text))
        return TextLook(text, tuple(map(float, sure)))


@dataclass(frozen=True, slots=True)
class _Way:
    """How a line is shown for a look: the room along and across it as parts of its height, whether its
    strokes are made bolder, so that dots touch, and by how much it is smoothed."""

    along: float
    across: float
    bolder: bool = False
    smooth_px: float = 0.0

    def shown(self, line: Image) -> Image:
        """The line that was cut out, as it is looked at."""
        if self.bolder:
            grow = cv2.dilate if _is_light(line) else cv2.erode
            line = np.asarray(grow(line, _DOT), np.uint8)
        if self.smooth_px:
            line = np.asarray(cv2.GaussianBlur(line, (0, 0), self.smooth_px), np.uint8)
        return line


_DOT: Final = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
_WAYS: Final = (
    _Way(0.35, 0.05),
    _Way(0.60, 0.15),
    _Way(0.35, 0.05, bolder=True),
    _Way(0.60, 0.15, smooth_px=1.2),
)


@dataclass(frozen=True, slots=True)
class _Doubts:
    """As `TextLine` has them."""

    left: bool
    right: bool
    gap: bool
    glare: float


@dataclass(frozen=True, slots=True, eq=False)
class _Strip:
    """A line in pixels of its picture: middle, direction (a unit vector to the right), length, height."""

    middle: Matrix
    along: Matrix
    length: float
    height: float

    @classmethod
    def of(cls, box: Matrix) -> _Strip:
        """Of a box's corners (left top, clockwise)."""
        along = (box[1] - box[0] + box[2] - box[3]) / 2
        down = (box[3] - box[0] + box[2] - box[1]) / 2
        length, height = float(np.linalg.norm(along)), float(np.linalg.norm(down))
        if height > _TURNED * length:
            along, length, height = down, height, length
        return cls(box.mean(axis=0), along / max(length, 1e-6), length, max(height, 1.0))

    @property
    def down(self) -> Matrix:
        return np.array([-self.along[1], self.along[0]])

    def turned_round(self) -> _Strip:
        """Upside down."""
        return replace(self, along=-self.along)

    def covers(self, other: _Strip) -> bool:
        """Whether the other one is this line or a part of it."""
        off = other.middle - self.middle
        beside, across = abs(float(off @ self.along)), abs(float(off @ self.down))
        end = beside + other.length / 2 - self.length / 2
        return across < _SAME_PLACE * self.height and end < _SAME_END * self.height

    def corners(self, along_room: float = 0.0, across_room: float = 0.0) -> Matrix:
        """(4, 2), with room as parts of the height."""
        a = self.along * (self.length / 2 + along_room * self.height)
        d = self.down * (self.height / 2 + across_room * self.height)
        return np.array([self.middle - a - d, self.middle + a - d, self.middle + a + d, self.middle - a + d])

    def cut_out(self, bgr: Image, along_room: float, across_room: float) -> Image:
        """The strip upright, as high as the network reads."""
        corners = self.corners(along_room, across_room)
        scale = _LINE_PX / (self.height * (1 + 2 * across_room))
        width = max(8, round((self.length + 2 * along_room * self.height) * scale))
        onto = np.array([[0, 0], [width, 0], [0, _LINE_PX]], np.float32)
        flags = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        turn = cv2.getAffineTransform(corners[[0, 1, 3]].astype(np.float32), onto)
        strip = cv2.warpAffine(bgr, turn, (width, _LINE_PX), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(strip, np.uint8)

    def doubts(self, bgr: Image) -> _Doubts:
        """What may be wrong with the line, whatever is read in it."""
        room = _END + 0.05
        line = self.cut_out(bgr, room, 0.0)
        grey = cv2.cvtColor(line, cv2.COLOR_BGR2GRAY)
        wide = max(2, round(_END * _LINE_PX))
        toned = 255 - grey if _is_light(line) else grey
        paper, ink = np.percentile(toned, (80, 5))
        outside = self.corners(room)
        size = np.array((bgr.shape[1], bgr.shape[0]))
        inside: NDArray[np.bool_] = np.all((outside >= 0) & (outside < size), axis=1)
        smooth = np.asarray(cv2.GaussianBlur(grey, (0, 0), _SMOOTH_PX), np.uint8)
        lightest = smooth.min(axis=0)
        glare = float((grey >= _BURNT).mean())
        ends = []
        for end, letter, corners in (
            (slice(wide), slice(wide, wide + _LETTER_PX), inside[[0, 3]]),
            (slice(-wide, None), slice(-wide - _LETTER_PX, -wide), inside[[1, 2]]),
        ):
            dark = float(np.percentile(toned[:, end], 5)) < paper - 0.5 * (paper - ink)
            columns = lightest[:_LOST_END_PX] if end.start is None else lightest[-_LOST_END_PX:]
            faint = glare >= _FAINT_GLARE and (
                float(np.percentile(toned[:, letter], 5)) > paper - _FAINT * (paper - ink)
            )
            ends.append(bool(dark or faint or not corners.all() or columns.min() >= _WHITE))
        within = lightest[_LOST_END_PX:-_LOST_END_PX] >= _WHITE
        return _Doubts(ends[0], ends[1], _longest_run(within) >= _LOST_PX, glare)

    def with_piece(self, other: _Strip) -> _Strip:
        """Both as one line, this one left of the other."""
        (x0, y0), (x1, y1) = self.corners()[0], other.corners()[1]
        along = other.middle - self.middle
        length = math.hypot(x1 - x0, y1 - y0)
        height = max(self.height, other.height)
        middle = (self.corners()[[0, 3]].mean(axis=0) + other.corners()[[1, 2]].mean(axis=0)) / 2
        return _Strip(middle, along / max(float(np.linalg.norm(along)), 1e-6), length, height)

    def continues(self, other: _Strip) -> bool:
        """Whether the other one lies on this line, directly to its right."""
        height = min(self.height, other.height)
        if max(self.height, other.height) > 1.6 * height:
            return False
        way = other.corners()[[0, 3]].mean(axis=0) - self.corners()[[1, 2]].mean(axis=0)
        gap, off = float(way @ self.along), float(way @ self.down)
        return -height < gap < _JOINED_GAP * height and abs(off) < 0.4 * height


def _is_light(line: Image) -> bool:
    """Whether the letters are lighter than what they stand on."""
    low, middle, high = np.percentile(cv2.cvtColor(line, cv2.COLOR_BGR2GRAY), (5, 50, 95))
    return bool(middle - low < high - middle)


def _is_inside(strip: _Strip, box: Box) -> bool:
    (x, y), (x0, y0, x1, y1) = strip.middle, box
    return bool(x0 <= x < x1 and y0 <= y < y1)


def _longest_run(flags: NDArray[np.bool_]) -> int:
    """How many in a row are set, at most."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _joined(strips: Sequence[_Strip]) -> list[_Strip]:
    """Lines whose pieces were found apart, whole."""
    left = list(strips)
    joined: list[_Strip] = []
    while left:
        whole = left.pop(0)
        while True:
            after = next((other for other in left if whole.continues(other)), None)
            before = next((other for other in left if other.continues(whole)), None)
            if after is not None:
                left.remove(after)
                whole = whole.with_piece(after)
            elif before is not None:
                left.remove(before)
                whole = before.with_piece(whole)
            else:
                break
        joined.append(whole)
    return joined
