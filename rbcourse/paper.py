"""The figures of BK, each as a function whose defaults are the numbers of the paper.

A function returns a `Drawing`: its ``figure`` is a Matplotlib figure, its ``data`` are the plotted
numbers, and ``figure_4(w1=[0.5, 1, 7]).write("mine")`` writes PNG, PDF and CSV to the folder
``mine``. The command ``python -m rbcourse BK4c --w1 0.5 1 7 --folder mine`` does the same, and
writes the costs as text. ``python -m rbcourse all --folder mine`` draws all figures of both texts.

Parameters
----------
panel : {"a", "b"}, optional
    The panel of the figure.
angles : array_like, shape (n,), optional
    Two or more increasing angles in rad, above 0 and below π.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Literal

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_single, check_all
from rbcourse._docs import described_by
from rbcourse._numerics import Array
from rbcourse.curves.cost import acceleration_cost, acceleration_cost_parts
from rbcourse.curves.projected import projected_cubic
from rbcourse.draw import bodies, coordinates, families
from rbcourse.draw.drawing import Drawing, style
from rbcourse.draw.save import Table
from rbcourse.optimum.two_poses import minimum_acceleration
from rbcourse.se3 import pose_from_components, pose_from_coordinates, twist_from_rates
from rbcourse.so3 import exp_so3
from rbcourse.straight_line import f, theta

__all__ = ["figure_1", "figure_2", "figure_3", "figure_4", "figure_5"]

ANGLES = np.arange(1, 23) * np.pi / 24
SIGMA = np.pi / 6 * np.array([1.0, 2, 3])
SIGMA_5 = np.pi / 6 * np.array([1.0, 4, 3])
_EXTRA = {"a": 0.0, "b": 1.0, "c": 5.0}
"""The differences between the end velocity and σ along the first axis, in BK (21)."""


@described_by(__doc__, returns="rbcourse.draw.drawing.Drawing")
def figure_1(
    *, rotation: ArrayLike = (0.4, -0.3, -0.6), position: ArrayLike = (2.4, 0.4, 1.0)
) -> Drawing:
    """Draw the fixed frame {F}, the frame {M} that moves with a body, and the vector d.

    Source: BK Fig. 1.

    Parameters
    ----------
    rotation : array_like, shape (3,), optional
        The rotation vector of the moving frame, in rad.
    position : array_like, shape (3,), optional
        The origin of the moving frame, in m.

    Examples
    --------
    >>> drawing = figure_1()
    >>> drawing.data["frame"]
    ['F', 'M']
    >>> plt.close(drawing.figure)
    """
    R, d = exp_so3(as_single("rotation", rotation, 3)), as_single("position", position, 3)
    poses, names = np.stack([np.eye(4), pose_from_components(R, d)]), ["F", "M"]
    with style():
        fig, ax = plt.subplots(figsize=(7, 4), subplot_kw={"projection": "space"})
        bodies.draw_moving_frame(ax, names, poses)
    data = bodies.pose_table({"frame": names}, poses)
    return Drawing(fig, "paper_fig1", data, bodies.describe_moving_frame(names, poses))


@described_by(__doc__, returns="rbcourse.draw.drawing.Drawing")
def figure_2(panel: Literal["a", "b"] = "a", *, angles: ArrayLike = ANGLES) -> Drawing:
    """Draw the angle θ of the projected line over time (a), or its derivative (b), for many angles.

    Source: BK Fig. 2.

    Examples
    --------
    >>> drawing = figure_2("b", angles=[0.5, 1, 2, 3])
    >>> list(drawing.data)
    ['angle [rad]', 't [1]', 'theta_dot [1]']
    >>> plt.close(drawing.figure)
    """
    t, angle = _grid(angles)
    order = _one_of("panel", panel, "ab")
    return _family("2", panel, {f"theta{'_dot' * order} [1]": theta(t, angle, order)}, t, angle)


@described_by(__doc__, returns="rbcourse.draw.drawing.Drawing")
def figure_3(panel: Literal["a", "b"] = "a", *, angles: ArrayLike = ANGLES) -> Drawing:
    """Draw the timing f of the projected line (a), or its derivative (b), for many angles.

    With this timing, the projected line turns at constant speed.
    Source: BK Fig. 3.

    Examples
    --------
    >>> drawing = figure_3()
    >>> drawing.name
    'paper_fig3a'
    >>> plt.close(drawing.figure)
    """
    t, angle = _grid(angles)
    order = _one_of("panel", panel, "ab")
    return _family("3", panel, {f"f{'_dot' * order} [1]": f(t, angle, order)}, t, angle)


@described_by(__doc__, returns="rbcourse.draw.drawing.Drawing")
def figure_4(
    panel: Literal["a", "b", "c"] = "c",
    *,
    sigma: ArrayLike = SIGMA,
    w0: ArrayLike | None = None,
    w1: ArrayLike | None = None,
) -> Drawing:
    """Draw the optimum and the projected cubic from I to exp(σ), in exponential coordinates.

    Source: BK (21), BK Fig. 4.

    Parameters
    ----------
    panel : {"a", "b", "c"}, optional
        The panel of the figure, which determines `w1`.
    sigma : array_like, shape (3,), optional
        The rotation vector of the goal, in rad; its norm is below π.
    w0, w1 : array_like, shape (3,), optional
        The angular velocities at both ends, by default those of the panel: σ, and σ + (k, 0, 0)
        with k = 0, 1 or 5.

    Examples
    --------
    >>> drawing = figure_4(w1=[0.5, 1, 7])
    >>> sorted(drawing.data)[:3]
    ['optimum sigma1 [rad]', 'optimum sigma2 [rad]', 'optimum sigma3 [rad]']
    >>> plt.close(drawing.figure)
    """
    _one_of("panel", panel, "abc")
    end = as_single("sigma", sigma, 3)
    if (size := float(np.linalg.norm(end))) >= np.pi:
        raise ValueError(f"sigma: a norm below π is wanted, in rad, got {size:.6g}")
    first = end if w0 is None else as_single("w0", w0, 3)
    last = end + _EXTRA[panel] * np.eye(3)[0] if w1 is None else as_single("w1", w1, 3)
    ends = np.eye(3), exp_so3(end), first, last
    curves = {"optimum": minimum_acceleration(*ends), "projection": projected_cubic(*ends)}
    data = coordinates.coordinate_table(curves, np.linspace(0, 1, 101))
    with style():
        fig = plt.figure(figsize=(8, 3.7))
        coordinates.draw_comparison(fig, data)
    costs = [float(acceleration_cost(curve)) for curve in curves.values()]
    said = f"Case ({panel}): {coordinates.describe_coordinates(data)} {_compared(costs)}"
    return Drawing(fig, f"paper_fig4{panel}", data, said)


@described_by(__doc__, returns="rbcourse.draw.drawing.Drawing")
def figure_5(
    panel: Literal["a", "b"] = "a",
    *,
    sigma: ArrayLike = SIGMA_5,
    d: ArrayLike = (8, 10, 12),
    w0: ArrayLike = (1, 2, 3),
    w1: ArrayLike = (2, 1, 1),
    d0_dot: ArrayLike = (1, 1, 1),
    d1_dot: ArrayLike = (1, 5, 3),
) -> Drawing:
    """Draw a cube that moves along the optimum (a), or along the projected cubic (b).

    The cube has an edge of 2 m. Stars mark its centre at eight of the 106 times of the data; at
    the second and the seventh, no cube is drawn, because it would intersect its neighbours.
    Source: BK Fig. 5.

    Parameters
    ----------
    sigma, d : array_like, shape (3,), optional
        The rotation vector of the goal in rad, and its position in m. The start is I and 0.
    w0, w1 : array_like, shape (3,), optional
        The angular velocities at both ends, in the body frame.
    d0_dot, d1_dot : array_like, shape (3,), optional
        The velocities of the centre at both ends, in the fixed frame.

    Examples
    --------
    >>> rest = {name: [0, 0, 0] for name in ("w0", "w1", "d0_dot", "d1_dot")}
    >>> drawing = figure_5("b", **rest)
    >>> drawing.data["x [m]"].shape
    (106,)
    >>> plt.close(drawing.figure)
    """
    _one_of("panel", panel, "ab")
    given = {"sigma": sigma, "d": d, "w0": w0, "w1": w1, "d0_dot": d0_dot, "d1_dot": d1_dot}
    vectors = {name: as_single(name, vector, 3) for name, vector in given.items()}
    poses = pose_from_coordinates([np.zeros(6), np.append(vectors["sigma"], vectors["d"])])
    w, d_dot = ([vectors[name] for name in names] for names in (["w0", "w1"], ["d0_dot", "d1_dot"]))
    ends = *poses, *twist_from_rates(poses, w, d_dot)
    best, near = minimum_acceleration(*ends), projected_cubic(*ends)
    motion, t = best if panel == "a" else near, np.linspace(0, 1, 106)
    drawn = t[::15]
    shown = motion(drawn)
    with style():
        fig = plt.figure(figsize=(4.3, 4.5))
        ax: Any = fig.add_subplot(projection="space")
        compared = best(drawn)[2:6] if panel == "b" else ()
        bodies.draw_cube_motion(ax, shown, side=2, omitted=(1, 6), compared=compared)
        if panel == "b":
            ax.text(0, 2.6, 9, "black outlines:\noptimum", ha="center")
    said = {
        "a": "Optimum: a cube moves with the least acceleration. ",
        "b": "Projection: the same cube; it has pink edges, and outlines of the optimum are "
        "black at the middle four times. ",
    }
    rotation, moving = np.transpose([acceleration_cost_parts(best), acceleration_cost_parts(near)])
    costs = f"{_compared(rotation)} The translation costs {moving[0]:.6g}."
    alt = f"{said[panel]}{bodies.describe_cube_motion(shown)} {costs}"
    return Drawing(fig, f"paper_fig5{panel}", bodies.motion_table(t, motion, drawn), alt)


def _compared(costs: Sequence[float]) -> str:
    """Return a sentence about the costs of the rotation: the optimum's and the projection's."""
    best, near = np.round(costs, 12).tolist()
    more = f", {100 * (near / best - 1):.3g} % more" if 0 < best < near else ""
    return (
        f"The optimal rotation costs {best:.6g} (the integral of 2‖ω'‖²), "
        f"the projected one {near:.6g}{more}."
    )


def _grid(angles: ArrayLike) -> tuple[Array, Array]:
    """Return 101 times and the angles, shape (angles, times)."""
    chosen = as_single("angles", angles, "n")
    check_all((chosen > 0) & (chosen < np.pi), "angles", chosen, "an angle above 0 and below π")
    if len(chosen) < 2 or not np.all(np.diff(chosen) > 0):
        raise ValueError("angles: two or more increasing angles are wanted")
    angle, t = np.meshgrid(chosen, np.linspace(0, 1, 101), indexing="ij")
    return t, angle


def _family(figure: str, panel: str, column: Table, t: Array, angle: Array) -> Drawing:
    data = {"angle [rad]": angle, "t [1]": t, **column}
    with style():
        fig, axes = plt.subplot_mosaic(
            "ab", figsize=(8, 3.6), per_subplot_kw={"a": {"projection": "3d"}}
        )
        families.draw_surface(axes["a"], data)
        families.draw_family(axes["b"], data)
    return Drawing(fig, f"paper_fig{figure}{panel}", data, families.describe_family(data))


def _one_of(name: str, value: str, known: str) -> int:
    """Return the index of a letter."""
    if value not in list(known):
        raise ValueError(f"{name}: one of {', '.join(map(repr, known))} is wanted, got {value!r}")
    return known.index(value)


FIGURES: dict[str, Callable[..., Drawing]] = {
    "1": figure_1,
    "2a": figure_2,
    "2b": partial(figure_2, "b"),
    "3a": figure_3,
    "3b": partial(figure_3, "b"),
    "4a": partial(figure_4, "a"),
    "4b": partial(figure_4, "b"),
    "4c": figure_4,
    "5a": figure_5,
    "5b": partial(figure_5, "b"),
}
"""The functions of the figures by their names."""
