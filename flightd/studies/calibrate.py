"""A lens from pictures of a board, as the keys of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.studies.frame_files import all_pictures
from flightd.vision import lens_calibration
from flightd.vision.lens_calibration import Target

_MOST_VIEWS = 60


@dataclass(frozen=True, slots=True)
class CalibratedLens:
    """`keys` are those of a camera's section; `boards` of the `pictures` showed enough of the board."""

    pictures: int
    boards: int
    error_px: float
    sigma_focal_px: float
    keys: dict[str, object]

    def document(self) -> dict[str, object]:
        """As JSON has it."""
        return {
            "pictures": self.pictures,
            "boards": self.boards,
            "error_px": round(self.error_px, 4),
            "sigma_focal_px": round(self.sigma_focal_px, 3),
            "camera": self.keys,
        }


def calibrate_lens(paths: Sequence[Path], board: Target) -> CalibratedLens:
    """Calibrate on every picture of `paths` that shows enough of the board.

    InputError when they differ in size, are too few, or do not say enough about the lens.
    """
    views, sizes, looked = [], set[tuple[int, int]](), 0
    for picture in all_pictures(paths, "looking for boards"):
        looked += 1
        view = board.view_of(picture.bgr)
        if view is not None:
            views.append(view)
            sizes.add((picture.bgr.shape[1], picture.bgr.shape[0]))
    if len(sizes) > 1:
        raise InputError(f"the pictures differ in size ({', '.join(f'{w}x{h}' for w, h in sorted(sizes))})")
    width, height = sizes.pop() if sizes else (0, 0)
    step = max(len(views) // _MOST_VIEWS, 1)
    result = lens_calibration.calibrate(views[::step], board, width, height)
    keys = lens_keys(result.lens)
    return CalibratedLens(looked, len(views), result.error_px, result.sigma_focal_px, keys)


def lens_keys(lens: Lens) -> dict[str, object]:
    """A lens as the keys of a camera's section."""
    return {
        "width_px": lens.width_px,
        "height_px": lens.height_px,
        "fx_px": round(lens.fx_px, 2),
        "fy_px": round(lens.fy_px, 2),
        "cx_px": round(lens.cx_px, 2),
        "cy_px": round(lens.cy_px, 2),
        "distortion": [round(value, 6) for value in lens.distortion],
    }
