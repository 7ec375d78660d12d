"""Velocities at poses of a path, from parabolas or from splines with continuous acceleration.

A cubic leg of duration h joins R₀ to R₁ = R₀ Q. At its ends, the ambient cubic M(t) of BK 6 has
M = R and M' = R ŵ. So its projection has w' = vee skew(Rᵀ M''), which is linear in the velocities.
With s = vee skew Q and the matrix B = ½ (tr Q I − Qᵀ), for which vee skew(Q ŵ) = B w,

    h² w'(0) = 6 s − 4 h w₀ − 2 h B w₁,    h² w'(1) = −6 s + 2 h Bᵀ w₀ + 4 h w₁.

The condition that w' is the same on both sides of each inner pose is a linear system for the
velocities. Each leg contributes a symmetric element (1/h) [[4 I, 2 B], [2 Bᵀ, 4 I]], and the load 6
s/h² at both of its ends. No singular value of B is larger than 1. So the system is diagonally
dominant and positive definite, and it has exactly one solution, for any poses. For unit quaternions
q = (cos ½θ, x) of Q, the element is the same with B = cos ½θ I + x̂, and the loads are 12 x/h². For
a body with the weight W, let K = Rᵀ M'' W. Then vee(K − Kᵀ) = τ = G w' + w × G w. For a continuous
torque, three things change: G replaces I; B is defined by B w = vee(Q ŵ W − (Q ŵ W)ᵀ); and the
loads are computed from Q W and −Qᵀ W. For the velocity of the origin in the body frame, B = Q.

Park and Ravani (Smooth invariant interpolation of rotations, 1997) construct invariant curves with
continuous acceleration and nearly least cost. McEnnan's quaternion spline (2003) and SciPy's
`RotationSpline` have cubic rotation vectors and solve a nonlinear system by iteration. In the
literature, we found no linear system for the velocities.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_inertia, as_single
from rbcourse._numerics import EPS, Array, matvec
from rbcourse.conversions import quaternion_from_matrix
from rbcourse.metrics import weight_of
from rbcourse.se3 import check_path
from rbcourse.so3 import hat, log_so3, right_jacobian_so3, vee

PathEnds = str | tuple[ArrayLike | None, ArrayLike | None]
"""The end conditions of a path: "natural", "periodic", or a pair of velocities."""

_SHORTEST, _LONGEST = 1e-100, 1e100  # limits of a duration
_NEAR_HALF_TURN = 1e-6
_EQUAL = 1e-12


def spline_velocities(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    inertia: ArrayLike | None = None,
) -> Array:
    """Return the velocities for which cubic legs join with a continuous acceleration.

    The velocities solve one linear system, which is positive definite for all poses. The computing
    time is proportional to N.
    Source: beyond BK 13.

    Parameters
    ----------
    times, poses
        As for `bessel_velocities`.
    ends : {"natural", "periodic"} or pair of array_like, optional
        "natural": the acceleration is 0 at both ends. "periodic": velocity and acceleration in the
        body frame are the same at both ends; the poses there may differ. A pair gives the first and
        the last velocity in the body frame: twists (ω, v), shape (6,), or ω, shape (3,). None in a
        pair means a natural end.
    inertia : array_like, shape (3, 3), optional
        The inertia of a body, as for `weighted_cubic_so3`. The torque is then continuous, and
        "natural" means zero torque at the ends. The default is 2 I.

    Returns
    -------
    ndarray, shape (N, 6) or (N, 3)
        Twists (ω, v), or angular velocities ω, per unit of the times, for the legs of
        `projected_spline_so3` and `projected_spline_se3`.

    Notes
    -----
    If the poses are moved, the velocities move with them; if the times are reversed, the velocities
    are those of the reversed path. For rotations about one axis by small angles, the velocities are
    those of SciPy's ``CubicSpline``. Singular set: successive poses that are a half-turn apart (up
    to 1e-6) raise ValueError, since no leg joins them.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> spline_velocities([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]])).round(3)
    array([[ 0.   , -0.093,  1.124],
           [ 0.101,  0.185,  0.512],
           [ 0.335,  0.345, -0.614]])
    """
    times, poses, _ = checked_path(times, poses)
    G = None if inertia is None else as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    fixed, given = as_ends(ends, len(poses), 3 if poses.shape[-1] == 3 else 6)
    parts = [rotation_system(times, poses[:, :3, :3], G)]
    if poses.shape[-1] == 4:
        parts.append(path_system(times, poses))
    columns = np.split(given, len(parts), axis=1)
    found = [x.solve(fixed, y, is_periodic(ends)) for x, y in zip(parts, columns, strict=True)]
    return np.concatenate(found, axis=1)


class KnotSystem(NamedTuple):
    """A quadratic function ½ xᵀ H x − xᵀ b of unknowns x at N knots: a sum over the legs.

    Each leg adds its element [[A, B], [Bᵀ, D]] to H and (b0, b1) to b at its two knots. The blocks
    have the shape (N − 1, m, m), and the loads the shape (N − 1, m).
    """

    A: Array
    B: Array
    D: Array
    b0: Array
    b1: Array

    def solve(self, fixed: NDArray[np.bool_], given: Array, periodic: bool = False) -> Array:
        """Return the minimizer x, shape (N, m), where x = `given` at the knots that are `fixed`.

        If `periodic`, x is the same at the first and the last knot. LinAlgError is raised if H is
        not positive definite.
        """
        from scipy.linalg import solveh_banded

        on, right = np.zeros((len(fixed), *self.A.shape[1:])), np.zeros_like(given)
        on[:-1] += self.A
        on[1:] += self.D
        right[:-1] += self.b0 - matvec(self.B, given[1:])
        right[1:] += self.b1 - matvec(self.B.mT, given[:-1])
        right -= matvec(on, given)
        on[fixed], right[fixed] = np.eye(on.shape[-1]), 0
        above = np.where((fixed[1:] | fixed[:-1])[:, None, None], 0, self.B)
        if not periodic:
            band = _band(on, above)
            return given + solveh_banded(band, right.ravel(), lower=True).reshape(given.shape)
        first, load = on[0] + on[-1], right[0] + right[-1]
        inner = np.zeros((len(on) - 2, *on.shape[1:]))  # columns that belong to the first knot
        if len(inner):
            inner[0] += above[0].mT
            inner[-1] += above[-1]
            columns = np.concatenate([inner, right[1:-1, :, None]], axis=-1)
            flat = columns.reshape(-1, columns.shape[-1])
            x = solveh_banded(_band(on[1:-1], above[1:-1]), flat, lower=True)
            by_first, alone = x[:, :-1], x[:, -1]
            first = first - inner.reshape(by_first.shape).T @ by_first
            load = load - inner.reshape(by_first.shape).T @ alone
        else:
            first = first + above[0] + above[0].mT
            by_first, alone = np.zeros((0, len(load))), np.zeros(0)
        np.linalg.cholesky((first + first.mT) / 2)  # raises LinAlgError if not positive definite
        end = np.linalg.solve(first, load)
        between = (alone - by_first @ end).reshape(-1, len(end))
        return np.concatenate([end[None], between, end[None]])


def _band(on: Array, above: Array) -> Array:
    """Return a symmetric block-tridiagonal matrix as a band of its lower half."""
    count, m = on.shape[:2]
    band = np.zeros((2 * m, m * count))
    for p in range(m):
        for q in range(m):
            if q <= p:
                band[p - q, q::m] = on[:, p, q]
            band[m + p - q, q : m * (count - 1) : m] = above[:, q, p]
    return band


def rotation_system(times: Array, R: Array, G: Array | None = None) -> KnotSystem:
    """Return the system of the angular velocities, in the metric G."""
    k, Q = 1 / np.diff(times)[:, None, None], R[:-1].mT @ R[1:]
    if G is None:
        same, load = 4 * k * np.eye(3), 3 * k[:, 0] ** 2 * _skew(Q)
        twice_B = np.trace(Q, axis1=1, axis2=2)[:, None, None] * np.eye(3) - Q.mT
        return KnotSystem(same, k * twice_B, same, load, load)
    W = weight_of("inertia", G)
    B = np.stack([_skew(Q @ unit @ W) for unit in hat(np.eye(3))], axis=-1)
    loads = (6 * k[:, 0] ** 2 * _skew(x) for x in (Q @ W, -Q.mT @ W))
    return KnotSystem(4 * k * G, 2 * k * B, 4 * k * G, *loads)


def quaternion_system(times: Array, R: Array, long: NDArray[np.bool_]) -> KnotSystem:
    """Return the system for unit quaternions; legs for which `long` is True turn the long way."""
    k, q = 1 / np.diff(times)[:, None, None], quaternion_from_matrix(R[:-1].mT @ R[1:])
    q = np.where(long[:, None], -q, q)
    same, load = 4 * k * np.eye(3), 12 * k[:, 0] ** 2 * q[:, 1:]
    return KnotSystem(same, 2 * k * (q[:, :1, None] * np.eye(3) + hat(q[:, 1:])), same, load, load)


def path_system(times: Array, poses: Array) -> KnotSystem:
    """Return the system of the velocities v = Rᵀ d' of the origin."""
    k, (R, d) = 1 / np.diff(times)[:, None, None], (poses[:, :3, :3], poses[:, :3, 3])
    same, chords = 4 * k * np.eye(3), 6 * k[:, 0] ** 2 * np.diff(d, axis=0)
    loads = matvec(R[:-1].mT, chords), matvec(R[1:].mT, chords)
    return KnotSystem(same, 2 * k * (R[:-1].mT @ R[1:]), same, *loads)


def _skew(X: Array) -> Array:
    return vee(X - X.mT)


def as_ends(ends: PathEnds, count: int, size: int) -> tuple[NDArray[np.bool_], Array]:
    """Return a mask of the poses whose velocities are given, and the velocities (0 elsewhere)."""
    fixed, given = np.zeros(count, bool), np.zeros((count, size))
    if isinstance(ends, str):
        if ends not in ("natural", "periodic"):
            raise ValueError(f"ends: 'natural', 'periodic' or a pair is wanted, got {ends!r}")
        return fixed, given
    if len(ends) != 2:
        raise ValueError(f"ends: a pair of velocities is wanted, got {len(ends)} of them")
    for place, value in ((0, ends[0]), (-1, ends[1])):
        if value is not None:
            fixed[place], given[place] = True, as_single("ends", value, size)
    return fixed, given


def is_periodic(ends: PathEnds) -> bool:
    """Return whether the end conditions are periodic."""
    return isinstance(ends, str) and ends == "periodic"


def resting_spline(times: Array, poses: Array) -> tuple[Array, Array, Array, Array]:
    """Return w, d', w' and d'' at the poses; for rotations, d' and d'' have no components.

    All of them are 0 at both ends and where two successive poses are equal up to rounding.
    """
    change, far = np.abs(np.diff(poses, axis=0)), np.abs(poses[:, :3, 3:]).max(initial=0)
    same = np.all(change[:, :3, :3] <= _EQUAL, axis=(1, 2))
    same &= np.all(change[:, :3, 3:] <= 64 * EPS * far, axis=(1, 2))
    rests, R = np.append(True, same) | np.append(same, True), poses[:, :3, :3]
    system, given = rotation_system(times, R), np.zeros((len(poses), 3))
    w = system.solve(rests, given)
    a = _accelerations(system, w)
    a[rests] = 0
    if poses.shape[-1] == 3:
        return w, np.zeros((len(R), 0)), a, np.zeros((len(R), 0))
    system = path_system(times, poses)
    v = system.solve(rests, given)
    bend = _accelerations(system, v)
    bend[rests] = 0
    return w, matvec(R, v), a, matvec(R, bend)


def _accelerations(system: KnotSystem, x: Array) -> Array:
    """Return the accelerations at the starts of the legs, and 0 at the end of the last leg."""
    starts = system.b0 - matvec(system.A, x[:-1]) - matvec(system.B, x[1:])
    return np.append(starts, np.zeros((1, 3)), axis=0)


def bessel_velocities(times: ArrayLike, poses: ArrayLike) -> Array:
    """Return velocities from parabolas; each parabola joins a pose to its two neighbours.

    A change of one pose affects only the velocities at this pose and at its neighbours. But the
    acceleration jumps at the poses. For random poses, the median excess of the cost over the
    optimum is 12 %, however small the steps are. The `spline_velocities` have neither drawback. If
    the poses are samples of a smooth motion, doubling their number divides the excess over the
    optimum (with the same end velocities) by 4.

    Parameters
    ----------
    times, poses : array_like, shapes (N,) and (N, 4, 4) or (N, 3, 3)
        Two or more increasing times, and for each of them a pose or a rotation matrix, valid to
        1e-9.

    Returns
    -------
    ndarray, shape (N, 6) or (N, 3)
        Twists (ω, v), or angular velocities ω, per unit of the times.

    Notes
    -----
    This is Bessel's choice (de Boor, A Practical Guide to Splines, chapter IV). For the origin, it
    is a parabola in R³. For the rotation, it is a parabola in exponential coordinates about the
    middle pose, so that the velocities move with the poses. At the first and the last pose, the
    parabola of the neighbour gives the velocity. For two poses, the velocity is constant.
    Singular set: neighbours that are a half-turn apart (up to 1e-6) raise ValueError.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> t = np.array([0, 1, 3])
    >>> bessel_velocities(t, exp_so3(t[:, None] ** 2 * [0, 0, 0.1])).round(12)  # 2 · 0.1 t
    array([[0. , 0. , 0. ],
           [0. , 0. , 0.2],
           [0. , 0. , 0.6]])
    """
    times, poses, _ = checked_path(times, poses)
    h, R, d = np.diff(times)[:, None], poses[:, :3, :3], poses[:, :3, 3:]
    turns = log_so3(R[:-1].mT @ R[1:])
    w = _slopes_of_parabolas(h, turns / h)
    for end, turn in ((0, -turns[0]), (-1, turns[-1])):
        w[end] = right_jacobian_so3(turn) @ w[end]  # convert from coordinates about the neighbour
    if not d.size:
        return w
    chords = np.diff(d[..., 0], axis=0)
    return np.concatenate([w, matvec(R.mT, _slopes_of_parabolas(h, chords / h))], axis=1)


def _slopes_of_parabolas(h: Array, slopes: Array) -> Array:
    bend = np.zeros((len(h) + 1, slopes.shape[1]))
    if len(h) > 1:
        bend[1:-1] = 2 * np.diff(slopes, axis=0) / (h[1:] + h[:-1])
        bend[0], bend[-1] = bend[1], bend[-2]
    return np.concatenate([slopes[:1] - h[:1] * bend[:1] / 2, slopes + h * bend[1:] / 2])


def checked_path(
    times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None
) -> tuple[Array, Array, Array | None]:
    """Return a checked path of two poses or more; neighbours must not be a half-turn apart."""
    times, poses, velocities = check_path(times, poses, velocities)
    if len(times) < 2:
        raise ValueError("times, poses: two or more are wanted, got 1")
    with np.errstate(over="ignore"):
        h = np.diff(times)
    odd = ~((h > _SHORTEST) & (h < _LONGEST))
    if odd.any():
        i = np.argmax(odd)
        raise ValueError(f"times[{i}] and times[{i + 1}] are {h[i]} apart: too close or too far")
    R = poses[:, :3, :3]
    far = np.sum(R[:-1] * R[1:], axis=(1, 2)) + 1 < _NEAR_HALF_TURN**2  # 2 + 2 cos(angle)
    if far.any():
        i = np.argmax(far)
        raise ValueError(
            f"poses[{i}] and poses[{i + 1}] are a half-turn apart: put a pose between them, "
            "to tell which way to turn"
        )
    return times, poses, velocities
