"""How long a picture takes to become a setpoint: the distribution, and where the time goes."""

from __future__ import annotations

import numpy as np

from flightd.replay.report.flight import Array, Latency
from flightd.replay.report.markup import element, number, text, ticks

_BINS = 48


def latency_section(latency: Latency) -> str:
    """Histogram of the total with its p50 and p99, and a table of the stages."""
    if "total" not in latency.stages or not np.isfinite(latency.stage("total")).any():
        return element("p", "The log holds no latencies.", class_="empty")
    total = latency.stage("total")
    return element("div", _histogram(total[np.isfinite(total)]), _stages(latency), class_="latency")


def _histogram(values_ms: Array) -> str:
    p50, p99 = (float(np.percentile(values_ms, percent)) for percent in (50, 99))
    low = float(values_ms.min())
    # the last bin takes in the rare very late ones, so that they do not flatten the rest
    high = min(float(values_ms.max()), p99 + 1.5 * max(p99 - low, 1.0))
    high = max(high, low + 1.0)
    counts, edges = np.histogram(np.minimum(values_ms, high), bins=_BINS, range=(low, high))
    tallest = max(int(counts.max()), 1)
    bars = "".join(
        f'<rect class="bar" x="{number(float(edge), 3)}" width="{number((high - low) / _BINS * 0.86, 3)}" '
        f'y="{number(100 - 100 * count / tallest)}" height="{number(100 * count / tallest)}">'
        f"<title>{number(float(edge), 1)} ms: {count} frames</title></rect>"
        for edge, count in zip(edges, counts, strict=False)
        if count
    )

    def across(value: float) -> str:
        return number(100 * (value - low) / (high - low))

    drawing = (
        f'<svg class="drawing" viewBox="{number(low, 3)} 0 {number(high - low, 3)} 100" '
        f'preserveAspectRatio="none" role="img" aria-label="Histogram of the latency">{bars}</svg>'
    )
    marks = "".join(
        element(
            "span",
            element("b", f"{name} {number(value, 1)} ms"),
            class_=f"mark {name}",
            style=f"left:{across(value)}%",
        )
        for name, value in (("p50", p50), ("p99", p99))
    )
    labels = "".join(
        element("span", number(tick, 1), style=f"left:{across(tick)}%") for tick in ticks(low, high, 7)
    )
    caption = element(
        "figcaption",
        element(
            "span", "Picture to setpoint", element("small", f"ms, {len(values_ms)} frames"), class_="name"
        ),
    )
    return element(
        "figure",
        caption,
        element("div", drawing, marks, class_="plot"),
        element("div", element("div", labels, class_="times"), class_="axis"),
        class_="histogram",
    )


def _stages(latency: Latency) -> str:
    rows = []
    total = latency.stage("total")
    longest = float(np.nanpercentile(total, 99))
    for stage in latency.stages:
        values = latency.stage(stage)
        values = values[np.isfinite(values)]
        if not len(values):
            continue
        p50, p99 = (float(np.percentile(values, percent)) for percent in (50, 99))
        bar = element(
            "div",
            element("i", style=f"width:{number(100 * min(p99 / longest, 1.0))}%", class_="late"),
            element("i", style=f"width:{number(100 * min(p50 / longest, 1.0))}%"),
            class_="gauge",
        )
        rows.append(
            element(
                "tr",
                element("th", text(stage), scope="row"),
                element("td", f"{p50:.1f}"),
                element("td", f"{p99:.1f}"),
                element("td", bar, class_="wide"),
                class_="total" if stage == "total" else None,
            )
        )
    head = element(
        "thead",
        element("tr", *(element("th", name, scope="col") for name in ("Stage", "p50 ms", "p99 ms", ""))),
    )
    return element("table", head, element("tbody", *rows), class_="stages")
