"""HTML and SVG as text: elements with everything escaped, numbers short, axes with round ticks."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable

import numpy as np

from flightd.replay.report.flight import Array

MINUS = "\u2212"
NOTHING = "\u2013"
"""What stands in a table where there is no value."""


def text(value: object) -> str:
    """Escaped text."""
    return html.escape(str(value))


def element(name: str, *children: str, **attributes: object) -> str:
    """`<name …>children</name>`; children are markup already, attribute values are escaped here.

    In attribute names a trailing underscore is dropped and the others become hyphens; an attribute
    that is None is left out."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{text(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{written}>{''.join(children)}</{name}>"


def table(heads: Iterable[str], rows: Iterable[str], name: str) -> str:
    """A table of rows that are markup already, scrolled where it is too large, by key as well."""
    head = element("thead", element("tr", *(element("th", text(label), scope="col") for label in heads)))
    return element(
        "div", element("table", head, element("tbody", *rows), class_=name), **scrolled(name.capitalize())
    )


def scrolled(label: str) -> dict[str, object]:
    """The attributes of a part of the page that scrolls by itself: reached and named without a mouse."""
    return {"class_": "scroll", "tabindex": 0, "role": "region", "aria_label": label}


def number(value: float, digits: int = 2) -> str:
    """A number with at most `digits` decimals and no trailing zeros."""
    shown = f"{value:.{digits}f}"
    if "." in shown:
        shown = shown.rstrip("0").rstrip(".")
    return "0" if shown in {"-0", ""} else shown


def clock(seconds: float) -> str:
    """Minutes and seconds: 1:05; tenths below ten seconds would be noise in a flight."""
    whole = round(abs(seconds))
    return f"{'-' if seconds < 0 else ''}{whole // 60}:{whole % 60:02d}"


def ticks(low: float, high: float, wanted: int) -> list[float]:
    """About `wanted` round numbers (1, 2 or 5 times a power of ten) within low..high."""
    if not high > low:
        return [low]
    rough = (high - low) / max(wanted, 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(index * step, 12) for index in range(first, last + 1)]


def thin(t_s: Array, values: Array, columns: int = 900) -> tuple[Array, Array]:
    """The lowest and highest value of each of `columns` stretches of time, so that no peak is lost.

    Stretches without a finite value become one NaN, which is a gap in the line."""
    if len(t_s) <= 2 * columns:
        return t_s, values
    picked: list[int] = []
    for part in np.array_split(np.arange(len(t_s)), columns):
        finite = part[np.isfinite(values[part])]
        if not len(finite):
            picked.append(int(part[0]))
            continue
        lowest, highest = finite[np.argmin(values[finite])], finite[np.argmax(values[finite])]
        picked += sorted({int(lowest), int(highest)})
    return t_s[picked], values[picked]


def path_data(xs: Iterable[float], ys: Iterable[float], digits: int = 2) -> str:
    """`d` of a path through the points, lifted over those that are not finite."""
    parts = []
    command = "M"
    for x, y in zip(xs, ys, strict=True):
        if not (math.isfinite(x) and math.isfinite(y)):
            command = "M"
            continue
        parts.append(f"{command}{number(x, digits)},{number(y, digits)}")
        command = "L"
    return "".join(parts)
