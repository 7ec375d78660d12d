"""Motions at constant velocity: geodesics and screws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_unit
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse.curves.curve import Curve, identity, weighted_sums
from rbcourse.curves.ends import Given, between
from rbcourse.curves.rigid import moving
from rbcourse.se3 import exp_se3, inverse_se3, join, log_se3
from rbcourse.so3 import hat, log


def geodesic(start: ArrayLike, goal: ArrayLike, *, duration: ArrayLike = 1.0) -> Curve:
    """Return the shortest curve between two rotations (metric (12)) or two poses (metric (14)).

    Source: BK 6.1; for poses, BK 2.6, BK (14).

    Parameters
    ----------
    start, goal : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotation matrices, or poses.
    duration : array_like, shape (...), optional
        The duration of the motion.

    Returns
    -------
    Curve
        For rotations, the curve R0 exp(σ̂ t) with constant angular velocity; its attribute
        ``rotation_vector`` is σ = log_so3(R0ᵀ R1), with ‖σ‖ ≤ π. For poses, a motion whose
        ``rotation`` is this curve and whose origin moves on a straight line at constant speed. The
        angular velocity and d' are constant, but v = Rᵀ d' is not.

    Notes
    -----
    Singular set: start and goal are a half-turn apart. Two geodesics are then shortest. In the
    ``rotation_vector`` of the returned geodesic, the component of largest magnitude (the first, if
    several are equal) is positive. For poses, `screw` is a geodesic of another metric.

    Examples
    --------
    >>> from rbcourse import exp_so3, pose_from_coordinates
    >>> c = geodesic(np.eye(3), exp_so3([0, 0, 1.5]), duration=3)
    >>> c(0.3, 1).round(12)  # the velocity
    array([0. , 0. , 0.5])
    >>> A1 = pose_from_coordinates([0, 0, np.pi / 2, 2, 4, 0])
    >>> geodesic(np.eye(4), A1)(0.5).round(3)[:2] + 0.0
    array([[ 0.707, -0.707,  0.   ,  1.   ],
           [ 0.707,  0.707,  0.   ,  2.   ]])
    """
    given = between(start, goal, duration=duration)
    given = given._replace(path=given.path[:2])
    turn, terms = geodesic_data(given)
    rotation = AlongGeodesic(duration=given.duration, rotation_vector=turn, terms=terms)
    return moving(given, rotation)


def geodesic_data(given: Given) -> tuple[Array, Array]:
    """Return the ``rotation_vector`` and the ``terms`` of an `AlongGeodesic`."""
    turn, R0 = log(given.ends.turn), given.ends.R0
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    K = hat(turn / np.where(angle == 0, 1.0, angle))
    swept = R0 @ K
    return turn, np.stack([R0, swept, swept @ K], axis=-3)


@described_by(geodesic, returns="ScrewMotion")
def screw(start: ArrayLike, goal: ArrayLike, *, duration: ArrayLike = 1.0) -> ScrewMotion:
    """Return the screw motion between two poses, which has one fixed axis and a constant twist.

    Its covariant acceleration is (0, ω × v). Every point of the body moves on a helix about the
    axis (see `screw_from_pose`). A screw motion is a geodesic of the indefinite metric (10), not of
    metric (14) (see `geodesic`). Singular set: the poses are a half-turn apart. `log_so3` then
    chooses one of two ω. Additional full turns give other screw motions, with other twists.
    The motion is A0 exp_se3(S t) with the ``twist`` S = log_se3(A0⁻¹ A1), and turns by at most π.
    Source: BK 2.6.

    Parameters
    ----------
    start, goal : array_like, shape (..., 4, 4)
        Poses A0 and A1.

    Examples
    --------
    >>> A1 = exp_se3([0, 0, np.pi, 0, -np.pi, 2])  # half round the line x = 1, 2 m up
    >>> screw(np.eye(4), A1)(0.5)[:3, 3].round(12)
    array([ 1., -1.,  1.])
    """
    given = between(start, goal, duration=duration)
    if not given.path:
        raise ValueError("start, goal: poses, shape (..., 4, 4), are wanted, got rotations")
    (R0, R1, *_), (d0, d1, *_) = given.ends, given.path
    A0, A1 = join(R0, d0), join(R1, d1)
    return ScrewMotion(duration=given.duration, A0=A0, displacement=log_se3(inverse_se3(A0) @ A1))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AlongGeodesic(Curve):
    """The `Curve` R0 exp(σ̂ p(t)) on the geodesic from R0 to R0 exp(σ̂); by default, p(t) = t.

    Source: BK 6.1.

    Attributes
    ----------
    R0, rotation_vector : ndarray, shapes (..., 3, 3) and (..., 3)
        The start, and the rotation vector σ from the start to the goal, in the body frame.
    """

    rotation_vector: Array
    terms: Array  # R0, R0 K and R0 K², for Rodrigues' formula R0 (I + sin a K + (1 − cos a) K²)

    @property
    def R0(self) -> Array:
        """The start."""
        return self.terms[..., 0, :, :]

    def _progress(self, t: Array, order: int) -> Array:
        """Return p or a derivative, shape (T, count) or (T, 1)."""
        return identity(t, order)

    def values(self, t: Array, order: int) -> Array:
        """Return R0 exp(σ̂ p), or σ times a derivative of p."""
        progress, count = self._progress(t, order), self.count
        if order:
            values = np.empty((len(t), count, 3))
            for i in range(3):  # four times as fast as one product
                np.multiply(progress, self.rotation_vector[:, i], out=values[..., i])
            return values
        weights = np.empty((3, count, len(t)))
        weights[0] = 1
        _write_sine_and_versine(progress.T, self._half_angle, *weights[1:])
        return weighted_sums(weights.T, self.terms.reshape(count, 3, 9), 3, 3)

    @cached_property
    def _half_angle(self) -> Array:
        return np.linalg.norm(self.rotation_vector, axis=-1, keepdims=True) / 2


def _write_sine_and_versine(progress: Array, half: Array, sine: Array, versine: Array) -> None:
    """Write sin a and 1 − cos a, computed from tan(a/2), where a is 2 · `half` · `progress`."""
    tangent = np.tan(np.multiply(progress, half, out=versine), out=versine)
    np.multiply(tangent, tangent, out=sine)
    sine += 1
    np.divide(tangent, sine, out=sine)
    sine *= 2
    versine *= sine


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


@described_by(returns="Screw")
def screw_from_pose(A: ArrayLike) -> Screw:
    """Return the screw of a displacement in the fixed frame: axis, point, angle and slide.

    The screw also has the ``pitch``, the slide per radian of the turn.
    Source: BK 2.6.

    Parameters
    ----------
    A : array_like, shape (..., 4, 4)
        Poses. For the screw in the fixed frame that takes A0 to A1, use A1 @ inverse_se3(A0).

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
