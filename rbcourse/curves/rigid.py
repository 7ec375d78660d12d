"""Motions of a rigid body: screw motions, and motions with independent rotation and path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import (
    as_duration,
    as_finite,
    as_positive,
    as_single,
    as_unit,
    check_broadcast,
)
from rbcourse._hermite import hermite_stack, stack_terms
from rbcourse._numerics import EPS, Array, matvec
from rbcourse._valid import as_poses
from rbcourse.curves.curve import Curve, Ends, geodesic_so3, with_inertia
from rbcourse.curves.projected_polynomial import ProjectedPolynomial, projected_cubic, watched
from rbcourse.optimum import solve
from rbcourse.optimum._search import ball, body
from rbcourse.se3 import exp_se3, inverse_se3, join, log_se3, split


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class RigidMotion(Curve):
    """A `Curve` on SE(3): a rotation R(t), and a polynomial path d(t) of one point of the body.

    Source: BK 6.3.

    Attributes
    ----------
    rotation : Curve on SO(3)
    path : ndarray, shape (..., n, 3)
        d(0) and d(1). A cubic also has d'(0) and d'(1), and a quintic also d''(0) and d''(1). The
        vectors are in m, in the fixed frame, and time runs from 0 to 1.
    centre : ndarray, shape (..., 3)
        The point of the body that follows the path, in the body frame, in m; 0 is the origin.
    """

    rotation: Curve
    path: Array
    centre: Array

    size = 4

    def values(self, t: Array, order: int) -> Array:
        """Return the pose, or (w, Rᵀ d'), or (w', Rᵀ d''), where d is the origin's position."""
        d = np.moveaxis(hermite_stack(self._terms, t, order), 0, -1)
        R = self.rotation.values(t, 0)
        values = np.empty((len(t), self.count, *self._core(order)))
        if order == 0:
            values[..., :3, :3], values[..., :3, 3] = R, d - self._arm(t, 0, R)
            values[..., 3, :3], values[..., 3, 3] = 0, 1
        else:
            values[..., :3] = turning = self.rotation.values(t, order)
            values[..., 3:] = matvec(R.mT, d) - self._arm(t, order, turning)
        return values

    def _arm(self, t: Array, order: int, turning: Array) -> Array | float:
        """Return R r, w × r or w' × r + w × (w × r): the centre's motion relative to the origin."""
        r = self.centre
        if not r.any():
            return 0.0
        if order == 0:
            return matvec(turning, r)
        if order == 1:
            return np.cross(turning, r)
        w = self.rotation.values(t, 1)
        return np.cross(turning, r) + np.cross(w, np.cross(w, r))

    @cached_property
    def _terms(self) -> Array:
        """The terms of the path, shape (n + 1, 3, count)."""
        return stack_terms(self.path)

    @property
    def breakpoints(self) -> Array:
        """The `Curve.breakpoints` of the rotation."""
        return self.rotation.breakpoints

    def lasting(self, duration: Array) -> Self:
        """Return the same motion with another duration."""
        return replace(self, duration=duration, rotation=self.rotation.lasting(duration))


Motion = TypeVar("Motion", bound=RigidMotion)


class ProjectedMotion(RigidMotion):
    """The `RigidMotion` whose rotation is a `ProjectedPolynomial`."""

    rotation: ProjectedPolynomial

    @property
    def margin(self) -> Array:
        """The margin of the rotation."""
        return self.rotation.margin


def rigid_motion(
    kind: type[Motion], rotation: Curve, *path: Array, centre: Array | None = None
) -> Motion:
    """Return the motion with this rotation and path, which use the same unit of time."""
    batch = np.broadcast_shapes(rotation.batch_shape, *(x.shape[:-1] for x in path))
    numbers = np.arange(rotation.count).reshape(rotation.batch_shape)
    turning = rotation.take(np.broadcast_to(numbers, batch))
    T = turning.duration[..., None]
    ends = [np.broadcast_to(T ** (i // 2) * x, (*batch, 3)) for i, x in enumerate(path)]
    return kind(
        duration=turning.duration,
        rotation=turning,
        path=np.stack(ends, axis=-2),
        centre=np.broadcast_to(0.0 if centre is None else centre, (*batch, 3)),
    )


def geodesic_se3(A0: ArrayLike, A1: ArrayLike, *, duration: ArrayLike = 1.0) -> RigidMotion:
    """Return the shortest curve from A0 to A1 in metric (14): a geodesic turn and a straight line.

    Singular set: half-turns, as for `geodesic_so3`. `screw_se3` is a geodesic of another metric.
    Source: BK 2.6, BK (14).

    Parameters
    ----------
    A0, A1, duration
        As for `projected_cubic_se3`.

    Returns
    -------
    RigidMotion
        Its ``rotation`` is `geodesic_so3`, and the origin moves on a straight line at constant
        speed. The angular velocity and d' are constant, but v = Rᵀ d' is not.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1 = pose_from_coordinates([0, 0, np.pi / 2, 2, 4, 0])
    >>> geodesic_se3(np.eye(4), A1)(0.5).round(3)[:2] + 0.0
    array([[ 0.707, -0.707,  0.   ,  1.   ],
           [ 0.707,  0.707,  0.   ,  2.   ]])
    """
    A0, A1 = as_poses("A0", A0), as_poses("A1", A1)
    check_broadcast(A0=(A0, 2), A1=(A1, 2))
    (R0, d0), (R1, d1) = split(A0), split(A1)
    return rigid_motion(RigidMotion, geodesic_so3(R0, R1, duration=duration), d0, d1)


def projected_cubic_se3(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
    *,
    duration: ArrayLike = 1.0,
) -> ProjectedMotion:
    """Return a near-optimal motion: a projected cubic, and a cubic in R³ for the origin.

    Source: BK 6.3, BK Prop. 5.

    Parameters
    ----------
    A0, A1 : array_like, shape (..., 4, 4)
        Poses at the start and at the end.
    w0, w1, d0_dot, d1_dot : array_like, shape (..., 3)
        Angular velocities at both ends in the body frame, and velocities of the origin in the
        *fixed* frame.
    duration : array_like, shape (...), optional
        The duration of the motion; velocities are per unit of this time.

    Returns
    -------
    ProjectedMotion
        Its ``rotation`` is `projected_cubic_so3`, with the same ``margin``, warning and singular
        set. The path of the origin is the optimum.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1, rest = pose_from_coordinates([0, 0, 1, 2, 0, 0]), [0, 0, 0]
    >>> c = projected_cubic_se3(np.eye(4), A1, rest, rest, rest, rest)  # from rest to rest
    >>> c(0.5, 1).round(3)[[2, 3, 4]]  # turn, forward, to the left
    array([ 1.639,  2.633, -1.438])
    """
    ends, path = _cubic_ends(A0, A1, w0, w1, d0_dot, d1_dot)
    rotation = watched(projected_cubic(*ends.over(duration)))
    return rigid_motion(ProjectedMotion, rotation, *path)


def minimum_acceleration_se3(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
    *,
    inertia: ArrayLike | None = None,
    mass: float = 1.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    duration: ArrayLike = 1.0,
) -> RigidMotion:
    """Return the minimum-acceleration motion of a ball or a body, whose centre follows a cubic.

    If its rotation has the least cost, the motion has the least `acceleration_cost` of all motions
    with these ends, for the same `inertia`, `mass` and `centre`.
    Source: BK 6.3; for bodies, beyond BK 9.

    Parameters
    ----------
    A0, A1, w0, w1, d0_dot, d1_dot, duration
        As for `projected_cubic_se3`.
    inertia : array_like, shape (..., 3, 3), optional
        As for `minimum_acceleration_so3`, about the centre of mass. The default is 2 I, as in
        metric (14).
    mass : float, optional
        The mass of the body, above 0. It changes the cost of the motion, but not the motion.
    centre : array_like, shape (3,), optional
        The centre of mass, in the body frame, in m; by default the origin.

    Returns
    -------
    RigidMotion
        Its ``rotation`` is `minimum_acceleration_so3`, with the same error and warning. Its
        ``path``, which the centre of mass follows, is a cubic.

    Notes
    -----
    Rotation and translation are independent in metric (14). In the metric of the kinetic energy,
    the rotation and the position d + R r of the centre of mass are independent. So each has its own
    optimum. The end velocities of the centre are d_c' = d' + R (w × r). `projected_cubic_se3` is
    near-optimal and has a closed form.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1, rest = pose_from_coordinates([0, 0, 1, 2, 0, 0]), [0, 0, 0]
    >>> minimum_acceleration_se3(np.eye(4), A1, rest, rest, rest, rest)(0.5)[:3, 3].round(9)
    array([1., 0., 0.])
    """
    ends, (d0, d1, v0, v1) = _cubic_ends(A0, A1, w0, w1, d0_dot, d1_dot)
    r = as_single("centre", centre, 3)
    as_positive("mass", mass)
    R0, R1, w0, w1 = ends
    v0, v1 = v0 + matvec(R0, np.cross(w0, r)), v1 + matvec(R1, np.cross(w1, r))
    given, T = ends.over(duration)
    task = ball(given) if inertia is None else body(*with_inertia(given, inertia), of_torque=False)
    rotation = solve(task, T)
    return rigid_motion(RigidMotion, rotation, d0 + R0 @ r, d1 + R1 @ r, v0, v1, centre=r)


def screw_se3(A0: ArrayLike, A1: ArrayLike, *, duration: ArrayLike = 1.0) -> ScrewMotion:
    """Return the screw motion from A0 to A1, which has one fixed axis and a constant twist.

    Its covariant acceleration is (0, ω × v). Every point of the body moves on a helix about the
    axis (see `screw_from_pose`). A screw motion is a geodesic of the indefinite metric (10), not of
    metric (14) (see `geodesic_se3`). Singular set: A0 and A1 are a half-turn apart. `log_so3` then
    chooses one of two ω. Additional full turns give other screw motions, with other twists.
    Source: BK 2.6.

    Parameters
    ----------
    A0, A1, duration
        As for `projected_cubic_se3`.

    Returns
    -------
    ScrewMotion
        The motion A0 exp_se3(S t) with ``twist`` S = log_se3(A0⁻¹ A1). It turns by at most π.

    Examples
    --------
    >>> A1 = exp_se3([0, 0, np.pi, 0, -np.pi, 2])  # half round the line x = 1, 2 m up
    >>> screw_se3(np.eye(4), A1)(0.5)[:3, 3].round(12)
    array([ 1., -1.,  1.])
    """
    A0, A1 = as_poses("A0", A0), as_poses("A1", A1)
    T = as_duration("duration", duration)
    batch = check_broadcast(A0=(A0, 2), A1=(A1, 2), duration=(T, 0))
    start, S = join(*split(A0)), log_se3(inverse_se3(A0) @ A1)
    return ScrewMotion(
        duration=np.broadcast_to(T, batch),
        A0=np.broadcast_to(start, (*batch, 4, 4)),
        displacement=np.broadcast_to(S, (*batch, 6)),
    )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ScrewMotion(Curve):
    """The `Curve` A0 exp_se3(S t) with constant twist S.

    ``A0`` is the start, ``twist`` is S = (ω, v) in the body frame, shape (..., 6), and
    ``displacement`` is S times the duration.
    Source: BK 2.6.
    """

    A0: Array
    displacement: Array

    size = 4

    @property
    def twist(self) -> Array:
        """The twist (ω, v) in the body frame."""
        return self.displacement / self.duration[..., None]

    def values(self, t: Array, order: int) -> Array:
        """Return A0 exp(S t), S, or (0, ω × v)."""
        S = self.displacement
        if order == 0:
            return self.A0 @ exp_se3(t[..., None] * S)
        if order == 2:
            S = np.concatenate([0 * S[:, :3], np.cross(S[:, :3], S[:, 3:])], axis=-1)
        return np.broadcast_to(S, (len(t), *S.shape))


def screw_from_pose(A: ArrayLike) -> Screw:
    """Return the screw of a displacement in the fixed frame: axis, point, angle and slide.

    Source: BK 2.6.

    Parameters
    ----------
    A : array_like, shape (..., 4, 4)
        Poses. For the screw in the fixed frame that takes A0 to A1, use A1 @ inverse_se3(A0).

    Returns
    -------
    Screw
        The screw; it also has ``pitch``, the slide per radian of the turn.

    Notes
    -----
    Singular set: half-turns, which have two screws (`log_so3` chooses the axis), and poses without
    a turn, which have no unique axis. A turn by less than 8 eps counts as a pure slide. For small
    angles, axis, slide and pitch have a relative error of a few eps divided by the angle. The point
    is then far away, and its error is a few eps ‖d‖ divided by the square of the angle.

    Examples
    --------
    >>> screw = screw_from_pose(exp_se3([0, 0, 2, 0, -2, 1]))  # about the vertical through x = 1
    >>> screw.axis.round(12), screw.point.round(12) + 0.0, float(screw.pitch.round(12))
    (array([0., 0., 1.]), array([1., 0., 0.]), 0.5)
    """
    S = log_se3(A)
    w, v = S[..., :3], S[..., 3:]
    angle = np.linalg.norm(w, axis=-1)
    turns = angle > 8 * EPS
    along = np.where(turns[..., None], w, v)
    moves = np.any(along, axis=-1, keepdims=True)
    axis = np.where(moves, as_unit("A", np.where(moves, along, 1.0), 3), 0.0)
    angle = np.where(turns, angle, 0.0)
    point = np.cross(axis, v) / np.where(turns, angle, np.inf)[..., None]
    return Screw(axis, point, angle, np.vecdot(axis, v))


class Screw(NamedTuple):
    """A turn about an axis and a slide along it; every displacement is a screw (Chasles).

    Attributes
    ----------
    axis : ndarray, shape (..., 3)
        The unit vector along the axis. If there is no turn, it is the direction of the slide; if
        there is no motion, it is 0.
    point : ndarray, shape (..., 3)
        The point on the axis that is nearest to the origin, in m; 0 if there is no turn.
    angle, slide : ndarray, shape (...)
        The turn, in [0, π] rad, and the displacement along the axis, in m.
    """

    axis: Array
    point: Array
    angle: Array
    slide: Array

    def __repr__(self) -> str:
        """Return a description of the screw, or the shape of a stack."""
        if np.ndim(self.angle):
            return f"<Screw, stack of shape {self.angle.shape}>"
        axis, point = (", ".join(f"{x:.4g}" for x in v + 0.0) for v in (self.axis, self.point))
        turn = f"{np.degrees(self.angle):.4g}° about ({axis}) through ({point}) m"
        return f"<Screw: {turn}, slide {self.slide:.4g} m>"

    @property
    def pitch(self) -> Array:
        """The slide per radian of the turn, in m: inf for a pure slide, NaN for no motion."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.divide(self.slide, self.angle)


def _cubic_ends(
    A0: ArrayLike, A1: ArrayLike, w0: ArrayLike, w1: ArrayLike, d0_dot: ArrayLike, d1_dot: ArrayLike
) -> tuple[Ends, tuple[Array, ...]]:
    poses = as_poses("A0", A0), as_poses("A1", A1)
    w = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    v = as_finite("d0_dot", d0_dot, 3), as_finite("d1_dot", d1_dot, 3)
    batch = check_broadcast(
        A0=(poses[0], 2),
        A1=(poses[1], 2),
        w0=(w[0], 1),
        w1=(w[1], 1),
        d0_dot=(v[0], 1),
        d1_dot=(v[1], 1),
    )
    (R0, d0), (R1, d1) = map(split, poses)
    return Ends(R0, R1, *w).broadcast_to(batch), (d0, d1, *v)
