"""Rigid bodies in the plane: poses (x, y, theta), the group SE(2), plans and paths.

Poses are in m, m and rad. Unless a docstring says otherwise, they are in the world frame. Angles
count full turns: theta and theta + 2π give the same orientation, but the latter has one more turn.
A twist is (vx, vy, omega) in the body frame. A plan is a list of commands (velocity, duration). A
path is an array with one row for each state.

Parameters
----------
pose, step : array_like, shape (..., 3)
    Poses (x, y, theta).
start, goal : array_like, shape (..., 3)
    Poses (x, y, theta) at both ends, in m, m and rad.
A : array_like, shape (..., 3, 3)
    Elements of SE(2), or matrices near them. The last row is not read.
S : array_like, shape (..., 3)
    Twists (vx, vy, omega), in m, m and rad for unit time; omega may have any size.
steps : int, optional
    The number of equal steps, at least 1.
plan : iterable of (velocity, duration)
    Velocities (vx, vy, vtheta) in m/s, m/s and rad/s, and durations of at least 0 in s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_count, as_finite, as_single, check_all, check_broadcast
from rbcourse._docs import described_by
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


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def matrix_from_planar(pose: ArrayLike) -> Array:
    """Return the matrices [[cos θ, −sin θ, x], [sin θ, cos θ, y], [0, 0, 1]] of planar poses.

    The matrices map coordinates in the body frame to coordinates in the world frame.
    Source: RR 3.1.

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


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def planar_from_matrix(A: ArrayLike) -> Array:
    """Return the planar poses (x, y, theta) of matrices, with −π ≤ theta ≤ π.

    The rotation nearest to the upper left block gives the angle. Singular set: blocks [[a, b], [b,
    −a]], to which all rotations are equally near; theta is then 0. At θ = ±π, rounding decides the
    sign.
    Source: RR 3.1.

    Examples
    --------
    >>> planar_from_matrix([[0, -1, 4], [1, 0, 5], [0, 0, 1]]).round(4)
    array([4.    , 5.    , 1.5708])
    """
    A = as_finite("A", A, 3, 3)
    block = scaled(A[..., :2, :2])  # so that nothing overflows
    sine, cosine = block[..., 1, 0] - block[..., 0, 1], block[..., 0, 0] + block[..., 1, 1]
    theta = np.arctan2(sine + 0.0, cosine + 0.0)  # removes the sign of a zero
    return np.concatenate([A[..., :2, 2], theta[..., None]], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def compose_planar(pose: ArrayLike, step: ArrayLike) -> Array:
    """Convert the pose `step` from the body frame of `pose` to the world frame.

    The matrix of the result is the product of the two matrices, and the angles add up.
    Source: RR 3.2.

    Examples
    --------
    >>> compose_planar([4, 5, np.pi / 2], [1, 0, np.pi]).round(4)  # one step ahead, and a half-turn
    array([4.    , 6.    , 4.7124])
    """
    pose, step = as_finite("pose", pose, 3), as_finite("step", step, 3)
    check_broadcast(pose=(pose, 1), step=(step, 1))
    moved = pose[..., :2] + _rotated(pose[..., 2], step[..., :2])
    return np.concatenate([moved, (pose[..., 2] + step[..., 2])[..., None]], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def inverse_planar(pose: ArrayLike) -> Array:
    """Return the pose of the world in the body frame; composed with `pose`, it gives (0, 0, 0).

    Source: RR 3.2.

    Examples
    --------
    >>> inverse_planar([4, 5, np.pi / 2]).round(4)  # the origin is 5 behind, 4 to the left
    array([-5.    ,  4.    , -1.5708])
    """
    pose = as_finite("pose", pose, 3)
    back = -pose[..., 2]
    return np.concatenate([-_rotated(back, pose[..., :2]), back[..., None]], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def exp_planar(S: ArrayLike) -> Array:
    """Return the pose to which the constant body twist S leads from (0, 0, 0) in unit time.

    The matrix of this pose is the exponential of [[0, −omega, vx], [omega, 0, vy], [0, 0, 0]].
    There is no singular set; omega = 0 gives the translation exactly. The vector (x, y) of the pose
    is (vx, vy), turned by omega/2 and multiplied by sin(omega/2) / (omega/2).
    Source: RR 3.2.

    Examples
    --------
    >>> exp_planar([np.pi, 0, np.pi]).round(4) + 0.0  # half a circle of radius 1, to the left
    array([0.    , 2.    , 3.1416])
    """
    S = as_finite("S", S, 3)
    half = S[..., 2:] / 2
    chord = sinc(half) * _rotated(half[..., 0], S[..., :2])
    return np.concatenate([chord, S[..., 2:]], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def log_planar(pose: ArrayLike) -> Array:
    """Return the body twist with −π ≤ omega ≤ π that leads from (0, 0, 0) to a pose in unit time.

    Singular set: half-turns, to which two twists lead. theta = π gives omega = π, and −π gives −π.
    If full turns are added to these angles, rounding decides the sign.
    Source: RR 3.1.

    Examples
    --------
    >>> log_planar([0, 2, np.pi]).round(4) + 0.0
    array([3.1416, 0.    , 3.1416])
    """
    pose = as_finite("pose", pose, 3)
    turn = _short(pose[..., 2:])
    chord = _rotated(-turn[..., 0] / 2, pose[..., :2])
    return np.concatenate([chord / sinc(turn / 2), turn], axis=-1)


@described_by(__doc__, returns="ndarray, shape (steps + 1, ..., 3)")
def interpolate_planar(
    start: ArrayLike, goal: ArrayLike, steps: int = 10, *, shortest: bool = False
) -> Array:
    """Return poses (x, y, theta) interpolated linearly, in equal steps, from start to goal.

    The path depends on which point of the body has the position (x, y). Singular set of `shortest`:
    angles that differ by half a turn. If the given angles differ by π or −π, the turn is this
    difference. If the angles also differ by full turns, rounding decides the sign of the turn. The
    first and the last row are exact.
    Source: RR 3.1, RR (14), RR (15), RR (16).

    Parameters
    ----------
    shortest : bool, optional
        Whether to turn by at most π (up to rounding). The last theta may then differ by full turns
        from the theta of `goal`. By default, theta changes from its given start to its given goal.

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


@described_by(__doc__, returns="ndarray, shape (commands + 1, ..., 3)")
def propagate_planar(start: ArrayLike, plan: Plan, *, frame: str = "world") -> Array:
    """Return the poses, with full turns, at the start and after each command of a plan.

    To see poses in between, divide a command.
    Source: RR 3.2, RR (17), RR (18), RR (19).

    Parameters
    ----------
    start : array_like, shape (..., 3)
        Poses (x, y, theta) at the start, in m, m and rad.
    frame : {"world", "body"}, optional
        The frame of vx and vy. With "world", a command adds its velocity times its duration. With
        "body", a command is a constant twist, which moves the body along an arc or a line
        (`exp_planar`).

    Examples
    --------
    >>> quarter = [([np.pi / 2, 0, np.pi / 2], 1)]  # a quarter of a circle to the left
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
    raise ValueError(f"frame: 'world' or 'body' is wanted, got {frame!r}")


def _rotated(theta: Array, vector: Array) -> Array:
    c, s, x, y = np.cos(theta), np.sin(theta), vector[..., 0], vector[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _short(angle: Array) -> Array:
    """Return angles without full turns; angles in [−π, π] are returned unchanged."""
    return np.where(np.abs(angle) <= np.pi, angle, np.arctan2(np.sin(angle), np.cos(angle)))


def as_plan(plan: Plan, size: int | str) -> Commands:
    """Return a list of checked commands; velocities have `size` numbers ("n": any number).

    ValueError names the malformed command and the reason.
    """
    try:
        commands = iter(plan)
    except TypeError as error:
        raise ValueError(f"plan: a list of (velocity, duration) is wanted, got {plan!r}") from error
    return [as_command(f"plan[{i}]", command, size) for i, command in enumerate(commands)]


def as_command(name: str, command: tuple[ArrayLike, float], size: int | str) -> tuple[Array, float]:
    """Return one checked command; error messages call it `name`."""
    try:
        velocity, duration = command
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: (velocity, duration) is wanted, got {command!r}") from error
    d = as_single(f"{name} duration", duration)
    check_all(d >= 0, f"{name} duration", d, "a duration from 0 up")
    return as_single(f"{name} velocity", velocity, size), float(d)


def interpolate(start: Array, goal: Array, steps: int) -> Array:
    """Interpolate linearly in equal steps; entries that are equal in start and goal are kept."""
    t = np.linspace(0, 1, as_count("steps", steps) + 1)
    batch = check_broadcast(start=(start, 1), goal=(goal, 1))
    t = t.reshape(-1, *[1] * (len(batch) + 1))
    return np.where(start == goal, start, (1 - t) * start + t * goal)


def propagate(start: Array, plan: Plan, move: Callable[[Array, Array], Array] = np.add) -> Array:
    """Return the start and the states after each ``move(state, velocity * duration)``."""
    path = [start]
    for i, (velocity, duration) in enumerate(as_plan(plan, start.shape[-1])):
        try:
            with np.errstate(over="raise"):
                path.append(move(path[-1], velocity * duration))
        except FloatingPointError as error:
            raise ValueError(f"plan[{i}] leads beyond the floating-point numbers") from error
    return np.array(path)
