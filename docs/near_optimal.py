"""Derive the numbers in near_optimal.md exactly, and print the leading terms of the excess.

Three vectors describe a problem. The rotation vector from R0 to R1 is sigma. Let u0 and u1 be the
end velocities, carried to the middle by parallel transport. Their mean is sigma + e, and
d = u1 - u0. A term of third order is a linear combination of sigma, e and d. The code stores its
three coefficients in an array. They are polynomials in t and in the inner products of sigma, e and
d. In a product with a polynomial, the array comes first.
"""

from itertools import combinations, pairwise

import numpy as np
from sympy import QQ, ring

RING, t, ss, ee, dd, se, sd, ed = ring("t, ss, ee, dd, se, sd, ed", QQ)
INNER = np.array([[ss, se, sd], [se, ee, ed], [sd, ed, dd]])
NAMES = ["ss", "ee", "dd", "se", "sd", "ed"]

sigma, e, d = np.eye(3, dtype=int) * RING.one
u0, u1 = sigma + e - d / 2, sigma + e + d / 2
# Hermite's cubics: one end value or end rate is 1, and the other three are 0
TO_GOAL, FIRST_RATE, LAST_RATE = 3 * t**2 - 2 * t**3, t - 2 * t**2 + t**3, t**3 - t**2
PAIRS = list(combinations(range(3), 2))


def dot(a, b):
    """Return the inner product."""
    return a @ INNER @ b


def triple(a, b, c):
    """Return a x (b x c), which is b (a.c) - c (a.b)."""
    return b * dot(a, c) - c * dot(a, b)


def _integral(p):
    return RING.from_dict({(k[0] + 1, *k[1:]): c / (k[0] + 1) for k, c in p.terms()})


# the derivative with respect to t, the integral from 0 to t, and the value at a time
rate = np.frompyfunc(lambda p: p.diff(t), 1, 1)
integral = np.frompyfunc(_integral, 1, 1)
at = np.frompyfunc(lambda p, time: p.subs(t, time), 2, 1)


def energy(x):
    """Return the integral of |x''|^2 from 0 to 1."""
    bend = rate(rate(x))
    return at(integral(dot(bend, bend)), 1)


def clamped(load, end_rate):
    """Solve y'''' = load with y = y' = 0 at t = 0, and y = 0, y' = end_rate at t = 1."""
    y = load
    for _ in range(4):
        y = integral(y)
    return y - at(y, 1) * TO_GOAL + (end_rate - at(rate(y), 1)) * LAST_RATE


CUBIC = sigma * TO_GOAL + u0 * FIRST_RATE + u1 * LAST_RATE
# in the coordinate y of R = R0 exp(y), the parallel velocity is y' + y x (y x y')/24 + ...
END_RATE = -triple(sigma, sigma, u1) / 24


def optimum():
    """Return the third-order term of the optimum R = R0 exp(y), where w''' + w x w'' = 0."""
    x, v = CUBIC, rate(CUBIC)
    a, j = rate(v), rate(rate(v))
    load = -triple(a, x, a) / 2 - triple(j, x, v) / 3 - triple(v, x, j) / 3
    return clamped(load, END_RATE)


def exponential():
    """Return the third-order term of the exponential cubic."""
    return END_RATE * LAST_RATE


def geodesic(a, b, share):
    """Return the point of the geodesic from exp(a) to exp(b) at a fraction of its length.

    A point is stored as a pair: its first-order term and its third-order term.
    """
    (a1, a3), (b1, b3) = a, b
    bend = triple(b1 - a1, a1, b1) * (share * (1 - share) / 12)
    return a1 + (b1 - a1) * share, a3 * (1 - share) + b3 * share + bend


def bezier():
    """Return the third-order term of Bézier's curve, by de Casteljau's construction."""
    last = -u1 / 3  # from R1 to the third control point
    back = -triple(sigma, sigma, last) / 24 - triple(last, sigma, last) / 12
    zero = 0 * sigma
    points = [(zero, zero), (u0 / 3, zero), (sigma + last, back), (sigma, zero)]
    while len(points) > 1:
        points = [geodesic(a, b, t) for a, b in pairwise(points)]
    return points[0][1]


def quaternion():
    """Return the third-order term of the quaternion cubic.

    The curve is a normalised cubic from (1, 0) to (cos, sin). The end rates of this cubic are half
    the velocities.
    """
    real = -TO_GOAL * ss / 8 - LAST_RATE * dot(sigma, u1) / 4
    imaginary = sigma * (-TO_GOAL * ss / 48 - LAST_RATE * dot(sigma, u1) / 16)
    half = CUBIC / 2
    return 2 * (imaginary - half * (real + dot(half, half) / 3))


def cayley():
    """Return the third-order term of Cayley's curve.

    The curve is a cubic in the coordinates g = tan(a/2) n = y/2 (1 + |y|^2/12 + ...).
    """
    goal = sigma * ss / 24
    end = END_RATE + u1 * ss / 12 + sigma * dot(sigma, u1) / 6
    g = CUBIC / 2
    return 2 * (goal * TO_GOAL + end * LAST_RATE / 2 - g * dot(g, g) / 3)


def projection():
    """Return the third-order term of the nearest rotation to a cubic of matrices.

    The cubic is I + skew + symmetric + skew, with parts of first, second and third order.
    """
    along = sigma * dot(sigma, u1)
    skew = -sigma * TO_GOAL * ss / 6 - (u1 * ss + 3 * along) * LAST_RATE / 8

    def stretched(a, b, v):
        """Return (tr S - S) v for S = (A B + B A)/2; A and B are the hats of a and b."""
        return -v * dot(a, b) - a * dot(b, v) / 2 - b * dot(a, v) / 2

    turned = stretched(sigma, sigma, CUBIC) * TO_GOAL / 2 + stretched(sigma, u1, CUBIC) * LAST_RATE
    return skew - turned / 2 - CUBIC * dot(CUBIC, CUBIC) / 3


def cumulative_energy():
    """Return the energy of the second-order deviation of the cumulative curve."""
    # y has the components of the deviation in the basis sigma x e, sigma x d, e x d
    first, last = u0 / 3, u1 / 3
    shares, turns = [1 - (1 - t) ** 3, TO_GOAL, t**3], [first, sigma - first - last, last]

    def cross(a, b):
        return np.array([a[i] * b[j] - a[j] * b[i] for i, j in PAIRS])

    # The body velocity at the end is w1 = u1 - sigma x u1/2, so the last turn has a part of second
    # order. To second order, the middle turn is exp(-first) exp(sigma) exp(-last).
    of_last = -cross(sigma, last) / 2
    of_middle = (cross(first, last) - cross(first, sigma) - cross(sigma, last)) / 2 - of_last
    y = of_middle * shares[1] + of_last * shares[2]
    for i, j in PAIRS:
        y = y + cross(turns[i], turns[j]) * (shares[i] * shares[j] / 2)
    squares = [
        [INNER[i, k] * INNER[j, m] - INNER[i, m] * INNER[j, k] for k, m in PAIRS] for i, j in PAIRS
    ]
    bend = rate(rate(y))
    return at(integral(bend @ np.array(squares) @ bend), 1)


def deviations():
    """Return the third-order deviation of each closed form from the optimum."""
    curves = {
        "projected_cubic": projection(),
        "exponential_cubic": exponential(),
        "bezier": bezier(),
        "quaternion_cubic": quaternion(),
        "cayley_cubic": cayley(),
    }
    best = optimum()
    return {way: curve - best for way, curve in curves.items()}


def forms():
    """Return the numerator of the leading excess of each closed form."""
    found = {way: energy(away) for way, away in deviations().items()}
    return {**found, "cumulative_bezier": cumulative_energy()}


def of_splines():
    """Return the leading excess of three splines, divided by θ⁴.

    The splines pass through the angles 0, θ and 0 about one axis at equally spaced times, with
    natural ends. They are the projected matrix spline, the projected spline and the quaternion
    spline. On each leg σ = θ p + θ³ r, where p is the cubic spline. The result is the integral of
    r''² divided by the integral of p''². The tangent of σ is y/x. In the first spline, x and y are
    splines. In the second spline, x and y are cubics on each leg.
    """
    p = (3 * t - t**3) / 2
    matrix = -p / 6 + p * p / 2 - p**3 / 3
    tangent = -p / 6 + p * TO_GOAL / 2 - p**3 / 3
    cost, *found = (at(integral(rate(rate(r)) ** 2), 1) for r in (p, matrix, tangent))
    return [found[0] / cost, found[1] / cost, found[1] / cost / 16]


if __name__ == "__main__":
    for way, form in forms().items():
        print(f"{way}: E = {form}\n")
