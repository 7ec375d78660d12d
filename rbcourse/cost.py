"""What a curve costs: the acceleration functional of BK (18)."""

import numpy as np

from rbcourse._numerics import Array
from rbcourse.chains import Chain, Retimed
from rbcourse.curves import Curve, which_curve


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
        unless all of it arises in less than a hundredth of the time, by a sudden ``f`` of a
        `projected_line_so3`.

    Raises
    ------
    RuntimeError
        If the integral does not settle to that, if the curve all but jumps: ``margin`` below 1e-6,
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
    if isinstance(curve, Retimed):
        rotation, translation = acceleration_cost_parts(curve.curve)
        return rotation * curve.rate**3, translation * curve.rate**3
    if isinstance(curve, Chain):
        moments = np.append(curve.times, curve.times[:-1] + curve.durations / 2)
        jumps, speeds = np.abs(curve.jumps(1)), np.abs(curve(moments, 1))
        for half in (slice(3), slice(3, None)):  # rad and m
            jump = jumps[:, half].max(initial=0)
            if jump > 1e-9 * speeds[:, half].max(initial=0):
                raise RuntimeError(f"acceleration cost: a velocity jumps at a joint, by {jump:.3g}")
        parts = acceleration_cost_parts(curve.legs)
        rotation, translation = (np.asarray(part / curve.durations**3) for part in parts)
        return rotation.sum(), translation.sum()
    return _integral(curve)


def _integral(curve: Curve) -> tuple[Array, Array]:
    """Return the two parts for a curve on [0, 1]."""
    from scipy.integrate import cubature

    ends = _panels(curve)
    widths = np.diff(ends)

    def integrand(share: Array) -> Array:
        """Return the sum over all panels, at one share of each."""
        squares = np.moveaxis(curve(ends[:-1] + share * widths, 2) ** 2, 1, -1) @ widths
        rotation, translation = squares[..., :3].sum(axis=-1), squares[..., 3:].sum(axis=-1)
        return np.stack([2 * rotation, translation], axis=-1)

    integral = cubature(integrand, [0], [1], rtol=1e-10, atol=1e-20, max_subdivisions=100)
    if integral.status != "converged" or not np.isfinite(integral.estimate).all():
        raise RuntimeError(
            f"acceleration cost: {integral.subdivisions} subdivisions leave an uncertainty of "
            f"{np.max(integral.error):.1e} in {np.max(integral.estimate):.6g} (see margin)"
        )
    rotation, translation = np.moveaxis(integral.estimate, -1, 0)
    return rotation[()], translation[()]


def _panels(curve: Curve) -> Array:
    """Return the ends of panels of time: sixteenths, and ever smaller to where the curve is fast.

    It is fast where it starts and ends, as its velocities and accelerations say, and near its
    margin.
    """
    curve = getattr(curve, "rotation", curve)
    w, a = (np.linalg.norm(curve([0, 1], k)[..., :3], axis=-1).reshape(2, -1) for k in (1, 2))
    if not np.isfinite(w).all():
        lost = np.unravel_index(np.argmin(np.isfinite(w).all(axis=0)), curve.batch_shape)
        which = which_curve(np.array(lost, int))
        raise RuntimeError(f"acceleration cost{which}: the curve is NaN, it did not converge")
    speeds = (w + np.sqrt(a)).max(axis=-1, initial=0)
    events = [(0.0, 1 / (1 + speeds[0])), (1.0, 1 / (1 + speeds[1]))]
    margin = np.ravel(getattr(curve, "margin", ()))
    if margin.min(initial=np.inf) < 1e-6:
        raise RuntimeError(
            f"acceleration cost: the curve all but jumps (margin {margin.min():.1e})"
        )
    when = np.broadcast_to(np.ravel(getattr(curve, "margin_time", 0.5)), margin.shape)
    events += [(t, gap / 4) for t, gap in zip(when, margin, strict=True) if gap < 0.25]
    events += zip(*(np.ravel(x) for x in getattr(curve, "quickest", ((), ()))), strict=True)
    cuts = [np.arange(17) / 16]
    for t, width in events:
        apart = 2.0 ** -np.arange(5, max(5, 2 - np.floor(np.log2(width))))
        cuts += [np.append(t - apart, t), t + apart]
    times = np.unique(np.concatenate(cuts))
    return times[(times >= 0) & (times <= 1)]
