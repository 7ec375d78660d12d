"""The functions of the report RR, under its own names and with its signatures.

Each hands its work to the package. Arguments that the report does not have are keyword-only.
Inputs of a wrong shape, or not finite, fail a check and are refused by a correction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import Rng, as_count, as_generator, as_single, as_tolerance, as_unit
from rbcourse._numerics import Array
from rbcourse.arm import LINKS, interpolate_joints, propagate_joints
from rbcourse.conversions import rotation_vector_from_quaternion
from rbcourse.draw.animate import Animation, Update, animate
from rbcourse.draw.arm import describe_arm, moving_arm
from rbcourse.draw.plane import describe_route, extent_of, moving_route
from rbcourse.draw.spheres import describe_images, moving_images
from rbcourse.planar import Plan, as_states, interpolate_planar, propagate_planar
from rbcourse.projection import is_se, is_so, project_se, project_so
from rbcourse.quaternion import is_unit_quaternion, project_quaternion, rotate_by_quaternion
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


def check_SOn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether m is a rotation matrix: mᵀm = I and det m = 1, each entry within epsilon.

    Only one square matrix of finite real numbers can pass; [[1]] is in SO(1). A negative or NaN
    epsilon is a ValueError.

    Source: RR 1.1, RR (1), RR (2).

    Examples
    --------
    >>> check_SOn([[0, -1], [1, 0]]), check_SOn([[0, 1], [1, 0]]), check_SOn([[1, 0]])
    (True, False, False)
    """
    return _passes(is_so, m, epsilon)


def check_quaternion(v: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether v is a unit quaternion (w, x, y, z): its norm is 1 within epsilon.

    Source: RR 1.2, RR (3).

    Examples
    --------
    >>> check_quaternion([0.5, 0.5, 0.5, 0.5]), check_quaternion([1, 1, 0, 0])
    (True, False)
    """
    return _passes(is_unit_quaternion, v, epsilon)


def check_SEn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether m is a pose: a rotation, any translation, and the last row 0, …, 0, 1.

    Only one matrix of 2 × 2 or larger can pass; the rotation and the last row are taken within
    epsilon, as `check_SOn` takes them.

    Source: RR 1.3.

    Examples
    --------
    >>> check_SEn([[0, -1, 5], [1, 0, 7], [0, 0, 1]]), check_SEn([[1]])
    (True, False)
    """
    return _passes(is_se, m, epsilon)


def correct_SOn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return a copy of m if it passes `check_SOn`, else the rotation matrix nearest to it.

    m is any square matrix, singular or reflected too; anything else is a ValueError.

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
    """Return a copy of v if it passes `check_quaternion`, else v over its norm.

    v has four finite real numbers (w, x, y, z), not all zero; anything else is a ValueError.

    Source: RR 1.5, RR (6), RR Fig. 2.

    Examples
    --------
    >>> correct_quaternion([2, 2, 0, 0])
    array([0.70710678, 0.70710678, 0.        , 0.        ])
    """
    return np.array(v) if check_quaternion(v, epsilon) else as_unit("v", as_single("v", v, 4), 4)


def correct_SEn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return a copy of m if it passes `check_SEn`, else the pose nearest to it.

    m is any matrix (n + 1, n + 1), n ≥ 1: its rotation is corrected, its translation kept, and the
    last row replaced by 0, …, 0, 1. Anything else is a ValueError.

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
    """Return a random rotation matrix, shape (3, 3).

    With ``naive=True`` three angles are uniform, and the rotation is not; with False it is, by
    Arvo's method. `rng` is a Generator, a seed or None.

    Source: RR 2.1.

    Examples
    --------
    >>> check_SOn(random_rotation_matrix(naive=False), 1e-14)
    True
    """
    return (sample_rotation_naive if _chosen("naive", naive) else sample_rotation)(rng=rng)


def random_quaternion(naive: bool, *, rng: Rng = None) -> Array:
    """Return a random unit quaternion, shape (4,); uniform, by Shoemake's method, if not naive.

    Source: RR 2.2.

    Examples
    --------
    >>> check_quaternion(random_quaternion(naive=False), 1e-14)
    True
    """
    return (sample_quaternion_naive if _chosen("naive", naive) else sample_quaternion)(rng=rng)


def visualize_rotation(rotation: ArrayLike, *, steps: int = 24) -> tuple[Figure, Animation]:
    """Show how a rotation carries v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0) over the sphere.

    Source: RR 2.2.

    Parameters
    ----------
    rotation : array_like, shape (3, 3) or (4,)
        A rotation matrix or a unit quaternion, within 0.01; the nearest one is shown.
    steps : int, optional
        In how many equal steps about one axis it is reached.

    Returns
    -------
    figure : Figure
        The sphere with all images.
    animation : Animation
        They appear one by one. A notebook shows a player; ``animation.save(path)`` writes a GIF.

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
    """Show where 100 random rotations carry v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0).

    Source: RR 2.2, RR Fig. 4, RR Fig. 5.

    Parameters
    ----------
    quaternion : bool
        True for `random_quaternion`, with v ↦ q v q⁻¹; False for `random_rotation_matrix`.
    naive : bool, optional
        Whether the angles are uniform; the rotations are not then.
    rng : Generator, int or None, optional
        Where the random numbers come from.
    steps : int, optional
        How many rotations.

    Returns
    -------
    figure, animation
        As for `visualize_rotation`.

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
    """Return the path from one planar pose to another that blends x, y and theta evenly.

    Poses are (x, y, theta) in m, m and rad, shape (3,); the path has the shape (steps + 1, 3).
    With `shortest` the body turns the short way. See `rbcourse.planar.interpolate_planar`.

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
    """Return the path that a plan makes a planar body go, shape (commands + 1, 3).

    The plan is a list of (velocity, duration): velocities (vx, vy, vtheta) in m/s, m/s and rad/s,
    durations from 0 up, in s. `frame`, "world" as in the report or "body", says along whose axes
    vx and vy are. See `rbcourse.planar.propagate_planar`.

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
    """Show a path of planar poses: a rectangle that turns with its pose, and its way.

    Source: RR 3.3, RR Fig. 6, RR Fig. 7.

    Parameters
    ----------
    path : array_like, shape (states, 3)
        Poses (x, y, theta): m, m, rad; one state is enough.
    length : float, optional
        How long the rectangle is, in m; by default a fifth of the larger extent of the path, and
        1 for a path that stays where it is, to 1e-12 of a metre or of its distance from the origin.

    Returns
    -------
    figure : Figure
        The whole way, and the rectangle at its end; pale at its start and on its way.
    animation : Animation
        A frame for each state, or for 40 of them. A notebook shows a player;
        ``animation.save(path)`` writes a GIF.

    Notes
    -----
    Lines join the states. To see the arc of a command in the frame of the body, cut it into shorter
    ones first.

    Examples
    --------
    >>> figure, animation = visualize_path([[0, 0, 0], [4, 2, 1]])
    >>> animation
    path: A rectangle goes from (0, 0) m, heading 0 degrees, to (4, 2) m, heading 57 degrees. From
    state to state its centre covers 4.47 m, and it turns by 57 degrees to the left.
    >>> plt.close(figure)
    """
    states = as_single("path", path, "states", 3)
    far = np.abs(states[:, :2]).max()
    if length is None:
        length = extent_of(states) / 5 or max(1.0, 1e-12 * far)
    if not as_single("length", length) > 1e-13 * far:
        raise ValueError(f"length: above 0 wanted, and enough to be seen, got {length!r}")
    return _show_path(
        "path", describe_route(states), states, lambda ax, p: moving_route(ax, states, length, p)
    )


def interpolate_arm(start: ArrayLike, goal: ArrayLike, *, steps: int = 10) -> Array:
    """Return the path that takes each joint angle evenly from its start to its goal.

    Angles are in rad, shape (n,), n = 2 for the arm of the report; the path has the shape
    (steps + 1, n). See `rbcourse.arm.interpolate_joints`.

    Source: RR 4.1, RR (20), RR (21).

    Examples
    --------
    >>> interpolate_arm([0, 0], [1, -2])[5]
    array([ 0.5, -1. ])
    """
    start = as_single("start", start, "n")
    return interpolate_joints(start, as_single("goal", goal, start.size), steps)


def forward_propagate_arm(start_pose: ArrayLike, plan: Plan) -> Array:
    """Return the path that a plan makes an arm go, shape (commands + 1, n).

    `start_pose` (the report's name) are joint angles in rad, shape (n,); the plan is a list of
    (velocity, duration), with the velocities of the joints in rad/s and durations from 0 up, in s.
    See `rbcourse.arm.propagate_joints`.

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
    """Show a path of an arm: its links in blue, and the way of its tip, a red curve that grows.

    Source: RR 4.3, RR Fig. 8, RR Fig. 9.

    Parameters
    ----------
    path : array_like, shape (states, n)
        Joint angles, in rad; one state is enough.
    lengths : array_like, shape (n,), optional
        Lengths of the links, in m, above 0.

    Returns
    -------
    figure : Figure
        The whole way of the tip, and the arm at its end; pale at its start and on its way.
    animation : Animation
        As for `visualize_path`.

    Examples
    --------
    >>> figure, animation = visualize_arm_path([[0, 0], [0, 1.57]])
    >>> animation
    arm_path: An arm with links of 2 and 1.5 m turns its joints from 0 and 0 to 0 and 90 degrees,
    by 0 and 90 degrees in all. From state to state its tip covers 2.12 m, from (3.5, 0) to
    (2, 1.5) m; its way is drawn in red.
    >>> plt.close(figure)
    """
    states = as_states(path)
    alt = describe_arm(states, lengths)
    return _show_path("arm_path", alt, states, lambda ax, p: moving_arm(ax, states, p, lengths))


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
    """Show a path; six states of it pale, at even distances, and 40 as frames."""
    last = len(states) - 1
    pale, frames = (
        np.linspace(0, last, min(count, last + 1)).round().astype(int) for count in (6, 40)
    )
    fig, ax = plt.subplots(figsize=(5.5, 4.2), dpi=72)
    update = moving(ax, pale)
    return fig, animate(fig, name, alt, lambda i: update(frames[i]), len(frames))


def _passes(test: Callable[..., Any], x: ArrayLike, epsilon: float) -> bool:
    """Return the membership test's result for a single matrix; a stack is rejected."""
    epsilon = as_tolerance("epsilon", epsilon)
    try:
        verdict = test(x, epsilon)
    except ValueError:
        return False
    return np.ndim(verdict) == 0 and bool(verdict)


def _chosen(name: str, value: bool) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: True or False wanted, got {value!r}")
    return bool(value)


def _rotation_vector(rotation: ArrayLike) -> Array:
    if check_SOn(rotation) and np.shape(rotation) == (3, 3):
        return log_so3(project_so(rotation))
    if check_quaternion(rotation):
        return rotation_vector_from_quaternion(project_quaternion(rotation))
    raise ValueError("rotation: a rotation matrix (3, 3) or a unit quaternion (4,) is wanted")
