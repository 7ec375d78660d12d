"""Wrong poses in recordings, such as those of a tracker that took one marker for another."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import Array
from rbcourse.curves._doubts import distances
from rbcourse.curves.smoothing import (
    DOMAIN,
    Smoother,
    checked_problem,
    smooth,
    turn_in_period,
)
from rbcourse.curves.velocities import usual_step

__all__ = ["wrong_poses"]

STEPS = 10.0  # the default period in median steps [with 20, 47 right poses of 300 are far]
ROUNDS = 5  # of smoothing with new weights
FAR = 4.0  # usual distances; of noise alone, 8 standard deviations
FULL_WEIGHT = 1.2  # usual distances: Huber's bound [2.4 standard deviations]
LEAST_WEIGHT = 1e-5
REST = 1e-9  # rad, m: smaller distances are those of a body that rests without noise
MANY = 0.1  # of the poses
FINE = 0.01  # of the usual step [0: of a motion with little noise, 35 of 300 right poses are found]


def wrong_poses(
    times: ArrayLike, poses: ArrayLike, period: float | None = None
) -> NDArray[np.bool_]:
    """Find rotations or poses of a recording that are far from a smooth curve near the others.

    The curve is a smoothing spline of a fixed period. Five times, poses that are far from it get
    less weight (Huber), and the spline is made again. A pose is wrong if its distance from the last
    spline, for its rotation or for its origin, is more than four times the usual one: that of three
    quarters of the poses, or a hundredth of the usual step if this is more. Smooth the others:
    ``good = ~wrong_poses(times, poses)``, and then ``smoothing_spline(times[good], poses[good])``.
    Source: beyond BK 17.

    Parameters
    ----------
    times : array_like, shape (N,)
        Times that do not decrease, with three or more different values.
    poses : array_like, shape (N, 3, 3) or (N, 4, 4)
        A rotation matrix or a pose for each of the times.
    period : float, optional
        The period of the smoothing, by default ten median steps. If more poses in a row are wrong
        than there are steps in a third of the period, some may be missed, and right poses near them
        found. With a longer period, right poses of a fast motion may be found.

    Returns
    -------
    ndarray of bool, shape (N,)
        True for poses that are wrong, or near a time at which the velocity jumps. If the frame or
        the body changes and does not change back, these are the poses near this time.

    Warns
    -----
    RuntimeWarning
        If the body turns by more than 1 rad in the time period/2π, so right poses may be far from
        the curve (with the default period, this is a turn by 36° in a step); or if more than a
        tenth of the poses are found.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> t, rng = np.linspace(0, 1, 50), np.random.default_rng(1)
    >>> measured = exp_so3(t[:, None] ** 2 * [0, 0, 2] + rng.normal(scale=0.02, size=(50, 3)))
    >>> measured[[20, 21]] = exp_so3([0.5, 0, 0])
    >>> np.flatnonzero(wrong_poses(t, measured))
    array([20, 21])
    """
    A, smoother, _, periods = checked_problem(times, poses, "natural", None, period, None)
    if period is None:
        periods = [STEPS * float(np.median(np.diff(smoother.knots)))] * len(periods)
    t = smoother.knots[smoother.which]
    for _ in range(ROUNDS):
        curve = smooth(smoother, A, [None] * len(periods), periods)
        off = _relative_distances(curve(t), A)
        weights = FULL_WEIGHT / np.clip(off, FULL_WEIGHT, FULL_WEIGHT / LEAST_WEIGHT)
        smoother = Smoother(t, weights, "natural")
    if (turn := turn_in_period(curve)) > DOMAIN:
        warnings.warn(
            f"period: the body turns by {turn:.3g} rad in the time period/2π, so right poses may "
            f"be far from the curve; choose a shorter one than {periods[0]:.3g}",
            RuntimeWarning,
            stacklevel=2,
        )
    found = off > FAR
    if found.mean() > MANY:
        warnings.warn(
            f"poses: {found.sum()} of {len(found)} are far from the curve, so the noise may vary; "
            "if so, keep them, and give weights to smoothing_spline",
            RuntimeWarning,
            stacklevel=2,
        )
    return found


def _relative_distances(near: Array, poses: Array) -> Array:
    """Return the distance of each pose, in rotation or origin, over the usual distance.

    Poses at rest that have no noise do not count for the usual distance.
    """
    off = np.zeros(len(poses))
    for x, move in zip(distances(near, poses), distances(poses[:-1], poses[1:]), strict=True):
        if x.max() > REST:
            usual = max(np.quantile(x[x > REST], 0.75), FINE * usual_step(move))
            off = np.maximum(off, x / usual)
    return off
