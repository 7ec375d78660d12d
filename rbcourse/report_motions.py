"""The functions of the report RR on motions, sections 3 and 4, under its own names.

Each hands its work to the package.
"""

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from rbcourse._checks import as_single
from rbcourse._numerics import Array
from rbcourse.arm import LINKS, interpolate_joints, propagate_joints
from rbcourse.draw.animate import Animation, animate
from rbcourse.draw.arm import arm_table, describe_arm, moving_arm
from rbcourse.draw.plane import describe_route, extent_of, moving_route, route_table
from rbcourse.planar import Plan, as_states, interpolate_planar, propagate_planar


def interpolate_rigid_body(
    start_pose: ArrayLike, goal_pose: ArrayLike, *, steps: int = 10, shortest: bool = False
) -> Array:
    """Return the path from one planar pose to another that blends x, y and theta evenly.

    Parameters
    ----------
    start_pose, goal_pose : array_like, shape (3,)
        Poses (x, y, theta): m, m, rad.
    steps : int, optional
        How many equal steps, from 1 up.
    shortest : bool, optional
        Whether to turn the short way; by default theta goes as far as the two numbers say.

    Returns
    -------
    ndarray, shape (steps + 1, 3)

    Raises
    ------
    ValueError
        If a pose is not three finite numbers, or `steps` is not an integer from 1 up.

    See Also
    --------
    interpolate_planar : The same, and more about it.

    References
    ----------
    RR 3.1, RR (14), RR (15), RR (16).

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
    """Return the path that a plan makes a planar body go.

    Parameters
    ----------
    start_pose : array_like, shape (3,)
        Pose (x, y, theta): m, m, rad.
    plan : iterable of (velocity, duration)
        N commands: velocities (vx, vy, vtheta) in m/s, m/s, rad/s; durations from 0 up, in s.
    frame : {"world", "body"}, optional
        Whose x and y axes the velocities are meant along; the report means the world's.

    Returns
    -------
    ndarray, shape (N + 1, 3)

    Raises
    ------
    ValueError
        If the pose is not three finite numbers, a command is none, or `frame` is neither.

    See Also
    --------
    propagate_planar : The same, and more about it.

    References
    ----------
    RR 3.2, RR (17), RR (18), RR (19).

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

    Parameters
    ----------
    path : array_like, shape (states, 3)
        Poses (x, y, theta): m, m, rad; one may be all.
    length : float, optional
        How long the rectangle is, in m; by default a fifth of the larger extent of the path, and
        1 for a path that stays where it is, but for rounding (1e-12 of a metre or of its distance
        from the origin).

    Returns
    -------
    figure : Figure
        The whole way, and the rectangle at its end; pale at its start and on its way.
    animation : Animation
        A frame for each state, or for 40 of them. A notebook shows a player;
        ``animation.save(path)`` writes a GIF.

    Raises
    ------
    ValueError
        If `path` is no such array, or the length is not above 0, or less than 1e-13 of the
        distance from the origin.

    Notes
    -----
    Lines join the states. To see the arc that a command in the frame of the body runs through,
    cut it into shorter ones first.

    References
    ----------
    RR 3.3, RR Fig. 6, RR Fig. 7.

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
    data = route_table(states)
    return _show("path", describe_route(data), len(states), moving_route, data, length)


def interpolate_arm(start: ArrayLike, goal: ArrayLike, *, steps: int = 10) -> Array:
    """Return the path that takes each joint angle evenly from its start to its goal.

    Parameters
    ----------
    start, goal : array_like, shape (n,)
        Joint angles, in rad: n = 2 for the arm of the report.
    steps : int, optional
        How many equal steps, from 1 up.

    Returns
    -------
    ndarray, shape (steps + 1, n)

    Raises
    ------
    ValueError
        If the two are not equally many finite numbers, or `steps` is not an integer from 1 up.

    See Also
    --------
    interpolate_joints : The same, and more about it.

    References
    ----------
    RR 4.1, RR (20), RR (21).

    Examples
    --------
    >>> interpolate_arm([0, 0], [1, -2])[5]
    array([ 0.5, -1. ])
    """
    start = as_single("start", start, "n")
    return interpolate_joints(start, as_single("goal", goal, start.size), steps)


def forward_propagate_arm(start_pose: ArrayLike, plan: Plan) -> Array:
    """Return the path that a plan makes an arm go.

    Parameters
    ----------
    start_pose : array_like, shape (n,)
        Joint angles, in rad (the report's name for them is kept): n = 2 for its arm.
    plan : iterable of (velocity, duration)
        N commands: velocities of the joints, in rad/s; durations from 0 up, in s.

    Returns
    -------
    ndarray, shape (N + 1, n)

    Raises
    ------
    ValueError
        If the angles are not finite numbers, or a command is none.

    See Also
    --------
    propagate_joints : The same, and more about it.

    References
    ----------
    RR 4.2, RR (22), RR (23).

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

    Parameters
    ----------
    path : array_like, shape (states, n)
        Joint angles, in rad; one state may be all.
    lengths : array_like, shape (n,), optional
        Lengths of the links, in m, above 0.

    Returns
    -------
    figure : Figure
        The whole way of the tip, and the arm at its end; pale at its start and on its way.
    animation : Animation
        A frame for each state, or for 40 of them. A notebook shows a player;
        ``animation.save(path)`` writes a GIF.

    Raises
    ------
    ValueError
        If `path` is no such array, or there is not one length above 0 for each joint.

    References
    ----------
    RR 4.3, RR Fig. 8, RR Fig. 9.

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
    data = arm_table(states, lengths)
    return _show("arm_path", describe_arm(data), len(states), moving_arm, data)


def _show(
    name: str, alt: str, states: int, moving: Callable[..., Any], data: Any, *more: float
) -> tuple[Figure, Animation]:
    """Show a path; six states of it pale, at even distances, and 40 as frames."""
    pale, frames = (
        np.linspace(0, states - 1, min(count, states)).round().astype(int) for count in (6, 40)
    )
    fig, ax = plt.subplots(figsize=(5.5, 4.2), dpi=72)
    update = moving(ax, data, *more, pale)
    animation = animate(fig, name, alt, lambda i: update(frames[i]), len(frames))
    return fig, animation
