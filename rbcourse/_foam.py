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

The private functions take the nine entries of a matrix, row by row: numbers for one matrix, arrays
for a stack. For stacks of few matrices, the SVD is faster (see `rbcourse.projection`).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array, blocks, scaled

Entries: TypeAlias = Sequence[Any]
GAP_ERROR = 1e-5  # of 1.8e6 matrices near s₂ = −s₃ or s₁ = s₂ = ±s₃, the largest error was 6e-6
LEAST_ZETA = 3e-3  # in units of s₁ ‖M‖²; for smaller ζ, the result loses digits
TOGETHER = 16_000  # matrices; 1e6 of them take 0.85 of the time that they take in blocks of 5,000
LEAST, MOST = 1e-30, 1e30  # ‖M‖² is kept between them, which avoids overflow of its sixth power


class Functions(NamedTuple):
    """Functions of numbers or of arrays; the argument of `acos` may exceed [−1, 1] by rounding."""

    sqrt: Callable[[Any], Any]
    tan: Callable[[Any], Any]
    acos: Callable[[Any], Any]


OF_NUMBERS = Functions(math.sqrt, math.tan, lambda x: math.acos(min(max(x, -1.0), 1.0)))
OF_ARRAYS = Functions(np.sqrt, np.tan, lambda x: np.arccos(np.minimum(np.maximum(x, -1), 1)))


def nearest_rotation(M: Array) -> Array | None:
    """Return the nearest rotation to one matrix, or None if it is not valid.

    With Python's numbers, one matrix takes 8 µs; `nearest_rotations` takes 100 µs for it, and the
    SVD with the correction of its rounding errors takes 45 µs.
    """
    entries = M.ravel().tolist()
    if not LEAST < _sum_of_squares(entries) < MOST:
        with np.errstate(over="ignore", invalid="ignore"):
            entries = scaled(M).ravel().tolist()
    try:
        R, valid = _project(entries, _sum_of_squares(entries), OF_NUMBERS)
    except ArithmeticError:  # ζ = 0
        return None
    return np.array([*R]).reshape(3, 3) if valid else None


def nearest_rotations(M: Array, R: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to M into R, and return a mask of the valid rotations.

    A rotation is not valid if ζ is less than `LEAST_ZETA` s₁ ‖M‖², which means that M is near the
    singular set of `project_so`. It is also not valid if an entry of M is not finite or ‖M‖ is
    extreme. The arrays have the shape (3, 3, N).

    Source: BK Prop. 2; F. L. Markley, Attitude determination using vector observations: a fast
    optimal matrix algorithm, J. Astronautical Sciences 41, 1993.
    """
    count = M.shape[-1]
    valid = np.zeros(count, bool)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        for part in blocks(count, TOGETHER):
            block = np.ascontiguousarray(M[..., part])
            norm2 = np.einsum("ijn,ijn->n", block, block)
            if not LEAST < norm2.min() <= norm2.max() < MOST:
                block = scaled(block, axis=(0, 1))
                norm2 = np.einsum("ijn,ijn->n", block, block)
            rows, valid[part] = _project([*block.reshape(9, -1)], norm2, OF_ARRAYS)
            for row, (i, j) in zip(rows, np.ndindex(3, 3), strict=True):
                R[i, j, part] = row
    return valid


def _project(M: Entries, norm2: Any, library: Functions) -> tuple[Iterator[Any], Any]:
    """Return the entries of the nearest rotation, and whether it is valid."""
    C = cofactors(M)
    s1, gap, det = _eigenvalues(M, C, norm2, library)
    lam = s1 + gap
    zeta = gap * (s1 * lam + det / s1)
    C = cofactors([lam * x + c for x, c in zip(M, C, strict=True)])
    X = [zeta * x + c for x, c in zip(M, C, strict=True)]
    C = cofactors(X)
    half = 0.5 / (zeta * lam)
    back = half * (zeta * lam) ** 2 / determinant(X, C)
    rows = (half * x + back * c for x, c in zip(X, C, strict=True))
    return rows, (norm2 > 0) & (zeta > LEAST_ZETA * s1 * norm2)


def _eigenvalues(M: Entries, C: Entries, norm2: Any, library: Functions) -> tuple[Any, Any, Any]:
    """Return s₁, the gap s₂ + s₃, and det M, given the cofactors C of M."""
    a, det = norm2 / 3, determinant(M, C)
    r2 = abs(a * a - _sum_of_squares(C) / 3) + 1e-200
    r = library.sqrt(r2)
    cosine = (a * (3 * r2 - a * a) + det * det) / (2 * r2 * r)
    sixth = library.acos(cosine) / 6
    x = a + r * (4 / (1 + library.tan(sixth) ** 2) - 2)  # a + 2 r cos(2 sixth)
    s1 = library.sqrt(x)
    return s1, library.sqrt(abs(norm2 - x + 2 * det / s1)), det


def gaps(M: Array) -> Array:
    """Return s₂ + s₃ with an error below `GAP_ERROR` ‖M‖, for bounds; M has the shape (3, 3, N).

    `rbcourse.projection.gap` has an error of a few eps ‖M‖, and takes 11 times as long for 500
    matrices.
    """
    entries = [*M.reshape(9, -1)]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        norm2 = np.einsum("ijn,ijn->n", M, M)
        gap: Array = _eigenvalues(entries, cofactors(entries), norm2, OF_ARRAYS)[1]
    return gap


def cofactors(M: Entries) -> Entries:
    """Return the cofactors of M."""
    a, b, c, d, e, f, g, h, i = M
    return (
        *(e * i - f * h, f * g - d * i, d * h - e * g),
        *(c * h - b * i, a * i - c * g, b * g - a * h),
        *(b * f - c * e, c * d - a * f, a * e - b * d),
    )


def determinant(M: Entries, C: Entries) -> Any:
    """Return the determinant of M, given its cofactors."""
    return M[0] * C[0] + M[1] * C[1] + M[2] * C[2]


def _sum_of_squares(M: Entries) -> Any:
    total = M[0] * M[0]
    for x in M[1:]:
        total += x * x
    return total
