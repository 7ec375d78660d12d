"""Closed forms of curves between two rotations or poses, and the registry `FORMS` of them.

Each function takes two rotations and two angular velocities, or two poses and two twists; for
poses, the origin moves on the cubic with the same boundary conditions. The projected cubic is
`rbcourse.projected_cubic`. CONTRIBUTING.md lists the steps that add a closed form.
"""

from collections.abc import Callable

from rbcourse.curves.bezier import bezier, corrected_bezier, cumulative_bezier
from rbcourse.curves.closed import (
    cayley_cubic,
    exponential_cubic,
    exponential_quintic,
    normal_cubic,
    quaternion_cubic,
)
from rbcourse.curves.curve import Curve
from rbcourse.curves.projected import projected_cubic

__all__ = [
    "FORMS",
    "bezier",
    "cayley_cubic",
    "corrected_bezier",
    "cumulative_bezier",
    "exponential_cubic",
    "exponential_quintic",
    "normal_cubic",
    "quaternion_cubic",
]

FORMS: dict[str, Callable[..., Curve]] = {
    make.__name__: make
    for make in (
        projected_cubic,
        exponential_cubic,
        bezier,
        corrected_bezier,
        cumulative_bezier,
        quaternion_cubic,
        cayley_cubic,
    )
}
"""The closed forms for two rotations and two velocities that the course compares, by name."""
