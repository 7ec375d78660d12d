"""What is true, computed another way: mpmath and brute force. Never imports rbcourse."""

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


def exact_polynomial(coefficients, t):
    """The sum of c_k t^k; the caller sets the precision."""
    return mp.fsum(c * t**k for k, c in enumerate(coefficients))


def polynomial_through(ends, t):
    """The polynomial with the values, then the derivatives, ... at 0 and 1, solved for; at t."""
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
    """Rodrigues' formula, as an mpmath matrix; the caller sets the precision."""
    angle, W = exact_norm(w), exact_hat([mp.mpf(x) for x in w])
    if angle == 0:
        return mp.eye(3)
    return mp.eye(3) + mp.sin(angle) / angle * W + (1 - mp.cos(angle)) / angle**2 * W**2


def exp_so3(w):
    with mp.workdps(DIGITS):
        return _array(exact_exp([float(x) for x in w]))


def expm(A):
    """The exponential of any matrix, by its power series."""
    with mp.workdps(DIGITS):
        return _array(mp.expm(mp.matrix(np.asarray(A, dtype=float).tolist()), method="taylor"))


def log_so3(R):
    """The rotation vector of the rotation nearest to R, by the polar iteration of Newton."""
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
    """The rotation nearest to M: U diag(1, …, 1, ±1) Vᵀ, by mpmath's singular values."""
    with mp.workdps(DIGITS):
        U, _, Vt = mp.svd_r(mp.matrix(np.asarray(M, dtype=float).tolist()))
        if mp.det(U * Vt) < 0:
            for i in range(U.rows):
                U[i, U.cols - 1] *= -1
        return _array(U * Vt)


def right_jacobian_so3(w):
    """∫₀¹ exp(−s ŵ) ds, the definition behind the closed form, by Gauss's rule with 24 nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    turns = [exp_so3(-(1 + node) / 2 * np.asarray(w)) for node in nodes]
    return np.einsum("n,nij->ij", weights / 2, turns)


def theta(t, angle, order=0):
    """BK (16) for f(t) = t, as printed, by its own derivatives."""
    with mp.workdps(DIGITS):
        w = mp.mpf(float(angle))
        return float(
            mp.diff(
                lambda u: mp.atan2(u * mp.sin(w), 1 - u + u * mp.cos(w)) / w,
                mp.mpf(float(t)),
                order,
            )
        )


def f(t, angle, order=0):
    """BK Corollary 2, as printed, by its own derivatives."""
    with mp.workdps(DIGITS):
        w = mp.mpf(float(angle))
        return float(
            mp.diff(
                lambda u: mp.sin(w * u) / (mp.sin(w * (1 - u)) + mp.sin(w * u)),
                mp.mpf(float(t)),
                order,
            )
        )


def line_singular_value(t, angle):
    """BK (17) as printed."""
    with mp.workdps(DIGITS):
        u, c = mp.mpf(float(t)), 2 * (1 - mp.cos(mp.mpf(float(angle))))
        return float(mp.sqrt(c * u**2 - c * u + 1))


def two_smallest_eigenvalues(S):
    """The sum of the two smallest eigenvalues of the symmetric part of S (…, n, n)."""
    return np.linalg.eigvalsh((S + np.swapaxes(S, -1, -2)) / 2)[..., :2].sum(axis=-1)


def derivative_by_differences(curve, t, size=2.0**-10):
    """R'(t) of a matrix curve by a central difference of order 8: error about 1e-13."""
    steps = np.array([1, 2, 3, 4])
    weights = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    return sum(
        weight * (curve(t + k * size) - curve(t - k * size)) / size
        for k, weight in zip(steps, weights, strict=True)
    )


def quaternion_product(p, q):
    """Hamilton's product, component by component: (w, x, y, z) along the first axis."""
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
    """The distance of unit quaternions p to the nearer of q and −q."""
    return np.minimum(np.linalg.norm(p - q, axis=-1), np.linalg.norm(p + q, axis=-1))


def quaternion(w):
    """The unit quaternion of a rotation vector: cosine and sine of half its length."""
    with mp.workdps(DIGITS):
        x = [mp.mpf(float(c)) for c in w]
        angle = exact_norm(x)
        scale = mp.sin(angle / 2) / angle if angle else mp.mpf(1) / 2
        return np.array([float(c) for c in [mp.cos(angle / 2), *(scale * c for c in x)]])


def arc(q0, q1, t):
    """The point at the share t of the great circle from q0 to q1, not the long way."""
    with mp.workdps(DIGITS):
        p, q = ([mp.mpf(float(c)) for c in x] for x in (q0, q1))
        p, q = ([c / mp.sqrt(mp.fdot(x, x)) for c in x] for x in (p, q))
        side = [b - mp.fdot(p, q) * a for a, b in zip(p, q, strict=True)]
        sine = mp.sqrt(mp.fdot(side, side))
        angle = mp.atan2(sine, mp.fdot(p, q))
        along, across = mp.cos(t * angle), mp.sin(t * angle) / (sine or 1)
        return np.array([float(along * a + across * b) for a, b in zip(p, side, strict=True)])


def rotation_of_quaternions(q):
    """The matrices (N, 3, 3) of quaternions (4, N), of any length but 0."""
    w, x, y, z = q / np.linalg.norm(q, axis=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _times(q, side):
    """The matrices (4, 4, ...) of p ↦ q p (side 0) and of p ↦ p q (side 1)."""
    columns = [
        quaternion_product(*((q, e) if side == 0 else (e, q)))
        for e in np.eye(4).reshape(4, 4, *(1 for _ in q.shape[1:]))
    ]
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _crosses(v):
    """The matrices (3, 3, N) of x ↦ v × x."""
    x, y, z = v
    nothing = np.zeros_like(x)
    return np.array([[nothing, -z, y], [z, nothing, -x], [-y, x, nothing]])


def minimum_acceleration(turn, w0, w1, tol=1e-9, jacobians=False):
    """BK (19) from I to exp(turn) by SciPy's `solve_bvp`: 13 equations for q, w, w', w''.

    Returns its solution, whose `sol(t)` has the quaternion in rows 0 – 3, w in rows 4 – 6.
    """
    from scipy.integrate import solve_bvp

    def embedded(w):
        return np.concatenate([np.zeros((1, *w.shape[1:])), w])

    def rates(_, y):
        q, w, acceleration, jerk = y[:4], y[4:7], y[7:10], y[10:]
        spin = quaternion_product(q, embedded(w)) / 2
        return np.concatenate([spin, acceleration, jerk, -np.cross(w, jerk, axis=0)])

    def rates_by_y(_, y):
        J = np.zeros((13, 13, y.shape[1]))
        J[:4, :4], J[:4, 4:7] = _times(embedded(y[4:7]), 1) / 2, _times(y[:4], 0)[:, 1:] / 2
        J[4:10, 7:13] = np.eye(6)[..., None]
        J[10:, 4:7], J[10:, 10:] = _crosses(y[10:]), -_crosses(y[4:7])
        return J

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

    def misses_by_ends(start, end):
        by_start, by_end = np.eye(13, 13), np.zeros((13, 13))
        by_start[7:] = 0
        by_end[7:10, :4], by_end[10:, 4:7] = _times(goal_back, 0)[1:], np.eye(3)
        return by_start, by_end

    t = np.linspace(0, 1, 11)
    guess = np.zeros((13, 11))
    guess[:4] = quaternion(3 * t**2 - 2 * t**3)
    guess[4:7] = np.outer(w0, 1 - t) + np.outer(w1, t)
    exact = {"fun_jac": rates_by_y, "bc_jac": misses_by_ends} if jacobians else {}
    return solve_bvp(rates, misses, t, guess, tol=tol, max_nodes=100_000, **exact)


def free_body(moments, a, c, t):
    """Euler's free body by Jacobi's functions: (a cn, b sn, c dn)(λ t), from (a, 0, c) at t = 0.

    For principal moments J1 < J2 < J3 and a, c > 0 with a²J1 (J2 − J1) < c²J3 (J3 − J2).
    """
    with mp.workdps(DIGITS):
        J1, J2, J3, a, c, t = (mp.mpf(float(x)) for x in (*moments, a, c, t))
        rate = c * mp.sqrt((J3 - J1) * (J3 - J2) / (J1 * J2))
        b = (J3 - J1) * a * c / (rate * J2)
        m = (J2 - J1) * a * b / (c * rate * J3)
        assert m < 1
        sn, cn, dn = (mp.ellipfun(name, rate * t, m=m) for name in ("sn", "cn", "dn"))
        return np.array([float(a * cn), float(b * sn), float(c * dn)])
