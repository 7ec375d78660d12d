"""Random rotations: uniform samples, naive samples (not uniform), and tests of uniformity.

Uniform means distributed by the Haar measure: multiplying a set of rotations by a rotation, from
the left or the right, does not change the probability of the set.

Parameters
----------
size : int or tuple of int, optional
    The number of rotations, or a batch shape; by default one rotation, without a batch axis.
rng : Generator, int or None, optional
    A generator, a seed, or None for fresh numbers, as for `numpy.random.default_rng`.
angle : array_like, shape (...)
    The angle a, in [0, π].
R : array_like, shape (n, 3, 3)
    At least 100 rotation matrices, in the order of the draws.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import Rng, as_angle, as_generator, as_size, as_within_unit
from rbcourse._docs import described_by
from rbcourse._numerics import BLOCK, Array, blocks, sine_gap_ratio
from rbcourse._valid import as_rotations
from rbcourse.quaternion import matrix_from_zyx, quaternion_from_zyx

__all__ = [
    "Rng",
    "UniformityTest",
    "angle_law",
    "arvo_rotation",
    "sample_quaternion",
    "sample_quaternion_naive",
    "sample_rotation",
    "sample_rotation_naive",
    "shoemake_quaternion",
    "uniformity_tests",
]

_HEIGHTS, _LONGITUDES = 4, 5  # cells of equal area; 5 of 100 rotations are expected in each


@described_by(returns="ndarray, shape (..., 3, 3)")
def arvo_rotation(x: ArrayLike) -> Array:
    """Return Arvo's rotation −M B for three numbers; uniform numbers give uniform rotations.

    B turns by 2π x₁ about the z axis, and −M is a half-turn about V = (√z cos 2π x₂, √z sin 2π x₂,
    √(1 − z)): M = I − 2 V Vᵀ. The printed product M B has the determinant −1.
    Source: RR 2.1, RR (9), RR (10), RR (11); J. Arvo, Fast random rotation matrices, Graphics Gems
    III, 1992.

    Parameters
    ----------
    x : array_like, shape (..., 3)
        x₁, x₂, z in [0, 1].

    Examples
    --------
    >>> arvo_rotation([0, 0, 0])  # V = z, B = I
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    x1, x2, z = np.moveaxis(as_within_unit("x", x, 3), -1, 0)
    theta, phi = 2 * np.pi * x1, 2 * np.pi * x2
    V = np.stack([np.cos(phi) * np.sqrt(z), np.sin(phi) * np.sqrt(z), np.sqrt(1 - z)], axis=-1)
    M = np.eye(3) - 2 * V[..., :, None] * V[..., None, :]
    B = matrix_from_zyx(np.stack([theta, 0 * theta, 0 * theta], axis=-1))
    return -M @ B


@described_by(returns="ndarray, shape (..., 4)")
def shoemake_quaternion(x: ArrayLike) -> Array:
    """Return Shoemake's quaternion for three numbers; uniform numbers give uniform rotations.

    The quaternion is (√s cos θ₂, √(1−s) sin θ₁, √(1−s) cos θ₁, √s sin θ₂), with θ₁ = 2π x₁ and θ₂ =
    2π x₂.
    Source: RR 2.2, RR (13); J. J. Kuffner, Effective sampling and distance metrics for 3D rigid
    body path planning, ICRA 2004; K. Shoemake, Uniform random rotations, Graphics Gems III, 1992.

    Parameters
    ----------
    x : array_like, shape (..., 3)
        s, x₁, x₂ in [0, 1].

    Examples
    --------
    >>> shoemake_quaternion([0.36, 0, 0])
    array([0.6, 0. , 0.8, 0. ])
    """
    s, x1, x2 = np.moveaxis(as_within_unit("x", x, 3), -1, 0)
    theta1, theta2 = 2 * np.pi * x1, 2 * np.pi * x2
    sigma1, sigma2 = np.sqrt(1 - s), np.sqrt(s)
    w, z = np.cos(theta2) * sigma2, np.sin(theta2) * sigma2
    return np.stack([w, np.sin(theta1) * sigma1, np.cos(theta1) * sigma1, z], axis=-1)


@described_by(__doc__, returns="ndarray, shape size + (3, 3)")
def sample_rotation(size: int | Sequence[int] | None = None, *, rng: Rng = None) -> Array:
    """Return uniformly random rotation matrices.

    On every processor, the result is ``arvo_rotation(rng.random(size + (3,)))`` up to a few eps.
    Source: RR 2.1, RR (9), RR (10), RR (11).

    Examples
    --------
    >>> R = sample_rotation(1000, rng=1)
    >>> R.shape, bool(abs(R.mean(axis=0)).max() < 0.1)
    ((1000, 3, 3), True)
    """
    return _in_blocks(_arvo, (3, 3), size, rng)


@described_by(sample_rotation, returns="ndarray, shape size + (4,)")
def sample_quaternion(size: int | Sequence[int] | None = None, *, rng: Rng = None) -> Array:
    """Return uniformly random unit quaternions; q and −q are equally likely.

    On every processor, the result is ``shoemake_quaternion(rng.random(size + (3,)))`` up to a few
    eps.
    Source: RR 2.2, RR (13).

    Examples
    --------
    >>> q = sample_quaternion((2, 500), rng=1)
    >>> q.shape, bool(abs(q.mean(axis=(0, 1))).max() < 0.1)
    ((2, 500, 4), True)
    """
    return _in_blocks(_shoemake, (4,), size, rng)


@described_by(sample_rotation, returns="ndarray, shape size + (3, 3)")
def sample_rotation_naive(size: int | Sequence[int] | None = None, *, rng: Rng = None) -> Array:
    """Return R_z(α) R_y(β) R_x(γ) for angles uniform on [0, 2π); the rotations are not uniform.

    The mean E tr² of the squared trace is 7/8; for uniform rotations, it is 1.
    Source: RR 2.1, RR (7), RR (8).

    Examples
    --------
    >>> sample_rotation_naive(5, rng=1).shape
    (5, 3, 3)
    """
    return matrix_from_zyx(_three_angles(size, rng))


@described_by(sample_rotation, returns="ndarray, shape size + (4,)")
def sample_quaternion_naive(size: int | Sequence[int] | None = None, *, rng: Rng = None) -> Array:
    """Return q_z(γ) q_y(β) q_x(α) for angles uniform on [0, 2π); the quaternions are not uniform.

    The rotations have the distribution of `sample_rotation_naive`, but the first random angle turns
    about x, not about z.
    Source: RR 2.2, RR (12).

    Examples
    --------
    >>> sample_quaternion_naive(rng=1).shape
    (4,)
    """
    return quaternion_from_zyx(_three_angles(size, rng)[..., ::-1])


def _three_angles(size: int | Sequence[int] | None, rng: Rng) -> Array:
    return 2 * np.pi * as_generator(rng).random((*as_size(size), 3))


def _in_blocks(
    kernel: Callable[[Array, Array], None],
    core: tuple[int, ...],
    size: int | Sequence[int] | None,
    rng: Rng,
) -> Array:
    """Return random draws; the kernel maps 3 × m uniform numbers to the entries of m draws.

    The kernels write `arvo_rotation` and `shoemake_quaternion` again, entry by entry. Medians in
    one run: 10⁴ matrices take 1.1 ms in place of 5.7 ms, 10⁶ matrices 42 ms in place of 570 ms,
    and 10⁶ quaternions 25 ms in place of 89 ms.
    """
    shape, generator = as_size(size), as_generator(rng)
    draws = np.empty((math.prod(shape), math.prod(core)))
    entries = np.empty((math.prod(core), min(len(draws), BLOCK)))
    for block in blocks(len(draws)):
        uniform = generator.random((block.stop - block.start, 3)).T
        some = entries[:, : uniform.shape[1]]
        kernel(uniform, some)
        draws[block] = some.T
    return draws.reshape(*shape, *core)


def _arvo(x: Array, entries: Array) -> None:
    """Write the entries of `arvo_rotation`, expanded in the angles φ and ψ = φ − θ."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = entries
    (c, cos_psi), (s, sin_psi) = _cos_sin(np.stack([x[1], x[1] - x[0]]))
    height, radius = 2 * x[2] - 1, 2 * np.sqrt(x[2] * (1 - x[2]))
    hc, hs = height * c, height * s
    np.subtract(hc * cos_psi, s * sin_psi, xx)
    np.add(hc * sin_psi, s * cos_psi, xy)
    np.multiply(radius, c, xz)
    np.add(hs * cos_psi, c * sin_psi, yx)
    np.subtract(hs * sin_psi, c * cos_psi, yy)
    np.multiply(radius, s, yz)
    np.multiply(radius, cos_psi, zx)
    np.multiply(radius, sin_psi, zy)
    np.negative(height, zz)


def _shoemake(x: Array, entries: Array) -> None:
    (c1, c2), (s1, s2) = _cos_sin(x[1:])
    sigma1, sigma2 = np.sqrt(1 - x[0]), np.sqrt(x[0])
    for entry, on_circle, sigma in zip(
        entries, (c2, s1, c1, s2), (sigma2, sigma1, sigma1, sigma2), strict=True
    ):
        np.multiply(on_circle, sigma, entry)


def _cos_sin(turns: Array) -> tuple[Array, Array]:
    """Return cosine and sine, computed fast from the tangent of half the angle."""
    tangent = np.pi * turns
    np.tan(tangent, tangent)
    versed = tangent * tangent
    versed += 1
    np.divide(2, versed, versed)
    tangent *= versed
    versed -= 1
    return versed, tangent


class UniformityTest(NamedTuple):
    """The result of a test of uniformity: ``statistic``, ``p_value`` and ``null``.

    ``statistic`` is the value of the statistic; ``p_value`` is the probability that uniform
    rotations give a value at least as unusual; ``null`` names the distribution of the statistic for
    uniform and independent rotations.
    """

    statistic: float
    p_value: float
    null: str


@described_by(__doc__, returns="ndarray, shape (...)")
def angle_law(angle: ArrayLike) -> Array:
    """Return the probability (a − sin a)/π that a uniform rotation turns by at most a.

    The density is (1 − cos a)/π.
    Source: RR 2.

    Examples
    --------
    >>> angle_law([0, np.pi / 2, np.pi]).round(3)  # 82 % turn by more than 90°
    array([0.   , 0.182, 1.   ])
    """
    a = as_angle(angle)
    return a**3 * sine_gap_ratio(a) / np.pi


@described_by(__doc__)
def uniformity_tests(R: ArrayLike) -> dict[str, UniformityTest]:
    """Return statistics that test whether rotations are uniform and independent.

    Source: RR 2; J. Arvo, Fast random rotation matrices, Graphics Gems III, 1992.

    Returns
    -------
    dict of str to UniformityTest
        E tr, E tr²
            Means of the trace and of its square. For large n, they are normal with means 0, 1 and
            variances 1/n, 2/n.
        angle
            The largest difference between the distribution of the angle and `angle_law`. It has
            Kolmogorov's distribution.
        image of e₁, image of e₃
            χ² of the first and of the last column on 20 cells of the sphere. The cells have equal
            areas; there are 4 in height and 5 in longitude. For large n, the distribution is χ²
            with 19 degrees of freedom.
        angle to next, angle to half
            The statistic of the row "angle" for two sets of turns: from each draw with an even
            index to the next draw, and from each draw of the first half to its partner in the
            second half. Both statistics detect draws that depend on each other.

    Examples
    --------
    >>> test = uniformity_tests(sample_rotation_naive(10_000, rng=1))["E tr²"]
    >>> round(test.statistic, 2), test.null, test.p_value < 1e-6
    (0.87, 'normal, mean 1, sd 0.014', True)
    """
    R = as_rotations("R", R)
    if R.ndim != 3 or len(R) < 100:
        raise ValueError(f"R: shape (n, 3, 3) with n >= 100 is wanted, got {R.shape}")
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

    cosine = (np.trace(R, axis1=-2, axis2=-1) - 1) / 2  # half the digits suffice for the test
    done = kstest(np.arccos(np.clip(cosine, -1, 1)), angle_law)
    return UniformityTest(float(done.statistic), float(done.pvalue), f"Kolmogorov, n = {len(R)}")


def _cell_test(points: Array) -> UniformityTest:
    """Return the χ² test of points on the sphere; zones of equal height have equal areas."""
    from scipy.stats import chisquare

    x, y, z = points.T
    row = np.clip((z + 1) / 2 * _HEIGHTS, 0, _HEIGHTS - 1).astype(int)
    column = np.clip((np.arctan2(y, x) / np.pi + 1) / 2 * _LONGITUDES, 0, _LONGITUDES - 1)
    cells = row * _LONGITUDES + column.astype(int)
    done = chisquare(np.bincount(cells, minlength=_HEIGHTS * _LONGITUDES))
    null = f"χ², {_HEIGHTS * _LONGITUDES - 1} degrees of freedom"
    return UniformityTest(float(done.statistic), float(done.pvalue), null)
