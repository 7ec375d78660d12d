"""Speeds and accelerations of a motion over time, with their limits, in one figure."""

from typing import Any, Unpack

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from rbcourse import Array, Body, Curve, Limits, limits_used
from rbcourse.draw.save import COLOURS

_NAMES = {
    "angular_speed": ("angular speed", "rad/s"),
    "speed": ("speed", "m/s"),
    "angular_acceleration": ("angular acceleration", "rad/s²"),
    "acceleration": ("acceleration", "m/s²"),
    "torque": ("torque", "N m"),
    "force": ("force", "N"),
}
_TIMES = 1001


def profiles(curve: Curve, *, body: Body | None = None, **limits: Unpack[Limits]) -> Figure:
    """Draw the speeds and accelerations of a curve over time, with their limits.

    The units on the axes are those of times in s and lengths in m.

    Parameters
    ----------
    curve : Curve
        A single curve on SO(3) or SE(3).
    body : Body, optional
        The body that moves, by default ``curve.body``. Speed and acceleration are those of its
        centre of mass.
    **limits : Limits
        Limits as for `fastest`; each is drawn as a dashed line. A limit on the torque or the force
        adds a picture of it. For a limit of three numbers, the three components are drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> from rbcourse import fastest, geodesic, pose_from_coordinates
    >>> path = geodesic(np.eye(4), pose_from_coordinates([0, 0, 1, 2, 0, 0]))
    >>> fig = profiles(fastest(path, acceleration=3, speed=1), acceleration=3, speed=np.ones(3))
    >>> len(fig.axes)
    4
    """
    if not isinstance(curve, Curve) or curve.batch_shape:
        raise ValueError(f"curve: a single Curve is wanted, got {curve!r}")
    if limits:
        limits_used(curve, body=body, **limits)  # checks the arguments
    t = np.linspace(*curve.domain, _TIMES)
    drawn = _vectors(curve, t, body or curve.body, np.asarray(limits.pop("gravity", np.zeros(3))))
    given = {name: limit for name, limit in limits.items() if limit is not None}
    shown = [name for name in drawn if name not in ("torque", "force") or name in given]
    columns = 2 if curve.size == 4 else 1
    rows = -(-len(shown) // columns)
    fig, axes = plt.subplots(
        rows,
        columns,
        sharex=True,
        squeeze=False,
        layout="constrained",
        figsize=(4.2 * columns, 1.9 * rows + 0.4),
    )
    for ax, name in zip(axes.flat, shown, strict=False):
        _draw(ax, t, drawn[name], given.get(name))
        ax.set(ylabel="{}\n({})".format(*_NAMES[name]), xlim=(t[0], t[-1]))
        ax.set_ylim(0, ax.get_ylim()[1] * (1.12 if name in given else 1))  # room for "limit"
    for ax in axes.flat[len(shown) :]:
        ax.remove()
    for ax in axes.flat[len(shown) - columns : len(shown)]:  # the last one of each column
        ax.set_xlabel("time (s)")
        ax.tick_params(labelbottom=True)
    return fig


def _vectors(curve: Curve, t: Array, body: Body, gravity: Array) -> dict[str, Array]:
    """Return the velocities, accelerations, torque and force at the times t, shape (N, 3)."""
    state, G, r = curve.state(t), body.inertia, body.centre
    w, a = state.velocity[:, :3], state.acceleration[:, :3]
    turning = {
        "angular_speed": w,
        "angular_acceleration": a,
        "torque": a @ G + np.cross(w, w @ G),
    }
    if curve.size == 3:
        return turning
    v = state.velocity[:, 3:] + np.cross(w, r)
    pull = state.acceleration[:, 3:] + np.cross(a, r) + np.cross(w, np.cross(w, r))
    force = body.mass * (pull - gravity @ state.pose[:, :3, :3])
    moving = {"speed": v, "acceleration": pull, "force": force}
    return {
        name: x for pair in zip(turning.items(), moving.items(), strict=True) for name, x in pair
    }


def _draw(ax: Any, t: Array, vectors: Array, limit: Any) -> None:
    """Draw the norm, or the components if there is a limit for each of them."""
    most = np.atleast_1d([] if limit is None else limit)
    if len(most) == 3:
        for axis, x, highest in zip("xyz", np.abs(vectors).T, most, strict=True):
            ax.plot(t, x, color=COLOURS[axis], label=axis)
            ax.axhline(highest, color=COLOURS[axis], ls="--", lw=1)
        ax.legend(ncols=3)
        return
    ax.plot(t, np.linalg.norm(vectors, axis=1), color=COLOURS["optimum"])
    for highest in most:
        ax.axhline(highest, color=COLOURS["path"], ls="--", lw=1)
        ax.text(t[0], highest, " limit", color=COLOURS["path"], va="bottom")
