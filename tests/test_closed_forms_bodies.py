"""Closed forms for real bodies and for jerk."""

import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

I3, REST = np.eye(3), np.zeros(3)
G = np.diag([1.0, 2.22, 3.18])
RNG = np.random.default_rng(5)
R0 = Rotation.random(6, rng=RNG).as_matrix()
TURN, W0, W1, A0, A1 = RNG.normal(size=(5, 6, 3)) * np.reshape([0.6, 1.5, 1.5, 4, 4], (5, 1, 1))
R1 = R0 @ rb.exp_so3(TURN)
FORMS = {
    "weighted": lambda R0, R1, w0, w1, a0, a1: rb.weighted_cubic_so3(R0, R1, w0, w1, G),
    "normal": lambda R0, R1, w0, w1, a0, a1: rb.normal_cubic_so3(R0, R1, w0, w1, G),
    "quintic": rb.exponential_quintic_so3,
}
TIMES = np.linspace(0, 1, 51)


@pytest.mark.parametrize("name", FORMS)
def test_the_ends_are_met_and_the_rates_are_derivatives(name):
    curves = FORMS[name](R0, R1, W0, W1, A0, A1)
    wanted = [(0, R0, R1), (1, W0, W1), *([(2, A0, A1)] if name == "quintic" else [])]
    for order, start, end in wanted:
        assert np.abs(curves([0, 1], order) - [start, end]).max() < 1e-13
    for t in (0.1, 0.5, 0.85):
        rate = oracles.derivative_by_differences(curves, t)
        assert np.abs(rate - curves(t) @ rb.hat_so3(curves(t, 1))).max() < 1e-10
        for order in (2, 3):
            rate = oracles.derivative_by_differences(lambda u, k=order: curves(u, k - 1), t)
            assert np.abs(rate - curves(t, order)).max() < 1e-10 * (1 + np.abs(rate).max())
    assert (
        np.abs(curves[2](0.3, 3) - curves(0.3, 3)[2]).max() < 1e-13 * np.abs(curves(0.3, 3)).max()
    )


@pytest.mark.source("beyond BK 6")
def test_the_weighted_cubic_is_the_nearest_rotation_in_the_metric():
    curves, W = rb.weighted_cubic_so3(R0, R1, W0, W1, G), rb.metrics.weight_from_inertia(G)
    for t in TIMES[::10]:
        assert np.abs(curves(t) - rb.project_so_weighted(cubic(t), W)).max() < 1e-13
    plain = rb.weighted_cubic_so3(R0, R1, W0, W1, 5 * I3)
    assert np.abs(plain(TIMES) - rb.projected_cubic_so3(R0, R1, W0, W1)(TIMES)).max() < 1e-14
    assert plain.margin == pytest.approx(rb.projected_cubic_so3(R0, R1, W0, W1).margin, rel=1e-12)
    flat = rb.weighted_cubic_so3(R0, R1, W0, W1, np.diag([1.0, 2, 3]))
    assert np.abs(flat([0, 1]) - [R0, R1]).max() < 1e-14


def cubic(t):
    ends = R0, R1, R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)
    weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, -(t**2) * (1 - t)
    return sum(weight * M for weight, M in zip(weights, ends, strict=True))


@pytest.mark.source("beyond BK 7")
def test_the_normal_cubic_is_what_its_formula_says():
    """x(t) is solved for again, by SciPy, and is a cubic."""
    from scipy.optimize import fsolve

    curve = rb.normal_cubic_so3(R0[0], R1[0], W0[0], W1[0], G)
    t = np.linspace(0, 1, 9)
    y = rb.log_so3(R0[0].T @ curve(t))
    inverse = np.linalg.inv(G)
    x = np.array(
        [fsolve(lambda x, y=y: x - inverse @ np.cross(x, G @ x) / 2 - y, y, xtol=1e-13) for y in y]
    )
    fit = np.polynomial.Polynomial.fit
    assert all(np.abs(fit(t, x[:, i], 3)(t) - x[:, i]).max() < 1e-12 for i in range(3))
    round_one = rb.normal_cubic_so3(R0, R1, W0, W1, 3 * I3)
    same = rb.exponential_cubic_so3(R0, R1, W0, W1)
    assert np.abs(round_one(TIMES) - same(TIMES)).max() < 1e-13


@pytest.mark.parametrize("angle", [2.0, 2.03, 2.5, 3.1])
def test_of_a_thin_plate_the_normal_cubic_is_there_or_says_that_it_is_not(angle):
    """About the middle axis the map from x to y is singular at about 2.02."""
    thin = np.diag([0.01, 1.0, 1.01])
    curve = rb.normal_cubic_so3(I3, rb.exp_so3([0, angle, 0]), REST, REST, thin)
    share = 3 * TIMES**2 - 2 * TIMES**3
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(angle * share, [0, 1, 0]))).max() < 1e-12
    a1, a3 = (1.01 - 1) / (2 * 0.01), (1 - 0.01) / (2 * 1.01)
    singular = rb.exp_so3([0, 1 / np.sqrt(a1 * a3), 0])
    with pytest.raises(ValueError, match=r"^normal cubic: the map from x to y is singular"):
        rb.normal_cubic_so3(I3, singular, REST, REST, thin)


@pytest.mark.source("beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize("make", [rb.weighted_cubic_so3, rb.normal_cubic_so3])
def test_the_excess_falls_with_the_fourth_power(make):
    """Of the projection without the weight it falls with the square."""

    def excess(make, s):
        ends = I3, rb.exp_so3(s * TURN), s * W0, s * W1
        best = rb.minimum_acceleration_so3(*ends, G).cost
        return np.median(rb.acceleration_cost(make(*ends), G) / best - 1)

    for form, power in ((lambda *ends: make(*ends, G), 4), (rb.projected_cubic_so3, 2)):
        assert np.log2(excess(form, 0.2) / excess(form, 0.1)) == pytest.approx(power, abs=0.25)


@pytest.mark.source("beyond BK 8")
def test_the_quintic_is_near_the_least_jerk_and_is_it_from_rest_to_rest():
    def excess(s):
        ends = I3, rb.exp_so3(s * TURN), s * W0, s * W1, s * A0, s * A1
        return rb.jerk_cost(rb.exponential_quintic_so3(*ends)) / rb.minimum_jerk_so3(*ends).cost - 1

    assert np.median(excess(1.0)) < 0.05
    assert np.log2(np.median(excess(0.2)) / np.median(excess(0.1))) == pytest.approx(4, abs=0.4)
    rest = rb.exponential_quintic_so3(R0, R1, REST, REST, REST, REST)
    assert rb.jerk_cost(rest) == pytest.approx(1440 * np.sum(TURN**2, axis=-1), rel=1e-10)


def test_moved_ends_give_the_moved_curve():
    L, Q = Rotation.random(2, rng=3).as_matrix()
    turned = Q.T @ G @ Q
    turned = (turned + turned.T) / 2
    for make in (rb.weighted_cubic_so3, rb.normal_cubic_so3):
        moved = make(L @ R0 @ Q, L @ R1 @ Q, W0 @ Q, W1 @ Q, turned)
        assert np.abs(moved(TIMES) - L @ make(R0, R1, W0, W1, G)(TIMES) @ Q).max() < 1e-12


def test_what_belongs_to_no_body_has_no_weight():
    with pytest.raises(
        ValueError, match=r"^inertia\[1\] has the principal moments 1, 1, 3; each must be at most"
    ):
        rb.weighted_cubic_so3(I3, I3, REST, REST, np.stack([I3, np.diag([1.0, 1, 3])]))
    rb.normal_cubic_so3(I3, I3, REST, REST, np.diag([1.0, 1, 3]))
    with pytest.raises(ValueError, match=r"^a0: shape \(\.\.\., 3\) wanted, got \(2,\)"):
        rb.exponential_quintic_so3(I3, I3, REST, REST, [0, 0], REST)


def test_of_rods_the_normal_cubic_meets_its_ends():
    for moments in ((1e-6, 1, 1), (1, 1, 1e-6), (1e-3, 1, 1)):
        curve = rb.normal_cubic_so3(I3, rb.exp_so3([0.4, 0.1, 0.3]), REST, REST, np.diag(moments))
        assert np.abs(curve(1) - rb.exp_so3([0.4, 0.1, 0.3])).max() < 1e-9
    singular = rb.exp_so3([[0, 0.1, 0], [0, 1 / np.sqrt(0.5 * 0.99 / 2.02), 0]])
    with pytest.raises(ValueError, match=r"^normal cubic of curve \[1\]: the map from x to y is"):
        rb.normal_cubic_so3(I3, singular, REST, REST, np.diag([0.01, 1, 1.01]))
