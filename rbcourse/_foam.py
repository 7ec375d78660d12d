"""The nearest rotations to 3 × 3 matrices: Markley's fast optimal attitude matrix, FOAM.

Let R be the nearest rotation to M, so that S = RᵀM is symmetric, with eigenvalues s₁ ≥ s₂ ≥ |s₃|.
The cofactor matrix of R f(S) is R cof f(S), for every function f. So three matrices are R times

    cof M                    a matrix with the eigenvalues s₂s₃, s₃s₁, s₁s₂;
    cof(λM + cof M)          one with ζ (s₂ + s₃), ζ (s₃ + s₁), ζ (s₁ + s₂);
    ζM + cof(λM + cof M)     λζ I,

where λ = s₁ + s₂ + s₃ and ζ = (s₁ + s₂)(s₂ + s₃)(s₃ + s₁) follow from ‖M‖, ‖cof M‖ and det M.
An error in λ or ζ leaves R times another symmetric matrix, near λζ I; one step of Newton's method
for the polar factor, X ← (X + X⁻ᵀ)/2, squares its relative distance.

`nearest_rotation` implements this for one matrix. `nearest_rotations` does the same for many, entry
by entry: its arrays have the shape (3, 3, N).
"""

import math
import threading
from collections.abc import Sequence
from operator import mul

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array, at_cache_line, blocks, scaled

LEAST_ZETA = 3e-3  # times s₁ ‖M‖²; below, digits are lost, and matrices are rare
_FEW = 10  # matrices, for which it is faster to take them one by one
_BLOCK = 5128  # matrices that fit into the cache; with rows of 4096 bytes they would collide there
_SAFE = 1e-30, 1e30  # squares of norms that can be taken to the sixth power


def nearest_rotation(M: Sequence[float]) -> list[float] | None:
    """Return the nearest rotation to M, both as nine numbers, row by row.

    s₁² is the largest root of x³ − ‖M‖² x² + ‖cof M‖² x − det² = 0, by Viète's formula
    x = a + 2 r cos(arccos(q)/3), with a = ‖M‖²/3, r² = a² − ‖cof M‖²/3 and
    q = (a (3 r² − a²) + det²)/(2 r³); and (s₂ + s₃)² = ‖M‖² − s₁² + 2 det/s₁.

    None is returned where ζ is less than `LEAST_ZETA` s₁ ‖M‖², near the singular set of
    `project_so`; and where ‖M‖² is not within 1e-30 and 1e30.

    References
    ----------
    BK Prop. 2; F. L. Markley, Attitude determination using vector observations: a fast optimal
    matrix algorithm, J. Astronautical Sciences 41, 1993.

    Examples
    --------
    >>> nearest_rotation([0, -2, 0, 3, 0, 0, 0, 0, 1])
    [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    """
    C = _cofactors(M)
    norm2, cof2, det = _dot(M, M), _dot(C, C), _dot(M[:3], C[:3])
    if not _SAFE[0] < norm2 < _SAFE[1]:
        return None
    a = norm2 / 3
    r2 = max(a * a - cof2 / 3, 1e-200)
    r = math.sqrt(r2)
    q = (a * (3 * r2 - a * a) + det * det) / (2 * r * r2)
    s1 = math.sqrt(a + 2 * r * math.cos(math.acos(max(-1.0, min(1.0, q))) / 3))
    gap = math.sqrt(max(norm2 - s1 * s1 + 2 * det / s1, 0.0))
    lam = s1 + gap
    zeta = gap * (s1 * lam + det / s1)
    if not zeta > LEAST_ZETA * s1 * norm2:
        return None
    X = _add(zeta, M, 1.0, _cofactors(_add(lam, M, 1.0, C)))
    C = _cofactors(X)
    return _add(0.5 / (lam * zeta), X, 0.5 * lam * zeta / _dot(X[:3], C[:3]), C)


def _cofactors(M: Sequence[float]) -> Sequence[float]:
    a, b, c, d, e, f, g, h, i = M
    return [
        *(e * i - f * h, f * g - d * i, d * h - e * g),
        *(h * c - i * b, i * a - g * c, g * b - h * a),
        *(b * f - c * e, c * d - a * f, a * e - b * d),
    ]


def _dot(x: Sequence[float], y: Sequence[float]) -> float:
    return sum(map(mul, x, y))


def _add(a: float, x: Sequence[float], b: float, y: Sequence[float]) -> list[float]:
    return [a * p + b * q for p, q in zip(x, y, strict=True)]


class _Workspace(threading.local):
    """Arrays that begin at a cache line, and are kept for the next call: that saves a third."""

    def __init__(self) -> None:
        self.M, self.X, self.C = (at_cache_line(3, 3, _BLOCK) for _ in range(3))
        self.rows = at_cache_line(7, _BLOCK)


_KEPT = _Workspace()


def nearest_rotations(M: Array, R: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to M into R, both of shape (3, 3, N); return which are right.

    Entries that fail are left undefined: near the singular set of `project_so` (see
    `nearest_rotation`), where an entry of M is not finite, and perhaps where ‖M‖ is extreme.

    References
    ----------
    BK Prop. 2, as `nearest_rotation`.

    Examples
    --------
    >>> M, R = np.random.default_rng(1).normal(size=(2, 3, 3, 100))
    >>> right = nearest_rotations(M, R)
    >>> bool(right.all()), np.allclose(R[..., 7].ravel(), nearest_rotation(M[..., 7].ravel()))
    (True, True)
    """
    count = M.shape[-1]
    right = np.zeros(count, bool)
    if count < _FEW:
        for k in range(count):
            found = nearest_rotation(M[..., k].ravel().tolist())
            if found:
                R[..., k], right[k] = np.reshape(found, (3, 3)), True
        return right
    size = 8 * math.ceil(count / 8 / math.ceil(count / _BLOCK))
    for block in blocks(count, size):
        part = slice(block.stop - block.start)
        entries, X, C = (x[..., part] for x in (_KEPT.M, _KEPT.X, _KEPT.C))
        np.copyto(entries, M[..., block])
        right[block] = _project(entries, X, C, _KEPT.rows[:, part])
        np.copyto(R[..., block], C)
    return right


def _project(M: Array, X: Array, C: Array, rows: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to M into C, and return which are right.

    X and rows are workspace.
    """
    norm2, cof2, det, s1, gap, t, u = rows
    m, x, c = ([list(row) for row in entries] for entries in (M, X, C))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        _dots(M, M, norm2)
        if not _SAFE[0] < norm2.min() <= norm2.max() < _SAFE[1]:
            np.copyto(M, scaled(M, axis=(0, 1)))
            _dots(M, M, norm2)
        _write_cofactors(m, c, t)
        _dots(C, C, cof2)
        _dots(M[:1], C[:1], det)
        _write_largest_and_gap(norm2, cof2, det, s1, gap, t, u)
        lam = np.add(s1, gap, u)
        zeta = np.multiply(s1, lam, det)
        zeta += t
        zeta *= gap
        right = zeta > LEAST_ZETA * s1 * norm2
        np.multiply(M, lam, X)
        X += C
        _write_cofactors(x, c, t)
        M *= zeta
        M += C
        _write_cofactors(m, c, t)
        zeta *= lam
        _dots(M[:1], C[:1], t)
        C *= zeta**2 / t
        C += M
        C *= 0.5 / zeta
    return right


def _write_largest_and_gap(
    norm2: Array, cof2: Array, det: Array, s1: Array, gap: Array, t: Array, u: Array
) -> None:
    """Write s₁, s₂ + s₃, and det/s₁ into t; with 2 cos 2φ = 4/(1 + tan² φ) − 2, which is faster."""
    a, a2, r2 = np.multiply(norm2, 1 / 3, s1), np.multiply(s1, s1, t), gap
    np.subtract(a2, np.multiply(cof2, 1 / 3, u), r2)
    np.maximum(r2, 1e-200, out=r2)
    r = np.sqrt(r2, u)
    q = np.subtract(np.multiply(r2, 3, cof2), a2, t)
    q *= a
    q += np.multiply(det, det, cof2)
    r2 *= r
    r2 *= 2
    q /= r2
    np.clip(q, -1, 1, out=q)
    np.arccos(q, q)
    q *= 1 / 6
    np.tan(q, q)
    q *= q
    q += 1
    np.divide(4, q, q)
    q -= 2
    q *= r
    a += q
    np.subtract(norm2, a, gap)
    np.sqrt(s1, s1)
    np.divide(det, s1, t)
    gap += t
    gap += t
    np.sqrt(np.maximum(gap, 0, out=gap), gap)


Entries = Sequence[Sequence[Array]]


def _write_cofactors(M: Entries, C: Entries, t: Array) -> None:
    """Write the cofactors of M into C: each row is the cross product of the two others."""
    for i in range(3):
        (a, b, c), (d, e, f), (x, y, z) = M[i - 2], M[i - 1], C[i]
        np.subtract(np.multiply(b, f, x), np.multiply(c, e, t), x)
        np.subtract(np.multiply(c, d, y), np.multiply(a, f, t), y)
        np.subtract(np.multiply(a, e, z), np.multiply(b, d, t), z)


def _dots(A: Array, B: Array, out: Array) -> None:
    np.einsum("ijn,ijn->n", A, B, out=out)
