"""Least costs by direct minimisation: Levenberg's and Marquardt's method from random starts.

It shares no code with the solver. A curve is a polynomial P(t) of quaternions that need not have
the norm 1; its end values are those of the problem, and the coefficients of the others are free.
"""

from math import comb

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from scipy.spatial.transform import Rotation

STEP = 1e-30  # of derivatives by complex numbers


def least_costs(what, problems, starts, seed):
    """Return the least cost that is found for each problem of (R0, R1, w0, w1, G, a0, a1)."""
    R0, R1, w0, w1, G, a0, a1 = (np.repeat(x, starts, axis=0) for x in problems)
    root = {
        "acceleration": lambda: np.linalg.cholesky(np.linalg.inv(G)).mT,
        "torque": lambda: np.broadcast_to(np.eye(3), G.shape),
        "jerk": lambda: np.broadcast_to(np.sqrt(2) * np.eye(3), G.shape),
    }[what]()
    rng, order = np.random.default_rng(seed), 3 if what == "jerk" else 2
    free = 8 + 4 * (order - 1)
    sign = np.tile([1, -1], len(R0) // 2)[:, None]  # of the last quaternion: both ways round
    ends = np.stack(
        [
            *_quaternion_and_rates(R0, w0, a0)[:order],
            *(sign * x for x in _quaternion_and_rates(R1, w1, a1)[:order]),
        ],
        axis=1,
    )
    size = 4.0**order * np.exp(rng.uniform(np.log(0.1), np.log(5), (len(R0), 1, 1)))
    c = size * rng.normal(size=(len(R0), free, 4)) / np.arange(1, 1 + free)[:, None]
    c = _minimise(what, _polynomials(order, free, 4 * free - 8), ends, c, G, root)
    fine = _polynomials(order, free, 16 * free)  # P may be almost 0 between the nodes
    cost = _cost(what, fine, ends, c, G, root)
    return np.where(np.isfinite(cost), cost, np.inf).reshape(-1, starts).min(axis=1)


def _minimise(what, polynomials, ends, c, G, root):
    """Return the coefficients of local minima, one for each start."""
    weight, hermite, bumps = polynomials
    cost, damping = _cost(what, polynomials, ends, c, G, root), np.full(len(c), 1e-2)
    active, stalled = np.arange(len(c)), np.zeros(len(c), int)
    for _ in range(120):
        part = ends[active], c[active], G[active], root[active]
        u, J = _linearised(what, hermite, bumps, *part)
        J = (np.sqrt(weight)[:, None, None, None] * J).reshape(len(active), -1, c.shape[1] * 4)
        A, b = J.mT @ J, J.mT @ (np.sqrt(weight)[:, None] * u).reshape(len(active), -1, 1)
        best, best_c, best_damping = cost[active], part[1].copy(), 8 * damping[active]
        diagonal = np.einsum("nii->ni", A) + 1e-12 * np.trace(A, axis1=1, axis2=2)[:, None]
        for factor in (0.05, 1.0, 10.0):
            damped = A.copy()
            np.einsum("nii->ni", damped)[...] += factor * damping[active, None] * diagonal
            tried = part[1] - np.linalg.solve(damped, b).reshape(part[1].shape)
            costs = _cost(what, polynomials, part[0], tried, *part[2:])
            better = costs < best
            best = np.where(better, costs, best)
            best_c[better] = tried[better]
            best_damping[better] = np.maximum(factor * damping[active] / 2, 1e-12)[better]
        stalled[active] = np.where(best > (1 - 1e-7) * cost[active], stalled[active] + 1, 0)
        cost[active], c[active], damping[active] = best, best_c, best_damping
        active = active[(stalled[active] < 3) & (damping[active] < 1e10) & (best > 1e-12)]
        if not len(active):
            break
    return c


def _linearised(what, hermite, bumps, ends, c, G, root):
    """Return u at the nodes, and its derivatives by the coefficients."""
    P = [h @ ends + b @ c for h, b in zip(hermite, bumps, strict=True)]
    J = np.zeros((*P[0].shape[:2], 3, c.shape[1], 4))
    for i, bump in enumerate(bumps):
        for j in range(4):
            moved = [x.astype(complex) for x in P]
            moved[i][..., j] += 1j * STEP
            u = _deviation(what, moved, G, root)
            J[..., j] += (u.imag / STEP)[..., None] * bump[:, None]
    return u.real, J


def _cost(what, polynomials, ends, c, G, root):
    weight, hermite, bumps = polynomials
    P = [h @ ends + b @ c for h, b in zip(hermite, bumps, strict=True)]
    with np.errstate(all="ignore"):
        return np.sum(_deviation(what, P, G, root) ** 2, axis=-1) @ weight


def _deviation(what, P, G, root):
    """Return u from P, P', P'' (and P'''): ω = 2 vec(P̄ P')/‖P‖², and so on."""
    N = np.sum(P[0] * P[0], axis=-1, keepdims=True)
    n = 2 * np.sum(P[0] * P[1], axis=-1, keepdims=True) / N
    w, bend = 2 * _vector(P[0], P[1]) / N, 2 * _vector(P[0], P[2]) / N
    a = bend - n * w
    if what == "jerk":
        n_rate = 2 * np.sum(P[1] ** 2 + P[0] * P[2], axis=-1, keepdims=True) / N - n**2
        bend_rate = 2 * (_vector(P[1], P[2]) + _vector(P[0], P[3])) / N - n * bend
        u = bend_rate - n_rate * w - n * a + np.cross(w, a) / 2
    else:
        u = _times(G, a) + np.cross(w, _times(G, w))
    return _times(root, u)


def _times(A, x):
    return (A[:, None] @ x[..., None])[..., 0]


def _vector(p, q):
    """The vector part of p̄ q."""
    return p[..., :1] * q[..., 1:] - q[..., :1] * p[..., 1:] - np.cross(p[..., 1:], q[..., 1:])


def _product(p, w):
    """p times the vector w."""
    scalar = -np.sum(p[:, 1:] * w, axis=-1, keepdims=True)
    return np.concatenate([scalar, p[:, :1] * w + np.cross(p[:, 1:], w)], axis=-1)


def _quaternion_and_rates(R, w, a):
    q = Rotation.from_matrix(R).as_quat(scalar_first=True)
    rate = _product(q, w) / 2
    return q, rate, (_product(rate, w) + _product(q, a)) / 2


def _polynomials(order, free, nodes):
    """Return Gauss's weights and, at his nodes, polynomials for the ends and the free ones.

    Each is a list: the values, and the derivatives up to the order.
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t = (x + 1) / 2
    powers = [Polynomial.basis(k) for k in range(2 * order)]
    ends = np.array([[_at(p, s, d) for p in powers] for s in (0, 1) for d in range(order)])
    inverse = np.linalg.inv(ends)
    hermite = [
        np.stack([_at(p, t, d) for p in powers], axis=-1) @ inverse for d in range(order + 1)
    ]
    factor = Polynomial([0, 1, -1]) ** order
    bumps = [
        sum(
            comb(d, j)
            * _at(factor, t, j)[:, None]
            * np.stack([_at(Chebyshev.basis(k, [0, 1]), t, d - j) for k in range(free)], axis=-1)
            for j in range(d + 1)
        )
        for d in range(order + 1)
    ]
    return weight / 2, hermite, bumps


def _at(polynomial, t, derivative):
    return (polynomial.deriv(derivative) if derivative else polynomial)(t)
