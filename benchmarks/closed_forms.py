"""The contest over N times: curves in closed form with the same four ends, as in lesson 12."""

import rbcourse as rb
from benchmarks.contest import OURS, Contest, Method
from benchmarks.rotations import cubic_ends
from rbcourse.draw.save import FORMS


def closed_forms(n, rng):
    """Return the contest of the rotations at n times; only the evaluation is timed."""
    return Contest("closed forms at N times", "", n, _methods(n, rng, lambda curve, t: curve(t)))


def closed_forms_with_derivatives(n, rng):
    """Return the same with velocity and acceleration."""

    def all_orders(curve, t):
        return [curve(t, order) for order in range(3)]

    return Contest("closed forms with derivatives", "", n, _methods(n, rng, all_orders))


def _methods(n, rng, values):
    t = rng.random(n)
    makers = {OURS: rb.projected_cubic_so3} | {
        f"rbcourse, {name}": make for name, make in FORMS.items() if name != "projection"
    }
    curves = {name: make(*cubic_ends()) for name, make in makers.items()}
    return [
        Method(
            name,
            makers[name].__name__,
            lambda curve=curve: values(curve, t),
            same=name == OURS,
        )
        for name, curve in curves.items()
    ]
