"""Rigid-body motion, taught by code that runs: rotations, poses, projections and curves."""

from rbcourse.connection import (
    christoffel,
    covariant_derivative,
    geodesic_flow,
    structure_constants,
)
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
from rbcourse.inertia import inertia_from_weight, weight_from_inertia
from rbcourse.line import f, line_singular_value, theta
from rbcourse.metrics import (
    METRIC_SE3,
    METRIC_SO3,
    components_from_tangent,
    inner_ga,
    inner_gl,
    inner_left_invariant,
    inner_se3,
    inner_so3,
    semi_riemannian_metric_se3,
    tangent_from_components,
)
from rbcourse.motions import geodesic_se3, projected_cubic_se3
from rbcourse.optimum import ConvergenceError
from rbcourse.projected import projected_cubic_so3, projected_line_so3, projected_quintic_so3
from rbcourse.projection import (
    distance_to_so,
    is_se,
    is_so,
    orthonormalize_gram_schmidt,
    project_se,
    project_so,
    project_so_weighted,
)
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

__version__ = "0.4.0"

__all__ = [
    "BASIS_SE3",
    "BASIS_SO3",
    "METRIC_SE3",
    "METRIC_SO3",
    "ConvergenceError",
    "Curve",
    "Screw",
    "UniformityTest",
    "acceleration_cost",
    "acceleration_cost_parts",
    "adjoint_se3",
    "canonical_quaternion",
    "christoffel",
    "components_from_tangent",
    "coordinates_from_pose",
    "covariant_derivative",
    "distance_to_so",
    "exp_se3",
    "exp_so3",
    "f",
    "geodesic_flow",
    "geodesic_se3",
    "geodesic_so3",
    "hat_se3",
    "hat_so3",
    "inertia_from_weight",
    "inner_ga",
    "inner_gl",
    "inner_left_invariant",
    "inner_se3",
    "inner_so3",
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
    "orthonormalize_gram_schmidt",
    "pose_from_components",
    "pose_from_coordinates",
    "project_quaternion",
    "project_se",
    "project_so",
    "project_so_weighted",
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
    "semi_riemannian_metric_se3",
    "shoot_minimum_acceleration_so3",
    "slerp",
    "slerp_long",
    "structure_constants",
    "tangent_from_components",
    "theta",
    "uniformity_tests",
    "vee_se3",
    "vee_so3",
    "weight_from_inertia",
    "zyx_from_matrix",
    "zyx_from_quaternion",
]
