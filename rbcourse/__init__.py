"""Rigid-body motion, taught by code that runs: rotations, poses, projections and curves."""

from rbcourse.conversions import (
    matrix_from_quaternion,
    matrix_from_zyx,
    quaternion_from_matrix,
    quaternion_from_rotation_vector,
    quaternion_from_zyx,
    rotation_vector_from_quaternion,
    zyx_from_matrix,
    zyx_from_quaternion,
)
from rbcourse.cost import acceleration_cost, acceleration_cost_parts
from rbcourse.curves import Curve, geodesic_so3
from rbcourse.line import f, line_singular_value, theta
from rbcourse.motions import geodesic_se3, projected_cubic_se3
from rbcourse.optimum import ConvergenceError
from rbcourse.projected import projected_cubic_so3, projected_line_so3, projected_quintic_so3
from rbcourse.projection import is_se, is_so, project_se, project_so
from rbcourse.quaternion import (
    canonical_quaternion,
    is_unit_quaternion,
    project_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    rotate_by_quaternion,
    slerp,
    slerp_long,
)
from rbcourse.relaxation import minimum_acceleration_se3, minimum_acceleration_so3
from rbcourse.sampling import (
    sample_quaternion,
    sample_quaternion_naive,
    sample_rotation,
    sample_rotation_naive,
)
from rbcourse.screws import Screw, screw_from_pose, screw_se3
from rbcourse.se3 import (
    BASIS_SE3,
    adjoint_se3,
    coordinates_from_pose,
    exp_se3,
    hat_se3,
    inverse_se3,
    log_se3,
    pose_from_components,
    pose_from_coordinates,
    vee_se3,
)
from rbcourse.shooting import shoot_minimum_acceleration_so3
from rbcourse.so3 import (
    BASIS_SO3,
    exp_so3,
    hat_so3,
    log_so3,
    right_jacobian_inverse_so3,
    right_jacobian_so3,
    vee_so3,
)
from rbcourse.uniformity import UniformityTest, uniformity_tests

__version__ = "0.3.0"

__all__ = [
    "BASIS_SE3",
    "BASIS_SO3",
    "ConvergenceError",
    "Curve",
    "Screw",
    "UniformityTest",
    "acceleration_cost",
    "acceleration_cost_parts",
    "adjoint_se3",
    "canonical_quaternion",
    "coordinates_from_pose",
    "exp_se3",
    "exp_so3",
    "f",
    "geodesic_se3",
    "geodesic_so3",
    "hat_se3",
    "hat_so3",
    "inverse_se3",
    "is_se",
    "is_so",
    "is_unit_quaternion",
    "line_singular_value",
    "log_se3",
    "log_so3",
    "matrix_from_quaternion",
    "matrix_from_zyx",
    "minimum_acceleration_se3",
    "minimum_acceleration_so3",
    "pose_from_components",
    "pose_from_coordinates",
    "project_quaternion",
    "project_se",
    "project_so",
    "projected_cubic_se3",
    "projected_cubic_so3",
    "projected_line_so3",
    "projected_quintic_so3",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_from_rotation_vector",
    "quaternion_from_zyx",
    "quaternion_multiply",
    "right_jacobian_inverse_so3",
    "right_jacobian_so3",
    "rotate_by_quaternion",
    "rotation_vector_from_quaternion",
    "sample_quaternion",
    "sample_quaternion_naive",
    "sample_rotation",
    "sample_rotation_naive",
    "screw_from_pose",
    "screw_se3",
    "shoot_minimum_acceleration_so3",
    "slerp",
    "slerp_long",
    "theta",
    "uniformity_tests",
    "vee_se3",
    "vee_so3",
    "zyx_from_matrix",
    "zyx_from_quaternion",
]
