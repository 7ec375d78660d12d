"""Explorers of motions through many rotations or poses."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.spheres import draw_sphere

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
"""The times of the four poses, as fractions of the duration."""
JOINED = ["geodesics", "cubics, parabolas", "cubics, spline", "the optimum"]
EDGES = np.array([0.9, 0.6, 0.3])
"""The edges of the box in m."""
_LONGEST = 12.0
_WAYS = {"angular speed (rad/s)": 2.5, "speed (m/s)": 3.5}

ANGLES = np.array([[-60.0, 0, 0], [-10, 40, 0], [50, -20, 30], [90, 20, 0]])
"""Yaw, pitch and roll of four orientations, in degrees."""
KINDS = {"parabolas": "z", "spline": "path"}
_STEEPEST = 8.0
_BETWEEN = np.linspace(0, 1, 25)


def spline_explorer() -> Explorer:
    """Return an explorer of two curves through four rotations, with their accelerations over time.

    Both curves are projected cubics. The left curve has the velocities of parabolas, the right
    curve those of the spline. On each sphere of directions, a line is the path of the first body
    axis, a short stroke shows the third axis, and dots are the given orientations. Below each
    sphere, a line shows ‖ω′‖ up to the present time. The controls are the ``ends`` ("natural" or
    "at rest"), the ``pitch`` of the third orientation in degrees, its time ``third`` in s, and the
    time ``t`` in s, which the play button moves (beyond BK 12, beyond BK 13).
    """
    with new_figure() as fig:
        artists: dict[str, Any] = {}
        for i, (kind, colour) in enumerate(KINDS.items()):
            ax: Any = fig.add_axes((0.48 * i + 0.06, 0.4, 0.48, 0.54), projection="space")
            draw_sphere(ax)
            ax.view_init(elev=20, azim=12)
            below = fig.add_axes((0.11 + 0.48 * i, 0.18, 0.38, 0.21))
            below.set(xlim=(0, 4), ylim=(0, _STEEPEST), xticks=[0, 1, 2, 3, 4], yticks=[0, 3, 6])
            below.set_xlabel("time (s)")
            below.tick_params(labelleft=i == 0)
            look: Any = {"color": COLOURS[colour]}
            fig.text(0.3 + 0.48 * i, 0.94, kind, ha="center", **look)
            dot: Any = {"color": "black", "marker": "o", "ls": "", "clip_on": False}
            artists |= {
                f"{kind} path": new_line(ax, **look, lw=2),
                f"{kind} given": new_line(ax, color=COLOURS["reference"], marker="o", ls="", ms=7),
                f"{kind} up": new_line(ax, color="black", lw=2.5),
                f"{kind} now": new_line(ax, color="black", marker="o", ls="", ms=5),
                f"{kind} joints": below.vlines([], 0, _STEEPEST, color=PALE, lw=1, ls=":"),
                f"{kind} ‖ω′‖": new_line(below, **look),
                f"{kind} ‖ω′‖ now": new_line(below, **dot),
            }
        fig.text(0.02, 0.42, r"$\Vert\omega'\Vert$ (rad/s²)")
    controls = {
        "ends": widgets.choice("ends", ["natural", "at rest"]),
        "pitch": widgets.slider("third pitch (°)", -40.0, -60.0, 60.0, 5.0),
        "third": widgets.slider("third time (s)", 2.0, 2.0, 3.0, 0.1),
        "t": widgets.stepped("time t (s)", 0.6, 0.0, 4.0, 0.05),
    }

    def show(ends: str, pitch: float, third: float, t: float) -> dict[str, str]:
        times, R, curves, shares = _two_splines(ends, pitch, third)
        said = {}
        for kind, (curve, inside, path, a) in zip(KINDS, curves, strict=True):
            now = curve(t)
            artists[f"{kind} path"].set_data_3d(*path[:, :, 0].T)
            artists[f"{kind} given"].set_data_3d(*R[:, :, 0].T)
            artists[f"{kind} up"].set_data_3d(*(now[:, :1] + now[:, 2:] * [0, 0.35]))
            artists[f"{kind} now"].set_data_3d(*now[:, :1])
            lines = [[(x, 0), (x, _STEEPEST)] for x in times[1:-1]]
            artists[f"{kind} joints"].set_segments(lines)
            artists[f"{kind} ‖ω′‖"].set_data(inside[inside <= t], a[inside <= t])
            artists[f"{kind} ‖ω′‖ now"].set_data([t], [np.linalg.norm(curve(t, 2))])
            jumps = np.linalg.norm(curve.jumps(2), axis=1)[times[1:-1] <= t]
            jumped = f"by {numbers(jumps, 2)} rad/s²" if len(jumps) else "not yet"
            said[f"{kind}: ω′ jumps"] = jumped
        for kind, share in zip(KINDS, shares, strict=True):
            said[f"{kind}: cost"] = f"{numbers(share, 3)} × the least"
        return said

    name = "Four orientations, two curves"
    return Explorer(name, fig, artists, controls, show, plays="t")


@lru_cache(maxsize=64)
def _two_splines(ends: str, pitch: float, third: float) -> tuple[Any, ...]:
    """Return times and rotations, the drawn data of each curve, and costs divided by the least."""
    times, angles = np.array([0, 1, third, 4]), ANGLES.copy()
    angles[2, 1] = pitch
    R = rb.matrix_from_zyx(np.radians(angles))
    conditions: Any = "rest" if ends == "at rest" else "natural"
    w = rb.bessel_velocities(times, R)
    w[[0, -1]] *= ends == "natural"
    starts, h = times[:-1, None], np.diff(times)[:, None]
    # times on both sides of each knot
    inside = np.nextafter(starts + h * _BETWEEN, starts).ravel()
    inside[:: len(_BETWEEN)] = times[:-1]
    splines = rb.chain(times, R, w), rb.projected_spline(times, R, conditions)
    curves = [(c, inside, c(inside), np.linalg.norm(c(inside, 2), axis=-1)) for c in splines]
    least = rb.minimum_acceleration_spline(times, R, conditions).cost
    return times, R, curves, [rb.acceleration_cost(c) / least for c in splines]


def chain_explorer() -> Explorer:
    """Return an explorer of a box that moves through four poses.

    The controls are the ``curve``, the ``duration`` of the motion in s, and the time ``t`` as a
    fraction of the duration, which the play button moves. There are four curves: geodesics,
    projected cubics with the velocities of parabolas, projected cubics with the velocities of the
    spline, and the optimum. All except the geodesics are at rest at both ends (BK 6.3, beyond BK
    14).
    """
    with new_figure() as fig:
        space = new_space(fig, (-0.06, -0.1, 0.74, 1.2), 2.15)
        artists: dict[str, Any] = {
            "way": new_line(space, color=COLOURS["path"]),
            "poses": space.plot(*POSES[:, :3, 3].T, "o", color=COLOURS["reference"])[0],
            "box": draw_box(space, POSES[0], EDGES),
        }
        for i, (name, high) in enumerate(_WAYS.items()):
            ax = fig.add_axes((0.66, 0.64 - 0.46 * i, 0.31, 0.27))
            ax.set(xlim=(0, _LONGEST), ylim=(0, high), xticks=[0, 4, 8, 12], title=name)
            artists |= {
                f"{name} joints": ax.vlines([], 0, high, color=PALE, lw=1, ls=":"),
                name: new_line(ax, color=COLOURS["path"]),
                f"{name} now": new_line(ax, color="black", marker="o", ls="", clip_on=False),
            }
        ax.set_xlabel("time (s)")
    controls = {
        "curve": widgets.menu("joined by", JOINED),
        "duration": widgets.slider("duration (s)", 6.0, 4.0, _LONGEST, 0.5),
        "t": widgets.stepped("time t", 0.5, 0.0, 1.0, 0.01),
    }

    def show(curve: str, duration: float, t: float) -> dict[str, str]:
        motion, times, path, speeds, texts = _through_poses(curve, duration)
        now, knots = t * duration, duration * SHARES
        artists["way"].set_data_3d(*path.T)
        move_box(artists["box"], motion(now), EDGES)
        here = _norms(motion(now, 1))
        for i, (name, high) in enumerate(_WAYS.items()):
            artists[name].set_data(times, speeds[:, i])
            artists[f"{name} now"].set_data([now], here[:, i])
            artists[f"{name} joints"].set_segments([[(k, 0), (k, high)] for k in knots[1:-1]])
        return texts

    return Explorer("Through four poses", fig, artists, controls, show, plays="t", seconds=6.0)


@lru_cache(maxsize=64)
def _through_poses(curve: str, duration: float) -> tuple[Any, ...]:
    """Return the motion, times with its positions and speeds, and the texts."""
    knots, times = duration * SHARES, np.linspace(0, duration, 241)
    motion, best = _joined(curve, knots), _joined(JOINED[-1], knots)
    speeds = _norms(motion(times, 1))
    fastest, strongest = speeds.max(axis=0), _norms(motion(times, 2)).max(axis=0)
    jumps = [_norms(motion.jumps(order))[:, 0].max() for order in (1, 2)]
    cost = "infinite: ω jumps"
    if curve != JOINED[0]:
        costs = [rb.acceleration_cost_parts(c)[0] for c in (motion, best)]
        cost = f"{numbers(costs[0] / costs[1], 3)} × the least"
    texts = {
        "fastest": f"{numbers(fastest[0], 2)} rad/s, {numbers(fastest[1], 2)} m/s",
        "strongest": f"{numbers(strongest[0], 2)} rad/s², {numbers(strongest[1], 2)} m/s²",
        "ω jumps": f"by {numbers(jumps[0], 2)} rad/s",
        "ω′ jumps": f"by {numbers(jumps[1], 2)} rad/s²",
        "cost of turning": cost,
    }
    return motion, times, motion(times)[:, :3, 3], speeds, texts


def _joined(curve: str, knots: rb.Array) -> Any:
    if curve == JOINED[0]:
        return rb.chain(knots, POSES, leg=rb.geodesic)
    if curve == JOINED[1]:
        w = rb.bessel_velocities(knots, POSES) * [[0], [1], [1], [0]]
        return rb.chain(knots, POSES, w)
    spline = rb.projected_spline if curve == JOINED[2] else rb.minimum_acceleration_spline
    return spline(knots, POSES, "rest")


def _norms(vectors: rb.Array) -> rb.Array:
    """Return the norms of both halves of vectors with six entries, shape (n, 2)."""
    return np.linalg.norm(vectors.reshape(-1, 2, 3), axis=-1)
