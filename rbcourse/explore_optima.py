"""Explorers of minimum acceleration: the optimum and the projection, solved again at each touch."""

from functools import lru_cache
from typing import Any

import numpy as np

from rbcourse._numerics import Array
from rbcourse.bodies import draw_box, move_box
from rbcourse.cost import acceleration_cost_parts
from rbcourse.curves import Curve
from rbcourse.explorer import Explorer, look, new_figure, new_line, slider
from rbcourse.figures import COLOURS
from rbcourse.motions import projected_cubic_se3
from rbcourse.projected import projected_cubic_so3
from rbcourse.relaxation import minimum_acceleration_se3, minimum_acceleration_so3
from rbcourse.se3 import pose_from_coordinates
from rbcourse.so3 import exp_so3, log_so3

Solved = tuple[dict[str, Curve], dict[str, float]]

_TIMES = np.linspace(0, 1, 61)
_SIGMA = np.pi / 6 * np.array([1, 2, 3])
_SIDE = 2.5
_WAYS = {"optimum": "-", "projection": "--"}


def minimum_acceleration_explorer() -> Explorer:
    """Return an explorer of the paper's example: the optimum and the projection, and their costs.

    From I to exp(s σ), σ as in BK (21), with ω(0) = s σ and ω(1) = s σ + k e₁. Controls: the
    displacement ``s``, the ``extra`` k in rad, and the time ``t`` of the marks, which plays.

    References
    ----------
    BK (18), BK (19), BK (21), BK 6.2, BK Fig. 4.
    """
    with look():
        fig = new_figure()
        ax = fig.add_axes((0.14, 0.15, 0.72, 0.7))
        ax.set(xlim=(0, 1), ylim=(-np.pi, np.pi), xlabel="time t", ylabel="σ (rad)")
        ax.set_yticks([-np.pi, 0, np.pi], ["−π", "0", "π"])
        artists: dict[str, Any] = {}
        for way, dash in _WAYS.items():
            for axis in "xyz":
                artists[f"{way} {axis}"] = new_line(ax, color=COLOURS[axis], ls=dash)
        for way, ms in {"optimum": 11, "projection": 6}.items():
            style: Any = {"color": "black", "marker": "o", "ms": ms, "mfc": "white"}
            artists[f"{way} now"] = new_line(ax, ls="", **style)
        for axis, number in zip("xyz", "₁₂₃", strict=True):
            style = {"color": COLOURS[axis], "va": "center"}
            artists[f"σ{number}"] = ax.text(1.03, 0, f"σ{number}", **style)
        for way, dash in _WAYS.items():
            ax.plot([], [], color="0.3", ls=dash, label=way)
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)
    controls = {
        "s": slider("way s (1)", 1.0, 0.05, 1.5, 0.05),
        "extra": slider("extra ω(1) (rad)", 1.0, -6.0, 6.0, 0.25),
        "t": slider("time t (1)", 0.0, 0.0, 1.0, 0.01),
    }

    def show(s: float, extra: float, t: float) -> dict[str, str]:
        curves, costs = _solved_rotations(s, extra)
        rotations = {}
        for way, curve in curves.items():
            rotations[way] = curve(_TIMES)
            lines, marks = _unbroken(log_so3(rotations[way])), log_so3(curve(t))
            for axis, line in zip("xyz", lines.T, strict=True):
                artists[f"{way} {axis}"].set_data(_TIMES, line)
            artists[f"{way} now"].set_data([t] * 3, marks)
        for number, height in zip("₁₂₃", s * _SIGMA, strict=True):
            artists[f"σ{number}"].set_position((1.03, height))
        return {**_compared(costs), "apart": _apart(rotations)}

    return Explorer("Minimum acceleration", fig, artists, controls, show, plays="t")


def cube_explorer() -> Explorer:
    """Return an explorer of Figure 5: two cubes on their ways, the optimum and the projection.

    The ends are the paper's, but for three that can be changed; pale, the goal. Controls: the
    ``turn``, as a share of the paper's; ``spin``, the last component of ω(1) in rad; ``rise``, that
    of the velocity at the end in m; and the time ``t``, which plays.

    References
    ----------
    BK 6.3, BK (14), BK Fig. 5.
    """
    with look():
        fig = new_figure()
        artists: dict[str, Any] = {}
        for way, left in zip(_WAYS, (0.0, 0.5), strict=True):
            ax: Any = fig.add_axes((left - 0.06, -0.02, 0.62, 0.95), projection="3d")
            ax.set(xlim=(-3, 11), ylim=(-3, 13), zlim=(-4, 14))
            ax.set(xticklabels=[], yticklabels=[], zticklabels=[])
            ax.set_box_aspect((14, 16, 18), zoom=1.0)
            ax.patch.set_visible(False)  # the two overlap a little
            ax.set_proj_type("ortho")
            ax.view_init(elev=18, azim=-22)
            style = {"color": "black", "lw": 1, "ls": _WAYS[way]}
            artists[f"{way} way"] = new_line(ax, **style)
            artists[f"{way} goal"] = draw_box(ax, np.eye(4), _SIDE)
            artists[f"{way} goal"].set_alpha(0.25)
            artists[way] = draw_box(ax, np.eye(4), _SIDE)
            fig.text(left + 0.25, 0.94, way, ha="center")
    controls = {
        "turn": slider("turn (1)", 1.0, 0.0, 1.15, 0.05),
        "spin": slider("ω₃(1) (rad)", 1.0, -6.0, 6.0, 0.25),
        "rise": slider("ḋ₃(1) (m)", 3.0, -20.0, 20.0, 1.0),
        "t": slider("time t (1)", 0.0, 0.0, 1.0, 0.01),
    }

    def show(turn: float, spin: float, rise: float, t: float) -> dict[str, str]:
        curves, costs = _solved_poses(turn, spin, rise)
        for way, curve in curves.items():
            artists[f"{way} way"].set_data_3d(*curve(_TIMES)[:, :3, 3].T)
            move_box(artists[f"{way} goal"], curve(1.0), _SIDE)
            move_box(artists[way], curve(t), _SIDE)
        now = {way: curve(t)[None, :3, :3] for way, curve in curves.items()}
        return {**_compared(costs, "rotation, "), "apart now": _apart(now)}

    return Explorer("The cube of Figure 5", fig, artists, controls, show, plays="t")


@lru_cache(maxsize=1)
def _solved_rotations(s: float, extra: float) -> Solved:
    """Solve BK (21) with these two changed; while only the time runs it stays solved."""
    ends = np.eye(3), exp_so3(s * _SIGMA), s * _SIGMA, s * _SIGMA + extra * np.eye(3)[0]
    return _with_costs(minimum_acceleration_so3(*ends), projected_cubic_so3(*ends))


@lru_cache(maxsize=1)
def _solved_poses(turn: float, spin: float, rise: float) -> Solved:
    """Solve BK 6.3 with these three changed; while only the time runs it stays solved."""
    sigma = turn * np.pi / 6 * np.array([1, 4, 3])
    A0, A1 = np.eye(4), pose_from_coordinates([*sigma, 8, 10, 12])
    ends = A0, A1, [1, 2, 3], [2, 1, spin], [1, 1, 1], [1, 5, rise]
    return _with_costs(minimum_acceleration_se3(*ends), projected_cubic_se3(*ends))


def _with_costs(best: Curve, near: Curve) -> Solved:
    curves = {"optimum": best, "projection": near}
    return curves, {way: float(acceleration_cost_parts(c)[0]) for way, c in curves.items()}


def _unbroken(sigma: Array) -> Array:
    """Return σ over time with a gap where it leaves the ball of radius π and comes in opposite."""
    jumps = np.linalg.norm(np.diff(sigma, axis=0), axis=-1) > np.pi
    return np.where(np.append(jumps, False)[:, None], np.nan, sigma)


def _compared(costs: dict[str, float], prefix: str = "") -> dict[str, str]:
    low, high = costs["optimum"], costs["projection"]
    ratio = f"{high / low:.3f}" if low > 1e-12 else "undefined: both cost nothing"
    return {
        f"{prefix}optimum": f"{low:.3f} rad²",
        f"{prefix}projection": f"{high:.3f} rad²",
        "ratio": ratio,
    }


def _apart(rotations: dict[str, Array]) -> str:
    best, near = rotations["optimum"], rotations["projection"]
    angles = np.linalg.norm(log_so3(np.swapaxes(best, -1, -2) @ near), axis=-1)
    return f"{np.degrees(angles.max()):.1f}°"
