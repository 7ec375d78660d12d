"""Screws: what every displacement is (Chasles), and the motion about one axis at one pitch."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array, as_finite, as_unit, check_broadcast
from rbcourse.curves import Chosen, Curve, pick
from rbcourse.se3 import exp_se3, inverse_se3, log_se3, pose_from_components


class Screw(NamedTuple):
    """A turn about an axis, and a slide along it: every displacement is one (Chasles).

    Attributes
    ----------
    axis : ndarray, shape (..., 3)
        The direction of the axis, of unit length; of the slide alone where nothing turns, and 0
        where nothing moves.
    point : ndarray, shape (..., 3)
        The point of the axis nearest to the origin, in m; 0 where nothing turns.
    angle : ndarray, shape (...)
        How far it turns, in [0, π] rad.
    slide : ndarray, shape (...)
        How far it moves along the axis, in m.
    """

    axis: Array
    point: Array
    angle: Array
    slide: Array

    @property
    def pitch(self) -> Array:
        """The slide for each rad of the turn, in m: inf for a slide alone, NaN for no motion."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.divide(self.slide, self.angle)


def screw_from_pose(A: ArrayLike) -> Screw:
    """Return the screw of a displacement, in the fixed frame: axis, point, angle and slide.

    Parameters
    ----------
    A : array_like, shape (..., 4, 4)
        Poses; what is none is not repaired (see `project_se`), and the last row is not read. For
        the screw from a pose A0 to A1, in the fixed frame, take A1 @ inverse_se3(A0).

    Returns
    -------
    Screw
        ``axis``, ``point``, ``angle`` and ``slide``, and their ``pitch``.

    Raises
    ------
    ValueError
        If `A` is not finite or not of that shape.

    See Also
    --------
    screw_se3 : The motion about this screw.

    Notes
    -----
    Singular set: a half-turn has two screws, the axis of `log_so3` is taken. Where nothing turns
    no axis is distinguished; what turns by rounding only, less than 8 eps, counts as a slide alone.
    Near there axis, slide and pitch are uncertain by a few eps over the angle, relatively, and the
    point, far away, by a few eps ‖d‖ over its square.

    References
    ----------
    BK 2.6.

    Examples
    --------
    >>> from rbcourse import exp_se3
    >>> A = exp_se3([0, 0, 2, 0, -2, 1])  # about the vertical line through x = 1
    >>> screw = screw_from_pose(A)
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


class ScrewMotion(Curve):
    """The `Curve` A0 exp_se3(S t), of constant twist S.

    Attributes
    ----------
    A0 : ndarray, shape (..., 4, 4)
        The start.
    twist : ndarray, shape (..., 6)
        S = (ω, v), body frame.

    References
    ----------
    BK 2.6.
    """

    def __init__(self, A0: Array, twist: Array) -> None:
        self.A0 = A0
        self.twist = twist
        self.batch_shape = twist.shape[:-1]

    def _pick(self, chosen: Chosen) -> Self:
        A0 = pick(self.A0, chosen, self.batch_shape, core=2)
        return type(self)(A0, pick(self.twist, chosen, self.batch_shape, core=1))

    def _evaluate(self, t: Array, order: int) -> Array:
        moved = t[..., None] * self.twist
        if order == 0:
            return self.A0 @ exp_se3(moved)
        if order == 1:
            return np.broadcast_to(self.twist, moved.shape).copy()
        w, v = self.twist[..., :3], self.twist[..., 3:]
        covariant = np.concatenate([np.zeros_like(w), np.cross(w, v)], axis=-1)
        return np.broadcast_to(covariant, moved.shape).copy()


def screw_se3(A0: ArrayLike, A1: ArrayLike) -> ScrewMotion:
    """Return the screw motion from A0 to A1: about one axis, at constant twist.

    Parameters
    ----------
    A0, A1 : array_like, shape (..., 4, 4)
        Poses; what is none is not repaired (see `project_se`), and the last row is not read.

    Returns
    -------
    ScrewMotion
        A `Curve`: A0 exp_se3(S t) with ``twist`` S = log_se3(A0⁻¹ A1), which turns by π at most.
        Its covariant acceleration is (0, ω × v): the origin runs on a helix.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    See Also
    --------
    geodesic_se3 : The same turn, while the origin runs straight.
    screw_from_pose : The axis and the pitch.

    Notes
    -----
    Singular set: between poses a half-turn apart there are two such motions; ω is the one that
    `log_so3` returns. Full turns more give more screws, all with other twists.

    It is a geodesic of the indefinite metric (10), not of the metric (14), for which the motion of
    the origin does not depend on how the body turns. And it depends on which point of the body is
    called the origin only as its displacement does: every point runs on a helix about the axis.

    References
    ----------
    BK 2.6.

    Examples
    --------
    >>> A1 = exp_se3([0, 0, np.pi, 0, -np.pi, 2])  # half round the line x = 1, 2 m up
    >>> screw_se3(np.eye(4), A1)(0.5)[:3, 3].round(12)
    array([ 1., -1.,  1.])
    """
    A0, A1 = as_finite("A0", A0, 4, 4), as_finite("A1", A1, 4, 4)
    check_broadcast(A0=(A0, 2), A1=(A1, 2))
    start = pose_from_components(A0[..., :3, :3], A0[..., :3, 3])
    return ScrewMotion(start, log_se3(inverse_se3(A0) @ A1))
