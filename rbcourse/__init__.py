"""Rigid-body motion, taught by code that runs: rotations, projections and curves on SO(3)."""

from rbcourse.curves import Curve, geodesic_so3, projected_line_so3
from rbcourse.line import f, line_singular_value, theta
from rbcourse.projection import is_se, is_so, project_se, project_so
from rbcourse.quaternion import (
    is_unit_quaternion,
    matrix_from_quaternion,
    quaternion_conjugate,
    quaternion_from_matrix,
    quaternion_multiply,
    rotate_by_quaternion,
    slerp,
)
from rbcourse.so3 import (
    BASIS_SO3,
    exp_so3,
    hat_so3,
    log_so3,
    right_jacobian_inverse_so3,
    right_jacobian_so3,
    vee_so3,
)

__version__ = "0.1.0"

__all__ = [
    "BASIS_SO3",
    "Curve",
    "exp_so3",
    "f",
    "geodesic_so3",
    "hat_so3",
    "is_se",
    "is_so",
    "is_unit_quaternion",
    "line_singular_value",
    "log_so3",
    "matrix_from_quaternion",
    "project_se",
    "project_so",
    "projected_line_so3",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_multiply",
    "right_jacobian_inverse_so3",
    "right_jacobian_so3",
    "rotate_by_quaternion",
    "slerp",
    "theta",
    "vee_so3",
]
