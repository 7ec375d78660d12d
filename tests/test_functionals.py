"""Check the functionals by variations of the integral and by derivatives."""

import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial

from rbcourse.curves.functionals import BallAcceleration, Effort, Jerk

G = np.array([[[2.0, 0.3, -0.1], [0.3, 1.5, 0.2], [-0.1, 0.2, 1.1]]])
every_functional = pytest.mark.parametrize(
    "functional",
    [BallAcceleration(), Effort(G, of_torque=False), Effort(G, of_torque=True), Jerk()],
)


@pytest.mark.source("beyond BK 2")
@every_functional
def test_the_costate_is_the_derivative_of_the_integral(functional):
    """½ d/ds ∫ ‖u‖² along w + s δw equals ±∫ p · δw if δw vanishes at both ends."""
    rng, order = np.random.default_rng(1), functional.ends // 2
    x, weights = np.polynomial.legendre.leggauss(40)
    w = [Polynomial(rng.normal(size=5)) for _ in range(3)]
    dw = [Polynomial(rng.normal(size=4)) * Polynomial([0, 1, -1]) ** order for _ in range(3)]

    def jets(s, count):
        """Return w + s δw and its derivatives at the nodes, each of shape (1, n, 3)."""
        moved = [p + s * q for p, q in zip(w, dw, strict=True)]
        return [
            np.stack([p.deriv(k)((x + 1) / 2) for p in moved], axis=-1)[None] for k in range(count)
        ]

    def cost(s):
        return np.sum(functional.deviation(*jets(s, order + 1))[0] ** 2, axis=-1) @ weights / 2

    slope = oracles.derivative_by_differences(cost, 0.0, 1e-3)
    change = jets(1, 1)[0] - jets(0, 1)[0]
    work = np.sum(functional.p(*jets(0, functional.ends + 1)) * change, axis=-1)[0] @ weights / 2
    assert slope / 2 == pytest.approx((-1) ** order * work, rel=1e-9)


@every_functional
@pytest.mark.parametrize("what", ["deviation", "p"])
def test_the_jacobians_are_the_derivatives_of_their_functions(functional, what):
    count = functional.ends + 1 if what == "p" else functional.ends // 2 + 1
    rates = np.random.default_rng(2).normal(size=(count, 1, 4, 3))
    by = getattr(functional, f"{what}_by")(*rates)
    assert len(by) == count
    for k, i in np.ndindex(count, 3):
        step = np.zeros_like(rates)
        step[k, ..., i] = 1
        slope = oracles.derivative_by_differences(
            lambda s, step=step: getattr(functional, what)(*(rates + s * step)), 0.0, 2.0**-7
        )
        assert np.abs(by[k][..., i] - slope).max() < 1e-11
