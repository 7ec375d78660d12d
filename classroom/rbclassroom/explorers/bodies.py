"""The explorer of real bodies: a book that is turned by three laws."""

from functools import lru_cache
from typing import Any

import numpy as np

from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, look, new_figure, new_line, new_space, numbers
from rbclassroom.figures.lesson13 import LOOKS, torques
from rbcourse import (
    Array,
    Curve,
    acceleration_cost,
    exp_so3,
    minimum_acceleration_so3,
    minimum_torque_so3,
    pose_from_components,
    torque_cost,
)
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.metrics import box_inertia

_TIMES = np.linspace(0, 1, 61)
_LENGTH, _WIDTH = 0.30, 0.20
_SCALE = 4.2
_STRONGEST = 0.3
_AXES = {
    "z, through the covers": np.eye(3)[2],
    "the diagonal x + y + z": np.ones(3) / np.sqrt(3),
    "x, along the spine": np.eye(3)[0],
    "y, across the cover": np.eye(3)[1],
}


def body_explorer() -> Explorer:
    """Return an explorer of a book of 1 kg that is turned from rest to rest in 1 s.

    It turns by the optimum for a ball, by least acceleration, and by least torque. Controls: the
    axis of the displacement, ``about``; the ``turn`` in degrees; the ``thickness`` of the book in
    cm; and the time ``t``, which plays (beyond BK 3, beyond BK 4).
    """
    with look():
        fig = new_figure()
        artists: dict[str, Any] = {}
        for k, (law, style) in enumerate(LOOKS.items()):
            space = new_space(fig, (k / 3 - 0.05, 0.41, 0.43, 0.53), 0.8)
            artists[law] = draw_box(space, np.eye(4), 1.0)
            fig.text((k + 0.5) / 3, 0.92, law, color=style["color"], ha="center")
        ax = fig.add_axes((0.13, 0.15, 0.83, 0.28))
        ax.set(xlim=(0, 1), ylim=(0, _STRONGEST), xlabel="time (s)", ylabel="torque (N m)")
        ax.set_yticks([0, 0.1, 0.2, 0.3])
        artists["now"] = ax.axvline(0, color="0.6", lw=1)
        for law, style in LOOKS.items():
            artists[f"{law} torque"] = new_line(ax, **style)
    controls = {
        "about": widgets.menu("turned about", list(_AXES)),
        "turn": widgets.slider("turn (°)", 150, 5, 175, 5),
        "thickness": widgets.slider("thickness (cm)", 3, 1, 30, 1),
        "t": widgets.stepped("time (s)", 0.0, 0.0, 1.0, 0.02),
    }

    def show(about: str, turn: float, thickness: float, t: float) -> dict[str, str]:
        edges = np.array([_LENGTH, _WIDTH, thickness / 100])
        curves, efforts, costs = _solved(about, turn, thickness)
        for law, curve in curves.items():
            move_box(artists[law], pose_from_components(curve(t), np.zeros(3)), _SCALE * edges)
            artists[f"{law} torque"].set_data(_TIMES, efforts[law])
        artists["now"].set_xdata([t, t])
        return {
            name: f"{numbers(np.array(of_laws) / min(of_laws), 2)} × the least"
            for name, of_laws in costs.items()
        }

    return Explorer("A book turned by three laws", fig, artists, controls, show, plays="t")


@lru_cache(maxsize=64)
def _solved(
    about: str, turn: float, thickness: float
) -> tuple[dict[str, Curve], dict[str, Array], dict[str, list[float]]]:
    G = box_inertia([_LENGTH, _WIDTH, thickness / 100])
    rest = np.zeros(3)
    ends = np.eye(3), exp_so3(np.radians(turn) * _AXES[about]), rest, rest
    curves: dict[str, Curve] = dict(
        zip(
            LOOKS,
            (
                minimum_acceleration_so3(*ends),
                minimum_acceleration_so3(*ends, G),
                minimum_torque_so3(*ends, G),
            ),
            strict=True,
        )
    )
    efforts = {
        law: np.linalg.norm(torques(curve, G, _TIMES), axis=-1) for law, curve in curves.items()
    }
    costs = {
        "acceleration": [float(acceleration_cost(curve, G)) for curve in curves.values()],
        "torque": [float(torque_cost(curve, G)) for curve in curves.values()],
    }
    return curves, efforts, costs
