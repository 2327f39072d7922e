"""The warehouse floor as pictures: small square tiles of it, painted when first looked at.

A tile is seen from straight above, rows along +y and columns along +x of the map, so that the tile lies
as the map does.  Colour is worked out as reflectance times light and stored with the sRGB gamma.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.paint import paint_srgb
from flightd.core.types import Image
from flightd.sim.appearance import Appearance
from flightd.sim.floor.lighting import Lighting
from flightd.sim.floor.paint_damage import UNDAMAGED, PaintDamage, Stripe, stroke_box
from flightd.sim.floor.printed_markers import FloorSigns
from flightd.sim.floor.texture import Box, NoiseField, Patch
from flightd.sim.floor.wear_marks import FloorMarks
from flightd.site.site import PadSign, Site

Floats: TypeAlias = NDArray[np.float32]

_CONCRETE_SRGB = (152, 150, 144)
_MAT_SRGB = (58, 58, 61)
_UPRIGHT_SRGB = (40, 62, 110)
_WOOD_SRGB = (148, 127, 101)
_BOARD_M = 0.145
_STEEL_SRGB = (118, 122, 124)
_MESH_M, _BAR_M = 0.033, 0.003
"""Pitch of a grating, and half of a bar's width."""
_STEEL_SHARE = 1.0 - (1.0 - 2.0 * _BAR_M / _MESH_M) ** 2
_GAMMA_STEPS = 4096


def _linear(srgb: tuple[int, int, int]) -> Floats:
    """BGR reflectance of an sRGB colour."""
    share = np.array(srgb[::-1]) / 255.0
    linear: Floats = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(
        np.float32
    )
    return linear


def _gamma_table() -> Image:
    share = np.linspace(0.0, 1.0, _GAMMA_STEPS)
    curve = np.where(share <= 0.0031308, share * 12.92, 1.055 * share ** (1 / 2.4) - 0.055)
    return np.round(curve * 255.0).astype(np.uint8)


class Floor:
    """Paints patches of one warehouse's floor; the same patch always looks the same."""

    def __init__(
        self,
        site: Site,
        look: Appearance,
        lighting: Lighting,
        seed: int,
        damage: PaintDamage = UNDAMAGED,
    ) -> None:
        self._look = look
        self._gaps, self._gratings = damage.gaps, damage.gratings
        self._lighting = lighting
        self._noise = NoiseField(seed)
        self._marks = FloorMarks(site, look, seed)
        self._signs = FloorSigns(site)
        self._strokes: list[Box | Stripe] = [*map(stroke_box, site.lines), *damage.false_lines]
        self._old, self._tapes = damage.old_lines, damage.tapes
        self._mats = [
            (x_m - half, y_m - half, x_m + half, y_m + half)
            for pad in site.pads
            if pad.sign is PadSign.MAT
            for (x_m, y_m), half in ((site.pad_centre(pad), pad.size_m / 2),)
        ]
        self._uprights, pallets = _shelf_feet(site) if look.concrete > 0.0 else ([], [])
        self._pallets = [*pallets, *damage.pallets]
        self._paint = _linear(paint_srgb(site.line_colour))
        self._gamma = _gamma_table()

    def paint(self, patch: Patch) -> Image:
        """(size, size, 3) BGR picture of the patch."""
        colour = self._concrete(patch)
        mats = self._cover(patch, self._mats, None)
        if mats is not None:
            rubber = 1.0 + 0.12 * self._noise.mix(patch, "mat", {0.004: 1.0, 0.03: 0.6})
            _lay(colour, _linear(_MAT_SRGB) * rubber[..., None], mats)
        self._lay_paint(colour, patch, mats)
        self._signs.lay(colour, patch)
        self._lay_gratings(colour, patch)
        shade = self._marks.shade(patch)
        if mats is not None:  # the mat lies on the marks
            shade += (1.0 - shade) * mats
        colour *= shade[..., None]
        self._lay_pallets_and_uprights(colour, patch)
        colour *= self._lighting.on(patch)[..., None]
        np.clip(colour, 0.0, 1.0, out=colour)
        picture: Image = self._gamma[(colour * np.float32(_GAMMA_STEPS - 1)).astype(np.uint16)]
        return picture

    def _concrete(self, patch: Patch) -> Floats:
        strength = np.float32(self._look.concrete)
        base = np.broadcast_to(_linear(_CONCRETE_SRGB), (patch.size, patch.size, 3)).copy()
        if strength <= 0.0:
            return base
        clouds = self._noise.mix(patch, "clouds", {2.7: 0.13, 1.1: 0.11, 0.43: 0.10, 0.17: 0.08})
        grain = self._noise.mix(
            patch, "grain", {0.07: 0.06, 0.028: 0.06, 0.011: 0.08, 0.0045: 0.10, 0.002: 0.10}
        )
        tint = self._noise.mix(patch, "tint", {3.1: 0.04, 0.6: 0.02})
        grit = self._noise.octave(patch, "grit", 0.009)
        value = 1.0 + strength * (clouds + grain - 0.25 * np.clip(grit - 2.0, 0.0, 1.0))
        base *= np.clip(value, 0.2, 2.0)[..., None]
        base[..., 0] *= 1.0 - strength * tint
        base[..., 2] *= 1.0 + strength * tint
        return base

    def _lay_gratings(self, colour: Floats, patch: Patch) -> None:
        """Drains: galvanised bars over dark holes, too fine to be told apart in coarse texels."""
        cover = self._cover(patch, self._gratings, None)
        if cover is None:
            return
        x = (patch.xs() + np.float32(patch.x_m)) / _MESH_M % 1.0
        y = (patch.xs() + np.float32(patch.y_m)) / _MESH_M % 1.0
        from_bar_m = np.minimum(np.abs(x - 0.5)[None, :], np.abs(y - 0.5)[:, None]) * _MESH_M
        bars = np.clip((_BAR_M - from_bar_m) / patch.texel_m + 0.5, 0.0, 1.0)
        fine = min(max(2.0 - 4.0 * patch.texel_m / _MESH_M, 0.0), 1.0)
        steel = 0.12 + 0.88 * (fine * bars + (1.0 - fine) * _STEEL_SHARE)
        _lay(colour, _linear(_STEEL_SRGB) * steel[..., None].astype(np.float32), cover)

    def _lay_pallets_and_uprights(self, colour: Floats, patch: Patch) -> None:
        wood = self._cover(patch, self._pallets, None)
        if wood is not None:
            # boards into the shelf, as pallets are stored: their own tone, dark gaps between, the grain
            xs = patch.xs() + np.float32(patch.x_m)
            tone = 0.16 * np.sin(np.floor(xs / _BOARD_M) * 12.9898)
            gap = np.clip(1.5 - np.abs((xs / _BOARD_M) % 1.0 - 0.5) * _BOARD_M / 0.012, 0.0, 1.0)
            grain = 0.2 * self._noise.mix(patch, "wood", {0.3: 0.6, 0.05: 0.5, 0.01: 0.5})
            boards = (1.0 + tone - 0.8 * gap)[None, :] * (1.0 + grain)
            _lay(colour, _linear(_WOOD_SRGB) * boards[..., None], wood)
        steel = self._cover(patch, self._uprights, None)
        if steel is not None:
            _lay(colour, _linear(_UPRIGHT_SRGB), steel)

    def _lay_paint(self, colour: Floats, patch: Patch, mats: Floats | None) -> None:
        """Tape, old lines and, over both, the paint."""
        for tape in self._tapes:
            stuck = self._cover(patch, [tape.stripe], None)
            if stuck is not None:
                _lay(colour, self._dirty(_linear(paint_srgb(tape.colour)), patch), stuck)
        ragged = None
        if self._look.ragged_m > 0.0:
            ragged = self._look.ragged_m * self._noise.mix(patch, "edge", {0.15: 0.5, 0.02: 0.4, 0.006: 0.6})
        for old in self._old:
            faded = self._cover(patch, [old.stripe], ragged)
            if faded is not None:
                faded *= np.float32(old.left) * self._kept(patch, mats)
                _lay(colour, self._dirty(self._paint, patch), faded)
        cover = self._cover(patch, self._strokes, ragged)
        if cover is None:
            return
        cover *= self._kept(patch, mats)
        gaps = self._cover(patch, self._gaps, None)
        if gaps is not None:
            cover *= 1.0 - gaps
        _lay(colour, self._dirty(self._paint, patch), cover)

    def _kept(self, patch: Patch, mats: Floats | None) -> Floats | np.float32:
        """Share of the paint that wear leaves."""
        if not self._look.wear > 0.0:
            return np.float32(1.0)
        rubbed = self._noise.mix(patch, "rubbed", {0.9: 0.5, 0.3: 0.45, 0.09: 0.35})
        chips = self._noise.mix(patch, "chips", {0.04: 0.35, 0.015: 0.5, 0.006: 0.5, 0.003: 0.4})
        threshold = _WEAR_AT_NONE - _WEAR_PER_SHARE * self._look.wear
        gone: Floats = np.clip((rubbed + chips - threshold) * 2.5, 0.0, 0.92)
        if mats is not None:  # the mat is newer than the floor
            gone *= 1.0 - 0.8 * mats
        return 1.0 - gone

    def _dirty(self, reflectance: Floats, patch: Patch) -> Floats:
        """Paint or tape of a colour below the floor's film of dirt."""
        paint = np.broadcast_to(reflectance, (patch.size, patch.size, 3)).copy()
        if self._look.dirt > 0.0:
            film = self._noise.mix(patch, "film", {1.3: 0.3, 0.3: 0.3, 0.07: 0.25, 0.02: 0.2, 0.005: 0.25})
            grey = np.clip(0.22 + 0.25 * film, 0.0, 0.8) * np.float32(self._look.dirt)
            paint *= (1.0 - 0.35 * grey)[..., None]
            paint += (_linear(_CONCRETE_SRGB) * 0.55 - paint) * (0.6 * grey)[..., None]
        return paint

    def _cover(self, patch: Patch, shapes: Sequence[Box | Stripe], ragged: Floats | None) -> Floats | None:
        """Share of each texel inside any of the shapes, their edges moved outward by `ragged` metres;
        None when no shape is near."""
        cover: Floats | None = None
        texel = np.float32(patch.texel_m)
        margin = 0.02 + patch.texel_m
        for shape in shapes:
            x0, y0, x1, y1 = shape.box() if isinstance(shape, Stripe) else shape
            if x1 < patch.x_m - margin or x0 > patch.x_m + patch.side_m + margin:
                continue
            if y1 < patch.y_m - margin or y0 > patch.y_m + patch.side_m + margin:
                continue
            inside = _inside_stripe(patch, shape) if isinstance(shape, Stripe) else _inside_box(patch, shape)
            if ragged is not None:
                inside = inside + ragged
            share = np.clip(inside / texel + np.float32(0.5), 0.0, 1.0)
            cover = share if cover is None else np.maximum(cover, share)
        return cover


_WEAR_AT_NONE = 2.6
_WEAR_PER_SHARE = 4.5


def _lay(colour: Floats, reflectance: Floats, cover: Floats) -> None:
    colour += (reflectance - colour) * cover[..., None]


def _inside_box(patch: Patch, box: Box) -> Floats:
    """How far each texel's centre is within the box, metres; negative outside."""
    x0, y0, x1, y1 = box
    xs = patch.xs()
    x = np.minimum(xs - np.float32(x0 - patch.x_m), np.float32(x1 - patch.x_m) - xs)
    y = np.minimum(xs - np.float32(y0 - patch.y_m), np.float32(y1 - patch.y_m) - xs)
    inside: Floats = np.minimum(x[None, :], y[:, None])
    return inside


def _inside_stripe(patch: Patch, stripe: Stripe) -> Floats:
    """As `_inside_box`."""
    xs = patch.xs()
    x = (xs + np.float32(patch.x_m - stripe.x_m))[None, :]
    y = (xs + np.float32(patch.y_m - stripe.y_m))[:, None]
    c, s = np.float32(math.cos(stripe.turn_rad)), np.float32(math.sin(stripe.turn_rad))
    along = np.float32(stripe.length_m / 2) - np.abs(x * c + y * s)
    inside: Floats = np.minimum(along, np.float32(stripe.width_m / 2) - np.abs(y * c - x * s))
    return inside


def _shelf_feet(site: Site) -> tuple[list[Box], list[Box]]:
    """Foot plates of the uprights and the pallets standing between them, as floor rectangles."""
    uprights: list[Box] = []
    pallets: list[Box] = []
    for shelf in site.shelves:
        front, back = shelf.y_m, shelf.y_m + shelf.inward * 0.12
        for x_m in np.arange(shelf.x0_m, shelf.x1_m + 0.01, 1.9):
            left = float(min(x_m, shelf.x1_m - 0.1))
            uprights.append((left, min(front, back), left + 0.1, max(front, back)))
            near, far = shelf.y_m + shelf.inward * 0.18, shelf.y_m + shelf.inward * 0.9
            for k in range(2):
                start = left + 0.15 + 0.86 * k
                if start + 0.8 < shelf.x1_m:
                    pallets.append((start, min(near, far), start + 0.8, max(near, far)))
    return uprights, pallets
