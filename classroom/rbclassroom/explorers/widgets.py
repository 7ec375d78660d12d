"""The controls of explorers. If a control has a unit, its label ends with the unit."""

from collections.abc import Sequence
from typing import Any

import ipywidgets
import numpy as np

from rbclassroom.explorers.explorer import numbers

_WIDE: dict[str, Any] = {"description_width": "9.5em"}
_LOOK: dict[str, Any] = {"style": _WIDE, "layout": {"width": "auto"}}


def slider(label: str, value: float, low: float, high: float, step: float) -> Any:
    """Return a slider."""
    limits = {"min": low, "max": high, "step": step, "readout_format": f".{_digits(step)}f"}
    return ipywidgets.FloatSlider(value, description=label, **_LOOK, **limits)


def stepped(label: str, value: float, low: float, high: float, step: float) -> Any:
    """Return a slider that can play; its values are `step` apart."""
    values = np.round(np.arange(low, high + step / 2, step), _digits(step)) + 0.0
    return listed(label, value, values.tolist(), _digits(step))


def listed(label: str, value: float, values: Sequence[float], decimals: int) -> Any:
    """Return a slider that can play, with the given values."""
    options = [(numbers(x, decimals), x) for x in values]
    return ipywidgets.SelectionSlider(options=options, value=value, description=label, **_LOOK)


def choice(label: str, options: list[str]) -> Any:
    """Return a row of buttons for one choice; the first option is chosen initially."""
    style = {**_WIDE, "button_width": "auto"}
    return ipywidgets.ToggleButtons(options=options, description=label, style=style)


def menu(label: str, options: list[str]) -> Any:
    """Return a menu for one choice of many options; the first option is chosen initially."""
    return ipywidgets.Dropdown(options=options, description=label, **_LOOK)


def _digits(step: float) -> int:
    return len(f"{step:g}".partition(".")[2])
