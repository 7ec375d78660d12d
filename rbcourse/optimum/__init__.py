"""Curves of least acceleration, torque or jerk: between two poses, and through many.

In private modules, `_search` chooses starting curves, `_guesses` makes them and lowers their costs,
`_collocation` solves the equation R p = c by Newton's method, `_spline` does this for all legs of a
path together, and `_second_variation` proves that a solution is a local minimum.
"""

from rbcourse.optimum._result import ConvergenceError, OptimalChain, Optimum
from rbcourse.optimum.excess import excess_estimate
from rbcourse.optimum.many_poses import (
    minimum_acceleration_spline,
    minimum_jerk_spline,
    minimum_torque_spline,
)
from rbcourse.optimum.smoothing import minimum_acceleration_smoothing
from rbcourse.optimum.two_poses import (
    minimum_acceleration,
    minimum_jerk,
    minimum_torque,
    stationary,
)

__all__ = [
    "ConvergenceError",
    "OptimalChain",
    "Optimum",
    "excess_estimate",
    "minimum_acceleration",
    "minimum_acceleration_smoothing",
    "minimum_acceleration_spline",
    "minimum_jerk",
    "minimum_jerk_spline",
    "minimum_torque",
    "minimum_torque_spline",
    "stationary",
]
