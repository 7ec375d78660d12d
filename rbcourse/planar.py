"""Rigid bodies in the plane: poses (x, y, theta), the group SE(2), plans and paths.

A pose (x, y, theta) counts full turns: theta and theta + 2π are the same orientation, reached after
another turn. A twist is (vx, vy, omega), in the order of the poses. A plan is a list of commands
(velocity, duration); a path is an array of states, one row each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_count, as_finite, as_single, check_broadcast
from rbcourse._numerics import Array, scaled, sinc

__all__ = [
    "Plan",
    "compose_planar",
    "exp_planar",
    "interpolate_planar",
    "inverse_planar",
    "log_planar",
    "matrix_from_planar",
    "planar_from_matrix",
    "propagate_planar",
]

Plan: TypeAlias = Iterable[tuple[ArrayLike, float]]
Commands: TypeAlias = list[tuple[Array, float]]


def matrix_from_planar(pose: ArrayLike) -> Array:
    """Return the matrices [[cos θ, −sin θ, x], [sin θ, cos θ, y], [0, 0, 1]] of planar poses.

    Source: RR 3.1.

    Parameters
    ----------
    pose : array_like, shape (..., 3)
        Poses (x, y, theta): m, m, rad, in the frame of the world.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Elements of SE(2); they carry coordinates of the body to those of the world.

    Examples
    --------
    >>> matrix_from_planar([4, 5, np.pi / 2]).round(12) + 0.0
    array([[ 0., -1.,  4.],
           [ 1.,  0.,  5.],
           [ 0.,  0.,  1.]])
    """
    pose = as_finite("pose", pose, 3)
    A = np.zeros((*pose.shape[:-1], 3, 3))
    A[..., 0, 0] = A[..., 1, 1] = np.cos(pose[..., 2])
    A[..., 1, 0] = np.sin(pose[..., 2])
    A[..., 0, 1] = -A[..., 1, 0]
    A[..., :2, 2], A[..., 2, 2] = pose[..., :2], 1
    return A


def planar_from_matrix(A: ArrayLike) -> Array:
    """Return the planar poses (x, y, theta) of matrices.

    Source: RR 3.1.

    Parameters
    ----------
    A : array_like, shape (..., 3, 3)
        Elements of SE(2). The rotation nearest to the upper left block is used; the last row is
        not read.

    Returns
    -------
    ndarray, shape (..., 3)
        Poses (x, y, theta): m, m, rad, −π ≤ theta ≤ π.

    Notes
    -----
    Singular set: blocks [[a, b], [b, −a]], reflections and zero among them, to which no rotation
    is nearest; theta is 0 there. At θ = ±π the sign is that of the rounding.

    Examples
    --------
    >>> planar_from_matrix([[0, -1, 4], [1, 0, 5], [0, 0, 1]]).round(4)
    array([4.    , 5.    , 1.5708])
    """
    A = as_finite("A", A, 3, 3)
    block = scaled(A[..., :2, :2])  # so that nothing overflows
    sine, cosine = block[..., 1, 0] - block[..., 0, 1], block[..., 0, 0] + block[..., 1, 1]
    theta = np.arctan2(sine + 0.0, cosine + 0.0)  # without the sign of a zero
    return np.concatenate([A[..., :2, 2], theta[..., None]], axis=-1)


def compose_planar(pose: ArrayLike, step: ArrayLike) -> Array:
    """Return the pose that is `step`, seen from `pose`: the product of the two, turns kept.

    Source: RR 3.2.

    Parameters
    ----------
    pose : array_like, shape (..., 3)
        Poses (x, y, theta): m, m, rad, in the frame of the world.
    step : array_like, shape (..., 3)
        Poses in the frame of the body.

    Returns
    -------
    ndarray, shape (..., 3)
        In the frame of the world. Its matrix is the product of theirs, and the angles add up.

    Examples
    --------
    >>> compose_planar([4, 5, np.pi / 2], [1, 0, np.pi]).round(4)  # a step ahead, and about-turn
    array([4.    , 6.    , 4.7124])
    """
    pose, step = as_finite("pose", pose, 3), as_finite("step", step, 3)
    check_broadcast(pose=(pose, 1), step=(step, 1))
    moved = pose[..., :2] + _rotated(pose[..., 2], step[..., :2])
    return np.concatenate([moved, (pose[..., 2] + step[..., 2])[..., None]], axis=-1)


def inverse_planar(pose: ArrayLike) -> Array:
    """Return the pose of the world, seen from the body.

    Source: RR 3.2.

    Parameters
    ----------
    pose : array_like, shape (..., 3)
        Poses (x, y, theta): m, m, rad, in the frame of the world.

    Returns
    -------
    ndarray, shape (..., 3)
        In the frame of the body: `compose_planar` of the two is (0, 0, 0).

    Examples
    --------
    >>> inverse_planar([4, 5, np.pi / 2]).round(4)  # the origin is 5 behind, 4 to the left
    array([-5.    ,  4.    , -1.5708])
    """
    pose = as_finite("pose", pose, 3)
    back = -pose[..., 2]
    return np.concatenate([-_rotated(back, pose[..., :2]), back[..., None]], axis=-1)


def exp_planar(S: ArrayLike) -> Array:
    """Return the pose that the constant body twist S reaches from (0, 0, 0) in unit time.

    Source: RR 3.2.

    Parameters
    ----------
    S : array_like, shape (..., 3)
        Twists (vx, vy, omega) in the frame of the body, in m, m and rad for unit time; omega may
        be more than a full turn.

    Returns
    -------
    ndarray, shape (..., 3)
        (x, y, omega): an arc of the angle omega was run through. (x, y) is its chord, that is
        (vx, vy), turned by omega/2, times sin(omega/2) / (omega/2).

    Notes
    -----
    No singular set; omega = 0 gives the translation exactly. `matrix_from_planar` of it is the
    exponential of the matrix [[0, −omega, vx], [omega, 0, vy], [0, 0, 0]].

    Examples
    --------
    >>> exp_planar([np.pi, 0, np.pi]).round(4) + 0.0  # half a circle of radius 1, to the left
    array([0.    , 2.    , 3.1416])
    """
    S = as_finite("S", S, 3)
    half = S[..., 2:] / 2
    chord = sinc(half) * _rotated(half[..., 0], S[..., :2])
    return np.concatenate([chord, S[..., 2:]], axis=-1)


def log_planar(pose: ArrayLike) -> Array:
    """Return the body twist that reaches a pose from (0, 0, 0) in unit time, by the short way.

    Source: RR 3.1.

    Parameters
    ----------
    pose : array_like, shape (..., 3)
        Poses (x, y, theta): m, m, rad; full turns in theta do not count.

    Returns
    -------
    ndarray, shape (..., 3)
        (vx, vy, omega), −π ≤ omega ≤ π; `exp_planar` of it is the pose, up to full turns.

    Notes
    -----
    Singular set: half-turns, which two twists reach. π itself is to the left, −π to the right;
    beyond, rounding decides.

    Examples
    --------
    >>> log_planar([0, 2, np.pi]).round(4) + 0.0
    array([3.1416, 0.    , 3.1416])
    """
    pose = as_finite("pose", pose, 3)
    turn = _short(pose[..., 2:])
    chord = _rotated(-turn[..., 0] / 2, pose[..., :2])
    return np.concatenate([chord / sinc(turn / 2), turn], axis=-1)


def interpolate_planar(
    start: ArrayLike, goal: ArrayLike, steps: int = 10, *, shortest: bool = False
) -> Array:
    """Return the path from one pose to another that blends x, y and theta evenly.

    Source: RR 3.1, RR (14), RR (15), RR (16).

    Parameters
    ----------
    start, goal : array_like, shape (..., 3)
        Poses (x, y, theta): m, m, rad, in the frame of the world.
    steps : int, optional
        How many equal steps, from 1 up.
    shortest : bool, optional
        Whether to turn the short way, by π at most (to rounding), whatever full turns the
        two angles differ by. By default theta goes from its start to its goal as given.

    Returns
    -------
    ndarray, shape (steps + 1, ..., 3)
        The first pose is the start, the last one the goal, exactly; with `shortest` its theta may
        differ from the goal's by full turns.

    Notes
    -----
    The place goes straight at constant speed and the body turns at a constant rate. Which point
    of the body is called its place makes a difference.

    Singular set of `shortest`: angles that differ by half a turn, where either way is as short.
    From 0, π is to the left and −π to the right; beyond, rounding decides.

    Examples
    --------
    >>> interpolate_planar([0, 0, 0], [4, 2, np.pi], steps=2)
    array([[0.        , 0.        , 0.        ],
           [2.        , 1.        , 1.57079633],
           [4.        , 2.        , 3.14159265]])
    """
    start, goal = as_finite("start", start, 3), as_finite("goal", goal, 3)
    if shortest:
        check_broadcast(start=(start, 1), goal=(goal, 1))
        turn = goal[..., 2] - start[..., 2]
        theta = np.where(np.abs(turn) <= np.pi, goal[..., 2], start[..., 2] + _short(turn))
        goal = np.stack(np.broadcast_arrays(goal[..., 0], goal[..., 1], theta), axis=-1)
    return interpolate(start, goal, steps)


def propagate_planar(start: ArrayLike, plan: Plan, *, frame: str = "world") -> Array:
    """Return the path that a plan makes a planar body go, one state more than commands.

    Source: RR 3.2, RR (17), RR (18), RR (19).

    Parameters
    ----------
    start : array_like, shape (..., 3)
        Pose (x, y, theta): m, m, rad, in the frame of the world.
    plan : iterable of (velocity, duration)
        Velocities (vx, vy, vtheta) in m/s, m/s and rad/s; durations from 0 up, in s. The empty
        plan leaves the start alone, and a command of no duration repeats the state.
    frame : {"world", "body"}, optional
        Whose x and y axes vx and vy are meant along: those of the world, or those of the body,
        which turn with it while the command lasts.

    Returns
    -------
    ndarray, shape (commands + 1, ..., 3)
        Poses in the frame of the world; the first is the start, exactly. Turns add up.

    Raises
    ------
    ValueError
        If the start is not finite or not of that shape, `frame` is neither of the two, or a
        command is malformed; the message says which and why.

    Notes
    -----
    In the world's frame a command adds velocity times duration. In the body's it is a constant
    twist, and the body runs through an arc, or a line: `exp_planar`, no small steps. The path has
    the ends of the commands only; cut a command into shorter ones to see what is between them.

    Examples
    --------
    >>> quarter = [([np.pi / 2, 0, np.pi / 2], 1)]  # ahead by a quarter of a circle, turning left
    >>> propagate_planar([0, 0, 0], quarter).round(4)[-1]
    array([1.5708, 0.    , 1.5708])
    >>> propagate_planar([0, 0, 0], quarter, frame="body").round(4)[-1]
    array([1.    , 1.    , 1.5708])
    """
    start = as_finite("start", start, 3)
    if frame == "world":
        return propagate(start, plan)
    if frame == "body":
        return propagate(start, plan, lambda pose, S: compose_planar(pose, exp_planar(S)))
    raise ValueError(f"frame: 'world' or 'body' wanted, got {frame!r}")


def _rotated(theta: Array, vector: Array) -> Array:
    """Return the vectors (x, y), turned by the angles theta."""
    c, s, x, y = np.cos(theta), np.sin(theta), vector[..., 0], vector[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _short(angle: Array) -> Array:
    """Return angles without their full turns; what is within π is left alone."""
    return np.where(np.abs(angle) <= np.pi, angle, np.arctan2(np.sin(angle), np.cos(angle)))


def as_plan(plan: Plan, size: int | str) -> Commands:
    """Return a plan as a list of commands, all of them checked.

    `size` is how many numbers a velocity has; "n" takes any.

    Raises
    ------
    ValueError
        If the plan or a command is malformed; the message says which and why.
    """
    try:
        commands = iter(plan)
    except TypeError as error:
        raise ValueError(f"plan: a list of (velocity, duration) wanted, got {plan!r}") from error
    return [as_command(f"plan[{i}]", command, size) for i, command in enumerate(commands)]


def as_command(name: str, command: tuple[ArrayLike, float], size: int | str) -> tuple[Array, float]:
    """Return one command as arrays; `name` is how it is called in messages."""
    try:
        velocity, duration = command
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: (velocity, duration) wanted, got {command!r}") from error
    d = float(as_single(f"{name} duration", duration))
    if d < 0:
        raise ValueError(f"{name} duration is {d}, a duration from 0 up is wanted")
    return as_single(f"{name} velocity", velocity, size), d


def as_states(path: ArrayLike) -> Array:
    """Return a path as an array of shape (states, k), at least one state.

    Raises
    ------
    ValueError
        If it has another shape, or an entry is not finite; the message names the first.
    """
    return as_single("path", path, "states", "k")


def interpolate(start: Array, goal: Array, steps: int) -> Array:
    """Return (1 − t) start + t goal at steps + 1 even times t in [0, 1], time first.

    Entries that are equal at both ends stay exactly equal.
    """
    t = np.linspace(0, 1, as_count("steps", steps) + 1)
    batch = check_broadcast(start=(start, 1), goal=(goal, 1))
    t = t.reshape(-1, *[1] * (len(batch) + 1))
    return np.where(start == goal, start, (1 - t) * start + t * goal)


def propagate(start: Array, plan: Plan, move: Callable[[Array, Array], Array] = np.add) -> Array:
    """Return the states from a start on, one more than commands, time first.

    Each is ``move(state, velocity * duration)`` of the one before it.
    """
    path = [start]
    for i, (velocity, duration) in enumerate(as_plan(plan, start.shape[-1])):
        try:
            with np.errstate(over="raise"):
                path.append(move(path[-1], velocity * duration))
        except FloatingPointError as error:
            raise ValueError(f"plan[{i}] leads beyond all numbers") from error
    return np.array(path)
