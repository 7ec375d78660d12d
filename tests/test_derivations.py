"""What the lessons derive on the board, symbolically or in 50 digits."""

import mpmath
import numpy as np
import pytest
import sympy as sp

import rbcourse as rb

A, T = sp.symbols("a t", positive=True)


def vector(name):
    return sp.Matrix(sp.symbols(f"{name}:3"))


def hat(x):
    return sp.Matrix(3, 3, lambda i, j: sum(sp.LeviCivita(i, k, j) * x[k] for k in range(3)))


def integral(p):
    return sp.integrate(sp.expand(p), (T, 0, 1))


@pytest.mark.source("BK (8)", "BK (9)")
def test_a_velocity_changes_by_its_components_alone_in_a_bi_invariant_metric():
    """Koszul's formula for G = 2 I gives ∇_x y = x × y/2, and that is 0 for y = x."""
    x, y, z = vector("x"), vector("y"), vector("z")
    koszul = x.cross(y).dot(z) - y.cross(z).dot(x) + z.cross(x).dot(y)
    assert sp.expand(koszul - x.cross(y).dot(z)) == 0  # half of it, for 2 ⟨∇_x y, z⟩


@pytest.mark.source("BK (10)")
def test_the_form_10_does_not_change_along_screws():
    """⟨[S, X], Y⟩ + ⟨X, [S, Y]⟩ = 0 for twists, so ∇_S S = 0: a constant twist is a geodesic."""
    alpha, beta = sp.symbols("alpha beta")

    def bracket(a, b):
        return a[0].cross(b[0]), a[0].cross(b[1]) - b[0].cross(a[1])

    def form(a, b):
        return alpha * a[0].dot(b[0]) + beta * (a[0].dot(b[1]) + a[1].dot(b[0]))

    S, X, Y = ((vector(f"{name}w"), vector(f"{name}v")) for name in "sxy")
    assert sp.expand(form(bracket(S, X), Y) + form(X, bracket(S, Y))) == 0


@pytest.mark.source("BK (18)", "BK (19)", "BK Prop. 7")
def test_the_first_variation_of_the_acceleration():
    """δw = η' + w × η, and half the change of ∫ ‖w'‖² is ∫ η · (w''' + w × w'')."""
    w = sp.Matrix([1 + T**2 - T**5, 2 * T - T**4, T**3 - 3])
    eta = T**2 * (1 - T) ** 2 * sp.Matrix([1 + T, T**2 - 2, 3 * T])
    change = w.diff(T).dot((eta.diff(T) + w.cross(eta)).diff(T))
    assert integral(change - eta.dot(w.diff(T, 3) + w.cross(w.diff(T, 2)))) == 0


@pytest.mark.source("BK (19)")
def test_the_rate_of_a_rotation_changes_by_its_variation_and_the_turning_of_the_frame():
    """(R e^η̂)ᵀ(R e^η̂)' = ŵ + the hat of η' + w × η, to first order in η."""
    w, eta, rate = vector("w"), vector("e"), vector("r")
    small = sp.Symbol("s")
    changed = (sp.eye(3) - small * hat(eta)) * (
        hat(w) * (sp.eye(3) + small * hat(eta)) + small * hat(rate)
    )
    assert sp.expand(changed.diff(small).subs(small, 0) - hat(rate + w.cross(eta))) == sp.zeros(3)


@pytest.mark.source("BK (19)")
def test_what_is_constant_along_an_optimum():
    """With w''' = −w × w'': R w'' by its rate in the body, and the number w·w'' − ‖w'‖²/2."""
    w = sp.Matrix([sp.Function(f"w{i}")(T) for i in range(3)])
    R = sp.Matrix(3, 3, lambda i, j: sp.Function(f"r{i}{j}")(T))
    b = w.diff(T, 2)
    third = dict(zip(w.diff(T, 3), -w.cross(b), strict=True))
    rates = dict(zip(R.diff(T), R * hat(w), strict=True))
    assert sp.expand((R * b).diff(T).subs(third).subs(rates)) == sp.zeros(3, 1)
    number = w.dot(b) - w.diff(T).dot(w.diff(T)) / 2
    assert sp.expand(number.diff(T).subs(third)) == 0


@pytest.mark.source("RR 2.1")
def test_the_law_of_the_angle_of_a_uniform_rotation():
    """A layer of the sphere in four dimensions, over half of its area, 2π²/2."""
    density = 4 * sp.pi * sp.sin(A / 2) ** 2 / 2 / sp.pi**2
    assert sp.simplify(density - (1 - sp.cos(A)) / sp.pi) == 0
    assert sp.integrate(density, (A, 0, sp.pi)) == 1


@pytest.mark.source("RR (7)", "RR (8)", "RR 2.1")
def test_where_three_angles_carry_e1_and_e3_and_what_makes_them_uniform():
    """The heights, and the volume |cos β| dα dβ dγ, uniform in sin β."""
    alpha, beta, gamma = angles = sp.symbols("alpha beta gamma", real=True)
    R = sp.rot_ccw_axis3(alpha) * sp.rot_ccw_axis2(beta) * sp.rot_ccw_axis1(gamma)
    assert sp.simplify(R[2, 0] + sp.sin(beta)) == 0
    assert sp.simplify(R[2, 2] - sp.cos(beta) * sp.cos(gamma)) == 0
    rates = []
    for angle in angles:
        W = sp.simplify(R.T * R.diff(angle))
        rates.append([W[2, 1], W[0, 2], W[1, 0]])
    assert sp.simplify(sp.Matrix(rates).det() ** 2 - sp.cos(beta) ** 2) == 0


@pytest.mark.source("BK Prop. 6", "BK (16)")
def test_the_middle_of_the_chord_bisects():
    half = (1 + sp.exp(sp.I * A)) / 2
    bisector = sp.cos(A / 2) * sp.exp(sp.I * A / 2)
    assert sp.simplify((half - bisector).rewrite(sp.cos).expand(trig=True)) == 0
    assert sp.simplify(sp.expand_complex(half - bisector)) == 0


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
