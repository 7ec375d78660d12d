"""What a curve costs: the acceleration functional of BK (18)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import EPS, Array, blocks
from rbcourse.curves import Curve, which_curve
from rbcourse.optimum import grid

_TOGETHER = 2000  # panels that are evaluated at once
_HALVINGS = 30
_MOST = 50_000  # panels that may be halved at once


def acceleration_cost(curve: Curve) -> Array:
    """Return L_a, the integral of the squared acceleration in metric (12) or (14).

    Parameters
    ----------
    curve : Curve
        On SO(3) or SE(3), or a stack of them.

    Returns
    -------
    ndarray, shape curve.batch_shape
        ∫ 2 ‖w'‖² dt, and on SE(3) ∫ (2 ‖w'‖² + ‖d''‖²) dt; to 1e-10 relative, or 1e-20 absolute,
        unless all of the acceleration falls within a hundredth of the interval, as with an abrupt
        ``f`` of a `projected_line_so3`.

    Raises
    ------
    RuntimeError
        If the integral does not settle to that, if the curve almost jumps: ``margin`` below 1e-6,
        or if the velocity of a `chain` jumps.

    See Also
    --------
    acceleration_cost_parts : Rotation and translation apart.

    Notes
    -----
    On SE(3) the two parts have different units; their sum, and any ratio of sums, depends on the
    unit of length.

    References
    ----------
    BK (18), with the covariant acceleration BK (9) in the metrics BK (12) and BK (14).

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3, projected_line_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> float(acceleration_cost(geodesic_so3(np.eye(3), R1)))
    0.0
    >>> float(acceleration_cost(projected_line_so3(np.eye(3), R1)).round(4))
    6.7627
    """
    rotation, translation = acceleration_cost_parts(curve)
    return rotation + translation


def acceleration_cost_parts(curve: Curve) -> tuple[Array, Array]:
    """Return the two parts of `acceleration_cost`: of the rotation, and of the translation.

    Parameters
    ----------
    curve : Curve
        On SO(3) or SE(3), or a stack of them.

    Returns
    -------
    rotation : ndarray, shape curve.batch_shape
        ∫ 2 ‖w'‖² dt.
    translation : ndarray, shape curve.batch_shape
        ∫ ‖d''‖² dt; 0 on SO(3).

    Raises
    ------
    RuntimeError
        As `acceleration_cost`.

    References
    ----------
    BK (18).

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates, projected_cubic_se3
    >>> A1, rest = pose_from_coordinates([0, 0, 0, 1, 0, 0]), [0, 0, 0]
    >>> rotation, translation = acceleration_cost_parts(
    ...     projected_cubic_se3(np.eye(4), A1, rest, rest, rest, rest)
    ... )
    >>> float(rotation), float(translation.round(12))
    (0.0, 12.0)
    """
    legs, durations = curve._unit_legs()
    cubes = (1 / np.asarray(durations, float)) ** 3
    parts = (
        part.reshape(legs.batch_shape) * cubes for part in integral(legs, _panels(legs), 1e-10)
    )
    if legs.batch_shape == curve.batch_shape:
        rotation, translation = parts
    else:
        rotation, translation = (np.sum(part, axis=-1) for part in parts)
    return rotation[()], translation[()]


def integral(curve: Curve, ends: Array, tolerance: float) -> tuple[Array, Array]:
    """Return ∫ 2 ‖w'‖² dt and ∫ ‖d''‖² dt for each curve of a stack on [0, 1], by halving panels.

    A panel is halved while the rules of Clenshaw and Curtis with 9 and 17 nodes differ there by
    more than `tolerance` times the cost; each curve has panels of its own.

    Parameters
    ----------
    curve : Curve
    ends : ndarray, shape (n + 1,)
        The ends of the panels at the start, from 0 to 1.
    tolerance : float

    Returns
    -------
    rotation, translation : ndarray, shape (count,)

    Raises
    ------
    RuntimeError
        If the integral does not settle.
    """
    fine, rough = grid(17), grid(9)
    cost = np.zeros((2, curve.count))
    which = np.repeat(np.arange(curve.count), len(ends) - 1)
    start, width = np.tile(ends[:-1], curve.count), np.tile(np.diff(ends), curve.count)
    for _ in range(_HALVINGS):
        value, error = np.empty((2, len(which))), np.empty((2, len(which)))
        for part in blocks(len(which), _TOGETHER):
            a = np.empty((17, len(which[part]), *curve._core(2)))
            curve._at(start[part] + fine.t[:, None] * width[part], which[part], 2, a)
            squares = np.stack([2 * _squares(a[..., :3]), _squares(a[..., 3:])])
            value[:, part] = width[part] * (fine.integral[-1] @ squares)
            rest = width[part] * (rough.integral[-1] @ squares[:, ::2])
            with np.errstate(invalid="ignore"):  # inf − inf
                error[:, part] = np.abs(value[:, part] - rest)
        expected = cost + _sums(which, value, curve.count)
        settled = error <= tolerance * expected[:, which] + 1e-20  # NaN is not
        coarse = ~settled.all(axis=0)
        lost = coarse & (width < 256 * EPS * (start + width))  # beyond the resolution of the times
        if lost.any() or np.count_nonzero(coarse) > _MOST + len(ends) * curve.count:
            break
        cost += _sums(which[~coarse], value[:, ~coarse], curve.count)
        which = np.repeat(which[coarse], 2)
        start, width = (np.repeat(x[coarse], 2) for x in (start, width / 2))
        start[1::2] += width[1::2]
        if not len(which):
            return cost[0], cost[1]
    raise RuntimeError(
        f"acceleration cost: halved panels leave an uncertainty of {error.sum(axis=1).max():.1e} "
        f"in {expected.max():.6g} (see margin)"
    )


def _squares(a: Array) -> Array:
    return np.sum(a**2, axis=-1)


def _sums(which: NDArray[np.intp], values: Array, count: int) -> Array:
    """Return the sums of the rows of values over the panels of each curve."""
    return np.stack([np.bincount(which, row, count) for row in values])


def _panels(curve: Curve) -> Array:
    """Return the ends of panels: sixteenths, and ever smaller ones to where the curve is quick.

    It may be quick at its start and end, as its velocities and accelerations there tell, and at
    its `_events`.
    """
    w, a = (np.linalg.norm(curve([0, 1], k)[..., :3], axis=-1).reshape(2, -1) for k in (1, 2))
    if not np.isfinite(w).all():
        lost = which_curve(int(np.argmin(np.isfinite(w).all(axis=0))), curve.batch_shape)
        raise RuntimeError(f"acceleration cost{lost}: the curve is NaN, it did not converge")
    speeds = (w + np.sqrt(a)).max(axis=-1, initial=0)
    ends = [(0.0, 1 / (1 + speeds[0])), (1.0, 1 / (1 + speeds[1]))]
    cuts = [np.arange(17) / 16]
    for when, width in ends + curve._events():
        apart = 2.0 ** -np.arange(5, max(5, 2 - np.floor(np.log2(width))))
        cuts += [np.append(when - apart, when), when + apart]
    times = np.unique(np.concatenate(cuts))
    return times[(times >= 0) & (times <= 1)]
