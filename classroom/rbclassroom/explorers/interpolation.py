"""Explorers of paths of rotations: four ways to interpolate, and the belt trick."""

from collections.abc import Callable
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.space import LIGHT, Faces
from rbcourse.quaternion import quaternion_from_rotation_vector as quaternion_of
from rbcourse.quaternion import quaternion_from_zyx, quaternion_multiply

_BOX = np.array([1.3, 0.8, 0.25])
_NOSE = 1.0
_TIMES = np.linspace(0, 1, 201)
_PLATE = np.array([0.44, 0.3, 0.06])
_HIGH, _WIDE = 1.03, np.array([0.12, 0, -0.12])
_HEIGHTS = np.array([_HIGH, *np.linspace(1, 0.28, 37), _PLATE[2] / 2])
"""The distances of the cross-sections of the belt from the plate's centre."""
_SHARES = np.array([0, *np.linspace(0, 1, 37), 1])
"""The turns of the cross-sections of a twisted belt, divided by the turn of the plate."""
_IMPOSSIBLE = "impossible: the plate would have to turn"
_FATES = {0: "not needed: q = 1", 360: f"{_IMPOSSIBLE}, as q = −1", 720: "possible, as q = 1"}


def _blended(ends: rb.Array, t: rb.Array) -> rb.Array:
    """Return (1 − t) times the first of two arrays plus t times the second, for all times."""
    return np.tensordot(np.stack([1 - t, t], axis=-1), ends, axes=1)


def _on_the_short_arc(ends: rb.Array, t: rb.Array) -> rb.Array:
    return rb.matrix_from_quaternion(rb.slerp(ends[0], ends[1], t))


_WAYS: dict[str, Callable[[rb.Array, rb.Array], rb.Array]] = {
    "ZYX angles": lambda angles, t: rb.matrix_from_zyx(_blended(angles, t)),
    "matrix entries": lambda angles, t: _blended(rb.matrix_from_zyx(angles), t),
    "quaternions": lambda angles, t: _on_the_short_arc(quaternion_from_zyx(angles), t),
    "rotation vectors": lambda angles, t: rb.exp_so3(
        _blended(rb.log_so3(rb.matrix_from_zyx(angles)), t)
    ),
}
"""For each name, a function of the ZYX angles of both ends, shape (2, 3), and of the times."""


def interpolation_explorer() -> Explorer:
    """Return an explorer of four ways from one orientation to another.

    The ways blend the ZYX angles, the entries of the matrices, the quaternions (on the short arc),
    and the rotation vectors. Each picture shows a box, its nose on the body's x axis, and the path
    of the nose from a circle to a dot (RR 2.1, RR 2.2, BK 2.5).
    """
    artists: dict[str, Any] = {}
    with new_figure() as fig:
        for k, way in enumerate(_WAYS):
            left, top = 0.5 * (k % 2), 1 - 0.5 * (k // 2)
            ax = new_space(fig, (left - 0.02, top - 0.572, 0.54, 0.56), 1.06)
            fig.text(left + 0.25, top - 0.054, way, ha="center")
            orange: Any = {"color": COLOURS["x"]}
            artists |= {
                f"{way} path": new_line(ax, **orange, lw=1.5),
                f"{way} start": new_line(ax, **orange, marker="o", ls="", ms=7, mfc="white"),
                f"{way} goal": new_line(ax, **orange, marker="o", ls="", ms=7),
                f"{way} nose": new_line(ax, **orange, lw=3.5),
                way: draw_box(ax, np.eye(4), _BOX),
            }
    angle = {"yaw": 180.0, "pitch": 90.0, "roll": 180.0}
    first = {"start": (-150.0, 0.0, 0.0), "goal": (140.0, -80.0, 0.0)}
    controls = {
        f"{name}{i}": widgets.slider(f"{end} {name} (°)", value, -most, most, 10.0)
        for i, (end, values) in enumerate(first.items())
        for (name, most), value in zip(angle.items(), values, strict=True)
    }
    controls["t"] = widgets.stepped("time t", 0.5, 0.0, 1.0, 0.01)

    def show(t: float, **angles: float) -> dict[str, str]:
        ends = np.radians([[angles[f"{name}{i}"] for name in angle] for i in (0, 1)])
        said = {}
        for way, function in _WAYS.items():
            M, now = function(ends, _TIMES), np.eye(4)
            now[:3, :3] = function(ends, np.array(t))
            move_box(artists[way], now, _BOX)
            path = _NOSE * M[::4, :, 0]
            artists[f"{way} path"].set_data_3d(*path.T)
            artists[f"{way} start"].set_data_3d(*path[:1].T)
            artists[f"{way} goal"].set_data_3d(*path[-1:].T)
            artists[f"{way} nose"].set_data_3d(*np.outer(now[:3, 0], [_BOX[0] / 2, _NOSE]))
            if way == "matrix entries":
                det = float(np.linalg.det(now[:3, :3]))
                fate = "a rotation" if det > 1 - 1e-9 else "not a rotation"
                said[way] = f"{fate}, determinant {numbers(det, 2)}"
                if det < 1e-9:
                    said["its box"] = "squashed to a line"
            else:
                turned = np.degrees(rb.angle_between(M[:-1], M[1:]).sum())
                said[way] = f"{numbers(turned, 0)}° in all"
        return said

    return Explorer("Four ways to the goal", fig, artists, controls, show, plays="t")


def double_cover_explorer() -> Explorer:
    """Return an explorer of a belt between the ceiling and a plate: the sign of a quaternion.

    The plate turns about the vertical z axis and twists the belt. The orange half of the belt and
    the orange line on the plate are on the side of the body's x axis. The right picture shows w and
    z of the quaternions along the belt, from 1 at the ceiling to q at the plate. After 720° only,
    the belt can be straightened while the plate does not move (BK 2.5, RR 2.2).
    """
    with new_figure() as fig:
        ax: Any = fig.add_axes((-0.19, -0.3, 1.0, 1.4), projection="space")
        ax.fit(-np.ones(3), np.ones(3), zoom=1.12)
        ax.view_init(elev=16, azim=-55)
        square = 0.35 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
        ax.add_artist(Faces(square[None] + [0, 0, _HIGH], ["white"]))
        side = fig.add_axes((0.69, 0.2, 0.29, 0.43))
        side.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), xticks=[-1, 0, 1], yticks=[-1, 0, 1])
        side.set(xlabel="$w$", aspect="equal")
        side.set_ylabel("$z$", rotation=0, labelpad=0)
        turns = np.linspace(0, 2 * np.pi, 91)
        side.plot(np.cos(turns), np.sin(turns), color=PALE, lw=1)
        violet: Any = {"color": COLOURS["screw"]}
        dot: Any = {"marker": "o", "ls": "", **violet}
        colours = [*np.repeat(["#F0A46E", "#9CC8E8"], len(_HEIGHTS) - 1), "none"]
        belt = Faces(_belt(_quaternions(0, 0)), colours)
        belt.set_edgecolor("none")
        artists: dict[str, Any] = {
            "belt": ax.add_artist(belt),
            "plate": draw_box(ax, np.eye(4), _PLATE),
            "front": new_line(ax, color=COLOURS["x"], lw=3),
            "path": new_line(side, **violet, lw=3, label="along the belt"),
            "q": new_line(side, **dot, ms=10, label="$q$ at the plate"),
        }
        side.plot([1], [0], **dot, ms=10, mfc="white", label="1 at the ceiling", zorder=1)
        side.legend(loc="lower center", bbox_to_anchor=(0.4, 1.02), handlelength=1.2)
    controls = {
        "turn": widgets.stepped("turn (°)", 360.0, 0.0, 720.0, 10.0),
        "untwist": widgets.slider("untwist (0 to 1)", 0.0, 0.0, 1.0, 0.05),
    }

    def show(turn: float, untwist: float) -> dict[str, str]:
        q = _quaternions(np.radians(turn), untwist if turn == 720 else 0)
        artists["belt"].corners = _belt(q)
        R = rb.matrix_from_quaternion(q[-1])
        move_box(artists["plate"], rb.pose_from_components(R, np.zeros(3)), _PLATE)
        artists["front"].set_data_3d(*np.outer(R[:, 0], _PLATE[0] * np.array([0.5, 0.9])))
        artists["path"].set_data(q[:, 0], q[:, 3])
        artists["q"].set_data(q[-1:, 0], q[-1:, 3])
        belt = f"{'still ' if untwist else ''}twisted by {turn:.0f}°"
        if turn == 720 and 0 < untwist < 1:
            belt = "partly untwisted"
        elif turn == 0 or (turn, untwist) == (720, 1):
            belt = "straight"
        return {
            "plate": "as at the start" if turn % 360 == 0 else f"turned by {turn:.0f}°",
            "quaternion": numbers(q[-1], 2),
            "belt": belt,
            "to untwist it": _FATES.get(int(turn), _IMPOSSIBLE),
        }

    return Explorer("A plate on a belt", fig, artists, controls, show, plays="turn", seconds=8)


def _quaternions(turn: float, untwist: float) -> rb.Array:
    """Return the quaternions of the cross-sections of the belt: a turn about z after another one.

    Both turns have the same angle. The axis of the other turn goes from z to −z as the belt is
    untwisted.
    """
    tilt = np.pi * untwist
    half = turn / 2 * _SHARES[:, None]
    axes = np.array([[0, 0, 1], [0, -np.sin(tilt), np.cos(tilt)]])
    return quaternion_multiply(*(quaternion_of(half * axis) for axis in axes))


def _belt(q: rb.Array) -> rb.Array:
    """Return the corners of the faces of the belt, shape (n, 4, 3).

    The straight belt is above the plate's centre, and each cross-section turns about this centre.
    Their distances from it differ, so the middle line of the belt never meets itself. The last face
    is a single point, far from the light, so that `Faces` takes the lit side of each face as its
    outer side.
    """
    straight = np.stack(np.broadcast_arrays(_WIDE, 0, _HEIGHTS[:, None]), axis=-1)
    sections = straight @ np.swapaxes(rb.matrix_from_quaternion(q), -1, -2)
    halves = sections[:, :2], sections[:, 1:]
    faces = [np.hstack([half[:-1], half[1:, ::-1]]) for half in halves]
    return np.concatenate([*faces, np.tile(-1e6 * LIGHT, (1, 4, 1))])
