"""Problems of optima, and least costs by direct minimisation from random starts.

The minimisation, by Levenberg's and Marquardt's method, shares no code with the solver. A curve is
a polynomial P(t) of quaternions that need not have the norm 1; its end values are those of the
problem, and the coefficients of the others are free.
"""

import numpy as np
from numpy.polynomial import Chebyshev
from oracles import quaternion_product
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation

import rbcourse as rb

I3, REST = np.eye(3), np.zeros(3)
ALONG = np.pi / 6 * np.array([1, 2, 3])
PAPER = {  # the rotation vector and the velocities of its figures
    "4b": (ALONG, ALONG, ALONG + I3[0]),
    "4c": (ALONG, ALONG, ALONG + 5 * I3[0]),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])
"""The inertia of a book of 1 kg, 30 cm by 20 cm by 3 cm."""
OPTIMA = {
    "ball": lambda R0, R1, w0, w1, *_: rb.minimum_acceleration_so3(R0, R1, w0, w1),
    "acceleration": lambda R0, R1, w0, w1, G, *_: rb.minimum_acceleration_so3(R0, R1, w0, w1, G),
    "torque": lambda R0, R1, w0, w1, G, *_: rb.minimum_torque_so3(R0, R1, w0, w1, G),
    "jerk": lambda R0, R1, w0, w1, _, a0, a1: rb.minimum_jerk_so3(R0, R1, w0, w1, a0, a1),
}
SOLVERS = OPTIMA | {"shooting": lambda *ends: rb.shoot_minimum_acceleration_so3(*ends[:4])}
COSTS = {
    **dict.fromkeys(("ball", "shooting"), lambda curve, _: rb.acceleration_cost(curve)),
    "acceleration": lambda curve, G: rb.acceleration_cost(curve, G),
    "torque": lambda curve, G: rb.torque_cost(curve, G),
    "jerk": lambda curve, _: rb.jerk_cost(curve),
}


def with_inertias(moments, rng):
    axes = Rotation.random(len(moments), rng=rng).as_matrix()
    G = axes @ (moments[:, :, None] * axes.mT)
    return (G + G.mT) / 2


def random_problems(count, seed, turn=3.0, speed=9.0):
    """R0, R1, w0, w1, inertias with moments up to (1, 2, 2.9) about random axes, a0, a1."""
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(5, count, 3))
    vectors *= rng.random((5, count, 1)) / np.linalg.norm(vectors, axis=-1, keepdims=True)
    sigma, w0, w1, a0, a1 = np.reshape([turn, speed, speed, 20, 20], (5, 1, 1)) * vectors
    moments = 1 + rng.random((count, 3)) * [0, 1, 1.9]
    R0 = Rotation.random(count, rng=rng).as_matrix()
    return [R0, R0 @ rb.exp_so3(sigma), w0, w1, with_inertias(moments, rng), a0, a1]


def bodies(count, seed):
    """Inertias of bodies whose largest moment is up to ten times the least one."""
    rng = np.random.default_rng(seed)
    moments = np.sort(np.exp(rng.uniform(0, np.log(10), (20 * count, 3))), axis=1)
    return with_inertias(moments[moments @ [1, 1, -1] > 0][:count], rng)


def some(problems, which):
    return [x[which] for x in problems]


def times(A, x):
    return (A @ x[..., None])[..., 0]


def deviation(what, G, w, a, b=0):
    """u, written down again: the cost is the integral of its square."""
    if what in ("ball", "shooting", "jerk"):
        return np.sqrt(2) * (b + np.cross(w, a) / 2 if what == "jerk" else a)
    torque = times(G, a) + np.cross(w, times(G, w))
    return torque if what == "torque" else times(np.linalg.cholesky(np.linalg.inv(G)).mT, torque)


def least_costs(what, problems, starts, seed):
    """Return the least cost that is found for each problem of (R0, R1, w0, w1, G, a0, a1)."""
    R0, R1, w0, w1, G, a0, a1 = (np.repeat(x, starts, axis=0) for x in problems)
    rng, order = np.random.default_rng(seed), 3 if what == "jerk" else 2
    free = 8 + 4 * (order - 1)
    sign = np.tile([1, -1], len(R0) // 2)[:, None]  # of the last quaternion: both ways round
    last = [sign * x for x in _quaternion_and_rates(R1, w1, a1)]
    ends = np.stack([*_quaternion_and_rates(R0, w0, a0)[:order], *last[:order]], axis=1)
    size = 4.0**order * np.exp(rng.uniform(np.log(0.1), np.log(5), (len(R0), 1, 1)))
    c = size * rng.normal(size=(len(R0), free, 4)) / np.arange(1, 1 + free)[:, None]
    c = _minimise(what, _polynomials(order, free, 4 * free - 8), ends, c, G[:, None])
    fine = _polynomials(order, free, 16 * free)  # P may be almost 0 between the nodes
    cost = _cost(what, fine, ends, c, G[:, None])
    return np.where(np.isfinite(cost), cost, np.inf).reshape(-1, starts).min(axis=1)


def _minimise(what, polynomials, ends, c, G):
    """Return the coefficients of local minima, one for each start."""
    weight = np.sqrt(polynomials[0])
    cost, damping = _cost(what, polynomials, ends, c, G), np.full(len(c), 1e-2)
    active, stalled = np.arange(len(c)), np.zeros(len(c), int)
    for _ in range(120):
        part = ends[active], c[active], G[active]
        u, J = _linearised(what, polynomials, *part)
        J = (weight[:, None, None, None] * J).reshape(len(active), -1, c.shape[1] * 4)
        A, b = J.mT @ J, J.mT @ (weight[:, None] * u).reshape(len(active), -1, 1)
        best, best_c, best_damping = cost[active], part[1].copy(), 8 * damping[active]
        diagonal = np.einsum("nii->ni", A) + 1e-12 * np.trace(A, axis1=1, axis2=2)[:, None]
        for factor in (0.05, 1.0, 10.0):
            damped = A.copy()
            np.einsum("nii->ni", damped)[...] += factor * damping[active, None] * diagonal
            tried = part[1] - np.linalg.solve(damped, b).reshape(part[1].shape)
            costs = _cost(what, polynomials, part[0], tried, part[2])
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


def _linearised(what, polynomials, ends, c, G):
    """Return u at the nodes, and its derivatives by the coefficients, by complex numbers."""
    _, hermite, bumps = polynomials
    P = [h @ ends + b @ c for h, b in zip(hermite, bumps, strict=True)]
    J = np.zeros((*P[0].shape[:2], 3, c.shape[1], 4))
    for i, j in np.ndindex(len(P), 4):
        moved = [x + 1e-30j * (np.arange(4) == j) * (k == i) for k, x in enumerate(P)]
        u = deviation(what, G, *_rates(*moved))
        J[..., j] += (u.imag / 1e-30)[..., None] * bumps[i][:, None]
    return u.real, J


def _cost(what, polynomials, ends, c, G):
    weight, hermite, bumps = polynomials
    P = [h @ ends + b @ c for h, b in zip(hermite, bumps, strict=True)]
    with np.errstate(all="ignore"):
        return np.sum(deviation(what, G, *_rates(*P)) ** 2, axis=-1) @ weight


def _rates(P, P1, P2, P3=None):
    """Return w, w' (and w'') from P and its derivatives: w = 2 vec(P̄ P')/‖P‖², and so on."""
    N = np.sum(P * P, axis=-1, keepdims=True)
    n, w = 2 * np.sum(P * P1, axis=-1, keepdims=True) / N, 2 * _vector(P, P1) / N
    a = 2 * _vector(P, P2) / N - n * w
    if P3 is None:
        return w, a
    n_rate = 2 * np.sum(P1**2 + P * P2, axis=-1, keepdims=True) / N
    bend_rate = 2 * (_vector(P1, P2) + _vector(P, P3)) / N
    return w, a, bend_rate - 2 * n * a - n_rate * w


def _vector(p, q):
    """The vector part of p̄ q."""
    return p[..., :1] * q[..., 1:] - q[..., :1] * p[..., 1:] - np.cross(p[..., 1:], q[..., 1:])


def _quaternion_and_rates(R, w, a):
    q = Rotation.from_matrix(R).as_quat(scalar_first=True).T
    w, a = (np.insert(x.T, 0, 0, axis=0) for x in (w, a))
    rate = quaternion_product(q, w) / 2
    return q.T, rate.T, (quaternion_product(rate, w) + quaternion_product(q, a)).T / 2


def _polynomials(order, free, nodes):
    """Return Gauss's weights and, at his nodes, polynomials for the ends and the free ones.

    Each is a list: the values, and the derivatives up to the order.
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t, orders = (x + 1) / 2, range(order + 1)
    hermite = BPoly.from_derivatives([0, 1], np.eye(2 * order).reshape(2, order, 2 * order))
    bump = Chebyshev([1 / 8, 0, -1 / 8], [0, 1]) ** order  # tᵐ (1 − t)ᵐ
    bumps = [bump * Chebyshev.basis(k, [0, 1]) for k in range(free)]
    at_nodes = [np.stack([one.deriv(d)(t) for one in bumps], axis=-1) for d in orders]
    return weight / 2, [hermite(t, d) for d in orders], at_nodes
