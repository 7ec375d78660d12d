"""The connection and the geodesics of a left-invariant metric, in components (BK section 2).

Components are those of angular velocities or twists, as in `rbcourse.metrics`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_symmetric, check_broadcast, first_index
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array, scaled
from rbcourse._valid import as_rotations_or_poses
from rbcourse.projection import project_se, project_so
from rbcourse.se3 import BASIS_SE3
from rbcourse.so3 import BASIS_SO3

__all__ = [
    "BASIS_SE3",
    "BASIS_SO3",
    "christoffel",
    "covariant_derivative",
    "geodesic_flow",
    "structure_constants",
]


@described_by(returns="ndarray, shape (m, m, m)")
def structure_constants(basis: ArrayLike) -> Array:
    """Return C with [L_i, L_j] = C[k, i, j] L_k, summed over k, for a basis of a Lie algebra.

    The constants are antisymmetric in i and j; for ``BASIS_SO3``, C[k, i, j] = ε_ijk.
    Source: BK 2.4, BK (2), BK (3).

    Parameters
    ----------
    basis : array_like, shape (m, n, n)
        The basis L_1 … L_m, such as ``BASIS_SO3`` or ``BASIS_SE3``. The matrices must be linearly
        independent; the tolerance is one part in a million. Up to rounding, their commutators must
        be combinations of the basis matrices.

    Examples
    --------
    >>> structure_constants(BASIS_SO3)[:, 0, 1]  # [L_1, L_2] = L_3
    array([0., 0., 1.])
    """
    L = as_finite("basis", basis, "n", "n")
    if L.ndim != 3 or len(L) == 0:
        raise ValueError(f"basis: shape (m, n, n) is wanted, got {L.shape}")
    m = len(L)
    _, exponents = np.frexp(np.abs(L).max(axis=(1, 2)))
    N = scaled(L)  # so that the sizes of the matrices do not matter
    columns = N.reshape(m, -1).T
    condition = np.linalg.cond(columns)
    if not condition < 1e6:
        raise ValueError("basis: the matrices are linearly dependent, to one part in a million")
    products = N[:, None] @ N
    brackets = (products - products.swapaxes(0, 1)).reshape(m * m, -1).T
    C = np.zeros((m, m * m))
    for _ in range(3):  # normal equations, refined twice
        C += np.linalg.solve(columns.T @ columns, columns.T @ (brackets - columns @ C))
    if np.abs(columns @ C - brackets).max() > 1e-14 * condition:
        raise ValueError("basis: a commutator of two of the matrices is not a combination of them")
    k, i, j = np.ix_(exponents, exponents, exponents)
    return np.ldexp(C.reshape(m, m, m), i + j - k)


@described_by(structure_constants, returns="ndarray, shape (..., m, m, m)")
def christoffel(G: ArrayLike, basis: ArrayLike) -> Array:
    """Return the Christoffel symbols Γ of a left-invariant metric in a left-invariant frame.

    At all points ∇_{L_j} L_k = Γ[i, j, k] L_i, summed over i. Two identities hold up to a few eps
    times the condition number of G. The torsion vanishes: Γ[i, j, k] − Γ[i, k, j] = C[i, j, k]. If
    G lowers the first index, Γ is antisymmetric in i and k. But Γ is *not* symmetric in j and k. Γ
    follows from Koszul's formula,
    2 ⟨∇_i L_j, L_k⟩ = ⟨[L_i, L_j], L_k⟩ − ⟨[L_j, L_k], L_i⟩ + ⟨[L_k, L_i], L_j⟩.
    Source: BK 2.4, BK (8).

    Parameters
    ----------
    G : array_like, shape (..., m, m)
        The matrix of the metric in the frame. It is symmetric and nonsingular, but need not be
        definite.

    Examples
    --------
    >>> christoffel(np.eye(3), BASIS_SO3)[:, 0, 1] + 0.0  # half of the cross product
    array([0. , 0. , 0.5])
    """
    C = structure_constants(basis)
    m = len(C)
    G = scaled(as_symmetric("G", G, m))  # the size of G does not matter
    sizes = np.abs(np.linalg.eigvalsh(G))
    singular = sizes.min(axis=-1) <= m * EPS * sizes.max(axis=-1)
    if singular.any():
        raise ValueError(f"{first_index('G', singular)} is singular")
    lowered = np.einsum("mki,...mj->...kij", C, G)  # ⟨[L_k, L_i], L_j⟩
    symmetric = lowered + np.swapaxes(lowered, -1, -2)
    columns = symmetric.reshape(*G.shape[:-1], m * m)
    raised = np.linalg.solve(G, columns).reshape(symmetric.shape)
    return (C + raised) / 2


@described_by(returns="ndarray, shape (..., m)")
def covariant_derivative(gamma: ArrayLike, v: ArrayLike, x: ArrayLike, x_dot: ArrayLike) -> Array:
    """Return the covariant derivative x_dot[i] + gamma[i, j, k] v[j] x[k] of a field along a curve.

    The sum is over j and k. For x = v, the result is the acceleration BK (9), which vanishes along
    geodesics (BK (8)). For x_dot = 0, the result is ∇_v x for left-invariant fields v and x.
    Source: BK 2.4, BK (8), BK (9).

    Parameters
    ----------
    gamma : array_like, shape (..., m, m, m)
        The Christoffel symbols, as returned by `christoffel`.
    v, x, x_dot : array_like, shape (..., m)
        The velocity of the curve, the field, and the time derivative of the field, in
        left-invariant components.

    Examples
    --------
    >>> gamma = christoffel(np.diag([2, 2, 2, 1, 1, 1]), BASIS_SE3)
    >>> S = [0, 0, 2, 3, 0, 0]  # a constant twist: the origin moves on a circle
    >>> covariant_derivative(gamma, S, S, np.zeros(6)) + 0.0  # ω × v, towards its centre
    array([0., 0., 0., 0., 6., 0.])
    """
    v = as_finite("v", v, "n")
    m = v.shape[-1]
    gamma = as_finite("gamma", gamma, m, m, m)
    x, x_dot = as_finite("x", x, m), as_finite("x_dot", x_dot, m)
    check_broadcast(gamma=(gamma, 3), v=(v, 1), x=(x, 1), x_dot=(x_dot, 1))
    return x_dot + np.einsum("...ijk,...j,...k->...i", gamma, v, x)


def geodesic_flow(G: ArrayLike, A0: ArrayLike, v0: ArrayLike, t: ArrayLike) -> tuple[Array, Array]:
    """Return A and v at the times t for the geodesics that start at A0 with the velocity v0.

    Source: BK 2.4, BK (8). The paper prints second derivatives of coordinates, which need the
    Christoffel symbols of the coordinates, not those of the left-invariant frame.

    Parameters
    ----------
    G : array_like, shape (..., 3, 3) for SO(3), (..., 6, 6) for SE(3)
        The matrix of a left-invariant metric, such as the inertia of a freely rotating body. It is
        symmetric and not singular, but need not be definite.
    A0, v0 : array_like, shapes (..., 3, 3) and (..., 3), or (..., 4, 4) and (..., 6)
        Rotations and angular velocities, or poses and twists, at t = 0.
    t : array_like, any shape
        Times in any order; they may be negative.

    Returns
    -------
    A, v : ndarray, shapes t.shape + A0.shape and t.shape + v0.shape
        Here A0.shape and v0.shape are the shapes after broadcasting the batches of G, A0 and v0.
        Along each geodesic, vᵀ G v is constant.

    Notes
    -----
    Singular set: none. For an indefinite metric on SE(3), the velocity may grow exponentially,
    beyond the range of the floating-point numbers. If the integration fails, FloatingPointError is
    raised. An eighth-order Runge–Kutta method with a relative tolerance of 3e-14 solves A' = A
    hat(v), v'_i = −Γ_ijk v_j v_k. On SO(3), these are Euler's equations. The N members of a batch
    share the tolerance, so the error of a single member may be up to √N times larger. In closed
    form, `screw` gives geodesics of the metric (10), and `geodesic` those of (12) and (14).

    Examples
    --------
    >>> G, spin = np.diag([1.0, 2, 3]), [0.01, 3, 0]  # a spin nearly about the middle axis
    >>> R, w = geodesic_flow(G, np.eye(3), spin, [0, 6])
    >>> w[:, 1].round(1)  # it flips
    array([ 3., -3.])
    """
    A0, m = as_rotations_or_poses("A0", A0)
    G, v0, times = as_symmetric("G", G, m), as_finite("v0", v0, m), as_finite("t", t)
    batch = check_broadcast(G=(G, 2), A0=(A0, 2), v0=(v0, 1))
    basis, project = (BASIS_SO3, project_so) if m == 3 else (BASIS_SE3, project_se)
    gamma = christoffel(G, basis)
    A0 = np.broadcast_to(project(A0), batch + A0.shape[-2:])
    v0 = np.broadcast_to(v0, (*batch, m))
    speed = float(np.abs(v0).max(initial=0)) or 1.0
    v0, times = v0 / speed, times * speed  # γ_sv(t) = γ_v(st)

    def flow(_: float, state: Array) -> Array:
        A, v = state[: A0.size].reshape(A0.shape), state[A0.size :].reshape(v0.shape)
        turning = np.einsum("...ijk,...j,...k->...i", gamma, v, v)
        return _joined(A @ np.tensordot(v, basis, 1), -turning)

    scales = _joined(*_scales(A0, v0, np.abs(times).max(initial=0)))
    states = _integrate(flow, _joined(A0, v0), scales, times.ravel())
    A, v = states[:, : A0.size], states[:, A0.size :]
    return project(A.reshape(times.shape + A0.shape)), speed * v.reshape(times.shape + v0.shape)


def _scales(A0: Array, v0: Array, last: float) -> tuple[Array, Array]:
    speeds = np.abs(v0).reshape(*v0.shape[:-1], v0.shape[-1] // 3, 3).max(axis=-1)
    speeds = np.where(speeds == 0, speeds.max(axis=-1, keepdims=True), speeds)
    speeds = np.where(speeds < 1e-200, 1.0, speeds)  # at rest
    scales = np.ones(A0.shape)
    if A0.shape[-1] == 4:
        path = np.abs(A0[..., :3, 3]).max(axis=-1) + last * speeds[..., 1]
        scales[..., :3, 3] = path[..., None]
    return scales, np.repeat(speeds, 3, axis=-1)


def _joined(A: Array, v: Array) -> Array:
    return np.concatenate([A.ravel(), v.ravel()])


def _integrate(
    flow: Callable[[float, Array], Array], start: Array, scales: Array, times: Array
) -> Array:
    from scipy.integrate import solve_ivp

    states = np.broadcast_to(start, (len(times), len(start))).copy()
    for side in (times > 0, times < 0):
        stops, where = np.unique(times[side], return_inverse=True)
        if stops.size == 0:
            continue
        order = np.argsort(np.abs(stops))
        end = float(stops[order[-1]])
        way = solve_ivp(
            flow, (0.0, end), start, "DOP853", stops[order], rtol=3e-14, atol=1e-14 * scales
        )
        if not way.success:
            raise FloatingPointError(f"a geodesic cannot be followed to its end: {way.message}")
        states[side] = way.y.T[np.argsort(order)][where]
    return states
