"""The functions of the report RR, with the names and signatures of the report, and its figures.

`figure_4` to `figure_9` are the figures 4 to 9 of the report; their defaults are the numbers of the
lessons, since the report prints no numbers for them. A function returns a
`rbcourse.draw.drawing.Drawing`: its ``figure`` is a Matplotlib figure, its ``data`` are the plotted
numbers, and ``figure_4(rng=7).write("mine")`` writes PNG, PDF and CSV to the folder ``mine``. The
command ``python -m rbcourse RR4 --rng 7 --folder mine`` does the same. `visualize` and the
other functions of the report draw any sample and any path.

Arguments that the report does not have are keyword-only. For inputs of a wrong shape or with
non-finite entries, a check returns False, and a correction raises ValueError.

Parameters
----------
m : array_like, shape (n, n) or (n + 1, n + 1)
    A square matrix, n ≥ 1; a pose has the shape (n + 1, n + 1).
v : array_like, shape (4,)
    A quaternion (w, x, y, z).
epsilon : float, optional
    The tolerance of each entry, at least 0.
rotation : array_like, shape (3, 3) or (4,)
    A rotation matrix or a unit quaternion (w, x, y, z), valid to 0.01.
quaternion : bool
    Whether to draw quaternions instead of matrices.
naive : bool
    Whether to draw by the naive method, which is not uniform.
rng : Generator, int or None, optional
    A generator, a seed, or None for fresh numbers.
start, goal : array_like, shape (n,) or (3,)
    The joint angles at both ends, in rad; n = 2 for the arm of the report. For `figure_6`, planar
    poses (x, y, theta).
start_pose : array_like, shape (3,) or (n,)
    The planar pose (x, y, theta), in m, m and rad, or the joint angles of the arm, in rad.
goal_pose : array_like, shape (3,)
    The planar pose (x, y, theta) at the end, in m, m and rad.
plan : iterable of (velocity, duration)
    Velocities (vx, vy, vtheta) in m/s, m/s and rad/s, or n velocities of joints in rad/s, and
    durations of at least 0, in s.
frame : {"world", "body"}, optional
    The frame of vx and vy; the report has "world".
path : array_like, shape (states, 3) or (states, n)
    Planar poses (x, y, theta), in m, m and rad, or joint angles, in rad.
length : float, optional
    The length of the rectangle, in m. `visualize_path` has a fifth of the larger extent of the
    path, or 1 m if the body does not move.
lengths : array_like, shape (n,), optional
    The lengths of the links, above 0, in m.
steps : int, optional
    The number of equal steps, or of random rotations, at least 1.
shortest : bool, optional
    Whether the body turns the short way round.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import Rng, as_count, as_generator, as_single, as_tolerance, as_unit
from rbcourse._docs import described_by
from rbcourse._numerics import Array
from rbcourse.arm import LINKS, interpolate_joints, propagate_joints
from rbcourse.draw.animate import Animation, Update, animate
from rbcourse.draw.arm import describe_arm, moving_arm
from rbcourse.draw.arm import path_table as joint_table
from rbcourse.draw.drawing import Drawing, style
from rbcourse.draw.plane import describe_route, extent_of, moving_route
from rbcourse.draw.plane import path_table as route_table
from rbcourse.draw.spheres import (
    Images,
    describe_images,
    image_table,
    in_middle_half,
    moving_images,
)
from rbcourse.planar import Plan, as_plan, interpolate_planar, propagate_planar
from rbcourse.projection import is_se, is_so, project_se, project_so
from rbcourse.quaternion import (
    is_unit_quaternion,
    project_quaternion,
    rotate_by_quaternion,
    rotation_vector_from_quaternion,
)
from rbcourse.sampling import (
    sample_quaternion,
    sample_quaternion_naive,
    sample_rotation,
    sample_rotation_naive,
)
from rbcourse.so3 import exp_so3, log_so3

__all__ = [
    "check_SEn",
    "check_SOn",
    "check_quaternion",
    "correct_SEn",
    "correct_SOn",
    "correct_quaternion",
    "figure_4",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "figure_9",
    "forward_propagate_arm",
    "forward_propagate_rigid_body",
    "interpolate_arm",
    "interpolate_rigid_body",
    "random_quaternion",
    "random_rotation_matrix",
    "visualize",
    "visualize_arm_path",
    "visualize_path",
    "visualize_rotation",
]

_V0 = np.array([0.0, 0.0, 1.0])
_V1 = np.array([0.0, 0.2, 0.0]) + _V0
_ROUTE: Plan = [
    ([1, 0, 0], 3),
    ([0, 0, np.pi / 4], 1),
    ([1, 1, 0], 2),
    ([1, 0, -np.pi / 4], 3),
]
"""The plan of `figure_7`, with velocities in the world frame."""
_FROM, _TO = np.radians([[-20, 110], [130, -60]])
"""The joint angles at both ends of `figure_8`."""
_TURNS: Plan = [([np.pi / 4, 0], 3), ([0, np.pi / 4], 3), ([-np.pi / 4, np.pi / 4], 3)]
"""The plan of `figure_9`: the shoulder turns, then the elbow, then both."""


def check_SOn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Return whether m is a rotation matrix: mᵀm = I and det m = 1, each entry within epsilon ≥ 0.

    Source: RR 1.1, RR (1), RR (2).

    Examples
    --------
    >>> check_SOn([[0, -1], [1, 0]]), check_SOn([[0, 1], [1, 0]]), check_SOn([[1, 0]])
    (True, False, False)
    """
    return _passes(is_so, m, epsilon)


def check_quaternion(v: ArrayLike, epsilon: float = 0.01) -> bool:
    """Return whether v is a unit quaternion (w, x, y, z): its norm is 1 within epsilon.

    Source: RR 1.2, RR (3).

    Examples
    --------
    >>> check_quaternion([0.5, 0.5, 0.5, 0.5]), check_quaternion([1, 1, 0, 0])
    (True, False)
    """
    return _passes(is_unit_quaternion, v, epsilon)


def check_SEn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Return whether m is a pose: a rotation and the last row 0, …, 0, 1, each within epsilon.

    Source: RR 1.3.

    Examples
    --------
    >>> check_SEn([[0, -1, 5], [1, 0, 7], [0, 0, 1]]), check_SEn([[1]])
    (True, False)
    """
    return _passes(is_se, m, epsilon)


def correct_SOn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return a copy of m if it passes `check_SOn`, otherwise the nearest rotation matrix.

    The matrix may be singular or a reflection.
    Source: RR 1.4, RR (4), RR (5), RR Fig. 1.

    Examples
    --------
    >>> correct_SOn([[1, 2, 3], [4, 5, 6], [7, 8, 9]]).round(8)
    array([[-0.75271952,  0.38914789,  0.5310153 ],
           [ 0.38914789, -0.38759388,  0.83566435],
           [ 0.5310153 ,  0.83566435,  0.1403134 ]])
    """
    return np.array(m) if check_SOn(m, epsilon) else project_so(as_single("m", m, "n", "n"))


def correct_quaternion(v: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return a copy of v = (w, x, y, z) ≠ 0 if it passes `check_quaternion`, otherwise v/‖v‖.

    Source: RR 1.5, RR (6), RR Fig. 2.

    Examples
    --------
    >>> correct_quaternion([2, 2, 0, 0])
    array([0.70710678, 0.70710678, 0.        , 0.        ])
    """
    return np.array(v) if check_quaternion(v, epsilon) else as_unit("v", as_single("v", v, 4), 4)


def correct_SEn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return a copy of m if it passes `check_SEn`, otherwise the nearest pose.

    The translation is kept, and the last row becomes 0, …, 0, 1.
    Source: RR 1.6, RR Fig. 3.

    Examples
    --------
    >>> correct_SEn([[3, 2, 4], [2, 3, 2], [0, 1, 1]]).round(12) + 0.0
    array([[1., 0., 4.],
           [0., 1., 2.],
           [0., 0., 1.]])
    """
    return np.array(m) if check_SEn(m, epsilon) else project_se(as_single("m", m, "n+1", "n+1"))


def random_rotation_matrix(naive: bool, *, rng: Rng = None) -> Array:
    """Return a random rotation matrix, shape (3, 3), which is uniformly random unless `naive`.

    Uniform rotations are drawn by Arvo's method. If naive, the three angles are uniform, but the
    rotation is not.
    Source: RR 2.1.

    Examples
    --------
    >>> check_SOn(random_rotation_matrix(naive=False), 1e-14)
    True
    """
    return (sample_rotation_naive if _chosen("naive", naive) else sample_rotation)(rng=rng)


def random_quaternion(naive: bool, *, rng: Rng = None) -> Array:
    """Return a random unit quaternion, shape (4,), which is uniformly random unless `naive`.

    Source: RR 2.2.

    Examples
    --------
    >>> check_quaternion(random_quaternion(naive=False), 1e-14)
    True
    """
    return (sample_quaternion_naive if _chosen("naive", naive) else sample_quaternion)(rng=rng)


def visualize_rotation(rotation: ArrayLike, *, steps: int = 24) -> tuple[Figure, Animation]:
    """Show how a rotation moves v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0) over the sphere.

    The figure shows the nearest rotation, which is reached in `steps` equal steps about one axis.
    Return the figure with all images, and an animation of them. A notebook shows the animation as a
    player; ``animation.save(path)`` writes a GIF.
    Source: RR 2.2.

    Examples
    --------
    >>> figure, animation = visualize_rotation(np.eye(3), steps=1)
    >>> plt.close(figure)
    """
    turn = _rotation_vector(rotation)
    R = exp_so3(np.linspace(0, 1, as_count("steps", steps) + 1)[:, None] * turn)
    place = ", ".join(f"{x:.2f}" for x in (R[-1] @ _V0).round(2) + 0.0)
    degrees = np.degrees(np.linalg.norm(turn))
    alt = f"A turn of {degrees:.0f} degrees carries the pole of a sphere to ({place})."
    return _show_images("rotation", alt, {"one rotation": (R @ _V0, R @ _V1)})


def visualize(
    quaternion: bool, *, naive: bool = False, rng: Rng = None, steps: int = 100
) -> tuple[Figure, Animation]:
    """Show the images of v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0) under `steps` random rotations.

    If `quaternion` is True, the rotations are v ↦ q v q⁻¹ with q from `random_quaternion`.
    Otherwise, `random_rotation_matrix` gives the rotations. Return a figure and an animation as
    `visualize_rotation` does.
    Source: RR 2.2, RR Fig. 4, RR Fig. 5.

    Examples
    --------
    >>> figure, animation = visualize(True, rng=1, steps=2)
    >>> plt.close(figure)
    """
    generator, count = as_generator(rng), range(as_count("steps", steps))
    if _chosen("quaternion", quaternion):
        q = np.array([random_quaternion(naive, rng=generator) for _ in count])
        pair = rotate_by_quaternion(q, _V0), rotate_by_quaternion(q, _V1)
        images = {"random quaternions": pair}
        return _show_images("random_quaternions", describe_images(images), images)
    R = np.array([random_rotation_matrix(naive, rng=generator) for _ in count])
    images = {"random matrices": (R @ _V0, R @ _V1)}
    return _show_images("random_matrices", describe_images(images), images)


def interpolate_rigid_body(
    start_pose: ArrayLike, goal_pose: ArrayLike, *, steps: int = 10, shortest: bool = False
) -> Array:
    """Return a path between two planar poses; x, y and theta change linearly.

    The path has the shape (steps + 1, 3).
    Source: RR 3.1, RR (14), RR (15), RR (16).

    Examples
    --------
    >>> interpolate_rigid_body([0, 0, 0], [10, 5, 1])[3]
    array([3. , 1.5, 0.3])
    """
    start, goal = as_single("start_pose", start_pose, 3), as_single("goal_pose", goal_pose, 3)
    return interpolate_planar(start, goal, steps, shortest=shortest)


def forward_propagate_rigid_body(
    start_pose: ArrayLike, plan: Plan, *, frame: str = "world"
) -> Array:
    """Return the path of a planar body that follows a plan, shape (commands + 1, 3).

    Source: RR 3.2, RR (17), RR (18), RR (19).

    Examples
    --------
    >>> forward_propagate_rigid_body([0, 0, 0], [([1, 0, 0.5], 2), ([0, 1, 0], 3)])
    array([[0., 0., 0.],
           [2., 0., 1.],
           [2., 3., 1.]])
    """
    return propagate_planar(as_single("start_pose", start_pose, 3), plan, frame=frame)


def visualize_path(path: ArrayLike, *, length: float | None = None) -> tuple[Figure, Animation]:
    """Show a path of planar poses: a rectangle at each pose, and the path of its centre.

    Straight lines join the states; to show the arc of a command in the body frame, divide the
    command first. Return a figure of the whole path, and an animation of at most 40 frames, as
    `visualize_rotation` does.
    Source: RR 3.3, RR Fig. 6, RR Fig. 7.

    Examples
    --------
    >>> figure, animation = visualize_path([[0, 0, 0], [4, 2, 1]])
    >>> plt.close(figure)
    """
    states = as_single("path", path, "states", 3)
    far = np.abs(states[:, :2]).max()
    if length is None:
        length = extent_of(states) / 5 or max(1.0, 1e-12 * far)
    if not as_single("length", length) > 1e-13 * far:
        raise ValueError(
            f"length: a number above 0, large enough to be seen, is wanted, got {length!r}"
        )
    return _show_path(
        "path", describe_route(states), states, lambda ax, p: moving_route(ax, states, length, p)
    )


def interpolate_arm(start: ArrayLike, goal: ArrayLike, *, steps: int = 10) -> Array:
    """Return the path on which each joint angle changes linearly from its start to its goal.

    The path has the shape (steps + 1, n).
    Source: RR 4.1, RR (20), RR (21).

    Examples
    --------
    >>> interpolate_arm([0, 0], [1, -2])[5]
    array([ 0.5, -1. ])
    """
    start = as_single("start", start, "n")
    return interpolate_joints(start, as_single("goal", goal, start.size), steps)


def forward_propagate_arm(start_pose: ArrayLike, plan: Plan) -> Array:
    """Return the path of an arm that follows a plan, shape (commands + 1, n).

    Source: RR 4.2, RR (22), RR (23).

    Examples
    --------
    >>> forward_propagate_arm([0, 0], [([0.5, 0], 2), ([0, -1], 1)])
    array([[ 0.,  0.],
           [ 1.,  0.],
           [ 1., -1.]])
    """
    return propagate_joints(as_single("start_pose", start_pose, "n"), plan)


def visualize_arm_path(path: ArrayLike, *, lengths: ArrayLike = LINKS) -> tuple[Figure, Animation]:
    """Show a path of an arm: its links in blue, and the path of its tip as a growing red curve.

    Return a figure and an animation as `visualize_path` does.
    Source: RR 4.3, RR Fig. 8, RR Fig. 9.

    Examples
    --------
    >>> figure, animation = visualize_arm_path([[0, 0], [0, 1.57]])
    >>> plt.close(figure)
    """
    states = as_single("path", path, "states", "k")
    alt = describe_arm(states, lengths)
    return _show_path("arm_path", alt, states, lambda ax, p: moving_arm(ax, states, p, lengths))


def figure_4(*, rng: Rng = 4, steps: int = 100) -> Drawing:
    """Draw random rotation matrices on two spheres: with three uniform angles, and uniform ones.

    The figure shows the images of v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0). Another sample has
    another seed `rng`.
    Source: RR Fig. 4.

    Examples
    --------
    >>> drawing = figure_4(rng=7, steps=2)
    >>> list(drawing.data)[:2]
    ['three angles v0 x [1]', 'three angles v0 y [1]']
    >>> plt.close(drawing.figure)
    """
    count, images = as_count("steps", steps), {}
    for name, sample in (("three angles", sample_rotation_naive), ("uniform", sample_rotation)):
        R = sample(count, rng=rng)
        images[name] = R @ _V0, R @ _V1
    return _two_spheres("report_fig4", images, "rotation matrices")


def figure_5(*, rng: Rng = 6, steps: int = 100) -> Drawing:
    """Draw random quaternions as `figure_4` draws random matrices.

    Source: RR Fig. 5.

    Examples
    --------
    >>> drawing = figure_5(steps=2)
    >>> plt.close(drawing.figure)
    """
    count, images = as_count("steps", steps), {}
    for name, sample in (("three angles", sample_quaternion_naive), ("uniform", sample_quaternion)):
        q = sample(count, rng=rng)
        images[name] = rotate_by_quaternion(q, _V0), rotate_by_quaternion(q, _V1)
    return _two_spheres("report_fig5", images, "quaternions")


def figure_6(
    *,
    start: ArrayLike = (0, 0, 0),
    goal: ArrayLike = (6, 3, np.pi / 2),
    steps: int = 50,
    length: float = 1.2,
) -> Drawing:
    """Draw a rectangle that moves between two planar poses.

    Source: RR Fig. 6.

    Examples
    --------
    >>> drawing = figure_6(goal=[4, 2, 1])
    >>> drawing.data["x [m]"][[0, -1]]
    array([0., 4.])
    >>> plt.close(drawing.figure)
    """
    ends = as_single("start", start, 3), as_single("goal", goal, 3)
    path = interpolate_planar(*ends, steps)
    pale = range(0, len(path), max(1, steps // 5))
    shape, what = {"figsize": (5, 3.4)}, "a rectangle between two poses"
    return _moving("report_fig6", path, pale, shape, length=length, what=what)


def figure_7(*, plan: Plan = _ROUTE, length: float = 1.2) -> Drawing:
    """Draw a rectangle that follows a plan of velocities in the world frame, in steps of 0.1 s.

    Source: RR Fig. 7.

    Examples
    --------
    >>> drawing = figure_7(plan=[([1, 0, 0.5], 2), ([0, 1, 0], 1)])
    >>> drawing.data["theta [rad]"][[0, -1]]
    array([0., 1.])
    >>> plt.close(drawing.figure)
    """
    pieces, pale = _pieces(plan, 3)
    path = forward_propagate_rigid_body([0, 0, 0], pieces)
    shape, what = {"figsize": (7, 3.1), "dpi": 80}, "a rectangle that follows a plan"
    return _moving("report_fig7", path, pale, shape, 5.0, length=length, what=what)


def figure_8(
    *,
    start: ArrayLike = _FROM,
    goal: ArrayLike = _TO,
    steps: int = 60,
) -> Drawing:
    """Draw an arm whose joint angles change linearly between two postures.

    Source: RR Fig. 8.

    Examples
    --------
    >>> drawing = figure_8(goal=[1, 1])
    >>> plt.close(drawing.figure)
    """
    path = interpolate_arm(start, goal, steps=steps)
    pale = range(0, steps, max(1, round(steps / 4.6)))
    return _moving("report_fig8", path, pale, {"figsize": (4.2, 4.2)})


def figure_9(*, plan: Plan = _TURNS) -> Drawing:
    """Draw an arm that follows a plan of joint velocities, in steps of 0.1 s.

    Source: RR Fig. 9.

    Examples
    --------
    >>> drawing = figure_9(plan=[([1, 0], 1.5), ([0, 1], 1)])
    >>> plt.close(drawing.figure)
    """
    pieces, pale = _pieces(plan, 2)
    path = forward_propagate_arm([0, 0], pieces)
    return _moving("report_fig9", path, pale, {"figsize": (4.2, 4.2)})


FIGURES: dict[str, Callable[..., Drawing]] = {
    name[-1]: globals()[name] for name in __all__ if name.startswith("figure_")
}
"""The functions of the figures by their names."""


def _two_spheres(name: str, images: Images, kind: str) -> Drawing:
    with style():
        shape: Any = {"figsize": (5.8, 3), "layout": "none"}
        fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "space"}, **shape)
        fig.subplots_adjust(0, 0.08, 1, 0.9, 0)
        update = moving_images(axes, images)
        for ax, (v0, _) in zip(axes, images.values(), strict=True):
            said = f"middle half: {in_middle_half(v0)} of {len(v0)}"
            fig.text(np.mean(ax.get_position().intervalx), 0.02, said, ha="center")
    frames = len(next(iter(images.values()))[0]) + 1
    moving = update, frames, max(6.0, frames / 25)
    return Drawing(fig, name, image_table(images), describe_images(images, kind), moving)


def _pieces(plan: Plan, size: int) -> tuple[Plan, list[int]]:
    """Return a plan in steps of at most 0.1 s, and the states that are drawn in a pale colour.

    These are the ends of the commands, and the middle of each command that moves a body on an arc.
    """
    pieces: list[tuple[Array, float]] = []
    ends, middles = [0], list[int]()
    for velocity, duration in as_plan(plan, size):
        count = max(1, round(10 * duration))
        if size == 3 and velocity[2] and velocity[:2].any():
            middles.append(len(pieces) + count // 2)
        pieces += count * [(velocity, duration / count)]
        ends.append(len(pieces))
    return pieces, [*ends, *middles]


def _moving(
    name: str,
    path: Array,
    pale: Iterable[int],
    shape: dict[str, Any],
    seconds: float = 4.0,
    *,
    length: float | None = None,
    what: str = "",
) -> Drawing:
    """Draw a path of a rectangle, or of an arm if no length is given; `what` is for the caption."""
    with style():
        fig, ax = plt.subplots(**shape)
        if length is None:
            update, data, alt = moving_arm(ax, path, pale), joint_table(path), describe_arm(path)
        else:
            update = moving_route(ax, path, length, pale)
            data, alt = route_table(path), describe_route(path, what)
    return Drawing(fig, name, data, alt, (update, len(path), max(seconds, len(path) / 25)))


def _show_images(name: str, alt: str, images: Any) -> tuple[Figure, Animation]:
    fig, ax = plt.subplots(
        figsize=(5, 5), dpi=80, layout="none", subplot_kw={"projection": "space"}
    )
    frames = max(len(v0) for v0, _ in images.values()) + 1
    seconds = max(4.0, frames / 25)
    return fig, animate(fig, name, alt, moving_images([ax], images), frames, seconds)


def _show_path(
    name: str, alt: str, states: Array, moving: Callable[[Any, Any], Update]
) -> tuple[Figure, Animation]:
    """Show at most six equally spaced states in a pale colour, and animate at most 40 frames."""
    last = len(states) - 1
    pale, frames = (
        np.linspace(0, last, min(count, last + 1)).round().astype(int) for count in (6, 40)
    )
    fig, ax = plt.subplots(figsize=(5.5, 4.2), dpi=72)
    update = moving(ax, pale)
    return fig, animate(fig, name, alt, lambda i: update(frames[i]), len(frames))


def _passes(test: Callable[..., Any], x: ArrayLike, epsilon: float) -> bool:
    """Return whether x passes a membership test; a stack never passes."""
    epsilon = as_tolerance("epsilon", epsilon)
    try:
        verdict = test(x, epsilon)
    except ValueError:
        return False
    return np.ndim(verdict) == 0 and bool(verdict)


def _chosen(name: str, value: bool) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: True or False is wanted, got {value!r}")
    return bool(value)


def _rotation_vector(rotation: ArrayLike) -> Array:
    if check_SOn(rotation) and np.shape(rotation) == (3, 3):
        return log_so3(project_so(rotation))
    if check_quaternion(rotation):
        return rotation_vector_from_quaternion(project_quaternion(rotation))
    raise ValueError("rotation: a rotation matrix (3, 3) or a unit quaternion (4,) is wanted")


for _name in __all__:
    described_by(__doc__)(globals()[_name])
