"""The nearest rotations to 3 × 3 matrices: Markley's fast optimal attitude matrix, FOAM.

Let R be the nearest rotation to M, so that S = RᵀM is symmetric, with eigenvalues s₁ ≥ s₂ ≥ |s₃|.
The cofactor matrix of R f(S) is R cof f(S), for every function f. So three matrices are R times

    cof M                    a matrix with the eigenvalues s₂s₃, s₃s₁, s₁s₂;
    cof(λM + cof M)          one with ζ (s₂ + s₃), ζ (s₃ + s₁), ζ (s₁ + s₂);
    ζM + cof(λM + cof M)     λζ I,

where λ = s₁ + s₂ + s₃ and ζ = (s₁ + s₂)(s₂ + s₃)(s₃ + s₁) follow from ‖M‖, ‖cof M‖ and det M.
An error in λ or ζ leaves R times another symmetric matrix, near λζ I; one step of Newton's method
for the polar factor, X ← (X + X⁻ᵀ)/2, squares its relative distance.

`nearest_rotations` does this entry by entry: its arrays have the shape (3, 3, N). For few matrices
the SVD is faster, see `rbcourse.projection`.
"""

import math
import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array, at_cache_line, blocks, scaled

LEAST_ZETA = 3e-3  # times s₁ ‖M‖²; below, digits are lost, and matrices are rare
_BLOCK = 5128  # matrices that fit into the cache; with rows of 4096 bytes they would collide there
_SAFE = 1e-30, 1e30  # squares of norms that can be taken to the sixth power


class _Workspace(threading.local):
    """Arrays that begin at a cache line, and are kept for the next call: that saves a third."""

    def __init__(self) -> None:
        self.M, self.X, self.C = (at_cache_line(3, 3, _BLOCK) for _ in range(3))
        self.rows = at_cache_line(7, _BLOCK)


_KEPT = _Workspace()


def nearest_rotations(M: Array, R: Array) -> NDArray[np.bool_]:
    """Write the nearest rotations to M into R, both of shape (3, 3, N); return which are right.

    s₁² is the largest root of x³ − ‖M‖² x² + ‖cof M‖² x − det² = 0, by Viète's formula
    x = a + 2 r cos(arccos(q)/3), with a = ‖M‖²/3, r² = a² − ‖cof M‖²/3 and
    q = (a (3 r² − a²) + det²)/(2 r³); and (s₂ + s₃)² = ‖M‖² − s₁² + 2 det/s₁.

    Entries that fail are left undefined: where ζ is less than `LEAST_ZETA` s₁ ‖M‖², near the
    singular set of `project_so`; where an entry of M is not finite; and perhaps where ‖M‖ is
    extreme.

    Source: BK Prop. 2; F. L. Markley, Attitude determination using vector observations: a fast
    optimal matrix algorithm, J. Astronautical Sciences 41, 1993.

    Examples
    --------
    >>> M = np.array([[0.0, -2, 0], [3, 0, 0], [0, 0, 1]])[..., None]
    >>> R = np.empty((3, 3, 1))
    >>> nearest_rotations(M, R), R[..., 0].round(12) + 0.0
    (array([ True]), array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]]))
    """
    count = M.shape[-1]
    right = np.zeros(count, bool)
    if not count:
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
