"""A planar arm: a chain of links, each turned by its joint relative to the previous link."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_single, check_all, first_index
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse.planar import Plan, interpolate, interpolate_planar, propagate

__all__ = [
    "LINKS",
    "Posture",
    "arm_forward_kinematics",
    "arm_inverse_kinematics",
    "arm_tip_jacobian",
    "interpolate_joints",
    "propagate_joints",
]

LINKS = (2.0, 1.5)
"""The lengths of the links in the report, in m (RR 4)."""


class Posture(NamedTuple):
    """Positions of the parts of an arm with n links, in the world frame.

    Parameters
    ----------
    joints : ndarray, shape (..., n + 1, 2)
        The positions of the joints in order, then the position of the tip. The first joint is at
        the origin.
    frames : ndarray, shape (..., n, 3)
        The poses (x, y, theta) of the frames of the links: each frame is at the centre of its link,
        with its x axis along the link.
    """

    joints: Array
    frames: Array


@described_by(returns="Posture")
def arm_forward_kinematics(q: ArrayLike, lengths: ArrayLike = LINKS) -> Posture:
    """Return the positions of the joints and the tip, and the frames of the links.

    Source: RR 4.

    Parameters
    ----------
    q : array_like, shape (..., n)
        Joint angles. The first is measured from the world's x axis, and each other angle from the
        previous link.
    lengths : array_like, shape (n,), optional
        Lengths of the links, above 0.

    Examples
    --------
    >>> arm_forward_kinematics([0, np.pi / 2]).joints.round(12)
    array([[0. , 0. ],
           [2. , 0. ],
           [2. , 1.5]])
    """
    q = as_finite("q", q, "n")
    heading = np.cumsum(q, axis=-1)
    along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    links = _lengths(lengths, q.shape[-1])[:, None] * along
    ends = np.cumsum(links, axis=-2)
    joints = np.concatenate([np.zeros_like(ends[..., :1, :]), ends], axis=-2)
    frames = np.concatenate([ends - links / 2, heading[..., None]], axis=-1)
    return Posture(joints, frames)


@described_by(arm_forward_kinematics, returns="ndarray, shape (..., 2, n)")
def arm_tip_jacobian(q: ArrayLike, lengths: ArrayLike = LINKS) -> Array:
    """Return the matrix that maps joint velocities to the velocity of the tip in the world frame.

    Singular set: all links lie on one line, stretched or folded. The rank is then 1. The matrix is
    in m/rad. Column k is the vector from joint k to the tip, turned to the left by 90°.
    Source: RR 4.

    Examples
    --------
    >>> arm_tip_jacobian([0, np.pi / 2]).round(12)
    array([[-1.5, -1.5],
           [ 2. ,  0. ]])
    """
    joints = arm_forward_kinematics(q, lengths).joints
    reach = joints[..., -1:, :] - joints[..., :-1, :]
    return np.stack([-reach[..., 1], reach[..., 0]], axis=-2)


@described_by(returns="ndarray, shape (..., 2, 2)")
def arm_inverse_kinematics(tip: ArrayLike, lengths: ArrayLike = LINKS) -> Array:
    """Return the two sets of joint angles that bring the tip of a two-link arm to a position.

    Singular set: the links lie on one line. Both solutions are then the same up to full turns. If
    equal links are folded, the tip is at the base for any first angle; one such angle is returned.
    The angles are in [−π, π], one row for each solution. The first solution has an elbow angle in
    [0, π], and the second is its mirror image.
    Source: RR 4.

    Parameters
    ----------
    tip : array_like, shape (..., 2)
        The position of the tip in the world frame. A position out of reach raises ValueError.
    lengths : array_like, shape (2,), optional
        Lengths of the links, above 0.

    Examples
    --------
    >>> np.degrees(arm_inverse_kinematics([2, 1.5])).round(2)
    array([[  0.  ,  90.  ],
           [ 73.74, -90.  ]])
    """
    tip, lengths = as_finite("tip", tip, 2), _lengths(lengths, 2)
    size = 2.0 ** np.frexp(lengths.max())[1]  # so that the unit of length does not matter
    (a, b), r = lengths / size, np.hypot(tip[..., 0], tip[..., 1]) / size
    slack = 4 * EPS * (a + b)  # allows for rounding errors of the tip
    out = (r > a + b + slack) | (r < abs(a - b) - slack)
    if out.any():
        reach = f"{abs(a - b) * size:.15g} to {(a + b) * size:.15g} m from the base"
        given = r[out].flat[0] * size
        raise ValueError(f"{first_index('tip', out)}: {reach} wanted, got {given} m")
    beyond, within = (a + b - r) * (a + b + r), (r - abs(a - b)) * (r + abs(a - b))
    half = np.arctan2(np.sqrt(np.maximum(beyond, 0)), np.sqrt(np.maximum(within, 0)))
    elbow = 2 * np.stack([half, -half], axis=-1)
    towards = np.arctan2(tip[..., 1], tip[..., 0])[..., None]
    shoulder = towards - np.arctan2(b * np.sin(elbow), a + b * np.cos(elbow))
    turns = np.round(shoulder / (2 * np.pi))
    return np.stack([shoulder - 2 * np.pi * turns, elbow], axis=-1)


@described_by(interpolate_planar, returns="ndarray, shape (steps + 1, ..., n)")
def interpolate_joints(start: ArrayLike, goal: ArrayLike, steps: int = 10) -> Array:
    """Interpolate joint angles linearly in equal steps, without removing full turns.

    The first and the last row are exact.
    Source: RR 4.1, RR (20), RR (21), with errata 19.

    Parameters
    ----------
    start, goal : array_like, shape (..., n)
        Joint angles at both ends, in rad.

    Examples
    --------
    >>> interpolate_joints([0, 0], [1, -2], steps=2)
    array([[ 0. ,  0. ],
           [ 0.5, -1. ],
           [ 1. , -2. ]])
    """
    start = as_finite("start", start, "n")
    return interpolate(start, as_finite("goal", goal, start.shape[-1]), steps)


@described_by(returns="ndarray, shape (commands + 1, ..., n)")
def propagate_joints(start: ArrayLike, plan: Plan) -> Array:
    """Return the joint angles, with full turns, at the start and after each command of a plan.

    Source: RR 4.2, RR (22), RR (23), with errata 20.

    Parameters
    ----------
    start : array_like, shape (..., n)
        Joint angles at the start, in rad.
    plan : iterable of (velocity, duration)
        Pairs of n joint velocities, in rad/s, and a duration of at least 0, in s. The plan may be
        empty.

    Examples
    --------
    >>> propagate_joints([0, 0], [([0.5, 0], 2), ([0, -1], 1)])
    array([[ 0.,  0.],
           [ 1.,  0.],
           [ 1., -1.]])
    """
    return propagate(as_finite("start", start, "n"), plan)


def _lengths(lengths: ArrayLike, n: int) -> Array:
    checked = as_single("lengths", lengths, n)
    check_all(checked > 0, "lengths", checked, "a length above 0")
    return checked
