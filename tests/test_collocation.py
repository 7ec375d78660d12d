"""R p = c, solved: a problem of a stack that fails harms no other."""

import numpy as np
import pytest

import rbcourse as rb
from rbcourse.curves import Ends
from rbcourse.optimum.chebyshev import grid
from rbcourse.optimum.collocation import (
    BallStationary,
    Failure,
    Solution,
    Stationary,
    relax,
    relax_ball,
)
from rbcourse.optimum.functionals import Effort

COUNT, NODES = 4, 17


def problems():
    """Boundary conditions, end velocities, and the projected cubics as curves to start from."""
    rng = np.random.default_rng(47)
    R0, R1 = rb.sample_rotation(COUNT, rng=rng), rb.sample_rotation(COUNT, rng=rng)
    ends = Ends(R0, R1, *rng.normal(size=(2, COUNT, 3)))
    starts = rb.bezier_so3(*ends)(grid(NODES).t).swapaxes(0, 1)
    return ends, np.stack([ends.w0, ends.w1], axis=1), starts


@pytest.mark.parametrize("kind", ["ball", "torque"])
@pytest.mark.parametrize("start", [np.nan, 1.0])  # with the second the matrix is singular
@pytest.mark.parametrize("broken", range(COUNT))
def test_relax_finds_the_others_where_one_problem_of_a_stack_is_singular(kind, start, broken):
    ends, rates, starts = problems()
    if kind == "ball":
        solve, equations = relax_ball, BallStationary(ends.R0, ends.R1, rates)
    else:
        functional = Effort(np.tile(np.diag([1.0, 2, 2.5]), (COUNT, 1, 1)), of_torque=True)
        solve, equations = relax, Stationary(functional, ends.R0, ends.R1, rates)
    alone = [solve(equations.take([i]), starts[[i]])[0] for i in range(COUNT)]
    assert all(isinstance(one, Solution) for one in alone)
    starts[broken] = start
    for i, one in enumerate(solve(equations, starts)):
        if i == broken:
            assert isinstance(one, Failure)
            assert not isinstance(one, Solution)
        else:
            assert one.cost == pytest.approx(alone[i].cost, rel=1e-12)
