"""Descriptions of curves for notebooks."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from rbcourse._numerics import Array

_WIDTH, _HEIGHT = 240, 60


def curve_html(curve: Any) -> str:
    """Return the description of a `Curve` and, for a single curve, a picture of its speeds."""
    words = escape(repr(curve)[1:-1])
    if curve.batch_shape:
        return f"<div>{words}</div>"
    try:
        start, end = curve.domain
        rates = curve(np.linspace(start, end, 121), 1)
    except (RuntimeError, ValueError):  # the curve jumps
        return f"<div>{words}</div>"
    drawn = _line(rates[:, :3], "#0072b2", "‖ω‖", "rad")
    if curve.size == 4:
        drawn += _line(rates[:, 3:], "#d55e00", "‖v‖", "m")
    return f"<div>{words}<br>{drawn}</div>"


def _line(rates: Array, colour: str, name: str, unit: str) -> str:
    """Return a small graph of the norm over time, from 0 to its largest value."""
    speed = np.linalg.norm(rates, axis=-1)
    largest = speed.max()
    if not np.isfinite(largest):
        return ""
    x = np.linspace(2, _WIDTH - 2, len(speed))
    y = _HEIGHT - 2 - (_HEIGHT - 4) * speed / (largest or 1)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    line = f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
    frame = f'<path d="M1 1V{_HEIGHT - 1}H{_WIDTH}" fill="none" stroke="currentColor"/>'
    label = f"{name} up to {largest:.3g} {unit} per unit of time"
    return (
        f'<span style="display:inline-block;margin-right:1em;font-size:small">{label}<br>'
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" role="img" aria-label="{label}">'
        f"{frame}{line}</svg></span>"
    )
