"""The explorer of real bodies: a book that is turned in three ways."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbclassroom.figures.lesson13 import LOOKS, torques
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import PALE

_TIMES = np.linspace(0, 1, 61)
_LENGTH, _WIDTH = 0.30, 0.20
_SCALE = 4.2
_AXES = {
    "z, through the covers": np.eye(3)[2],
    "the diagonal x + y + z": np.ones(3) / np.sqrt(3),
    "x, along the spine": np.eye(3)[0],
    "y, across the cover": np.eye(3)[1],
}
_COSTS = {"acceleration": rb.acceleration_cost, "torque": rb.torque_cost}


def body_explorer() -> Explorer:
    """Return an explorer of a book of 1 kg that is turned from rest to rest in 1 s.

    It shows three motions: the optimum for a ball, the motion of least acceleration, and the motion
    of least torque. The controls are ``about`` (the axis of the displacement), the ``turn`` in
    degrees, the ``thickness`` of the book in cm, and the time ``t``, which the play button moves
    (beyond BK 3, beyond BK 4).
    """
    artists: dict[str, Any] = {}
    with new_figure() as fig:
        for k, (law, style) in enumerate(LOOKS.items()):
            space = new_space(fig, (k / 3 - 0.063, 0.428, 0.459, 0.566), 0.8)
            artists[law] = draw_box(space, np.eye(4), 1.0)
            fig.text((k + 0.5) / 3, 0.94, law, color=style["color"], ha="center")
        ax = fig.add_axes((0.13, 0.092, 0.83, 0.39))
        ax.set(xlim=(0, 1), ylim=(0, 0.2), xlabel="time (s)", ylabel="torque (N m)")
        ax.set_yticks([0, 0.1, 0.2])
        ax.set_xticks([0, 0.5, 1], ["0", "", "1"])
        ax.xaxis.set_label_coords(0.5, -0.035)  # between two numbers, which leaves more room
        artists["now"] = ax.axvline(0, color=PALE, lw=1)
        artists |= {f"{law} torque": new_line(ax, **style) for law, style in LOOKS.items()}
    controls = {
        "about": widgets.menu("turned about", list(_AXES)),
        "turn": widgets.slider("turn (°)", 150, 5, 175, 5),
        "thickness": widgets.slider("thickness (cm)", 3, 1, 15, 1),
        "t": widgets.stepped("time (s)", 0.5, 0.0, 1.0, 0.02),
    }

    def show(about: str, turn: float, thickness: float, t: float) -> dict[str, str]:
        edges = np.array([_LENGTH, _WIDTH, thickness / 100])
        curves, efforts, costs = _solved(about, turn, thickness)
        for law, curve, effort in zip(LOOKS, curves, efforts, strict=True):
            pose = rb.pose_from_components(curve(t), np.zeros(3))
            move_box(artists[law], pose, _SCALE * edges)
            artists[f"{law} torque"].set_data(_TIMES, effort)
        artists["now"].set_xdata([t, t])
        shares = {name: np.array(of_laws) / min(of_laws) for name, of_laws in costs.items()}
        return {name: f"{numbers(share, 2)} × the least" for name, share in shares.items()}

    return Explorer("A book turned in three ways", fig, artists, controls, show, plays="t")


@lru_cache(maxsize=64)
def _solved(about: str, turn: float, thickness: float) -> Any:
    book = rb.Body.box([_LENGTH, _WIDTH, thickness / 100])
    ends = np.eye(3), rb.exp_so3(np.radians(turn) * _AXES[about])
    curves: list[rb.Curve] = [
        rb.minimum_acceleration(*ends),
        rb.minimum_acceleration(*ends, body=book),
        rb.minimum_torque(*ends, body=book),
    ]
    efforts = [np.linalg.norm(torques(c, book.inertia, _TIMES), axis=-1) for c in curves]
    costs = {name: [float(cost(c, body=book)) for c in curves] for name, cost in _COSTS.items()}
    return curves, efforts, costs
