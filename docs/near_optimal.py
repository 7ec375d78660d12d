"""Derive the numbers in near_optimal.md exactly, and print the leading terms of the excess.

Three vectors describe a problem. The rotation vector from R0 to R1 is sigma. Let u0 and u1 be the
end velocities, carried to the middle by parallel transport. Their mean is sigma + e, and
d = u1 - u0. A term of third order is a linear combination of sigma, e and d. The code stores its
three coefficients in a list. They are polynomials in t and in the inner products of sigma, e and d.
"""

from itertools import pairwise

from sympy import QQ, ring

RING, t, ss, ee, dd, se, sd, ed = ring("t, ss, ee, dd, se, sd, ed", QQ)
INNER = [[ss, se, sd], [se, ee, ed], [sd, ed, dd]]
NAMES = ["ss", "ee", "dd", "se", "sd", "ed"]

one = RING.one
sigma = [one, 0 * one, 0 * one]
u0, u1 = [one, one, -one / 2], [one, one, one / 2]
# Hermite's cubics: one end value or end rate is 1, and the other three are 0
TO_GOAL, FIRST_RATE, LAST_RATE = 3 * t**2 - 2 * t**3, t - 2 * t**2 + t**3, t**3 - t**2


def add(*vectors):
    """Return the sum of the vectors."""
    return [sum(parts, 0 * one) for parts in zip(*vectors, strict=True)]


def times(share, vector):
    """Return a vector multiplied by a polynomial."""
    return [share * part for part in vector]


def dot(a, b):
    """Return the inner product."""
    return sum(a[i] * b[j] * INNER[i][j] for i in range(3) for j in range(3))


def triple(a, b, c):
    """Return a x (b x c), which is b (a.c) - c (a.b)."""
    return add(times(dot(a, c), b), times(-dot(a, b), c))


def rate(x, order=1):
    """Return the derivative of x with respect to t, of the given order."""
    for _ in range(order):
        x = [part.diff(t) for part in x]
    return x


def integral(p):
    """Return the integral of p from 0 to t."""
    return RING.from_dict({(k[0] + 1, *k[1:]): c / (k[0] + 1) for k, c in p.terms()})


def at(p, time):
    """Return the value of a polynomial at a time."""
    return p.subs(t, time)


def energy(x):
    """Return the integral of |x''|^2 from 0 to 1."""
    bend = rate(x, 2)
    return at(integral(dot(bend, bend)), 1)


def clamped(load, end_rate):
    """Solve y'''' = load with y = y' = 0 at t = 0, and y = 0, y' = end_rate at t = 1."""
    parts = []
    for p, last in zip(load, end_rate, strict=True):
        for _ in range(4):
            p = integral(p)
        miss, slope = at(p, 1), at(p.diff(t), 1)
        parts.append(p - miss * TO_GOAL + (last - slope) * LAST_RATE)
    return parts


CUBIC = add(times(TO_GOAL, sigma), times(FIRST_RATE, u0), times(LAST_RATE, u1))
# in the coordinate y of R = R0 exp(y), the parallel velocity is y' + y x (y x y')/24 + ...
END_RATE = times(QQ(-1, 24), triple(sigma, sigma, u1))


def optimum():
    """Return the third-order term of the optimum R = R0 exp(y), where w''' + w x w'' = 0."""
    x, v, a, j = (rate(CUBIC, k) for k in range(4))
    load = add(
        times(QQ(-1, 2), triple(a, x, a)),
        times(QQ(-1, 3), triple(j, x, v)),
        times(QQ(-1, 3), triple(v, x, j)),
    )
    return clamped(load, END_RATE)


def exponential():
    """Return the third-order term of the exponential cubic."""
    return times(LAST_RATE, END_RATE)


def geodesic(a, b, share):
    """Return the point of the geodesic from exp(a) to exp(b) at a fraction of its length.

    A point is stored as a pair: its first-order term and its third-order term.
    """
    (a1, a3), (b1, b3) = a, b
    way = add(b1, times(-1, a1))
    bend = triple(way, a1, b1)
    first = add(a1, times(share, way))
    third = add(times(1 - share, a3), times(share, b3), times(share * (1 - share) / 12, bend))
    return first, third


def bezier():
    """Return the third-order term of Bézier's curve, by de Casteljau's construction."""
    last = times(QQ(-1, 3), u1)  # from R1 to the third control point
    back = add(
        times(QQ(-1, 24), triple(sigma, sigma, last)), times(QQ(-1, 12), triple(last, sigma, last))
    )
    zero = times(0, sigma)
    points = [(zero, zero), (times(QQ(1, 3), u0), zero), (add(sigma, last), back), (sigma, zero)]
    while len(points) > 1:
        points = [geodesic(a, b, t) for a, b in pairwise(points)]
    return points[0][1]


def quaternion():
    """Return the third-order term of the quaternion cubic.

    The curve is a normalised cubic from (1, 0) to (cos, sin). The end rates of this cubic are half
    the velocities.
    """
    real = -TO_GOAL * ss / 8 - LAST_RATE * dot(sigma, u1) / 4
    imaginary = add(
        times(-TO_GOAL * ss / 48, sigma), times(-LAST_RATE * dot(sigma, u1) / 16, sigma)
    )
    half = times(QQ(1, 2), CUBIC)
    shorter = times(-real - dot(half, half) / 3, half)
    return times(2, add(imaginary, shorter))


def cayley():
    """Return the third-order term of Cayley's curve.

    The curve is a cubic in the coordinates g = tan(a/2) n = y/2 (1 + |y|^2/12 + ...).
    """
    goal = times(ss / 24, sigma)
    end = add(END_RATE, times(ss / 12, u1), times(dot(sigma, u1) / 6, sigma))
    g = times(QQ(1, 2), CUBIC)
    third = add(times(TO_GOAL, goal), times(LAST_RATE / 2, end))
    return times(2, add(third, times(-dot(g, g) / 3, g)))


def projection():
    """Return the third-order term of the nearest rotation to a cubic of matrices.

    The cubic is I + skew + symmetric + skew, with parts of first, second and third order.
    """
    skew = add(
        times(-TO_GOAL * ss / 6, sigma),
        times(-LAST_RATE * ss / 8, u1),
        times(-3 * LAST_RATE * dot(sigma, u1) / 8, sigma),
    )

    def stretched(a, b, v):
        """Return (tr S - S) v for S = (A B + B A)/2; A and B are the hats of a and b."""
        return add(times(-dot(a, b), v), times(-dot(b, v) / 2, a), times(-dot(a, v) / 2, b))

    turned = add(
        times(TO_GOAL / 2, stretched(sigma, sigma, CUBIC)),
        times(LAST_RATE, stretched(sigma, u1, CUBIC)),
    )
    return add(skew, times(QQ(-1, 2), turned), times(-dot(CUBIC, CUBIC) / 3, CUBIC))


def cumulative_energy():
    """Return the energy of the second-order deviation of the cumulative curve."""
    # y has the components of the deviation in the basis sigma x e, sigma x d, e x d
    first, last = times(QQ(1, 3), u0), times(QQ(1, 3), u1)
    middle = add(sigma, times(-1, first), times(-1, last))
    shares = 1 - (1 - t) ** 3, TO_GOAL, t**3

    def cross(a, b):
        pairs = (0, 1), (0, 2), (1, 2)
        return [a[i] * b[j] - a[j] * b[i] for i, j in pairs]

    # The body velocity at the end is w1 = u1 - sigma x u1/2, so the last turn has a part of second
    # order. To second order, the middle turn is exp(-first) exp(sigma) exp(-last).
    of_last = times(QQ(-1, 2), cross(sigma, last))
    of_middle = add(
        times(QQ(-1, 2), cross(first, sigma)),
        times(QQ(1, 2), cross(first, last)),
        times(QQ(-1, 2), cross(sigma, last)),
        times(-1, of_last),
    )
    y = add(times(shares[1], of_middle), times(shares[2], of_last))
    for (p, a), (q, b) in [
        ((shares[0], first), (shares[1], middle)),
        ((shares[0], first), (shares[2], last)),
        ((shares[1], middle), (shares[2], last)),
    ]:
        y = add(y, times(p * q / 2, cross(a, b)))
    bend = rate(y, 2)
    pairs = (0, 1), (0, 2), (1, 2)
    squared = 0 * one
    for x, (i, j) in zip(bend, pairs, strict=True):
        for z, (k, m) in zip(bend, pairs, strict=True):
            squared += x * z * (INNER[i][k] * INNER[j][m] - INNER[i][m] * INNER[j][k])
    return at(integral(squared), 1)


def deviations():
    """Return the third-order deviation of each closed form from the optimum."""
    best = times(-1, optimum())
    curves = {
        "projected_cubic": projection(),
        "exponential_cubic": exponential(),
        "bezier": bezier(),
        "quaternion_cubic": quaternion(),
        "cayley_cubic": cayley(),
    }
    return {way: add(curve, best) for way, curve in curves.items()}


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
    cost = at(integral(p.diff(t).diff(t) ** 2), 1)
    found = [at(integral(r.diff(t).diff(t) ** 2), 1) / cost for r in (matrix, tangent)]
    return [*found, found[1] / 16]


if __name__ == "__main__":
    for way, form in forms().items():
        print(f"{way}: E = {form}\n")
