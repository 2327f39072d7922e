"""Fusion of what several methods found, each weighted by its own uncertainty."""

from __future__ import annotations

import math

from flightd.vision.lines.band import Band, LinearFit, swapped


def fuse(guesses: list[Band], tolerance_px: float) -> list[Band]:
    """One band for each that any method found: those that agree are averaged by information.

    Two guesses agree when their centre lines stay within `tolerance_px` where the shorter is visible,
    and their widths are alike; guesses that differ more are kept apart, for the evidence to decide.
    """
    fused: list[Band] = []
    for strip in guesses:
        for k, other in enumerate(fused):
            if strip.steep == other.steep and _agree(strip, other, tolerance_px):
                fused[k] = _merge(other, strip)
                break
        else:
            fused.append(strip)
    return fused


def _agree(one: Band, other: Band, tolerance_px: float) -> bool:
    shorter = one if one.u1 - one.u0 < other.u1 - other.u0 else other
    a, b = one.centre.a - other.centre.a, one.centre.b - other.centre.b
    u0, u1 = shorter.u0, shorter.u1
    if abs(a + b * u0) > tolerance_px or abs(a + b * u1) > tolerance_px:
        return False
    middle = (u0 + u1) / 2
    width, width_other = (s.high.at(middle) - s.low.at(middle) for s in (one, other))
    return abs(width - width_other) <= 2 * tolerance_px + 0.2 * max(width, width_other)


def without_repeats(strips: list[Band]) -> list[Band]:
    """Longest first, each band once."""
    kept: list[Band] = []
    for strip in sorted(strips, key=lambda s: -s.length_px * s.support):
        for other in kept:
            candidate = strip if strip.steep == other.steep else _turned(strip)
            if candidate is not None and same_band(candidate, other):
                break
        else:
            kept.append(strip)
    return kept


def _turned(strip: Band) -> Band | None:
    return swapped(strip) if abs(strip.centre.b) > 0.4 else None


def same_band(one: Band, other: Band) -> bool:
    """Whether the two centre lines run within each other's band where the shorter one is visible."""
    shorter, longer = (one, other) if one.length_px < other.length_px else (other, one)
    reach = 0.5 * max(one.width_px, other.width_px) / longer.cosine + 2.0
    near = [abs(shorter.centre.at(u) - longer.centre.at(u)) <= reach for u in (shorter.u0, shorter.u1)]
    turn = abs(math.atan(one.centre.b) - math.atan(other.centre.b))
    return all(near) and turn < math.radians(12)


def _merge(one: Band, other: Band) -> Band:
    main = one if one.length_px * one.support >= other.length_px * other.support else other
    return Band(
        one.steep,
        _average(one.centre, other.centre),
        _average(one.low, other.low),
        _average(one.high, other.high),
        min(one.u0, other.u0),
        max(one.u1, other.u1),
        main.support,
    )


def _average(one: LinearFit, other: LinearFit) -> LinearFit:
    """Information-weighted mean of two fits of the same line (2x2 normal equations, in closed form)."""
    first, second = _information(one), _information(other)
    if first is None or second is None:
        return one if first is not None else other
    aa, ab, bb = (p + q for p, q in zip(first, second, strict=True))
    ya = first[0] * one.a + first[1] * one.b + second[0] * other.a + second[1] * other.b
    yb = first[1] * one.a + first[2] * one.b + second[1] * other.a + second[2] * other.b
    det = aa * bb - ab * ab
    if det <= 0:
        return one
    a, b = (bb * ya - ab * yb) / det, (aa * yb - ab * ya) / det
    return LinearFit(a, b, bb / det, aa / det, -ab / det)


def _information(fit: LinearFit) -> tuple[float, float, float] | None:
    det = fit.var_a * fit.var_b - fit.cov_ab**2
    if det <= 0:
        return None
    return fit.var_b / det, -fit.cov_ab / det, fit.var_a / det
