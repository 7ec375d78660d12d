"""Explorers of rotations: representations of one orientation, projections, random rotations."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, apart, new_figure, new_line, new_space, numbers
from rbclassroom.explorers.names import new_name, put_name
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.space import Sight
from rbcourse.draw.spheres import draw_sphere
from rbcourse.sampling import sample_rotation_naive, uniformity_tests

_BOX = np.array([1.3, 0.8, 0.25])
_REACH = float(np.linalg.norm(_BOX)) / 2
_LEAST = 1.05
_ENDS = {
    "first turn": (1.3, 0.65),
    "second turn": (_LEAST, 0.87),
    "third turn": (_LEAST, 0.71),
    "one axis for all": (1.23, 1.03),
}
"""The axes of turns, the distances of their named ends from the origin, and the widths of names."""
_LINE = 0.28  # the height of a name
_SAMPLERS = {"three angles": sample_rotation_naive, "uniform": rb.sample_rotation}
_MOST = 2000
_BINS = np.linspace(-1, 1, 21)


def rotation_explorer() -> Explorer:
    """Return an explorer of orientations: three angles, and other representations.

    The picture shows a box with its axes. Dashed lines are the axes of the three turns: the fixed z
    axis, the y axis after the first turn, and the body's own x axis. A dotted line is the axis of
    the single turn that replaces them (RR 2.1, RR (7), RR (8), RR 2.2, BK 2.5).
    """
    with new_figure() as fig:
        ax = new_space(fig, (-0.15, -0.08, 1.28, 1.15), 1.3)
        sight = ax.sight()
        artists: dict[str, Any] = {"box": draw_box(ax, np.eye(4), _BOX)}
        for axis, name in zip("zyx", _ENDS, strict=False):
            artists[name] = new_line(ax, ls="--", color=COLOURS[axis], lw=1.5)
            artists[f"{name} name"] = new_name(ax, name, color=COLOURS[axis])
        artists["one axis for all"] = new_line(ax, ls=":", color="black", lw=3)
        artists["one axis for all name"] = new_name(ax, "one axis for all")
        artists |= _axes_of(ax, "body", ls="-", lw=3.5)
    controls = {
        "alpha": widgets.slider("yaw α (°)", 20.0, -180.0, 180.0, 1.0),
        "beta": widgets.stepped("pitch β (°)", -20.0, -90.0, 90.0, 1.0),
        "gamma": widgets.slider("roll γ (°)", 20.0, -180.0, 180.0, 1.0),
    }

    def show(alpha: float, beta: float, gamma: float) -> dict[str, str]:
        angles = np.radians([alpha, beta, gamma])
        R = rb.matrix_from_zyx(angles)
        move_box(artists["box"], rb.pose_from_components(R, np.zeros(3)), _BOX)
        _move_axes(artists, "body", R)
        second = rb.matrix_from_zyx(angles * [1, 0, 0])[:, 1]
        r = rb.log_so3(R)
        angle = float(np.linalg.norm(r))
        axis = r / angle if angle > 0 else np.zeros(3)
        turns = np.array([[0, 0, 1], second, R[:, 0], axis])
        # the last name is not at the ends where the other names are
        sides = -1, -1, -1, np.copysign(1, turns[:3].sum(axis=0) @ axis)
        for (name, (far, wide)), side, along in zip(_ENDS.items(), sides, turns, strict=True):
            artists[name].set_data_3d(*np.outer(side * along, [-_LEAST, far]))
            place = _beyond(side * far * along, sight, np.array([wide, _LINE]))
            put_name(artists[f"{name} name"], place)
        artists["one axis for all name"].set_text("one axis for all" if angle > 0 else "")
        said = {
            "matrix": _lines(R),
            "quaternion": numbers(rb.quaternion_from_matrix(R), 2),
            "axis": numbers(axis, 2) if angle > 0 else "any",
            "angle": apart(np.eye(3), R),
        }
        if abs(beta) == 90:
            sign = "−" if beta > 0 else "+"
            left = numbers((alpha - np.sign(beta) * gamma + 180) % 360 - 180, 0)
            said["gimbal lock"] = f"first and third axis coincide,\nα {sign} γ = {left}°"
        return said

    return Explorer("An orientation", fig, artists, controls, show, plays="beta")


def _beyond(end: rb.Array, sight: Sight, size: rb.Array) -> rb.Array:
    """Return the place of a name of this size, beyond an end and, in this view, beside the box."""
    plane = np.stack([sight.right, sight.up])
    seen = plane @ end + [0, 1e-9]  # the name of an axis that points to the eye is above it
    far = float(np.linalg.norm(seen))
    towards = seen / max(far, 1e-9)
    slope = np.abs(towards)
    beyond = max(far + min(size / 2 / np.maximum(slope, 1e-9)), _REACH + size / 2 @ slope)
    place: rb.Array = end + (beyond - far) * towards @ plane
    return place


def projection_explorer() -> Explorer:
    """Return an explorer of a matrix that is not a rotation, and of two methods to repair it.

    Grey lines are the columns of I + pull · E, full lines those of the nearest rotation, and dashed
    lines those of Gram–Schmidt (BK 4, BK Prop. 2, RR 1.4).
    """
    with new_figure() as fig:
        ax = new_space(fig, (-0.4, -0.52, 1.71, 1.71), 2.2)
        artists = {
            **_axes_of(ax, "M", PALE, ls="-", lw=7, zorder=1),
            **_axes_of(ax, "nearest", ls="-", lw=3.5),
            **_axes_of(ax, "Gram–Schmidt", ls="--", lw=2),
        }
        for name in ("M", "nearest", "Gram–Schmidt"):
            artists[f"{name} z"].set_label(name)
        fig.legend(loc="upper right", handlelength=1.6)
    controls = {
        "e12": widgets.slider("y leans", 0.8, -1.0, 1.0, 0.05),
        "e23": widgets.slider("z leans", 0.0, -1.0, 1.0, 0.05),
        "e33": widgets.slider("z stretched", 0.0, -2.0, 1.0, 0.05),
        "pull": widgets.stepped("pull (0 to 1)", 0.6, 0.0, 1.0, 0.01),
    }

    def show(e12: float, e23: float, e33: float, pull: float) -> dict[str, str]:
        M = np.eye(3) + pull * np.array([[0, e12, 0], [0, 0, e23], [0, 0, e33]])
        R, (G, fate) = rb.project_so(M), _gram_schmidt(M)
        for name, matrix in (("M", M), ("nearest", R), ("Gram–Schmidt", G)):
            _move_axes(artists, name, matrix)
        singular = np.linalg.svd(M, compute_uv=False)
        det = float(np.linalg.det(M))
        said = {
            "determinant": numbers(det, 2),
            "singular values": numbers(singular, 2),
            "M to nearest": numbers(np.linalg.norm(M - R), 3),
            "M to Gram–Schmidt": fate or numbers(np.linalg.norm(M - G), 3),
            "angle between": "none" if fate else apart(R, G),
        }
        if singular[1] + np.sign(det) * singular[2] < 1e-9:
            said["nearest?"] = "several are equally near"
        return said

    return Explorer("Two repairs", fig, artists, controls, show, plays="pull")


def _gram_schmidt(M: rb.Array) -> tuple[rb.Array, str]:
    """Return the Gram–Schmidt result for M and, if it is not a rotation, the reason."""
    try:
        G = rb.projection.orthonormalize_gram_schmidt(M)
    except ValueError:
        return np.zeros((3, 3)), "none: M is flat"
    return G, "" if np.linalg.det(G) > 0 else "a mirror"


def random_explorer() -> Explorer:
    """Return an explorer of random rotations: the images of e₁, and tests of uniformity.

    Each seed has a fixed sequence of 2000 rotations, of which the first ones are shown (RR 2,
    RR 2.1, RR 2.2).
    """
    with new_figure() as fig:
        ax = fig.add_axes((-0.01, -0.03, 0.56, 1.0), projection="space")
        draw_sphere(ax)
        fig.text(0.27, 0.92, "images of $e_1$", ha="center")
        pink = {"color": COLOURS["projection"]}
        artists: dict[str, Any] = {"points": new_line(ax, **pink, marker="o", ls="", ms=4, mew=0)}
        fig.text(0.27, 0.02, "pale: the far side", ha="center")
        side = fig.add_axes((0.68, 0.18, 0.3, 0.73))
        side.set(xlim=(0, 3.2), ylim=(-1, 1), xlabel="density", ylabel="their heights")
        side.set(xticks=[0, 1, 2, 3], yticks=[-1, -0.5, 0, 0.5, 1])
        side.axvline(0.5, color="black", ls="--", lw=1.5)
        side.text(0.35, 1.04, "uniform")
        steps: Any = {"orientation": "horizontal", "lw": 2, **pink}
        artists["histogram"] = side.stairs(np.zeros(20), _BINS, baseline=None, **steps)
    controls = {
        "sampler": widgets.choice("sampler", list(_SAMPLERS)),
        "number": widgets.stepped("rotations", 40.0, 20.0, _MOST, 20.0),
        "seed": widgets.slider("seed", 0.0, 0.0, 20.0, 1.0),
    }

    def show(sampler: str, number: float, seed: float) -> dict[str, str]:
        R = _sample(sampler, int(seed))[: int(number)]
        points = R[:, :, 0]
        artists["points"].set_data_3d(*points.T)
        counts, _ = np.histogram(np.clip(points[:, 2], -1, 1), _BINS)
        artists["histogram"].set_data(counts / (len(R) * np.diff(_BINS)), _BINS)
        caps = np.mean(np.abs(points[:, 2]) > 0.5)
        said = {"|height| > ½": f"{numbers(100 * caps, 1)} %; uniform: 50 %"}
        if len(R) < 100:
            return {**said, "p-values": "from 100 rotations on"}
        for name in ("image of e₁", "angle"):
            p = uniformity_tests(R)[name].p_value
            said[f"p, {name}"] = "< 1e-6: not uniform" if p < 1e-6 else f"{p:.2g}"
        return said

    return Explorer("Random rotations", fig, artists, controls, show, plays="number", seconds=10)


@lru_cache(maxsize=8)
def _sample(sampler: str, seed: int) -> rb.Array:
    return _SAMPLERS[sampler](_MOST, rng=seed)


def _axes_of(ax: Any, name: str, colour: str | None = None, **style: Any) -> dict[str, Any]:
    artists: dict[str, Any] = {}
    for axis in "xyz":
        artists[f"{name} {axis}"] = new_line(ax, color=colour or COLOURS[axis], **style)
        if not colour and style["ls"] == "-":
            artists[f"{name} {axis} letter"] = new_name(ax, f"${axis}$", color=COLOURS[axis])
    return artists


def _move_axes(artists: dict[str, Any], name: str, M: rb.Array) -> None:
    for axis, column in zip("xyz", M.T, strict=True):
        artists[f"{name} {axis}"].set_data_3d(*np.outer(column, [0, 1]))
        if f"{name} {axis} letter" in artists:
            put_name(artists[f"{name} {axis} letter"], 1.2 * column)


def _lines(M: rb.Array) -> str:
    """Return a matrix as lines of text in which all numbers have the same width."""
    rows = (numbers(row, 3).split(", ") for row in M)
    return "\n".join("  ".join(x.rjust(6, "\u2007") for x in row) for row in rows)
