"""Velocities at poses of a path, from parabolas or from splines with continuous acceleration.

A cubic leg of duration h joins R₀ to R₁ = R₀ Q. At its ends, the ambient cubic M(t) of BK 6 has
M = R and M' = R ŵ. So its projection has w' = vee skew(Rᵀ M''), which is linear in the velocities.
With s = vee skew Q and the matrix B = ½ (tr Q I − Qᵀ), for which vee skew(Q ŵ) = B w,

    h² w'(0) = 6 s − 4 h w₀ − 2 h B w₁,    h² w'(1) = −6 s + 2 h Bᵀ w₀ + 4 h w₁.

The condition that w' is the same on both sides of each inner pose is a linear system for the
velocities. Each leg contributes a symmetric element (1/h) [[4 I, 2 B], [2 Bᵀ, 4 I]], and the load
6 s/h² at both of its ends. No singular value of B is larger than 1. So the system is diagonally
dominant and positive definite, and has exactly one solution, for any poses. For unit quaternions
q = (cos ½θ, x) of Q, the element is the same with B = cos ½θ I + x̂, and the loads are 12 x/h². For
a body with the weight W, let K = Rᵀ M'' W. Then vee(K − Kᵀ) = τ = G w' + w × G w. For a continuous
torque, G replaces I, B w = vee(Q ŵ W − (Q ŵ W)ᵀ), and Q W and −Qᵀ W give the loads. For the
velocity of the origin in the body frame, B = Q.

Park and Ravani (Smooth invariant interpolation of rotations, 1997) construct invariant curves with
continuous acceleration and nearly least cost. McEnnan's quaternion spline (2003) and SciPy's
`RotationSpline` solve a nonlinear system by iteration. We found no linear system in the literature.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_finite, as_single
from rbcourse._docs import described_by
from rbcourse._numerics import Array, matvec
from rbcourse._quaternions import quaternion_of
from rbcourse.body import Body, weight_of
from rbcourse.curves.ends import as_body
from rbcourse.se3 import check_path
from rbcourse.so3 import hat, log, right_jacobian_so3, vee

PathEnds: TypeAlias = (
    Literal["natural", "rest", "periodic"] | tuple[ArrayLike | None, ArrayLike | None] | Array
)
"""The end conditions of a path: a word, or a pair of velocities."""

_SHORTEST, _LONGEST = 1e-100, 1e100  # limits of a duration
_CLOSE = 1e-5  # of the usual step; closer times are refused [at 1e-6, w' jumps by 1 %]
_NEAR_HALF_TURN = 1e-6  # rad; nearer, entries rounded to 1e-16 change the axis by over 1e-10
_ENDS = "'natural', 'rest', 'periodic' or a pair of velocities"


def spline_velocities(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    *,
    rest_at: Sequence[int] | NDArray[np.integer] = (),
    body: Body | None = None,
) -> Array:
    """Return the velocities for which cubic legs join with a continuous acceleration.

    They solve one linear system, in a time proportional to N. It is definite for all poses.
    Source: beyond BK 13.

    Parameters
    ----------
    times : array_like, shape (N,)
        Two or more increasing times.
    poses : array_like, shape (N, 3, 3) or (N, 4, 4)
        A rotation matrix or a pose for each of the times.
    ends : {"natural", "rest", "periodic"} or pair of array_like, optional
        "natural": the acceleration (for a body, the torque) is 0 at both ends. "rest": the velocity
        is 0 at both ends. "periodic": velocity and acceleration in the body frame are the same at
        both ends; the poses there may differ. A pair gives the first and the last velocity in the
        body frame: angular velocities, shape (3,), or twists (ω, v), shape (6,). None in a pair
        means a natural end.
    rest_at : sequence of int, optional
        The indices of other poses at which the velocity is 0; repeated poses are not implied.
    body : Body, optional
        The body that moves, by default the ball of metric (12). Each of its principal moments is at
        most the sum of the other two. The torque is then continuous, and the centre of mass moves
        on a cubic spline.

    Returns
    -------
    ndarray, shape (N, 6) or (N, 3)
        Twists (ω, v), or angular velocities ω, per unit of the times, for the legs of
        `projected_spline`.

    Notes
    -----
    If the poses are moved, the velocities move with them; reversed times reverse them. For
    rotations about one axis by small angles, they are those of SciPy's ``CubicSpline``.
    Singular set: successive poses a half-turn apart (up to 1e-6) raise ValueError.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> spline_velocities([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]])).round(3)
    array([[ 0.   , -0.093,  1.124],
           [ 0.101,  0.185,  0.512],
           [ 0.335,  0.345, -0.614]])
    """
    times, poses, _ = checked_path(times, poses)
    conditions = as_ends(ends, len(poses), 3 * poses.shape[-1] - 6, rest_at)
    body = as_body(body, Body.ball())
    h, R = np.diff(times), poses[:, :3, :3]
    turning = conditions._replace(given=conditions.given[:, :3])
    w = _rotation_system(h, R, body).solve(turning)
    if poses.shape[-1] == 3:
        return w
    return np.concatenate([w, path_velocities(h, poses, w, conditions, body.centre)], axis=1)


def path_velocities(h: Array, poses: Array, w: Array, conditions: Conditions, r: Array) -> Array:
    """Return v = Rᵀ d' at the poses; the point r of the body moves on a cubic spline."""
    R = poses[:, :3, :3]
    given = conditions.given[:, 3:] + np.cross(conditions.given[:, :3], r)
    chords = np.diff(poses[:, :3, 3] + R @ r, axis=0)
    loads = matvec(R[:-1].mT, chords), matvec(R[1:].mT, chords)
    system = _cubic_system(h, np.eye(3), R[:-1].mT @ R[1:], *loads)
    return system.solve(conditions._replace(given=given)) - np.cross(w, r)


class Conditions(NamedTuple):
    """End conditions: `given` values, shape (N, m), at the knots that are `fixed`; 0 elsewhere.

    If the shape of `fixed` is (N, m), it tells which of the values are fixed.
    """

    fixed: NDArray[np.bool_]
    given: Array
    periodic: bool = False  # then the values at both ends are equal, and none is given


class KnotSystem(NamedTuple):
    """A quadratic function ½ xᵀ H x − xᵀ b of values x at N knots, m at each: a sum over the legs.

    Each leg adds its element [[A, B], [Bᵀ, D]] to H and (b0, b1) to b at its two knots. The blocks
    have the shape (N − 1, m, m), and the loads the shape (N − 1, m).
    """

    A: Array
    B: Array
    D: Array
    b0: Array
    b1: Array

    def solve(self, ends: Conditions) -> Array:
        """Return the minimizer x; LinAlgError is raised if H is not positive definite."""
        fixed, given, periodic = ends
        if not periodic:
            return self._solve(fixed, given[..., None])[..., 0]
        # x is composed of the minimizers whose values at both ends are 0, or unit vectors
        count, m = given.shape
        values, both = np.zeros((count, m, 1 + m)), np.zeros(count, bool)
        values[[0, -1], :, 1:], both[[0, -1]] = np.eye(m), True
        x = self._solve(both, values)
        first = self.b0[0, :, None] - self.A[0] @ x[0] - self.B[0] @ x[1]
        last = self.b1[-1, :, None] - self.B[-1].T @ x[-2] - self.D[-1] @ x[-1]
        load, by_units = np.split(first + last, [1], axis=1)
        np.linalg.cholesky(load - by_units)  # raises LinAlgError if not positive definite
        end = np.linalg.solve(load - by_units, load[:, 0])
        return x[..., 0] + (x[..., 1:] - x[..., :1]) @ end

    def _solve(self, fixed: NDArray[np.bool_], given: Array) -> Array:
        """Return a minimizer for each column of `given`, shape (N, m, columns)."""
        from scipy.linalg import solveh_banded

        count, m, columns = given.shape
        on, load = at_knots(self.A, self.D), at_knots(self.b0, self.b1)[..., None]
        if given.any():
            x, y = given[:-1], given[1:]
            load = load - at_knots(self.A @ x + self.B @ y, self.B.mT @ x + self.D @ y)
        free = np.broadcast_to(~fixed.reshape(count, -1), (count, m))
        on = np.where(free[:, :, None] & free[:, None], on, np.eye(m))
        load = np.where(free[..., None], load, 0)
        above = np.where(free[:-1, :, None] & free[1:, None], self.B, 0)
        band = np.zeros((2 * m, m * count))
        for q in range(m):
            band[: m - q, q::m] = on[:, q:, q].T
            band[m - q : 2 * m - q, q : m * (count - 1) : m] = above[:, q].T
        x = solveh_banded(band, load.reshape(-1, columns), lower=True)
        return given + x.reshape(given.shape)


def at_knots(starts: Array, ends: Array) -> Array:
    """Return the sum of the legs' values at each knot, shape (N, ...), from shapes (N − 1, ...)."""
    none = np.zeros((1, *starts.shape[1:]))
    return np.concatenate([starts, none]) + np.concatenate([none, ends])


def _cubic_system(h: Array, G: Array, B: Array, *loads: Array) -> KnotSystem:
    """Return the system with elements [[4 G, 2 B], [2 Bᵀ, 4 G]]/h, and with loads times 6/h²."""
    k = 1 / h[:, None, None]
    same = 4 * k * G
    return KnotSystem(same, 2 * k * B, same, *(6 * k[:, 0] ** 2 * x for x in loads))


def _rotation_system(h: Array, R: Array, body: Body) -> KnotSystem:
    Q = R[:-1].mT @ R[1:]
    if body.is_ball:
        load = _skew(Q) / 2
        B = (np.trace(Q, axis1=1, axis2=2)[:, None, None] * np.eye(3) - Q.mT) / 2
        return _cubic_system(h, np.eye(3), B, load, load)
    G = as_single("body.inertia", body.inertia, 3, 3)
    W = weight_of("body.inertia", G)
    B = _skew(Q[:, None] @ (hat(np.eye(3)) @ W)).mT
    return _cubic_system(h, G, B, _skew(Q @ W), -_skew(Q.mT @ W))


def quaternion_system(h: Array, R: Array, long: NDArray[np.bool_] | bool = False) -> KnotSystem:
    """Return the system for unit quaternions; legs for which `long` is True turn the long way."""
    q = np.where(long, -1, 1)[..., None] * quaternion_of(R[:-1].mT @ R[1:])
    B = q[:, :1, None] * np.eye(3) + hat(q[:, 1:])
    return _cubic_system(h, np.eye(3), B, 2 * q[:, 1:], 2 * q[:, 1:])


def _skew(X: Array) -> Array:
    return vee(X - X.mT)


def as_ends(
    ends: PathEnds, count: int, size: int, rest_at: Sequence[int] | NDArray[np.integer] = ()
) -> Conditions:
    """Return the end conditions for `count` knots, with `size` values at each."""
    fixed, given = np.zeros(count, bool), np.zeros((count, size))
    try:
        if any(isinstance(i, bool) for i in rest_at):
            raise TypeError("a mask is not a list of indices")
        fixed[[index(i) for i in rest_at]] = True
    except (TypeError, IndexError) as error:
        raise ValueError(
            f"rest_at: indices of the {count} poses are wanted, got {rest_at!r}"
        ) from error
    if isinstance(ends, str):
        if ends not in ("natural", "rest", "periodic"):
            word: str = ends
            hint = "; 'clamped' is 'rest' here" if word == "clamped" else ""
            raise ValueError(f"ends: {_ENDS} is wanted, got {ends!r}{hint}")
        if ends == "periodic" and fixed.any():
            raise ValueError("rest_at: not with ends='periodic'")
        fixed[[0, -1]] |= ends == "rest"
        return Conditions(fixed, given, ends == "periodic")
    pair = list(np.atleast_1d(ends)) if isinstance(ends, np.ndarray) else ends
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise ValueError(f"ends: {_ENDS} is wanted, got {ends!r}")
    for place, value in ((0, pair[0]), (-1, pair[1])):
        if value is not None:
            fixed[place], given[place] = True, _end_rate(f"ends[{place % 2}]", value, size)
    return Conditions(fixed, given)


def _end_rate(name: str, value: ArrayLike, size: int) -> Array:
    if isinstance(value, str):
        raise ValueError(f"{name}: a velocity or None is wanted, got {value!r}")
    rate = as_finite(name, value)
    if rate.shape != (size,):
        hint = "; twist_from_rates makes twists (ω, v)" if size == 6 else ""
        raise ValueError(f"{name}: shape ({size},) is wanted, got {rate.shape}{hint}")
    return rate


@described_by(spline_velocities)
def bessel_velocities(times: ArrayLike, poses: ArrayLike) -> Array:
    """Return velocities from parabolas; each parabola joins a pose to its two neighbours.

    A change of one pose affects only the velocities at this pose and at its neighbours. But the
    acceleration jumps at the poses, and for random rotations at equally spaced times, the median
    excess of the cost over the optimum is 14 to 15 %, however small the steps are. For samples of a
    smooth motion, doubling their number divides the excess by 4.

    Returns
    -------
    ndarray, shape (N, 6) or (N, 3)
        Twists (ω, v), or angular velocities ω, per unit of the times.

    Notes
    -----
    This is Bessel's choice (de Boor, A Practical Guide to Splines, chapter IV). For rotations, the
    parabolas are in exponential coordinates about the middle pose. At the first and the last pose,
    the parabola of the neighbour gives the velocity. For two poses, the velocity is constant.
    Singular set: that of `spline_velocities`.

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
    turns = log(R[:-1].mT @ R[1:])
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


def usual_step(steps: Array) -> float:
    """Return the upper quartile of the steps above 0, or 0."""
    steps = np.sort(steps[steps > 0])
    return float(steps[3 * len(steps) // 4]) if len(steps) else 0.0


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
    usual = usual_step(h)
    if h.min() < _CLOSE * usual:
        i = np.argmin(h)
        raise ValueError(
            f"times[{i}] and times[{i + 1}] are {h[i]:.3g} apart, most others {usual:.3g}: leave "
            "one of them out, or use smoothing_spline, which averages their poses"
        )
    R = poses[:, :3, :3]
    far = np.sum(R[:-1] * R[1:], axis=(1, 2)) + 1 < _NEAR_HALF_TURN**2  # 2 + 2 cos(angle)
    if far.any():
        i = np.argmax(far)
        raise ValueError(
            f"poses[{i}] and poses[{i + 1}] are a half-turn apart: put a pose between them, "
            "to tell which way to turn"
        )
    return times, poses, velocities
