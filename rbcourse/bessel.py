"""Velocities for a path of poses: Bessel's parabolas, and where it rests."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array
from rbcourse.so3 import log_so3, right_jacobian_so3
from rbcourse.trajectories import as_samples

SHORTEST, LONGEST = 1e-100, 1e100
"""Between these durations lie, so that squares do not overflow."""
_HALF_TURN = math.pi - 1e-6
_EQUAL = 1e-12


def bessel_velocities(times: ArrayLike, poses: ArrayLike) -> Array:
    """Return velocities for a path: at each pose of the parabola through it and its neighbours.

    Parameters
    ----------
    times : array_like, shape (N,)
        Increasing; two or more.
    poses : array_like, shape (N, 4, 4) or (N, 3, 3)
        Poses, or rotation matrices, one for each time.

    Returns
    -------
    ndarray, shape (N, 6) or (N, 3)
        Twists (ω, v), or angular velocities ω, body frame, per unit of the times.

    Raises
    ------
    ValueError
        If times do not increase, a matrix is no pose or no rotation, or neighbours are a half-turn
        apart, to 1e-6.

    See Also
    --------
    chain : The curve; it takes these velocities but at its ends, where it rests.

    Notes
    -----
    Bessel's choice (de Boor, A Practical Guide to Splines, chapter IV); for even times, that of
    Catmull and Rom. The parabola of the origin is one in R³; that of the rotation is one in the
    exponential coordinates about the pose in the middle, so that moved poses have moved velocities.
    The first and the last pose have what the parabolas of their neighbours have there; two poses
    alone have the constant velocity between them.

    Singular set: half-turns between neighbours.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> t = np.array([0, 1, 3])
    >>> bessel_velocities(t, exp_so3(t[:, None] ** 2 * [0, 0, 0.1])).round(12)  # 2 · 0.1 t
    array([[0. , 0. , 0. ],
           [0. , 0. , 0.2],
           [0. , 0. , 0.6]])
    """
    times, poses, _ = as_path(times, poses)
    w, d_dot, *_ = _parabolas(times, poses)
    return twists(poses, w, d_dot)


def as_path(
    times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None
) -> tuple[Array, Array, Array | None]:
    """Return `as_samples`, of two poses or more, no neighbours a half-turn apart."""
    times, poses, velocities = as_samples(times, poses, velocities)
    if len(times) < 2:
        raise ValueError("times, poses: two or more wanted, got 1")
    with np.errstate(over="ignore"):
        h = np.diff(times)
    odd = ~((h > SHORTEST) & (h < LONGEST))
    if odd.any():
        i = np.argmax(odd)
        raise ValueError(f"times[{i}] and times[{i + 1}] are {h[i]} apart: too near, or too far")
    far = np.linalg.norm(_turns(poses), axis=-1) > _HALF_TURN
    if far.any():
        i = np.argmax(far)
        raise ValueError(
            f"poses[{i}] and poses[{i + 1}] are a half-turn apart: put a pose between them, "
            "to tell which way to turn"
        )
    return times, poses, velocities


def _turns(poses: Array) -> Array:
    """Return the rotation vectors from each pose to the next, body frame."""
    R = poses[:, :3, :3]
    return log_so3(R[:-1].mT @ R[1:])


def _parabolas(times: Array, poses: Array) -> tuple[Array, Array, Array, Array]:
    """Return w and d', w' and d'' of the parabolas; d has no components for rotations."""
    h, turns = np.diff(times)[:, None], _turns(poses)
    d = poses[:, :3, 3:].reshape(len(poses), -1)
    w, a = _parabola(h, turns / h)
    for end, turn in ((0, -turns[0]), (-1, turns[-1])):
        w[end] = right_jacobian_so3(turn) @ w[end]  # coordinates about the neighbour
    d_dot, d_bend = _parabola(h, np.diff(d, axis=0) / h)
    return w, d_dot, a, d_bend


def parabolas_and_rests(times: Array, poses: Array) -> tuple[Array, Array, Array, Array]:
    """Return the same, but 0 where a path rests: at its ends, and at equal neighbours."""
    change, far = np.abs(np.diff(poses, axis=0)), np.abs(poses[:, :3, 3:]).max(initial=0)
    same = np.all(change[:, :3, :3] <= _EQUAL, axis=(1, 2))
    same &= np.all(change[:, :3, 3:] <= 64 * EPS * far, axis=(1, 2))
    rates = _parabolas(times, poses)
    for values in rates:
        values[np.append(True, same) | np.append(same, True)] = 0
    return rates


def _parabola(h: Array, slopes: Array) -> tuple[Array, Array]:
    """Return the first and the second derivatives of the parabolas, from chords and their slopes.

    At the ends they are those of the neighbours' parabolas; of one chord, a line.
    """
    bend = np.zeros((len(h) + 1, slopes.shape[1]))
    if len(h) > 1:
        bend[1:-1] = 2 * np.diff(slopes, axis=0) / (h[1:] + h[:-1])
        bend[0], bend[-1] = bend[1], bend[-2]
    first, others = slopes[:1] - h[:1] * bend[:1] / 2, slopes + h * bend[1:] / 2
    return np.concatenate([first, others]), bend


def rotated(poses: Array, v: Array) -> Array:
    """Return vectors of body frames in the fixed frame."""
    return (poses[:, :3, :3] @ v[..., None])[..., 0] if v.size else v


def twists(poses: Array, w: Array, d_dot: Array) -> Array:
    """Return (w, Rᵀ d'), or w where nothing moves."""
    return np.concatenate([w, rotated(poses.mT, d_dot)], axis=-1)
