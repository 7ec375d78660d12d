"""What the lessons derive on the board, symbolically or in 50 digits."""

import mpmath
import numpy as np
import pytest
import sympy as sp

import rbcourse as rb

T = sp.Symbol("t", positive=True)


def integral(p):
    return sp.integrate(sp.expand(p), (T, 0, 1))


@pytest.mark.source("BK (18)", "BK (19)", "BK Prop. 7")
def test_the_first_variation_of_the_acceleration():
    """δw = η' + w × η, and half the change of ∫ ‖w'‖² is ∫ η · (w''' + w × w'')."""
    w = sp.Matrix([1 + T**2 - T**5, 2 * T - T**4, T**3 - 3])
    eta = T**2 * (1 - T) ** 2 * sp.Matrix([1 + T, T**2 - 2, 3 * T])
    change = w.diff(T).dot((eta.diff(T) + w.cross(eta)).diff(T))
    assert integral(change - eta.dot(w.diff(T, 3) + w.cross(w.diff(T, 2)))) == 0


@pytest.mark.source("BK Cor. 1", "BK 6.1", "BK (17)")
@pytest.mark.parametrize(
    ("degrees", "misprinted"), [(10, None), (90, "0.7935"), (150, "0.4009"), (179, None)]
)
def test_the_area_under_the_rate_of_theta_and_its_energy(degrees, misprinted):
    """The area is 1, under the misprint less; ∫ θ'² dt = (1 − cos a + a tan(a/2))/a²."""
    with mpmath.workdps(50):
        a = mpmath.mpf(degrees) * mpmath.pi / 180

        def integral_of(power, s_power=2):
            def rate(t):
                s_squared = 1 - 2 * (1 - mpmath.cos(a)) * t * (1 - t)
                return mpmath.sin(a) / a / s_squared ** (s_power / mpmath.mpf(2))

            return mpmath.quad(lambda t: rate(t) ** power, mpmath.linspace(0, 1, 17))

        assert abs(integral_of(1) - 1) < mpmath.mpf("1e-40")
        assert misprinted in (None, mpmath.nstr(integral_of(1, s_power=1), 4))
        closed = (a * mpmath.tan(a / 2) + 1 - mpmath.cos(a)) / a**2
        assert abs(integral_of(2) / closed - 1) < mpmath.mpf("1e-30")


@pytest.mark.source("BK 6.2", "BK Cor. 2")
def test_the_line_timed_by_f_of_a_cubic_is_the_optimum_of_case_a():
    """f(p(t)), p the cubic with the end velocities k0 and k1 of the geodesic."""
    sigma, k0, k1 = np.pi / 6 * np.array([1, 2, 3]), 0.3, 1.8
    a = np.linalg.norm(sigma)
    p = np.polynomial.Polynomial([0, k0, 3 - 2 * k0 - k1, k0 + k1 - 2])

    def timed(t, order):
        f, speed = [rb.projected_line.f(p(t), a, k) for k in range(3)], p.deriv()(t)
        return (f[0], f[1] * speed, f[2] * speed**2 + f[1] * p.deriv(2)(t))[order]

    ends = np.eye(3), rb.exp_so3(sigma)
    line = rb.projected_line_so3(*ends, timed)
    best = rb.minimum_acceleration_so3(*ends, k0 * sigma, k1 * sigma)
    t = np.linspace(0, 1, 101)
    for order in range(3):
        assert np.abs(line(t, order) - best(t, order)).max() < 1e-11


@pytest.mark.source("beyond BK 5")
def test_the_clamped_beam_bends_downwards_everywhere_and_rest_to_rest_costs_720_and_12():
    """Its Green function for t ≤ s, by its equation, and why it is positive."""
    s = sp.Symbol("s", positive=True)
    left = T**2 * (1 - s) ** 2 * (3 * s - T - 2 * s * T) / 6
    right = left.subs({T: s, s: T}, simultaneous=True)
    assert left.subs(T, 0) == left.diff(T).subs(T, 0) == 0
    assert right.subs(T, 1) == right.diff(T).subs(T, 1) == 0
    for order in range(4):
        jump = sp.expand((right - left).diff(T, order).subs(T, s))
        assert sp.simplify(jump - (1 if order == 3 else 0)) == 0
    # 3s − t(1 + 2s) ≥ 3s − s(1 + 2s) = 2s(1 − s) for t ≤ s
    assert sp.expand(3 * s - s * (1 + 2 * s) - 2 * s * (1 - s)) == 0
    whole = sp.expand(sp.integrate(left, (T, 0, s)) + sp.integrate(right, (T, s, 1)))
    assert whole.diff(s, 4) == 1  # under a load of 1
    assert {N.subs(s, end) for N in (whole, whole.diff(s)) for end in (0, 1)} == {0}
    assert sp.integrate(whole, (s, 0, 1)) == sp.Rational(1, 720)
    quintic, cubic = 10 * T**3 - 15 * T**4 + 6 * T**5, 3 * T**2 - 2 * T**3
    assert integral(quintic.diff(T, 3) ** 2) == 720
    assert integral(cubic.diff(T, 2) ** 2) == 12
    string = T * (1 - T) / 2  # −N'' = 1
    assert integral(string) == sp.Rational(1, 12)
