"""The nearest rotations to 3 × 3 matrices, by Markley's FOAM (fast optimal attitude matrix).

Let R be the nearest rotation to M. Then S = RᵀM is symmetric and has eigenvalues s₁ ≥ s₂ ≥ |s₃|.
The cofactor matrix of R f(S) is R cof f(S) for every function f. So three matrices are products of
R and a symmetric matrix:

    cof M is R times a matrix with the eigenvalues s₂s₃, s₃s₁, s₁s₂;
    cof(λM + cof M) is R times a matrix with the eigenvalues ζ (s₂ + s₃), ζ (s₃ + s₁), ζ (s₁ + s₂);
    ζM + cof(λM + cof M) is R times λζ I,

where λ = s₁ + s₂ + s₃ and ζ = (s₁ + s₂)(s₂ + s₃)(s₃ + s₁). Here s₁² is the largest root of
x³ − ‖M‖² x² + ‖cof M‖² x − det² = 0, computed by Viète's formula, and
(s₂ + s₃)² = ‖M‖² − s₁² + 2 det/s₁. If λ or ζ has an error, the result is R times another symmetric
matrix near λζ I. One step of Newton's method for the polar factor, X ← (X + X⁻ᵀ)/2, squares the
relative distance of this matrix from λζ I.

Arrays have the shape (3, 3, N). For few matrices, the SVD is faster (see `rbcourse.projection`).
"""

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import BLOCK, Array, blocks, scaled

GAP_ERROR = 4e-6  # of 1.8e6 matrices near s₂ = −s₃ or s₁ = s₂ = s₃, the largest error was 2e-6
LEAST_ZETA = 3e-3  # in units of s₁ ‖M‖²; for smaller ζ, the result loses digits


def nearest_rotations(M: Array, R: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to M into R, and return a mask of the valid rotations.

    A rotation is not valid if ζ is less than `LEAST_ZETA` s₁ ‖M‖², which means that M is near the
    singular set of `project_so`. It is also not valid if an entry of M is not finite or ‖M‖ is
    extreme.

    Source: BK Prop. 2; F. L. Markley, Attitude determination using vector observations: a fast
    optimal matrix algorithm, J. Astronautical Sciences 41, 1993.
    """
    count = M.shape[-1]
    right = np.zeros(count, bool)
    workspace = np.empty((3, 3, 3, min(count, BLOCK)))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        for part in blocks(count):
            of_block, X, C = workspace[..., : part.stop - part.start]
            of_block[...] = M[..., part]
            right[part] = _project(of_block, X, C)
            R[..., part] = C
    return right


def _project(M: Array, X: Array, C: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to one block M into C; M and X are overwritten."""
    norm2 = _dots(M, M)
    if not 1e-30 < norm2.min() <= norm2.max() < 1e30:  # avoids overflow of norm2**6
        M[...] = scaled(M, axis=(0, 1))
        norm2 = _dots(M, M)
    s1, gap, det = _eigenvalues(M, C, norm2)
    lam = s1 + gap
    zeta = gap * (s1 * lam + det / s1)
    np.multiply(M, lam, X)
    X += C
    write_cofactors(X, C)
    M *= zeta
    M += C
    write_cofactors(M, C)
    C *= (zeta * lam) ** 2 / _dots(M[:1], C[:1])
    C += M
    C *= 0.5 / (zeta * lam)
    right: NDArray[np.bool_] = zeta > LEAST_ZETA * s1 * norm2
    return right


def _eigenvalues(M: Array, C: Array, norm2: Array) -> tuple[Array, Array, Array]:
    """Return s₁, the gap s₂ + s₃, and det M; write the cofactors of M into C."""
    write_cofactors(M, C)
    a, cof2, det = norm2 / 3, _dots(C, C), _dots(M[:1], C[:1])
    r2 = np.maximum(a * a - cof2 / 3, 1e-200)
    r = np.sqrt(r2)
    cosine = np.clip((a * (3 * r2 - a * a) + det * det) / (2 * r2 * r), -1, 1)
    x = a + r * (4 / (1 + np.tan(np.arccos(cosine) / 6) ** 2) - 2)  # a + 2 r cos(arccos(cosine)/3)
    s1 = np.sqrt(x)
    return s1, np.sqrt(np.maximum(norm2 - x + 2 * det / s1, 0)), det


def gaps(M: Array) -> Array:
    """Return s₂ + s₃ with an error below `GAP_ERROR` ‖M‖, for bounds.

    `rbcourse.projection.gap` has an error of a few eps ‖M‖, and takes 11 times as long for 500
    matrices.
    """
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        return _eigenvalues(M, np.empty_like(M), _dots(M, M))[1]


def write_cofactors(M: Array, C: Array) -> None:
    """Write the cofactors of M into C."""
    for i in range(3):
        (a, b, c), (d, e, f), (x, y, z) = M[i - 2], M[i - 1], C[i]
        np.subtract(b * f, c * e, x)
        np.subtract(c * d, a * f, y)
        np.subtract(a * e, b * d, z)


def _dots(A: Array, B: Array) -> Array:
    return np.einsum("ijn,ijn->n", A, B)
