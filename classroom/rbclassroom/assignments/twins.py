"""The course's versions of the functions that students keep, with the students' arguments.

Later sets use them where a student's own function is missing or wrong. R, R0 and R1 are rotations,
shape (3, 3), and t is a number.
"""

import numpy as np

import rbcourse as rb
from rbcourse import Array, exp_so3, hat_so3, log_so3, textbook

__all__ = [
    "cubic",
    "exp_so3",
    "hat_so3",
    "log_so3",
    "nearest_rotation",
    "projected_cubic",
    "vee_so3",
]


def vee_so3(A: Array) -> Array:
    """Return the vector of the skew part of a matrix, shape (3, 3)."""
    return rb.vee_so3(A)


def nearest_rotation(M: Array) -> Array:
    """Return the rotation that is nearest to a matrix, shape (3, 3)."""
    return rb.project_so(M)


def cubic(p0: Array, p1: Array, v0: Array, v1: Array, t: float) -> Array:
    """Return the point of the cubic from p0 to p1 with the end velocities v0 and v1."""
    return textbook.polynomial(textbook.cubic_coefficients(p0, p1, v0, v1), np.asarray(t))


def projected_cubic(R0: Array, R1: Array, w0: Array, w1: Array, t: float) -> Array:
    """Return the rotation of the projected cubic with the angular velocities w0 and w1."""
    return textbook.projected_cubic(R0, R1, w0, w1, np.array([t]))[0][0]


alone = False
"""Whether `my_motion.mine` returns only the functions of this module, without a word."""
