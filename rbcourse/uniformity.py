"""Are these rotations uniformly random? Statistics whose law is known if they are."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_angle, as_finite, sine_gap_ratio

_HEIGHTS, _LONGITUDES = 4, 5  # cells of equal area; 5 of 100 rotations are expected in each


class UniformityTest(NamedTuple):
    """What a statistic says of a sample.

    Parameters
    ----------
    statistic : float
        Its value.
    p_value : float
        How likely uniform rotations are to give a value at least as unusual.
    null : str
        Its law if the rotations are uniform and independent.
    """

    statistic: float
    p_value: float
    null: str


def angle_law(angle: ArrayLike) -> Array:
    """Return the probability (a − sin a)/π that a uniform rotation turns by at most a.

    Its density is (1 − cos a)/π: large turns are common, small ones are rare.

    Parameters
    ----------
    angle : array_like
        Angles a in [0, π], in rad.

    Returns
    -------
    ndarray
        Of the same shape.

    Raises
    ------
    ValueError
        If an angle lies outside [0, π].

    References
    ----------
    RR 2.

    Examples
    --------
    >>> angle_law([0, np.pi / 2, np.pi]).round(3)  # 82 % turn by more than 90°
    array([0.   , 0.182, 1.   ])
    """
    a = as_angle(angle)
    return a**3 * sine_gap_ratio(a) / np.pi


def uniformity_tests(R: ArrayLike) -> dict[str, UniformityTest]:
    """Return statistics that tell whether rotations are uniform and independent.

    Parameters
    ----------
    R : array_like, shape (n, 3, 3)
        At least 100 rotation matrices, in the order in which they were drawn; what is none is not
        repaired (see `project_so`).

    Returns
    -------
    dict of str to UniformityTest
        E tr, E tr²
            The mean of the trace and of its square; normal, with means 0 and 1 and the variances
            1/n and 2/n (for large n).
        angle
            The largest distance between the observed distribution of the angle and `angle_law`;
            Kolmogorov's law.
        image of e₁, image of e₃
            χ² of the first and of the last column, on 20 cells of the sphere of equal area, 4 in
            height by 5 in longitude; χ² with 19 degrees of freedom (for large n).
        angle to next, angle to half
            As angle, of the turns from each even draw to the next, and from each draw of the first
            half to its partner in the second: draws that depend on these partners show here.

    Raises
    ------
    ValueError
        If `R` is not finite, not of that shape, or has fewer than 100 members.

    References
    ----------
    RR 2; J. Arvo, Fast random rotation matrices, Graphics Gems III, 1992.

    Examples
    --------
    >>> from rbcourse import sample_rotation_naive
    >>> test = uniformity_tests(sample_rotation_naive(10_000, rng=1))["E tr²"]
    >>> round(test.statistic, 2), test.null, test.p_value < 1e-6
    (0.87, 'normal, mean 1, sd 0.014', True)
    """
    R = as_finite("R", R, 3, 3)
    if R.ndim != 3 or len(R) < 100:
        raise ValueError(f"R: shape (n, 3, 3) with n >= 100 wanted, got {R.shape}")
    back, pairs = np.swapaxes(R, -1, -2), len(R) // 2
    trace = np.trace(R, axis1=-2, axis2=-1)
    return {
        "E tr": _mean_test(trace, 0, 1),
        "E tr²": _mean_test(trace**2, 1, 2),
        "angle": _angle_test(R),
        "image of e₁": _cell_test(R[:, :, 0]),
        "image of e₃": _cell_test(R[:, :, 2]),
        "angle to next": _angle_test(back[: 2 * pairs : 2] @ R[1 : 2 * pairs : 2]),
        "angle to half": _angle_test(back[:pairs] @ R[pairs : 2 * pairs]),
    }


def _mean_test(values: Array, mean: float, variance: float) -> UniformityTest:
    from scipy.special import erfc

    observed, sd = values.mean(), np.sqrt(variance / len(values))
    p_value = erfc(abs(observed - mean) / (np.sqrt(2) * sd))
    return UniformityTest(float(observed), float(p_value), f"normal, mean {mean}, sd {sd:.2g}")


def _angle_test(R: Array) -> UniformityTest:
    from scipy.stats import kstest

    cosine = (np.trace(R, axis1=-2, axis2=-1) - 1) / 2  # half the digits are enough for a law
    done = kstest(np.arccos(np.clip(cosine, -1, 1)), angle_law)
    return UniformityTest(float(done.statistic), float(done.pvalue), f"Kolmogorov, n = {len(R)}")


def _cell_test(points: Array) -> UniformityTest:
    """Return the χ² of points of the sphere: by Archimedes equal heights have equal areas."""
    from scipy.stats import chisquare

    x, y, z = points.T
    row = np.clip((z + 1) / 2 * _HEIGHTS, 0, _HEIGHTS - 1).astype(int)
    column = np.clip((np.arctan2(y, x) / np.pi + 1) / 2 * _LONGITUDES, 0, _LONGITUDES - 1)
    cells = row * _LONGITUDES + column.astype(int)
    done = chisquare(np.bincount(cells, minlength=_HEIGHTS * _LONGITUDES))
    null = f"χ², {_HEIGHTS * _LONGITUDES - 1} degrees of freedom"
    return UniformityTest(float(done.statistic), float(done.pvalue), null)
