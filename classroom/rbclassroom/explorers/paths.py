"""The explorer of a motion through four poses."""

from typing import Any

import numpy as np

from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, look, new_figure, new_line, new_space, numbers
from rbcourse import (
    Array,
    Chain,
    Curve,
    bessel_velocities,
    chain,
    geodesic_se3,
    minimum_acceleration_se3,
    pose_from_coordinates,
    projected_cubic_se3,
    projected_quintic_so3,
)
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS

POSES = pose_from_coordinates(
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
    "geodesics": geodesic_se3,
    "projected cubics": projected_cubic_se3,
    "optima": minimum_acceleration_se3,
    "projected quintics": projected_quintic_so3,
}
_EDGES = np.array([0.9, 0.6, 0.3])
_LONGEST = 12.0
_SAMPLES = 241
_WAYS = {"angular speed (rad/s)": 2.5, "speed (m/s)": 3.5}


def chain_explorer() -> Explorer:
    """Return an explorer of a box on its way through four poses.

    Controls: the ``leg``, a curve with its name; ``share``, the velocities at the two poses between
    as a share of Bessel's, of which geodesics have no need; the ``duration`` of the whole in s; and
    the time ``t`` in [0, 1], as a share of it, which plays (BK 6.3).
    """
    with look():
        fig = new_figure()
        space = new_space(fig, (-0.08, -0.1, 0.74, 1.2), 2.05)
        artists: dict[str, Any] = {
            "way": new_line(space, color=COLOURS["path"]),
            "poses": new_line(space, color=COLOURS["reference"], marker="o", ls=""),
            "box": draw_box(space, POSES[0], _EDGES),
        }
        artists["poses"].set_data_3d(*POSES[:, :3, 3].T)
        for i, (name, high) in enumerate(_WAYS.items()):
            ax = fig.add_axes((0.66, 0.62 - 0.48 * i, 0.32, 0.29))
            ax.set(xlim=(0, _LONGEST), ylim=(0, high), xticks=[0, 4, 8, 12])
            ax.set_title(name)
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
        motion = four_poses(leg, share, duration)
        controls["share"].disabled = leg == "geodesics"
        times, now = np.linspace(0, duration, _SAMPLES), t * duration
        artists["way"].set_data_3d(*motion(times)[:, :3, 3].T)
        move_box(artists["box"], motion(now), _EDGES)
        speeds, strongest = _norms(motion, times, 1), _norms(motion, times, 2).max(axis=1)
        for name, high, values, here in zip(
            _WAYS, _WAYS.values(), speeds, _norms(motion, np.array([now]), 1), strict=True
        ):
            artists[name].set_data(times, values)
            artists[f"{name} now"].set_data([now], here)
            segments = [[(when, 0), (when, high)] for when in motion.times[1:-1]]
            artists[f"{name} joints"].set_segments(segments)
        jumps = [_largest(motion.jumps(1)), _largest(motion.jumps(2))]
        return {
            "fastest": f"{numbers(speeds[0].max(), 2)} rad/s, {numbers(speeds[1].max(), 2)} m/s",
            "strongest": f"{numbers(strongest[0], 2)} rad/s², {numbers(strongest[1], 2)} m/s²",
            "ω jumps": f"by {numbers(jumps[0], 2)} rad/s",
            "ω′ jumps": f"by {numbers(jumps[1], 2)} rad/s²",
        }

    return Explorer("Through four poses", fig, artists, controls, show, plays="t", seconds=6.0)


def four_poses(leg: str, share: float, duration: float) -> Chain:
    """Return the chain of the explorer, at rest at both ends."""
    times, curve = duration * SHARES, LEGS[leg]
    if curve is geodesic_se3:
        return chain(times, POSES, leg=curve)
    velocities = share * bessel_velocities(times, POSES)
    velocities[[0, -1]] = 0
    return chain(times, POSES, velocities, leg=curve)


def _norms(motion: Curve, times: Array, order: int) -> Array:
    """Return the norms of both halves, shape (2, times)."""
    return np.linalg.norm(motion(times, order).reshape(-1, 2, 3), axis=-1).T


def _largest(jumps: Array) -> Any:
    """Return by how much the turning jumps at most."""
    return np.linalg.norm(jumps[:, :3], axis=-1).max()
