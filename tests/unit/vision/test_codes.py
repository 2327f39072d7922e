"""Reading codes: every symbology, every way it may lie in the picture, and never a wrong text."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import segno
import zxingcpp

from flightd.core.types import Image
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.code_regions import CodeSearch

PHOTOGRAPHS = Path(__file__).parents[4] / "shared" / "real" / "codes"
LINES = PHOTOGRAPHS.parent / "lines"


def label(text: str, kind: str, scale: int = 4, *, gs1: bool = False) -> Image:
    """A printed code on white, quiet zone included."""
    code = zxingcpp.create_barcode(
        text, getattr(zxingcpp.BarcodeFormat, kind), **({"gs1": True} if gs1 else {})
    )
    return np.pad(np.asarray(code.to_image(scale=scale), np.uint8), 10 * scale, constant_values=255)


def qr(text: str, scale: int = 4) -> Image:
    matrix = np.array([list(row) for row in segno.make(text, error="h", micro=False).matrix])
    drawing = np.kron(np.where(matrix, 0, 255).astype(np.uint8), np.ones((scale, scale), np.uint8))
    return np.pad(drawing, 4 * scale, constant_values=255)


def on_shelf(code: Image, x: int, y: int, width: int = 640, height: int = 480) -> Image:
    """A picture of a brown box with the code stuck on it."""
    picture = np.full((height, width, 3), (90, 120, 150), np.uint8)
    cv2.rectangle(picture, (40, 40), (width - 40, height - 40), (70, 100, 130), 3)
    picture[y : y + code.shape[0], x : x + code.shape[1]] = code[..., None]
    return picture


def texts(picture: Image) -> list[str]:
    return [read.text for read in read_codes(picture) if read.believed]


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("QRCode", "https://example.org/pallet/1"),
        ("DataMatrix", "PALLET-000123"),
        ("Aztec", "AISLE A"),
        ("PDF417", "two shelves further"),
        ("Code128", "005-3379497200006"),
        ("Code93", "BAY93"),
        ("Code39", "001EC947D49B"),
        ("Code39", "P65754"),  # a Code 32, too, by its check digit
        ("Code39Ext", "ab12"),
        ("ITF", "30885909173820"),
        ("EAN13", "9780679601050"),
        ("EAN8", "96385074"),
        ("UPCA", "036602301467"),
        ("Codabar", "A1234567B"),
    ],
)
def test_every_symbology_is_read_and_believed(kind: str, text: str) -> None:
    assert texts(on_shelf(label(text, kind, 3), 50, 120, 900)) == [text]


@pytest.mark.parametrize("turn_deg", [0, 20, 45, 70, 90, 135, 180, 250])
@pytest.mark.parametrize("kind", ["QRCode", "DataMatrix", "Code128", "EAN13"])
def test_codes_are_read_however_they_are_turned(kind: str, turn_deg: float) -> None:
    text = "9780679601050" if kind == "EAN13" else "BOX-4711"
    code = label(text, kind, 3)
    height, width = code.shape
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), turn_deg, 1.0)
    turn[:, 2] += 320 - width / 2, 320 - height / 2
    picture = cv2.warpAffine(code, turn, (640, 640), borderValue=255)
    assert texts(np.asarray(picture, np.uint8)) == [text]


def low_bars(text: str, turn_deg: float, size: tuple[int, int], at: tuple[int, int]) -> Image:
    """A label about `at` (x, y) whose bars are so low that, turned, no level line crosses all of them."""
    code = label(text, "Code128", 3)
    bars = np.pad(code[60:110, 10:-10], 10, constant_values=255)
    height, width = bars.shape
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), turn_deg, 1.0)
    turn[:, 2] += at[0] - width / 2, at[1] - height / 2
    return np.asarray(cv2.warpAffine(bars, turn, size, borderValue=120), np.uint8)


@pytest.mark.parametrize("turn_deg", [-17, -13, 14, 16, 104])
def test_low_bars_are_read_tilted_beside_a_code_that_is_read_at_once(turn_deg: float) -> None:
    picture = low_bars("BOX-4711", turn_deg, (700, 500), (330, 300))
    picture[20:104, 560:644] = cv2.resize(label("AL-01", "DataMatrix", 2), (84, 84))
    assert sorted(texts(picture)) == ["AL-01", "BOX-4711"]


def test_only_where_there_are_edges_enough_for_a_code_is_looked_for_one() -> None:
    large = np.full((900, 1200), 110, np.uint8)
    cv2.rectangle(large, (100, 80), (1100, 820), 70, 30)
    assert CodeSearch(large).busy() == []
    code = qr("here", 4)
    high, wide = code.shape
    large[600 : 600 + high, 200 : 200 + wide] = code
    found = CodeSearch(large).busy()
    assert found is not None
    (busy,) = found
    assert (busy.x0, busy.y0) < (200, 600)
    assert (busy.x1, busy.y1) > (200 + wide, 600 + high)
    assert (busy.x1 - busy.x0) * (busy.y1 - busy.y0) < 0.1 * large.size
    assert texts(large) == ["here"]


@pytest.mark.parametrize("shape", [(1, 1), (2, 900), (3, 3), (700, 1)])
def test_a_picture_too_small_for_a_code_has_none(shape: tuple[int, int]) -> None:
    assert texts(np.full(shape, 110, np.uint8)) == []


def test_a_small_picture_is_looked_at_whole() -> None:
    assert CodeSearch(np.full((480, 640), 110, np.uint8)).busy() is None


@pytest.mark.parametrize("scale", [3, 4, 5, 6, 7, 8, 10, 14, 20])
@pytest.mark.parametrize("kind", ["QRCode", "DataMatrix", "Code128", "EAN13"])
def test_a_code_of_any_size_is_read_in_a_large_picture(kind: str, scale: int) -> None:
    text = "9780679601050" if kind == "EAN13" else "BOX-4711"
    code = cv2.GaussianBlur(label(text, kind, scale), (0, 0), 0.8)
    room = 300, max(300, 1200 - code.shape[1])
    large = np.asarray(np.pad(code, (room, room), constant_values=120), np.uint8)
    large[::50] = 90  # edges all over, but no code
    large[300 : 300 + code.shape[0], 300 : 300 + code.shape[1]] = code
    assert texts(large) == [text]


def test_a_negative_code_is_read() -> None:
    assert texts(on_shelf(255 - label("NIGHT-7", "DataMatrix", 6), 200, 150)) == ["NIGHT-7"]


def test_a_faint_shaded_code_is_read() -> None:
    code = label("9780804816632", "EAN13", 2).astype(np.float64)
    shade = np.linspace(0.3, 1.0, code.shape[1])
    faint = (90 + (code - 128) * 0.5) * shade + 20
    assert texts(on_shelf(np.clip(faint, 0, 255).astype(np.uint8), 180, 160)) == ["9780804816632"]


def creased(code: Image, amplitude_px: float, narrow: bool) -> Image:
    """The code printed on cloth that bulges between the finder patterns."""
    height, width = code.shape
    v, u = np.mgrid[0:height, 0:width].astype(np.float32)
    a, b = u / width - 0.5, v / height - 0.5
    fold = np.exp(-((a / 0.15) ** 2) - (b / 0.3) ** 2) if narrow else np.cos(np.pi * a) * np.cos(np.pi * b)
    shift = (amplitude_px * fold).astype(np.float32)
    down = 0.5 * shift if narrow else -0.7 * shift
    bent = cv2.remap(code, u + shift, v + down, cv2.INTER_LINEAR, borderValue=255)
    return np.asarray(cv2.GaussianBlur(bent, (0, 0), 1.0), np.uint8)


@pytest.mark.parametrize(("amplitude_px", "narrow"), [(7.0, False), (9.0, True)])
def test_a_creased_qr_code_is_flattened_first(amplitude_px: float, narrow: bool) -> None:
    code = creased(qr("http://code.example.com/cloth", 6), amplitude_px, narrow)
    assert not zxingcpp.read_barcodes(code), "too flat to show anything: crease it more"
    assert texts(code) == ["http://code.example.com/cloth"]


def test_corners_are_centred_and_start_at_the_codes_own_top_left() -> None:
    code = qr("corner", 5)
    (read,) = read_codes(on_shelf(code, 300, 200))
    quiet = 4 * 5
    x0, y0 = 300 + quiet - 319.5, 200 + quiet - 239.5
    side = code.shape[0] - 2 * quiet
    expected = [(x0, y0), (x0 + side, y0), (x0 + side, y0 + side), (x0, y0 + side)]
    assert np.allclose(read.corners_px, expected, atol=3.0)
    turned = np.ascontiguousarray(np.rot90(on_shelf(code, 300, 200), 2))
    (read,) = read_codes(turned)
    assert np.allclose(read.corners_px, -np.array(expected), atol=3.0)


def test_several_codes_come_each_once() -> None:
    picture = on_shelf(qr("upper", 4), 60, 50, 800, 600)
    picture[300 : 300 + 200, 60 : 60 + 300] = cv2.resize(label("LOWER", "Code128", 2), (300, 200))[..., None]
    picture[300 : 300 + 120, 500 : 500 + 120] = cv2.resize(qr("twin", 4), (120, 120))[..., None]
    picture[450 : 450 + 120, 500 : 500 + 120] = cv2.resize(qr("twin", 4), (120, 120))[..., None]
    assert sorted(texts(picture)) == ["LOWER", "twin", "twin", "upper"]


def test_gs1_elements_come_with_the_read() -> None:
    code = label("(01)09501101530003(10)AB-123(21)X1", "DataMatrix", 5, gs1=True)
    (read,) = read_codes(on_shelf(code, 100, 100))
    assert read.gs1 == (("01", "09501101530003"), ("10", "AB-123"), ("21", "X1"))


def test_a_digital_link_gives_its_elements_and_keeps_its_text() -> None:
    text = "https://example.com/01/09501101530003/21/X1"
    (read,) = read_codes(on_shelf(qr(text, 4), 100, 100))
    assert (read.text, read.gs1) == (text, (("01", "09501101530003"), ("21", "X1")))
    (read,) = read_codes(on_shelf(qr("https://example.com/01/09501101530004", 4), 100, 100))
    assert read.gs1 == ()
    assert "check digit" in read.gs1_problem
    (read,) = read_codes(on_shelf(qr("https://example.com/about", 4), 100, 100))
    assert (read.gs1, read.gs1_problem) == ((), "")


def test_pictures_without_codes_give_nothing() -> None:
    rng = np.random.default_rng(5)
    noise = rng.integers(0, 256, (480, 640), np.uint8)
    planks = np.repeat(rng.integers(60, 200, 40), 16).astype(np.uint8)[None].repeat(480, axis=0)
    smooth = np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.0), np.uint8)
    for picture in (noise, planks, smooth, np.zeros((480, 640, 3), np.uint8), np.zeros((5, 7), np.uint8)):
        assert texts(picture) == []


@pytest.mark.parametrize("sigma_px", [1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
@pytest.mark.parametrize("kind", ["EAN13", "Code128", "ITF", "Code39", "UPCE", "QRCode"])
def test_blur_may_hide_a_code_but_never_changes_it(kind: str, sigma_px: float) -> None:
    text = {"EAN13": "9780679601050", "ITF": "070429", "UPCE": "01234565"}.get(kind, "ABC123")
    full = "012345000065" if kind == "UPCE" else text
    code = cv2.GaussianBlur(label(text, kind, 2), (0, 0), sigma_px)
    noisy = code + np.random.default_rng(3).normal(0, 4, code.shape)
    told = texts(on_shelf(np.clip(noisy, 0, 255).astype(np.uint8), 90, 120))
    assert told in ([], [full])


def test_the_region_of_a_code_is_found_and_a_bare_shelf_has_none() -> None:
    picture = on_shelf(qr("where", 4), 400, 250)
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    (region,) = CodeSearch(grey).regions()
    assert region.contains(400 + 66, 250 + 66)
    assert (region.x1 - region.x0) * (region.y1 - region.y0) < 0.2 * grey.size
    bare = on_shelf(np.full((10, 10), 128, np.uint8), 0, 0)
    assert CodeSearch(np.asarray(cv2.cvtColor(bare, cv2.COLOR_BGR2GRAY), np.uint8)).regions() == []


@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="the photographs are not beside this repository")
def test_the_photographs_are_read() -> None:
    from flightd.studies import codes as command

    expected = command.read_labels(PHOTOGRAPHS / "codes.json").codes or {}
    verdict = command.compare(list(command.read([PHOTOGRAPHS])), expected)
    assert verdict.wrong == ()
    assert verdict.read_part >= 0.98, verdict.missed


@pytest.mark.skipif(not LINES.is_dir(), reason="the photographs are not beside this repository")
def test_photographs_of_floors_hold_no_code() -> None:
    files = [entry["file"] for entry in json.loads((LINES / "labels.json").read_text())["images"]]
    for file in files:
        picture = cv2.imread(str(LINES / file))
        assert picture is not None
        assert texts(np.asarray(cv2.resize(picture, (640, 480)), np.uint8)) == [], file
