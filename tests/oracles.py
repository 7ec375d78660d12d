"""Independent computations, by mpmath and brute force. This module never imports rbcourse."""

import mpmath as mp
import numpy as np

DIGITS = 60


def _array(matrix):
    return np.array([[float(x) for x in row] for row in matrix.tolist()])


def exact_hat(w):
    x, y, z = w
    return mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def exact_norm(w):
    return mp.sqrt(mp.fsum(mp.mpf(x) ** 2 for x in w))


def polynomial_through(ends, t):
    """Return p(t) for the polynomial p with the given values and derivatives at 0 and 1."""
    count, ends = len(ends), np.asarray(ends, float)
    with mp.workdps(DIGITS):
        rows = [
            [mp.ff(k, order) * mp.mpf(at) ** max(k - order, 0) for k in range(count)]
            for order in range(count // 2)
            for at in (0, 1)
        ]
        weights = mp.lu_solve(mp.matrix(rows).T, mp.matrix([mp.mpf(t) ** k for k in range(count)]))
        columns = ends.reshape(count, -1).T.tolist()
        values = [mp.fsum(w * mp.mpf(x) for w, x in zip(weights, c, strict=True)) for c in columns]
        return np.array(values, float).reshape(ends.shape[1:])


def exact_exp(w):
    """Return exp(ŵ) by Rodrigues' formula, as an mpmath matrix; the caller sets the precision."""
    angle, W = exact_norm(w), exact_hat([mp.mpf(x) for x in w])
    if angle == 0:
        return mp.eye(3)
    return mp.eye(3) + mp.sin(angle) / angle * W + (1 - mp.cos(angle)) / angle**2 * W**2


def exp_so3(w):
    with mp.workdps(DIGITS):
        return _array(exact_exp([float(x) for x in w]))


def expm(A):
    """Return the exponential of any matrix, by its power series."""
    with mp.workdps(DIGITS):
        return _array(mp.expm(mp.matrix(np.asarray(A, dtype=float).tolist()), method="taylor"))


def log_so3(R):
    """Return the rotation vector of the rotation nearest to R, by Newton's polar iteration."""
    with mp.workdps(DIGITS):
        X = mp.matrix(np.asarray(R, dtype=float).tolist())
        for _ in range(8):
            X = (X + (X.T) ** -1) / 2
        sine = [X[2, 1] - X[1, 2], X[0, 2] - X[2, 0], X[1, 0] - X[0, 1]]
        angle = mp.atan2(exact_norm(sine), X[0, 0] + X[1, 1] + X[2, 2] - 1)
        symmetric = (X + X.T) / 2 - mp.cos(angle) * mp.eye(3)  # (1 − cos) n nᵀ
        k = max(range(3), key=lambda i: symmetric[i, i])
        if angle > 1:
            axis = [symmetric[i, k] for i in range(3)]
            sign = -1 if mp.fsum(a * s for a, s in zip(axis, sine, strict=True)) < 0 else 1
        else:
            axis, sign = sine, 1
        length = exact_norm(axis)
        if length == 0:
            return np.zeros(3)
        return np.array([float(sign * angle * a / length) for a in axis])


def nearest_rotation(M):
    """Return the rotation U diag(1, …, 1, ±1) Vᵀ nearest to M, by mpmath's singular values."""
    with mp.workdps(DIGITS):
        U, _, Vt = mp.svd_r(mp.matrix(np.asarray(M, dtype=float).tolist()))
        if mp.det(U * Vt) < 0:
            for i in range(U.rows):
                U[i, U.cols - 1] *= -1
        return _array(U * Vt)


def right_jacobian_so3(w):
    """Return the right Jacobian by its definition, ∫₀¹ exp(−s ŵ) ds, with 24 Gauss nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    turns = [exp_so3(-(1 + node) / 2 * np.asarray(w)) for node in nodes]
    return np.einsum("n,nij->ij", weights / 2, turns)


def _derivative(formula, t, angle, order):
    with mp.workdps(DIGITS):
        w = mp.mpf(float(angle))
        return float(mp.diff(lambda u: formula(u, w), mp.mpf(float(t)), order))


def theta(t, angle, order=0):
    """Return θ of BK (16) for f(t) = t, or its derivative by differences."""
    return _derivative(
        lambda u, w: mp.atan2(u * mp.sin(w), 1 - u + u * mp.cos(w)) / w, t, angle, order
    )


def f(t, angle, order=0):
    """Return f of BK Corollary 2, or its derivative by differences."""
    return _derivative(
        lambda u, w: mp.sin(w * u) / (mp.sin(w * (1 - u)) + mp.sin(w * u)), t, angle, order
    )


def line_singular_value(t, angle):
    """Return BK (17) as printed."""
    with mp.workdps(DIGITS):
        u, c = mp.mpf(float(t)), 2 * (1 - mp.cos(mp.mpf(float(angle))))
        return float(mp.sqrt(c * u**2 - c * u + 1))


def two_smallest_eigenvalues(S):
    """Return the sum of the two smallest eigenvalues of the symmetric part of S (…, n, n)."""
    return np.linalg.eigvalsh((S + np.swapaxes(S, -1, -2)) / 2)[..., :2].sum(axis=-1)


def derivative_by_differences(curve, t, size=2.0**-10):
    """Return R'(t) of a matrix curve by central differences of order 8, accurate to about 1e-13."""
    steps = np.array([1, 2, 3, 4])
    weights = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    return sum(
        weight * (curve(t + k * size) - curve(t - k * size)) / size
        for k, weight in zip(steps, weights, strict=True)
    )


def quaternion_product(p, q):
    """Return Hamilton's product by components; the first axis holds (w, x, y, z)."""
    a, b, c, d = p
    w, x, y, z = q
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def between_rotations(p, q):
    """Return the distance from unit quaternions p to the nearer of q and −q."""
    return np.minimum(np.linalg.norm(p - q, axis=-1), np.linalg.norm(p + q, axis=-1))


def quaternion(w):
    """Return the unit quaternion of a rotation vector, by cosine and sine of half its length."""
    with mp.workdps(DIGITS):
        x = [mp.mpf(float(c)) for c in w]
        angle = exact_norm(x)
        scale = mp.sin(angle / 2) / angle if angle else mp.mpf(1) / 2
        return np.array([float(c) for c in [mp.cos(angle / 2), *(scale * c for c in x)]])


def arc(q0, q1, t):
    """Return the point at fraction t of the shorter great-circle arc from q0 to q1."""
    with mp.workdps(DIGITS):
        p, q = ([mp.mpf(float(c)) for c in x] for x in (q0, q1))
        p, q = ([c / mp.sqrt(mp.fdot(x, x)) for c in x] for x in (p, q))
        side = [b - mp.fdot(p, q) * a for a, b in zip(p, q, strict=True)]
        sine = mp.sqrt(mp.fdot(side, side))
        angle = mp.atan2(sine, mp.fdot(p, q))
        along, across = mp.cos(t * angle), mp.sin(t * angle) / (sine or 1)
        return np.array([float(along * a + across * b) for a, b in zip(p, side, strict=True)])


def rotation_of_quaternions(q):
    """Return the matrices (N, 3, 3) of quaternions (4, N) of any nonzero length."""
    w, x, y, z = q / np.linalg.norm(q, axis=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def minimum_acceleration(turn, w0, w1, tol=1e-9):
    """Solve BK (19) from I to exp(turn) by SciPy's `solve_bvp`: 13 equations for q, w, w', w''.

    Returns the solution; `sol(t)` has the quaternion in rows 0 – 3, and w in rows 4 – 6.
    """
    from scipy.integrate import solve_bvp

    def embedded(w):
        return np.concatenate([np.zeros((1, *w.shape[1:])), w])

    def rates(_, y):
        q, w, acceleration, jerk = y[:4], y[4:7], y[7:10], y[10:]
        spin = quaternion_product(q, embedded(w)) / 2
        return np.concatenate([spin, acceleration, jerk, -np.cross(w, jerk, axis=0)])

    angle = np.linalg.norm(turn)
    axis = np.asarray(turn) / angle

    def quaternion(share):
        half = share * angle / 2
        return np.concatenate([np.cos(half)[None], np.sin(half) * axis[:, None]])

    goal_back = quaternion(np.ones(1))[:, 0] * [1, -1, -1, -1]

    def misses(start, end):
        turned = quaternion_product(goal_back, end[:4])
        return np.concatenate(
            [start[:4] - [1, 0, 0, 0], start[4:7] - w0, turned[1:], end[4:7] - w1]
        )

    t = np.linspace(0, 1, 11)
    guess = np.zeros((13, 11))
    guess[:4] = quaternion(3 * t**2 - 2 * t**3)
    guess[4:7] = np.outer(w0, 1 - t) + np.outer(w1, t)
    return solve_bvp(rates, misses, t, guess, tol=tol, max_nodes=100_000)


def least_directly(deviation, ends, curve, terms=16, nodes=80):
    """Minimise ∫ ‖u‖² dt over normalised polynomials of quaternions, starting from a nearby curve.

    No Euler–Lagrange equation is used. `deviation` takes w, w', … and returns u, all of shape (...,
    3). `ends` has R0, R1, and then pairs of rates at the two ends: w0, w1, and so on. Returns w as
    a function of t, and the cost.
    """
    from math import comb

    from numpy.polynomial import Polynomial, chebyshev
    from scipy.interpolate import BPoly
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    pairs = len(ends) // 2 - 1
    x, weights = np.polynomial.legendre.leggauss(nodes)
    t, root = (x + 1) / 2, np.sqrt(weights / 2)[:, None]
    q = Rotation.from_matrix(curve(np.linspace(0, 1, 201))).as_quat(scalar_first=True)
    for i in range(1, len(q)):
        q[i] *= np.sign(q[i] @ q[i - 1])

    def jet_at_end(q, rates):
        jet = [q]
        for k in range(len(rates)):
            products = [
                comb(k, i) * quaternion_product(jet[k - i], np.append(0, rates[i]))
                for i in range(k + 1)
            ]
            jet.append(sum(products) / 2)
        return jet

    hermite = BPoly.from_derivatives(
        [0, 1], [jet_at_end(q[0], ends[2::2]), jet_at_end(q[-1], ends[3::2])]
    )
    bump = Polynomial([0, 1, -1]) ** (pairs + 1)

    def tables(t):
        order = range(pairs + 2)
        base = [np.array([hermite(s, k) if k else hermite(s) for s in t]) for k in order]
        T = [chebyshev.chebval(2 * t - 1, chebyshev.chebder(np.eye(terms), k, 2)).T for k in order]
        B = [(bump.deriv(k) if k else bump)(t)[:, None] for k in order]
        return base, [sum(comb(k, i) * B[i] * T[k - i] for i in range(k + 1)) for k in order]

    def rates(x, table):
        """Return w and its rates, from derivatives of n w = 2 im(q̄ q') with n = ‖q‖²."""
        base, shapes = table
        Q = [b + s @ x.reshape(*x.shape[:-1], terms, 4) for b, s in zip(base, shapes, strict=True)]

        def im(p, q):
            return (
                p[..., :1] * q[..., 1:] - q[..., :1] * p[..., 1:] - np.cross(p[..., 1:], q[..., 1:])
            )

        def dot(p, q):
            return np.sum(p * q, axis=-1, keepdims=True)

        n, n1 = dot(Q[0], Q[0]), 2 * dot(Q[0], Q[1])
        w = 2 * im(Q[0], Q[1]) / n
        a = (2 * im(Q[0], Q[2]) - n1 * w) / n
        if pairs == 1:
            return Q[0], [w, a]
        n2 = 2 * (dot(Q[1], Q[1]) + dot(Q[0], Q[2]))
        b = (2 * (im(Q[0], Q[3]) + im(Q[1], Q[2])) - 2 * n1 * a - n2 * w) / n
        return Q[0], [w, a, b]

    table = tables(t)

    def residuals(x):
        Q, w = rates(x, table)
        u = root * deviation(*w)
        # without this term the norm would be undetermined
        norm = 30 * root[:, 0] * (np.sum(Q * Q, axis=-1) - 1)
        return np.concatenate([u.reshape(*u.shape[:-2], -1), norm], axis=-1)

    def jacobian(x):
        return (residuals(x + 1e-30j * np.eye(len(x))).imag / 1e-30).T

    base, shapes = tables(np.linspace(0, 1, 201))
    x = np.linalg.lstsq(shapes[0], q - base[0])[0].ravel()
    options = {"method": "lm", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "max_nfev": 500}
    x = least_squares(residuals, x, jacobian, **options).x
    u = root * deviation(*rates(x, table)[1])
    return lambda t: rates(x, tables(t))[1][0], float(np.sum(u * u))
