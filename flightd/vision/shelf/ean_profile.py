"""Reads an EAN-13 from the brightness across its bars where blur has run the bars into each other.

A reader of edges needs each bar to be seen.  Here the whole symbol is drawn, blurred, and compared: where it
lies (with the stretch of perspective), how far it is blurred, how light paper and ink are, and the digits are
those with which the drawing differs least from what was seen.  As in Gallo and Manduchi, "Reading 1D barcodes
with mobile phones using deformable templates" (PAMI 2011), with the blur as one more unknown, and digits that
are told apart with their neighbours in place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.vision.shelf.ean_symbol import (
    DIGIT_MODULES,
    LEFT_AT,
    LEFT_DIGITS,
    MODULES,
    RIGHT_AT,
    RIGHT_DIGITS,
    RankedTexts,
    best_by_sets,
    likeliest_text,
    symbol_modules,
)

_Vector: TypeAlias = NDArray[np.float64]

_SAMPLES: Final = 4
"""For each module."""
_QUIET: Final = 6
"""Modules beside the symbol that are compared too: the standard demands seven on the right."""
_AT: Final = (np.arange(-_QUIET * _SAMPLES, (MODULES + _QUIET) * _SAMPLES) + 0.5) / _SAMPLES
"""Where it is compared, in modules from the left edge of the symbol."""
_ACROSS: Final = _AT / MODULES - 0.5
_BLURS: Final = (0.55, 0.95, 1.35)
"""Modules, standard deviation: where the search begins."""
_LEAST_BLUR, _MOST_BLUR = 0.25, 1.9
_STEPS: Final = 2
_ROUNDS: Final = 4
_GREY: Final = 3
_REACH: Final = 2
"""Modules beside a digit that it still changes."""

_STEEPS = np.linspace(-6.0, 6.0, 2401)
_STEP_TABLE = np.array([0.5 * (1.0 + math.erf(x / math.sqrt(2.0))) for x in _STEEPS])


class Place(NamedTuple):
    """Where a symbol lies in a profile, in pixels: its left edge, a module's width in the middle, and how
    much that grows from there on (px for each module squared)."""

    start_px: float
    module_px: float
    growth: float

    def at(self, modules: _Vector | float) -> _Vector:
        """Pixels of these places in the symbol."""
        u = np.asarray(modules, np.float64)
        return np.asarray(self.start_px + self.module_px * u + self.growth * u * (u - MODULES), np.float64)


@dataclass(frozen=True, slots=True)
class ProfileRead:
    """What a profile says: 13 digits, by how many times the noise the next valid text fits worse, the part
    of the profile's variance that is explained, where the symbol lies, and its blur in modules."""

    text: str
    margin: float
    forced: float
    explained: float
    place: Place
    blur: float


class Start(NamedTuple):
    """Where to begin: how well digits anywhere could explain it (0 to 1), and with what."""

    score: float
    place: Place
    blur: float
    left: Matrix
    right: Matrix


def best_start(profile: _Vector, places: Sequence[Place]) -> Start:
    """The best of all places and blurs, each digit alone at its best."""
    dark = -_sampled(profile, places)
    found = []
    for blur in _BLURS:
        of_left, of_right = _templates(blur)
        left, right = _alike(dark, LEFT_AT, of_left), _alike(dark, RIGHT_AT, of_right)
        scores = best_by_sets(left, right) / 12
        best = int(scores.argmax())
        found.append(Start(float(scores[best]), places[best], blur, left[best], right[best]))
    return max(found, key=lambda start: start.score)


def read_profile(profile: _Vector, start: Start) -> ProfileRead:
    """The likeliest text from there on."""
    ranked, place, blur = likeliest_text(-start.left, -start.right), start.place, start.blur
    return _settled(profile, ranked.text, place, blur)


def read_again(profile: _Vector, known: ProfileRead, place: Place) -> ProfileRead:
    """The likeliest text of another profile of the same symbol, as blurred, which is expected at `place`."""
    return _settled(profile, known.text, place, known.blur)


def _settled(profile: _Vector, text: str, place: Place, blur: float) -> ProfileRead:
    for more in range(_ROUNDS, -1, -1):
        fit = _fitted(profile, text, place, blur)
        ranked = _ranked(fit, text)
        place, blur = fit.place, fit.blur
        if ranked.text == text or not more:
            break
        text = ranked.text
    noise = max(float(fit.rest @ fit.rest) / len(fit.rest) * _SAMPLES, 1e-9)
    spread = float(np.square(fit.seen - fit.seen.mean()).sum())
    explained = 1.0 - float(fit.rest @ fit.rest) / max(spread, 1e-9)
    margin = ranked.margin / noise if ranked.text == text else 0.0
    return ProfileRead(text, margin, ranked.forced / noise, explained, fit.place, fit.blur)


class _Fit(NamedTuple):
    place: Place
    blur: float
    seen: _Vector
    rest: _Vector
    contrast: _Vector
    modules: Matrix


def _fitted(profile: _Vector, text: str, place: Place, blur: float) -> _Fit:
    """Gauss-Newton over place and blur; paper and ink, each linear across the symbol, in closed form."""
    drawn = symbol_modules(text)
    for _ in range(_STEPS):
        modules = _blurred_modules(blur)
        seen, dark = _sampled(profile, [place])[0], modules @ drawn
        levels = _levels(dark)
        solved = np.linalg.lstsq(levels, seen, rcond=None)[0]
        rest = seen - levels @ solved
        slope = np.gradient(seen) * _SAMPLES / place.module_px
        softer = (_blurred_modules(blur * 1.05) @ drawn - dark) / (0.05 * blur)
        moves = np.stack(
            [
                -slope,
                -slope * _AT,
                -slope * _AT * (_AT - MODULES),
                -(solved[2] + solved[3] * _ACROSS) * softer,
            ],
            axis=1,
        )
        step = np.linalg.lstsq(np.hstack([moves, levels]), rest, rcond=None)[0]
        width = place.module_px
        place = Place(
            place.start_px + float(np.clip(step[0], -width, width)),
            width * (1.0 + float(np.clip(step[1] / width, -0.03, 0.03))),
            place.growth + width * float(np.clip(step[2] / width, -0.0005, 0.0005)),
        )
        blur = float(np.clip(blur + np.clip(step[3], -0.2, 0.2), _LEAST_BLUR, _MOST_BLUR))
    modules = _blurred_modules(blur)
    seen = _sampled(profile, [place])[0]
    levels = _levels(modules @ drawn)
    solved = np.linalg.lstsq(levels, seen, rcond=None)[0]
    return _Fit(place, blur, seen, seen - levels @ solved, solved[2] + solved[3] * _ACROSS, modules)


def _levels(dark: _Vector) -> Matrix:
    """Columns for the paper and for how much darker ink is, each linear across the symbol."""
    return np.stack([np.ones_like(dark), _ACROSS, -dark, -dark * _ACROSS], axis=1)


def _ranked(fit: _Fit, text: str) -> RankedTexts:
    """What other digits would cost, each in the place of one of `text`, among the others of it."""
    drawn = symbol_modules(text)

    def costs(at: int, digits: Matrix) -> _Vector:
        first = (at + _QUIET - _REACH) * _SAMPLES
        window = slice(first, first + (DIGIT_MODULES + 2 * _REACH) * _SAMPLES)
        other = digits - drawn[at : at + DIGIT_MODULES]
        change = fit.contrast[window, None] * (fit.modules[window, at : at + DIGIT_MODULES] @ other.T)
        return np.asarray(np.square(fit.rest[window, None] + change).sum(axis=0), np.float64)

    return likeliest_text(
        np.stack([costs(at, LEFT_DIGITS) for at in LEFT_AT]),
        np.stack([costs(at, RIGHT_DIGITS) for at in RIGHT_AT]),
    )


def _sampled(profile: _Vector, places: Sequence[Place]) -> Matrix:
    """(places, samples) of the profile; beyond its ends as at them."""
    at = np.stack([place.at(_AT) for place in places])
    return np.asarray(np.interp(at.ravel(), np.arange(len(profile)), profile).reshape(at.shape), np.float64)


def _blurred_modules(blur: float) -> Matrix:
    """(samples, 95): how dark each dark module makes each sample."""
    return _darkened(_AT, MODULES, blur)


def _darkened(at: _Vector, modules: int, blur: float) -> Matrix:
    """(samples, modules): how dark each of so many modules makes the samples `at` these places."""
    edges = (at[:, None] - np.arange(modules + 1)) / blur
    steps = np.interp(edges.ravel(), _STEEPS, _STEP_TABLE).reshape(edges.shape)
    return np.asarray(steps[:, :-1] - steps[:, 1:], np.float64)


@lru_cache(maxsize=len(_BLURS))
def _templates(blur: float) -> tuple[Matrix, Matrix]:
    """The digits of either half with a module to each side, which is the same beside all of them; what is
    farther off is taken for grey.  Centred, of length 1."""
    left, right = (
        np.pad(digits, ((0, 0), (1, 1)), constant_values=((0.0, 0.0), ends))
        for digits, ends in ((LEFT_DIGITS, (1.0, 0.0)), (RIGHT_DIGITS, (0.0, 1.0)))
    )
    return _drawn(left, blur), _drawn(right, blur)


def _drawn(digits: Matrix, blur: float) -> Matrix:
    """Rows of modules as samples, blurred."""
    modules = digits.shape[1]
    at = (np.arange(modules * _SAMPLES) + 0.5) / _SAMPLES + _GREY
    grey = np.full((len(digits), _GREY), 0.5)
    drawn = np.hstack([grey, digits, grey]) @ _darkened(at, modules + 2 * _GREY, blur).T
    drawn = drawn - drawn.mean(axis=1, keepdims=True)
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True), np.float64)


def _alike(dark: Matrix, begins: Sequence[int], templates: Matrix) -> Matrix:
    """(places, begins, templates): correlation of what begins a module before there with each template."""
    firsts, width = [(at - 1 + _QUIET) * _SAMPLES for at in begins], templates.shape[1]
    windows = np.stack([dark[:, first : first + width] for first in firsts], axis=1)
    windows = windows - windows.mean(axis=2, keepdims=True)
    length = np.maximum(np.linalg.norm(windows, axis=2, keepdims=True), 1e-9)
    return np.asarray((windows @ templates.T) / length, np.float64)
