"""Codes in a picture: every symbology zxing-cpp knows, looked for again where something looks like a code.

The first look is at the picture as it is, wherever it has edges enough for a code.  Only where dense
perpendicular edges say that one may be (`code_regions`) and none was read, the region is looked at again:
turned upright, inverted, enlarged, shrunk, with local contrast, sharpened, smoothed.  A read is believed when
error correction or a checksum vouches for it; a checksum of one digit found in an altered picture, and
symbologies without any, need a second look that agrees.  A linear code without any that does not end in quiet
zones (`quiet_zones`) may be a part of a longer one: it is never believed, however many looks agree.  Two
believed texts at one place contradict each other, and then neither counts.  What is still not read and has
bars one way is fitted as a blurred EAN-13 (`blurred_ean`).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import zxingcpp

from flightd.core.geometry import Matrix
from flightd.core.types import CodeRead, Image
from flightd.vision.shelf.blurred_ean import read_blurred_ean
from flightd.vision.shelf.code_modules import module_px, qr_version
from flightd.vision.shelf.code_regions import CodeRegion, CodeSearch, shrunk
from flightd.vision.shelf.crease_flattening import flatten_qr
from flightd.vision.shelf.digital_link import parse_digital_link
from flightd.vision.shelf.edge_turn import edges_turn_rad
from flightd.vision.shelf.gs1 import Gs1Error, parse_element_string
from flightd.vision.shelf.quiet_zones import ends_in_quiet_zones

_UNASKED = frozenset((zxingcpp.BarcodeFormat.Code39, zxingcpp.BarcodeFormat.Code32))
"""Code 32 is another writing of a Code 39 of six characters: by chance, every tenth of these would be told as
one.  The first means all kinds of Code 39, which are asked for each."""
_FORMATS = tuple(
    one
    for one in zxingcpp.barcode_formats_list(zxingcpp.BarcodeFormats(zxingcpp.BarcodeFormat.AllReadable))
    if one not in _UNASKED
)


class _Proof(enum.IntEnum):
    """What stands behind a read of a symbology."""

    NONE = 0
    CHECKSUM = 1
    CORRECTION = 2


_CORRECTION = frozenset(("QR Code", "Data Matrix", "Aztec", "PDF417", "MaxiCode"))
"""Families with Reed-Solomon correction: what is wrong does not come out."""
_CHECKSUM = frozenset(("Code 128", "Code 93", "DataBar"))
_SMALL = frozenset(("Micro QR Code", "Aztec Rune"))
"""Too small to carry enough of it."""
_FRAMED = frozenset(("Code 39", "Code 39 Standard", "Code 39 Extended", "Pharmazentralnummer"))
"""They begin and end with a character that their text may not have: no part of one is another one."""
_CHECKED_RETAIL = frozenset(("EAN-13", "UPC-A"))
"""Everything else (ITF, Code 39, Codabar, the short UPC-E and EAN-8, ...) is easily misread in parts."""


@dataclass(frozen=True, slots=True)
class _Look:
    """One more way of looking at a region: scaled, turned, altered, negative.  `upright` turns it back by as
    much as its edges are turned."""

    scale: float = 1.0
    turn_deg: float = 0.0
    upright: bool = False
    alter: Callable[[Image], Image] | None = None
    global_threshold: bool = False


def _local_contrast(grey: Image) -> Image:
    return np.asarray(cv2.createCLAHE(clipLimit=3.0, tileGridSize=(8, 8)).apply(grey), np.uint8)


def _sharper(grey: Image) -> Image:
    return np.asarray(cv2.addWeighted(grey, 2.5, cv2.GaussianBlur(grey, (0, 0), 2.0), -1.5, 0.0), np.uint8)


def _much_sharper(grey: Image) -> Image:
    return np.asarray(cv2.addWeighted(grey, 4.0, cv2.GaussianBlur(grey, (0, 0), 3.0), -3.0, 0.0), np.uint8)


def _contrast_sharper(grey: Image) -> Image:
    return _sharper(_local_contrast(grey))


def _smoother(grey: Image) -> Image:
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), 1.2), np.uint8)


def _without_specks(grey: Image) -> Image:
    return np.asarray(cv2.medianBlur(grey, 3), np.uint8)


_LOOKS = (
    _Look(),
    _Look(upright=True),
    _Look(2.0),
    _Look(1.5, upright=True),
    _Look(0.5),
    _Look(1.5, alter=_local_contrast),
    _Look(1.0, 30.0),
    _Look(1.0, 60.0),
    _Look(1.0, 45.0),
    _Look(2.0, alter=_sharper),
    _Look(1.0, alter=_smoother),
    _Look(2.0, alter=_local_contrast),
    _Look(2.0, alter=_without_specks, global_threshold=True),
    _Look(2.0, alter=_contrast_sharper),
    _Look(2.0, alter=_much_sharper),
    _Look(2.0, alter=_smoother),
    _Look(3.0, alter=_local_contrast),
    _Look(0.5, alter=_local_contrast),
)
"""In the order in which they help most often on photographs; all are tried where nothing is read."""

_FLATTENED = len(_LOOKS) + 1
_BLURRED = _FLATTENED + 1
"""The looks that follow those."""
_LARGEST_LOOK_PX = 1000
"""Enlarged views longer than this would cost more than they show."""
_MOST_PIXELS = 5_000_000
"""What the second looks at one picture may scan together: bounds the time on pictures full of texture."""
_LEAST_TURN_RAD = math.radians(4.0)
"""Edges that are turned by less are upright: a level line still crosses all bars of most labels."""
_SHRUNK = 4
_SMALLEST_PX = 16
"""Shorter side of a view worth scanning."""
_MOST_DAMAGED = 2
"""Damaged QR codes of a region that are flattened."""


@dataclass(slots=True)
class _Candidate:
    """One text at one place, with the looks that gave it."""

    symbology: str
    text: str
    proof: _Proof
    gs1: bool
    corners: Matrix
    whole: bool = True
    looks: set[int] = field(default_factory=set)
    first_look: int = 0
    unaltered: bool = False
    module_px: float | None = None

    @property
    def sure(self) -> bool:
        return self.proof is _Proof.CORRECTION or (self.proof is _Proof.CHECKSUM and self.unaltered)

    @property
    def believed(self) -> bool:
        return self.sure or (self.whole and len(self.looks) >= 2)

    def inside(self, region: CodeRegion) -> bool:
        x, y = self.corners.mean(axis=0)
        return region.contains(float(x), float(y))

    def overlaps(self, other: _Candidate, slack: float = 0.3) -> bool:
        """Whether the middle of one lies within the other or beside it, by `slack` of its length."""
        return _within(self.corners, other.corners, slack) or _within(other.corners, self.corners, slack)

    def is_same_place(self, other: _Candidate) -> bool:
        # a linear code is told as the thin strip that was read, and may be told twice: top and bottom
        return self.overlaps(other, 0.3 if self.proof is _Proof.CORRECTION else 0.9)


def _within(corners: Matrix, others: Matrix, slack_part: float) -> bool:
    slack = slack_part * float(np.ptp(others, axis=0).max())
    x, y = corners.mean(axis=0)
    hull = cv2.convexHull(others.astype(np.float32))
    return cv2.pointPolygonTest(hull, (float(x), float(y)), True) >= -slack


def read_codes(picture: Image, *, deeper: bool = True) -> tuple[CodeRead, ...]:
    """Every code of a picture, (H, W, 3) BGR or (H, W), believed ones first, then from top to bottom.

    With `deeper` False only the first look is taken.  Reads that nothing vouches for yet are returned
    too (`CodeRead.believed` is False): two frames may agree on them (`mission.scan.code_votes`).
    """
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture, np.uint8)
    found: list[_Candidate] = []
    search = CodeSearch(grey)
    busy = search.busy()
    for view, picture_from_view in _first_views(grey, busy):
        codes = _scan(view, try_invert=False, try_downscale=busy is None)
        _collect(found, grey, codes, picture_from_view, 0)
    if deeper:
        budget = _MOST_PIXELS
        doubtful = [_around(c, grey.shape[1], grey.shape[0]) for c in found if not c.believed]
        known = [candidate for candidate in found if candidate.believed]
        for region in doubtful + search.regions([candidate.corners for candidate in known]):
            if not _is_read(region, found, known):
                budget = _look_again(grey, region, found, known, budget)
    kept = _without_contradictions(found)
    height, width = grey.shape
    reads = [_code_read(candidate, width, height) for candidate in kept]
    return tuple(sorted(reads, key=lambda read: (not read.believed, min(y for _, y in read.corners_px))))


def _first_views(grey: Image, busy: Sequence[CodeRegion] | None) -> Iterator[tuple[Image, Matrix]]:
    """What the first look is at: the whole, or its busy boxes, and all of it shrunk for what is large there;
    with the (3, 3) map from each view's pixels to the picture's."""
    if busy is None:
        yield grey, np.eye(3)
        return
    for box in busy:
        yield _part(grey, box), _picture_from_part(box)
    middle = (_SHRUNK - 1) / 2
    yield shrunk(grey, _SHRUNK), np.array([[_SHRUNK, 0, middle], [0, _SHRUNK, middle], [0, 0, 1.0]])


def _scan(
    grey: Image,
    binarizer: zxingcpp.Binarizer = zxingcpp.Binarizer.LocalAverage,
    *,
    try_invert: bool = True,
    try_downscale: bool = True,
    return_errors: bool = False,
) -> list[zxingcpp.Barcode]:
    if min(grey.shape) < _SMALLEST_PX:
        return []
    codes = zxingcpp.read_barcodes(
        grey,
        formats=zxingcpp.BarcodeFormats(_FORMATS),
        text_mode=zxingcpp.TextMode.Plain,
        binarizer=binarizer,
        try_invert=try_invert,
        try_downscale=try_downscale,
        return_errors=return_errors,
    )
    return list(codes)


def _part(grey: Image, region: CodeRegion) -> Image:
    return np.ascontiguousarray(grey[region.y0 : region.y1, region.x0 : region.x1])


def _picture_from_part(region: CodeRegion) -> Matrix:
    """The (3, 3) map from the pixels of a part to the picture's."""
    return np.array([[1.0, 0, region.x0], [0, 1.0, region.y0], [0, 0, 1.0]])


def _is_read(region: CodeRegion, found: Iterable[_Candidate], known: Sequence[_Candidate]) -> bool:
    """Whether something inside is believed that was not `known` before."""
    new = (one for one in found if not any(one is other for other in known))
    return any(candidate.believed and candidate.inside(region) for candidate in new)


def _look_again(
    grey: Image, region: CodeRegion, found: list[_Candidate], known: Sequence[_Candidate], budget: int
) -> int:
    """Try every look on a region until something inside is believed that is not `known`, or the budget of
    pixels is spent; returns what is left of it."""
    crop = _part(grey, region)
    damaged: list[tuple[Image, Matrix, zxingcpp.Barcode]] = []
    turn_rad = edges_turn_rad(crop, _LEAST_TURN_RAD)
    for number, one in enumerate(_LOOKS, start=1):
        if one.upright and turn_rad is None:
            continue
        look = replace(one, turn_deg=math.degrees(turn_rad or 0.0)) if one.upright else one
        if max(crop.shape) * look.scale > _LARGEST_LOOK_PX or min(crop.shape) * look.scale < _SMALLEST_PX:
            continue
        view, picture_from_view = _view(crop, look)
        budget -= view.size
        if budget < 0:
            break
        picture_from_view = _picture_from_part(region) @ picture_from_view
        binarizer = zxingcpp.Binarizer
        chosen = binarizer.GlobalHistogram if look.global_threshold else binarizer.LocalAverage
        codes = _scan(view, chosen, return_errors=True)
        _collect(found, grey, codes, picture_from_view, number)
        damaged += [(view, picture_from_view, code) for code in codes if _is_damaged_qr(code)][:1]
        if _is_read(region, found, known):
            return budget
    if not _flatten_damaged(damaged, found):
        _read_blurred(crop, region, found)
    return budget


def _flatten_damaged(
    damaged: Sequence[tuple[Image, Matrix, zxingcpp.Barcode]], found: list[_Candidate]
) -> bool:
    """Read one of the QR codes that were found and not read, flattened; says whether one was."""
    for view, picture_from_view, code in damaged[:_MOST_DAMAGED]:
        mended = flatten_qr(view, _corners(code), qr_version(code))
        if mended is not None:
            placed = _transformed(_corners(code), picture_from_view)
            _add(
                found,
                _Candidate("QR Code", mended, _Proof.CORRECTION, False, placed, first_look=_FLATTENED),
                _FLATTENED,
            )
            return True
    return False


def _read_blurred(crop: Image, region: CodeRegion, found: list[_Candidate]) -> None:
    """Several bands agreed on what it says: that counts as two looks, and never as one that is sure."""
    read = read_blurred_ean(crop)
    if read is not None:
        symbology, text = _retail_name("EAN-13", read.text)
        corners = read.corners + np.array([region.x0, region.y0])
        new = _Candidate(symbology, text, _Proof.CHECKSUM, False, corners, first_look=_BLURRED)
        for look in (_BLURRED, _BLURRED + 1):
            _add(found, new, look)


def _is_damaged_qr(code: zxingcpp.Barcode) -> bool:
    return not code.valid and str(code.format) == "QR Code" and qr_version(code) > 0


def _view(crop: Image, look: _Look) -> tuple[Image, Matrix]:
    """The altered crop, and the (3, 3) map from its pixels to the crop's."""
    height, width = crop.shape
    turn = np.radians(look.turn_deg)
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    size = (round((width * c + height * s) * look.scale), round((width * s + height * c) * look.scale))
    scale = np.diag([1 / look.scale, 1 / look.scale, 1.0])
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]])
    to_middle, back = np.eye(3), np.eye(3)
    to_middle[:2, 2] = -(np.array(size) - 1) / 2
    back[:2, 2] = (width - 1) / 2, (height - 1) / 2
    crop_from_view: Matrix = back @ rotation @ scale @ to_middle
    if look.scale < 1.0 and not look.turn_deg:
        view = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    elif look.scale == 1.0 and not look.turn_deg:
        view = crop
    else:
        flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        view = cv2.warpAffine(crop, crop_from_view[:2], size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    grey = np.asarray(view, np.uint8)
    return (look.alter(grey) if look.alter else grey), crop_from_view


def _collect(
    found: list[_Candidate],
    grey: Image,
    codes: Iterable[zxingcpp.Barcode],
    picture_from_view: Matrix,
    look: int,
) -> None:
    for code in codes:
        if not code.valid or not code.text:
            continue
        symbology, text = _named(code)
        corners = _transformed(_corners(code), picture_from_view)
        is_gs1 = code.content_type == zxingcpp.ContentType.GS1
        proof = _proof(code)
        _add(
            found,
            _Candidate(
                symbology,
                text,
                proof,
                is_gs1,
                corners,
                whole=proof is not _Proof.NONE or _is_whole(code, text, grey, corners),
                first_look=look,
                module_px=module_px(code, corners),
            ),
            look,
        )


def _add(found: list[_Candidate], new: _Candidate, look: int) -> None:
    for known in found:
        if (known.symbology, known.text) == (new.symbology, new.text) and known.is_same_place(new):
            break
    else:
        found.append(new)
        known = new
    known.looks.add(look)
    known.whole |= new.whole
    known.unaltered |= look in {0, 1}


def _named(code: zxingcpp.Barcode) -> tuple[str, str]:
    return _retail_name(str(code.format), str(code.text))


def _retail_name(symbology: str, text: str) -> tuple[str, str]:
    """Symbology and text; an EAN-13 that starts with 0 is the UPC-A code it is printed as, and a UPC-E is
    told as the UPC-A that it abbreviates."""
    if symbology in {"EAN-13", "UPC-E"} and len(text) == 13 and text[0] == "0":
        return "UPC-A" if symbology == "EAN-13" else symbology, text[1:]
    return symbology, text


def _proof(code: zxingcpp.Barcode) -> _Proof:
    family, name = str(code.symbology), str(code.format)
    if family in _CORRECTION and name not in _SMALL:
        return _Proof.CORRECTION
    return _Proof.CHECKSUM if family in _CHECKSUM or name in _CHECKED_RETAIL else _Proof.NONE


def _is_whole(code: zxingcpp.Barcode, text: str, grey: Image, corners: Matrix) -> bool:
    """Whether a weakly checked code is no part of a longer one; `text` as it is told."""
    name = str(code.format)
    if name in _SMALL or name in _FRAMED:
        return True
    if name == "UPC-E" and not text.startswith("0"):
        return False
    return ends_in_quiet_zones(grey, corners, name)


def _corners(code: zxingcpp.Barcode) -> Matrix:
    p = code.position
    return np.array(
        [(q.x, q.y) for q in (p.top_left, p.top_right, p.bottom_right, p.bottom_left)], np.float64
    )


def _transformed(points: Matrix, homography: Matrix) -> Matrix:
    moved: Matrix = points @ homography[:2, :2].T + homography[:2, 2]
    return moved


def _around(candidate: _Candidate, width: int, height: int) -> CodeRegion:
    low, high = candidate.corners.min(axis=0), candidate.corners.max(axis=0)
    margin = 12.0 + 0.25 * float((high - low).max())
    return CodeRegion(
        max(0, int(low[0] - margin)),
        max(0, int(low[1] - margin)),
        min(width, int(high[0] + margin) + 1),
        min(height, int(high[1] + margin) + 1),
        0.0,
    )


def _without_contradictions(found: Sequence[_Candidate]) -> Iterator[_Candidate]:
    """Those that nothing at least as well proven contradicts at the same place."""
    for one in found:
        rivals = [o for o in found if o is not one and one.overlaps(o)]
        if not any((o.believed, o.proof) >= (one.believed, one.proof) for o in rivals):
            yield one


def _code_read(candidate: _Candidate, width: int, height: int) -> CodeRead:
    corners = candidate.corners - ((width - 1) / 2, (height - 1) / 2)
    elements: tuple[tuple[str, str], ...] = ()
    problem = ""
    try:
        elements = (parse_element_string if candidate.gs1 else parse_digital_link)(candidate.text)
    except Gs1Error as err:
        problem = str(err)
    return CodeRead(
        symbology=candidate.symbology,
        text=candidate.text,
        corners_px=tuple((round(float(x), 1), round(float(y), 1)) for x, y in corners),
        sure=candidate.sure,
        agreeing=len(candidate.looks),
        quality=round(1.0 - candidate.first_look / (_BLURRED + 1), 3),
        gs1=elements,
        gs1_problem=problem,
        module_px=candidate.module_px,
        whole=candidate.whole,
    )
