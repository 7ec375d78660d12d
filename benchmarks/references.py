"""What is true, to 50 digits: mpmath, and the power series of the optimum."""

import sys
from functools import cache
from pathlib import Path

import mpmath as mp
import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests"))
import oracles

DIGITS = 50


def doubles(matrices):
    """Return mpmath matrices as the sum of two float arrays, along the last axis."""
    entries = [[list(map(_two, row)) for row in matrix.tolist()] for matrix in matrices]
    return np.array(entries)


def _two(x):
    high = float(x)
    return high, float(x - high)


def distances(values, truth):
    """Return how far values are from what `doubles` gave, in the Frobenius norm."""
    off = (values - truth[..., 0]) - truth[..., 1]
    return np.linalg.norm(off.reshape(len(off), -1), axis=-1)


def against(truth, few=slice(None)):
    """Return the function that gives the error of a value, at a few places.

    Parameters
    ----------
    truth : callable
        Returns the `doubles` at these places; it is called once, when it is needed.
    few : index, optional
        The places, all by default.
    """
    known = cache(truth)

    def error(value):
        found, true = value[few].reshape(-1, 9), known().reshape(-1, 9, 2)
        return distances(found, true).max()

    return error


def against_orders(truth, few):
    """Return the same for R, ŵ and ŵ' side by side; of the last two the error is relative."""
    known = cache(truth)

    def error(value):
        true = known()
        off = [distances(value[few, k], true[:, k]).max() for k in range(3)]
        sizes = np.linalg.norm(true[..., 0], axis=-1).max(axis=0)
        return max(off[0], *(off[1:] / sizes[1:]))

    return error


def exact(array):
    """Return a float matrix as mpmath's."""
    return mp.matrix(np.asarray(array, dtype=float).tolist())


def nearest(M):
    """Return the rotation nearest to an mpmath matrix, and the sum of S's two least eigenvalues."""
    U, s, V = mp.svd_r(M)
    sign = mp.sign(mp.det(U * V))
    return U * mp.diag([1, 1, sign]) * V, s[1] + sign * s[2]


def nearest_rotations(matrices):
    """Return the nearest rotations as `doubles`, and the sums of S's two least eigenvalues."""
    with mp.workdps(DIGITS):
        found = [nearest(exact(M)) for M in matrices]
        return doubles([R for R, _ in found]), np.array([float(gap) for _, gap in found])


def geodesic(R0, R1, times):
    """Return R0 exp(σ̂ t) as `doubles`; the turn must not be near 0 or π."""
    with mp.workdps(DIGITS):
        start, turn = nearest(exact(R0))[0], nearest(exact(R0).T * exact(R1))[0]
        sine = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        length = oracles.exact_norm(sine)
        angle = mp.atan2(length, turn[0, 0] + turn[1, 1] + turn[2, 2] - 1)
        sigma = [angle * x / length for x in sine]
        return doubles([start * oracles.exact_exp([mp.mpf(t) * x for x in sigma]) for t in times])


def projected_cubic(R0, R1, w0, w1, times, derivatives=False):
    """Return R as `doubles`, with `derivatives` [R, ŵ, ŵ'] of shape (3, 9), by small differences.

    R' = R ŵ, and R'' = R (ŵ² + ŵ') of which RᵀR'' has ŵ' as its skew part.
    """
    with mp.workdps(DIGITS):
        start, end = exact(R0), exact(R1)
        hat_start, hat_end = (oracles.exact_hat([mp.mpf(x) for x in w]) for w in (w0, w1))
        rates = start * hat_start, end * hat_end
        h = mp.mpf(10) ** -12

        def curve(t):
            s = 1 - t
            M = s**2 * (1 + 2 * t) * start + t**2 * (1 + 2 * s) * end
            return nearest(M + t * s**2 * rates[0] - t**2 * s * rates[1])[0]

        def all_orders(t):
            R, before, after = curve(t), curve(t - h), curve(t + h)
            rate, bend = R.T * (after - before) / (2 * h), R.T * (after - 2 * R + before) / h**2
            skew = [(A - A.T) / 2 for A in (rate, bend)]
            return mp.matrix([list(A) for A in (R, *skew)])

        return doubles([(all_orders if derivatives else curve)(mp.mpf(float(t))) for t in times])


def optimum(R1, w0, w1, acceleration, jerk):
    """Return 101 rotations of the optimum from I to R1, as `doubles`.

    Newton's method on the power series, begun near w'(0) and w''(0); the last step is in 50 digits,
    and leaves 20 or more.
    """
    start = np.concatenate([acceleration, jerk])
    for _ in range(3):
        slope = _slope(R1, w0, w1, start)
        start = start - np.linalg.solve(slope, _misses(R1, w0, w1, start, float))
    with mp.workdps(DIGITS):
        start = np.array([mp.mpf(x) for x in start])
        start = start - np.linalg.inv(slope) @ _misses(R1, w0, w1, start, mp.mpf)
        rotations, _ = series(w0, start, mp.mpf)
        return doubles([mp.matrix(R.tolist()) for R in rotations])


def _slope(R1, w0, w1, start, size=1e-5):
    steps = size * np.eye(6)
    return np.transpose(
        [
            (_misses(R1, w0, w1, start + e, float) - _misses(R1, w0, w1, start - e, float))
            / (2 * size)
            for e in steps
        ]
    )


def _misses(R1, w0, w1, start, number):
    rotations, w = series(w0, start, number)
    off = rotations[-1] @ _array(R1, number).T
    skew = (off - off.T) / 2
    return np.concatenate([[skew[2, 1], skew[0, 2], skew[1, 0]], w - _array(w1, number)])


def _array(values, number):
    flat = np.asarray(values)
    return np.array([number(x) for x in flat.ravel()]).reshape(flat.shape)


def series(w0, start, number, pieces=25, order=20):
    """Return R at 101 times and w(1), by R' = R ŵ and w'' = Rᵀc, in 25 power series."""
    R, w, acceleration, c = _array(np.eye(3), number), _array(w0, number), start[:3], start[3:]
    rotations, share = [R], number(1) / pieces
    for _ in range(pieces):
        Rs, hats = np.empty((2, order + 1, 3, 3), dtype=R.dtype)
        ws = np.empty((order + 2, 3), dtype=R.dtype)
        Rs[0], ws[0], ws[1] = R, w, acceleration
        for n in range(order):
            hats[n] = _hat(ws[n])
            ws[n + 2] = Rs[n].T @ c / ((n + 1) * (n + 2))
            Rs[n + 1] = np.einsum("kij,kjl->il", Rs[: n + 1], hats[n::-1]) / (n + 1)
        rotations += [_sum(Rs, share * k / 4) for k in range(1, 5)]
        R, w = rotations[-1], _sum(ws, share)
        acceleration = _sum([k * v for k, v in enumerate(ws)][1:], share)
    return rotations, w


def _hat(v):
    x, y, z = v
    return np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]])


def _sum(coefficients, t):
    total = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        total = total * t + coefficient
    return total
