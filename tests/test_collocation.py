"""Newton's method may fail for one problem of a stack; the other problems are still solved."""

import numpy as np
import pytest

import rbcourse as rb
from rbcourse._polynomials import grid
from rbcourse.curves.functionals import BallAcceleration, Effort
from rbcourse.optimum import _collocation as collocation


@pytest.mark.parametrize("of_torque", [False, True])
@pytest.mark.parametrize("start", [np.nan, 1.0])  # the second start makes the matrix singular
def test_one_singular_problem_does_not_affect_the_rest_of_a_stack(of_torque, start):
    rng = np.random.default_rng(47)
    R0, R1 = rb.sample_rotation((2, 4), rng=rng)
    rates = rng.normal(size=(4, 2, 3))
    R = rb.closed_forms.bezier(R0, R1, *rates.swapaxes(0, 1))(grid(17).t).swapaxes(0, 1)
    solve = collocation.relax
    equations = collocation.BallStationary(BallAcceleration(), R0, R1, rates)
    if of_torque:
        functional = Effort(np.stack([np.diag([1.0, 2, 2.5])] * 4), of_torque=True)
        equations = collocation.Stationary(functional, R0, R1, rates)
    alone = [solve(equations.take([i]), R[[i]])[0] for i in range(4)]
    R[2] = start
    for i, (one, want) in enumerate(zip(solve(equations, R), alone, strict=True)):
        if i == 2:
            assert isinstance(one, collocation.Failure)
        else:
            assert one.cost == pytest.approx(want.cost, rel=1e-12)
