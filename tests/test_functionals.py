"""The functionals against their definitions: variations of the integral, and derivatives."""

import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial

from rbcourse.optimum.functionals import BallAcceleration, Effort, Jerk

G = np.array([[2.0, 0.3, -0.1], [0.3, 1.5, 0.2], [-0.1, 0.2, 1.1]])[None]
FUNCTIONALS = {
    "ball": BallAcceleration(),
    "acceleration": Effort(G, of_torque=False),
    "torque": Effort(G, of_torque=True),
    "jerk": Jerk(),
}


def jets(polynomials, t, count):
    """Three polynomials and their derivatives at the times t, each of shape (1, n, 3)."""
    return [
        np.stack([(p.deriv(k) if k else p)(t) for p in polynomials], axis=-1)[None]
        for k in range(count)
    ]


@pytest.mark.source("beyond BK 2")
@pytest.mark.parametrize("name", FUNCTIONALS)
def test_the_costate_is_the_derivative_of_the_integral(name):
    """½ d/ds of ∫ ‖u‖² along w + s δw is ±∫ p · δw, for a δw that vanishes at both ends."""
    functional, rng = FUNCTIONALS[name], np.random.default_rng(1)
    x, weights = np.polynomial.legendre.leggauss(40)
    t, order = (x + 1) / 2, functional.ends // 2
    w = [Polynomial(rng.normal(size=5)) for _ in range(3)]
    dw = [Polynomial(rng.normal(size=4)) * Polynomial([0, 1, -1]) ** order for _ in range(3)]

    def cost(s):
        moved = [p + s * q for p, q in zip(w, dw, strict=True)]
        u = functional.deviation(*jets(moved, t, order + 1))
        return np.sum(u[0] ** 2, axis=-1) @ weights / 2

    slope = oracles.derivative_by_differences(cost, 0.0, 1e-3)
    p = functional.p(*jets(w, t, functional.ends + 1))
    work = np.sum(p[0] * jets(dw, t, 1)[0][0], axis=-1) @ weights / 2
    sign = -1 if functional.ends == 2 else 1
    assert slope / 2 == pytest.approx(sign * work, rel=1e-9)


@pytest.mark.parametrize("name", FUNCTIONALS)
@pytest.mark.parametrize("what", ["deviation", "p"])
def test_the_derivatives_are_derivatives(name, what):
    functional, rng = FUNCTIONALS[name], np.random.default_rng(2)
    count = functional.ends + 1 if what == "p" else functional.ends // 2 + 1
    rates = rng.normal(size=(count, 1, 4, 3))
    by = getattr(functional, f"{what}_by")(*rates)
    assert len(by) == count
    for k, i in np.ndindex(count, 3):
        step = np.zeros_like(rates)
        step[k, ..., i] = 1

        def moved(s, step=step):
            return getattr(functional, what)(*(rates + s * step))

        slope = oracles.derivative_by_differences(moved, 0.0, 2.0**-7)
        assert np.abs(by[k][..., i] - slope).max() < 1e-11


@pytest.mark.source("beyond BK 1", "beyond BK 5")
def test_the_deviations_are_the_torque_and_the_covariant_jerk():
    rng = np.random.default_rng(3)
    w, a, b = rng.normal(size=(3, 1, 5, 3))
    h = w @ G[0]
    torque = a @ G[0] + np.cross(w, h)
    squares = {
        "ball": 2 * np.sum(a**2, axis=-1),
        "acceleration": np.sum(torque * (torque @ np.linalg.inv(G[0])), axis=-1),
        "torque": np.sum(torque**2, axis=-1),
        "jerk": 2 * np.sum((b + np.cross(w, a) / 2) ** 2, axis=-1),
    }
    for name, functional in FUNCTIONALS.items():
        u = functional.deviation(*(w, a, b)[: functional.ends // 2 + 1])
        scale = np.reshape(functional.scale, (-1, 1))
        assert scale * np.sum(u**2, axis=-1) == pytest.approx(squares[name], rel=1e-13)


@pytest.mark.source("beyond BK 5")
@pytest.mark.parametrize(("kappa", "same"), [(0, False), (0.5, True), (1, False)])
def test_the_covariant_jerk_is_the_same_seen_from_the_body(kappa, same):
    """Rᵀ(t) has the body velocity −R w; only with κ = ½ has its jerk the same size."""
    w, a, b = np.random.default_rng(4).normal(size=(3, 3))
    here = b + kappa * np.cross(w, a)
    # by the derivatives of −R w, turned back by R: −w, −a and −(b + w × a)
    there = -(b + np.cross(w, a)) + kappa * np.cross(-w, -a)
    assert (abs(here @ here - there @ there) < 1e-12) == same
