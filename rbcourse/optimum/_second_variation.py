"""The second variation of an optimum between two poses, and a proof that it is positive.

Vary R(t) to R exp(s η̂), where η and η' (for the jerk, also η'') vanish at both ends. Let
x = η' + w × η and ε = R η, so that ε' = R x. Since R p = c, the second derivative of the cost with
respect to s is

    ½ δ² ∫ L dt = ± ∫ δp · x + c · (ε' × ε) dt,    δp = Σ Pᵢ x⁽ⁱ⁾,  Pᵢ = ∂p/∂w⁽ⁱ⁾,

where ± is − for the acceleration and the torque, and + for the jerk. It is the integral of
L(x, x) = x⁽ᵏ⁾ · M x⁽ᵏ⁾ plus terms with fewer derivatives; M is constant and positive definite. Each
such x and its first k − 1 derivatives vanish at both ends, and ∫ R x dt = 0. If the second
derivative is at least a positive multiple of ∫ L(x, x) dt for every such x, the curve is a strict
local minimum. Three steps prove this, up to rounding, quadrature and the error of the curve.

(1) A penalty, `_PENALTY` ‖∫ R x dt‖², is added, and the form must be positive also for x that
violate ∫ R x dt = 0. Then ε is the primitive of R x with ε(1) = −ε(0), so that the form is
symmetric. (2) x is split into x₁ and x₂, where x₁⁽ᵏ⁾ is a polynomial of a degree below J, and x₂⁽ᵏ⁾
is orthogonal to such polynomials. In a basis of Legendre polynomials, the form for x₁ is a matrix
Q. Successive integrations of x₂⁽ᵏ⁾ divide its norm by at least 2J − 1, 2J − 3, …, so the terms with
fewer derivatives are at most a share γ of ∫ L(x₂, x₂) dt. (3) The mixed terms are
∫ x₂⁽ᵏ⁾ · F x₁ dt, and only the part of F x₁ orthogonal to the polynomials contributes. Let E be the
matrix of the inner products of these parts. The form is positive if γ < 1 and Q − E/(1 − γ) is
positive definite.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from rbcourse._numerics import Array, matvec
from rbcourse._polynomials import Grid, grid
from rbcourse.curves.functionals import BallAcceleration
from rbcourse.so3 import hat

_PENALTY = 1e4  # the penalty is this number times (‖c‖ + 1) ‖M‖
_CLEAR = 1e-6  # a smaller eigenvalue may differ from 0 only by rounding
_DEGREES = 24, 48, 96  # of test functions; the next, if the bounds of an eigenvalue are not clear
_SMALL = 2 * np.pi**3  # for a ball, a smaller ‖c‖ suffices (docs/near_optimal.md)


@lru_cache
def polynomials(m: int, k: int, nodes: int) -> list[Any]:
    """Return m polynomials with k-fold zeros at 0 and 1, and their first 2 k derivatives, at nodes.

    Each array has the shape (nodes, m), for Chebyshev nodes. The k-th derivatives are the
    normalised Legendre polynomials of the degrees k, k + 1, …
    """
    from numpy.polynomial.legendre import legder, legint, legval

    coefficients = np.diag(np.sqrt(2.0 * np.arange(m + k) + 1))[:, k:]
    made = [legint(coefficients, k - i, lbnd=-1, scl=0.5) for i in range(k)]
    made += [legder(coefficients, i, scl=2) for i in range(k + 1)]
    return [legval(2 * grid(nodes).t - 1, c).T for c in made]


def is_positive(curve: Any) -> bool:
    """Tell whether the second variation is proven to be positive, for a stack of one curve."""
    if np.isnan(curve.constant).any():
        return False
    if isinstance(curve.functional, BallAcceleration) and np.linalg.norm(curve.constant) < _SMALL:
        return True
    for m in _DEGREES:
        least, bound = least_eigenvalues(curve, m)
        if bound > _CLEAR or least < _CLEAR:
            return bound > _CLEAR
    return False


def least_eigenvalues(curve: Any, m: int) -> tuple[float, float]:
    """Return the least eigenvalues of Q and of Q − E/(1 − γ), which is −∞ if γ is 1 or more.

    There are m polynomials for each axis.
    """
    functional, k = curve.functional, curve.functional.ends // 2
    sign, J = (-1) ** k, m + k
    nodes = grid(max(4 * m + 1, 2 * curve.series.shape[-2] - 1))
    t, weights = nodes.t, nodes.integral[-1]
    R, *rates = (curve.values(t[:, None], i).swapaxes(0, 1) for i in range(2 * k + 2))
    P = [np.broadcast_to(Pi[0], (len(t), 3, 3)) for Pi in functional.p_by(*rates)]
    c = matvec(R, functional.p(*rates))[0].mean(axis=0)
    R, M, size = R[0], P[-1][0], float(np.linalg.norm(c))

    root = np.linalg.inv(np.linalg.cholesky(M)).T  # with x = root @ y, L(x, x) = ‖y⁽ᵏ⁾‖²
    x = [on_each_axis(values, root) for values in polynomials(m, k, len(t))]
    rate = R @ x[0]
    total = np.tensordot(weights, rate, axes=1)
    turn = np.tensordot(nodes.integral, rate, axes=1) - total / 2
    # the form of x and z is ± ∫ z · force(x) dt
    penalty = sign * _PENALTY * (1 + size) * np.linalg.norm(M, 2)
    force = R.mT @ (penalty * total - hat(c) @ turn)
    force += sum(Pi @ xi for Pi, xi in zip(P, x, strict=True))
    Q = sign * products(weights, x[0], force)
    Q = (Q + Q.T) / 2

    F = root.T @ force
    for _ in range(k):
        F = np.tensordot(nodes.integral, F, axes=1)
    legendre = polynomials(J, 0, len(t))[0]
    F -= np.tensordot(legendre, np.tensordot(weights[:, None] * legendre, F, (0, 0)), axes=1)
    share = _share([root.T @ Pi @ root for Pi in P], _largest(root.T @ root) * size, nodes, J)
    least, bound = float(np.linalg.eigvalsh(Q)[0]), -np.inf
    if share < 1:
        bound = float(np.linalg.eigvalsh(Q - products(weights, F, F) / (1 - share))[0])
    return least, bound


def _share(P: list[Array], c: float, nodes: Grid, J: int) -> float:
    """Return γ, a bound on the terms with fewer derivatives, as a share of ∫ ‖y₂⁽ᵏ⁾‖² dt."""
    k = len(P) // 2
    norms = [_largest(Pi) for Pi in P]
    # ‖y₂⁽ⁱ⁾‖ is at most size[k − i] ‖y₂⁽ᵏ⁾‖, and ‖ε‖ at most ‖x₂‖/π
    size = np.cumprod([1.0, *(1 / (2 * J - 1 - 2 * i) for i in range(k))])
    share = size[k] ** 2 * c / np.pi
    share += sum(norms[i] * size[k] * size[k - i] for i in range(k + 1))
    if k == 2:  # integration by parts: ∫ y · P₃ y⁽³⁾ = −∫ (P₃ᵀ y)' · y''
        slopes = np.tensordot(nodes.derivative, P[3], axes=1)
        share += norms[3] * size[1] + _largest(slopes) * size[2]
    return float(share)


def _largest(matrices: Array) -> float:
    return float(np.linalg.norm(matrices, 2, axis=(-2, -1)).max())


def on_each_axis(values: Array, root: Array) -> Array:
    """Multiply m functions, shape (n, m), by the columns of a matrix: shape (n, 3, 3 m)."""
    return np.einsum("tj,ab->tajb", values, root).reshape(len(values), 3, -1)


def products(weights: Array, x: Array, y: Array) -> Array:
    """Return the integrals of the inner products of functions, shapes (..., n, 3, columns)."""
    n, three, columns = x.shape[-3:]
    x = (weights[:, None, None] * x).reshape(*x.shape[:-3], n * three, columns)
    return x.mT @ y.reshape(*y.shape[:-3], n * three, y.shape[-1])
