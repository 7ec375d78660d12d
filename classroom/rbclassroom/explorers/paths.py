"""The explorer of a motion through four poses."""

from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS

POSES = rb.pose_from_coordinates(
    [
        [0.0, 0.0, 0.0, -1.1, -1.4, -0.7],
        [0.0, 0.9, 0.8, -0.8, 0.1, 0.9],
        [0.8, 0.4, 1.8, 1.1, -0.2, 0.0],
        [0.0, 0.6, 2.8, 1.4, 1.0, 1.0],
    ]
)
"""Four poses: σ in rad and d in m."""
SHARES = np.array([0.0, 0.35, 0.65, 1.0])
"""When each is reached, of the whole time."""
LEGS: dict[str, Any] = {
    "geodesics": rb.geodesic_se3,
    "projected cubics": rb.projected_cubic_se3,
    "optima": rb.minimum_acceleration_se3,
    "projected quintics": rb.projected_quintic_so3,
}
_EDGES = np.array([0.9, 0.6, 0.3])
_LONGEST = 12.0
_WAYS = {"angular speed (rad/s)": 2.5, "speed (m/s)": 3.5}


def chain_explorer() -> Explorer:
    """Return an explorer of a box on its way through four poses.

    Controls: the ``leg``, a curve with its name; ``share``, the velocities at the two poses between
    as a share of Bessel's, of which geodesics have no need; the ``duration`` of the whole in s; and
    the time ``t`` in [0, 1], as a share of it, which plays (BK 6.3).
    """
    with new_figure() as fig:
        space = new_space(fig, (-0.08, -0.1, 0.74, 1.2), 2.05)
        artists: dict[str, Any] = {
            "way": new_line(space, color=COLOURS["path"]),
            "poses": new_line(space, color=COLOURS["reference"], marker="o", ls=""),
            "box": draw_box(space, POSES[0], _EDGES),
        }
        artists["poses"].set_data_3d(*POSES[:, :3, 3].T)
        for i, (name, high) in enumerate(_WAYS.items()):
            ax = fig.add_axes((0.66, 0.62 - 0.48 * i, 0.32, 0.29))
            ax.set(xlim=(0, _LONGEST), ylim=(0, high), xticks=[0, 4, 8, 12], title=name)
            artists |= {
                f"{name} joints": ax.vlines([], 0, high, color="0.7", lw=1, ls=":"),
                name: new_line(ax, color=COLOURS["path"]),
                f"{name} now": new_line(ax, color=COLOURS["optimum"], marker="o", ls=""),
            }
        ax.set_xlabel("time (s)")
    controls = {
        "leg": widgets.menu("joined by", list(LEGS)),
        "share": widgets.slider("× Bessel's ω, v", 1.0, 0.0, 1.5, 0.1),
        "duration": widgets.slider("duration (s)", 6.0, 4.0, _LONGEST, 0.5),
        "t": widgets.stepped("time t", 0.0, 0.0, 1.0, 0.01),
    }

    def show(leg: str, share: float, duration: float, t: float) -> dict[str, str]:
        knots = duration * SHARES
        velocities = share * rb.bessel_velocities(knots, POSES) * [[0], [1], [1], [0]]
        controls["share"].disabled = rested = leg == "geodesics"
        motion = rb.chain(knots, POSES, None if rested else velocities, leg=LEGS[leg])
        times, now = np.linspace(0, duration, 241), t * duration
        artists["way"].set_data_3d(*motion(times)[:, :3, 3].T)
        move_box(artists["box"], motion(now), _EDGES)
        speeds, here = _norms(motion(times, 1)), _norms(motion(now, 1))
        for i, (name, high) in enumerate(_WAYS.items()):
            artists[name].set_data(times, speeds[:, i])
            artists[f"{name} now"].set_data([now], here[:, i])
            artists[f"{name} joints"].set_segments([[(k, 0), (k, high)] for k in knots[1:-1]])
        fastest, strongest = speeds.max(axis=0), _norms(motion(times, 2)).max(axis=0)
        jumps = [_norms(motion.jumps(order))[:, 0].max() for order in (1, 2)]
        return {
            "fastest": f"{numbers(fastest[0], 2)} rad/s, {numbers(fastest[1], 2)} m/s",
            "strongest": f"{numbers(strongest[0], 2)} rad/s², {numbers(strongest[1], 2)} m/s²",
            "ω jumps": f"by {numbers(jumps[0], 2)} rad/s",
            "ω′ jumps": f"by {numbers(jumps[1], 2)} rad/s²",
        }

    return Explorer("Through four poses", fig, artists, controls, show, plays="t", seconds=6.0)


def _norms(vectors: rb.Array) -> rb.Array:
    """Return the norms of both halves of vectors with six entries, shape (n, 2)."""
    return np.linalg.norm(vectors.reshape(-1, 2, 3), axis=-1)
