"""What a curve costs: the acceleration functional of BK (18)."""

import numpy as np

from rbcourse._numerics import Array
from rbcourse.curves import Curve


def acceleration_cost(curve: Curve) -> Array:
    """Return L_a, the integral of the squared acceleration in metric (12) or (14).

    Parameters
    ----------
    curve : Curve
        On SO(3) or SE(3), or a stack of them.

    Returns
    -------
    ndarray, shape curve.batch_shape
        ∫ 2 ‖w'‖² dt, and on SE(3) ∫ (2 ‖w'‖² + ‖d''‖²) dt; to 1e-10 relative, or 1e-20 absolute.

    Raises
    ------
    RuntimeError
        If the integral does not settle to that, as it is for a curve whose ``margin`` is nearly 0.

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
    from scipy.integrate import cubature

    def integrand(t: Array) -> Array:
        squares = curve(t[:, 0], 2) ** 2
        rotation, translation = squares[..., :3].sum(axis=-1), squares[..., 3:].sum(axis=-1)
        return np.stack([2 * rotation, translation], axis=-1)

    integral = cubature(integrand, [0], [1], rtol=1e-10, atol=1e-20, max_subdivisions=500)
    if integral.status != "converged":
        raise RuntimeError(
            f"acceleration cost: {integral.subdivisions} subdivisions leave an uncertainty of "
            f"{np.max(integral.error):.1e} in {np.max(integral.estimate):.6g} (see margin)"
        )
    rotation, translation = np.moveaxis(integral.estimate, -1, 0)
    return rotation[()], translation[()]
