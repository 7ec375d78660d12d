"""Explorers of optimal motions, beside closed forms and beside optima of other costs."""

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.integrate import cumulative_simpson

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, apart, new_figure, new_line, new_space, numbers
from rbclassroom.figures import FORMS
from rbclassroom.figures.lesson13 import LOOKS, torques
from rbcourse.draw.bodies import draw_box, draw_ground, move_box
from rbcourse.draw.save import COLOURS, PALE

Solved = tuple[list[rb.Curve], dict[str, str]]

_TIMES = np.linspace(0, 1, 61)
_COST_TIMES = np.linspace(0, 1, 101)
_SIGMA = np.pi / 6 * np.array([1, 2, 3])
_SIDE = 3.5
_LOW, _HIGH = np.array([-2.0, -2, -2]), np.array([10.0, 12, 15])
_BOX = np.array([1.3, 0.8, 0.25])
_OUTLINE: Any = {"colours": 7 * ["none"], "linewidth": 1.5}
_WAYS = {"optimum": "-", "projection": "--"}
_LENGTH, _WIDTH = 0.30, 0.20
_SCALE = 4.2
_AXES = {
    "z, through the covers": np.eye(3)[2],
    "the diagonal x + y + z": np.ones(3) / np.sqrt(3),
    "x, along the spine": np.eye(3)[0],
    "y, across the cover": np.eye(3)[1],
}
_COSTS = {"acceleration": rb.acceleration_cost, "torque": rb.torque_cost}


def minimum_acceleration_explorer() -> Explorer:
    """Return an explorer of the paper's example: the optimum and a closed form, and their costs.

    Both curves run from I to exp(s σ), with ω(0) = s σ, ω(1) = s σ + k e₁, and the σ of BK (21).
    The box follows the optimum, and its pink outline follows the closed form (BK 1, BK (18),
    BK (19), BK (21), BK 6.2, BK Fig. 4).
    """
    with new_figure() as fig:
        ax = fig.add_axes((0.12, 0.18, 0.46, 0.78))
        ax.set(xlim=(0, 1), ylim=(-1.2, 2.6), xlabel="time $t$", ylabel=r"$\sigma$ (rad)")
        ax.set(xticks=[0, 0.5, 1], yticks=[-1, 0, 1, 2])
        artists: dict[str, Any] = {}
        for way, dash in (("optimum", "-"), ("rival", "--")):
            for axis in "xyz":
                artists[f"{way} {axis}"] = new_line(ax, color=COLOURS[axis], ls=dash)
        for i, axis in enumerate("xyz", start=1):
            look: Any = {"color": COLOURS[axis], "va": "center"}
            artists[f"sigma{i}"] = ax.text(1.03, 0, rf"$\sigma_{i}$", **look)
        artists["now"] = ax.axvline(0, color=PALE, lw=1)
        space = new_space(fig, (0.585, 0.165, 0.51, 0.75), 1.0)
        for way in ("optimum", "rival"):
            artists[f"{way} box"] = draw_box(space, np.eye(4), _BOX)
        artists["rival box"].set(edgecolor=COLOURS["projection"], **_OUTLINE)
        fig.text(0.83, 0.88, "optimum: full lines", ha="center")
        fig.text(0.8, 0.15, "closed form: dashed, pink", ha="center", color=COLOURS["projection"])
    controls = {
        "rival": widgets.menu("closed form", list(FORMS)),
        "size": widgets.slider("size s (1: paper's)", 1.0, 0.05, 1.5, 0.05),
        "t": widgets.slider("time t", 0.5, 0.0, 1.0, 0.01),
        "k": widgets.stepped("k (rad/time)", 3.0, -6.0, 6.0, 0.25),
    }

    def show(rival: str, size: float, t: float, k: float) -> dict[str, str]:
        curves, said = _solved_rotations(rival, size, k)
        for way, curve in zip(("optimum", "rival"), curves, strict=True):
            for axis, line in zip("xyz", rb.log_so3(curve(_TIMES)).T, strict=True):
                artists[f"{way} {axis}"].set_data(_TIMES, line)
            move_box(artists[f"{way} box"], rb.pose_from_components(curve(t), np.zeros(3)), _BOX)
        artists["now"].set_xdata([t, t])
        # the labels must not overlap
        heights = size * _SIGMA[1] + max(size, 0.5) * (_SIGMA - _SIGMA[1])
        for i, height in enumerate(heights, start=1):
            artists[f"sigma{i}"].set_position((1.03, height))
        return {**said, "apart at most": apart(*(curve(_TIMES) for curve in curves))}

    return Explorer("Minimum acceleration", fig, artists, controls, show, plays="k", seconds=6)


def cube_explorer() -> Explorer:
    """Return an explorer of Figure 5: one cube follows the optimum, another the projection.

    A black outline shows the optimum around the projection, too, and texts show the costs of the
    rotations until the time t, in rad². The boundary conditions are those of the paper, but three
    of them can be changed. The goal has a pale colour (BK 6.3, BK (14), BK Fig. 5).
    """
    with new_figure() as fig:
        artists: dict[str, Any] = {}
        for (way, dash), left in zip(_WAYS.items(), (0.0, 0.5), strict=True):
            ax: Any = fig.add_axes((left - 0.09, 0.03, 0.65, 0.95), projection="space")
            ax.fit(_LOW, _HIGH, zoom=1.04)
            ax.view_init(elev=18, azim=-22)
            draw_ground(ax, _LOW, _HIGH)
            for name, end, far in zip("xyz", 5 * np.eye(3), (1.5, 1.2, 1.2), strict=True):
                ax.plot(*np.outer(end, [0, 1]), color=PALE, lw=1.5, zorder=0)
                ax.text(*(far * end), f"${name}$", color="0.5", ha="center", va="center")
            artists[f"{way} way"] = new_line(ax, color="black", lw=1, ls=dash)
            artists |= {name: draw_box(ax, np.eye(4), _SIDE) for name in (f"{way} goal", way)}
            artists[f"{way} goal"].set_alpha(0.25)
            fig.text(left + 0.25, 0.94, way, ha="center")
            artists[f"{way} cost"] = fig.text(left + 0.25, 0.87, "", ha="center")
        artists["difference"] = draw_box(ax, np.eye(4), _SIDE)
        artists["difference"].set(edgecolor=COLOURS["optimum"], **_OUTLINE)
        artists["projection"].set_edgecolor(COLOURS["projection"])
        fig.text(0.25, 0.02, "axes: 5 m long", ha="center")
        fig.text(0.75, 0.02, "black: the optimum", ha="center")
    controls = {
        "turn": widgets.slider("turn (1: paper's)", 1.0, 0.0, 1.15, 0.05),
        "spin": widgets.slider("ω₃(1) (rad/time)", 1.0, -6.0, 6.0, 0.25),
        "rise": widgets.slider("ḋ₃(1) (m/time)", 3.0, -20.0, 20.0, 1.0),
        "t": widgets.stepped("time t", 0.5, 0.0, 1.0, 0.01),
    }

    def show(turn: float, spin: float, rise: float, t: float) -> dict[str, str]:
        curves, said = _solved_poses(turn, spin, rise)
        now = round(t * (len(_COST_TIMES) - 1))
        for way, curve, spent in zip(_WAYS, curves, _spent(turn, spin, rise), strict=True):
            artists[f"{way} cost"].set_text(f"cost until now: {spent[now]:.1f}")
            artists[f"{way} way"].set_data_3d(*curve(_TIMES)[:, :3, 3].T)
            move_box(artists[f"{way} goal"], curve(1.0), _SIDE)
            move_box(artists[way], curve(t), _SIDE)
        move_box(artists["difference"], curves[0](t), _SIDE)
        return {**said, "apart now": apart(*(curve(t)[:3, :3] for curve in curves))}

    return Explorer("The cube of Figure 5", fig, artists, controls, show, plays="t")


def body_explorer() -> Explorer:
    """Return an explorer of a book of 1 kg that is turned from rest to rest in 1 s.

    It shows three motions: the optimum for a ball, the motion of least acceleration, and the motion
    of least torque (beyond BK 3, beyond BK 4).
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
        curves, efforts, costs = _solved_turns(about, turn, thickness)
        for law, curve, effort in zip(LOOKS, curves, efforts, strict=True):
            pose = rb.pose_from_components(curve(t), np.zeros(3))
            move_box(artists[law], pose, _SCALE * edges)
            artists[f"{law} torque"].set_data(_TIMES, effort)
        artists["now"].set_xdata([t, t])
        shares = {name: np.array(of_laws) / min(of_laws) for name, of_laws in costs.items()}
        return {name: f"{numbers(share, 2)} × the least" for name, share in shares.items()}

    return Explorer("A book turned in three ways", fig, artists, controls, show, plays="t")


@lru_cache(maxsize=64)
def _solved_rotations(rival: str, size: float, k: float) -> Solved:
    """Solve the problem of BK (21) with another size and another k."""
    ends, best = _best_rotation(size, k)
    return _compared(rival, best, FORMS[rival](*ends))


@lru_cache(maxsize=256)
def _best_rotation(size: float, k: float) -> tuple[tuple[rb.Array, ...], rb.Curve]:
    """Return the ends and the optimum, which are the same for all rivals."""
    sigma = size * _SIGMA
    ends = np.eye(3), rb.exp_so3(sigma), sigma, sigma + k * np.eye(3)[0]
    return ends, rb.minimum_acceleration(*ends)


@lru_cache(maxsize=64)
def _solved_poses(turn: float, spin: float, rise: float) -> Solved:
    """Solve the problem of BK 6.3 with these three changes."""
    sigma = turn * np.pi / 6 * np.array([1, 4, 3])
    goal = rb.pose_from_coordinates([*sigma, 8, 10, 12])
    w, d_dot = np.array([[1, 2, 3], [2, 1, spin]]), np.array([[1, 1, 1], [1, 5, rise]])
    poses = np.stack([np.eye(4), goal])
    ends = *poses, *rb.twist_from_rates(poses, w, d_dot)
    best = rb.minimum_acceleration(*ends)
    return _compared("projection", best, rb.projected_cubic(*ends))


@lru_cache(maxsize=64)
def _spent(turn: float, spin: float, rise: float) -> rb.Array:
    """Return the costs of the rotation until each time, shape (2, times), for both curves."""
    curves, _ = _solved_poses(turn, spin, rise)
    rates = [curve.state(_COST_TIMES).acceleration[:, :3] for curve in curves]
    costs = [w @ curve.body.inertia * w for w, curve in zip(rates, curves, strict=True)]
    spent: rb.Array = cumulative_simpson(np.sum(costs, axis=-1), x=_COST_TIMES, initial=0)
    return spent


def _compared(rival: str, *curves: rb.Curve) -> Solved:
    """Return the optimum and the closed form, and the texts about their costs."""
    low, high = (float(rb.acceleration_cost_parts(curve)[0]) for curve in curves)
    if low > 1e-12:
        ratio = numbers(high / low, 3)
    else:
        ratio = "none: the optimum costs nothing" if high > 1e-12 else "none: both cost nothing"
    costs = {"optimum": low, rival: high}
    said = {f"cost, {way}": f"{numbers(cost, 3)} rad²" for way, cost in costs.items()}
    return list(curves), {**said, "their ratio": ratio}


@lru_cache(maxsize=64)
def _solved_turns(about: str, turn: float, thickness: float) -> Any:
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
