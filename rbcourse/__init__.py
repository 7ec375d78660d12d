"""Rigid-body motion: rotations, poses, projections, and curves through them.

The package exports the names for everyday use. Other names are only in its modules: inner products
in `rbcourse.metrics`, the connection in `rbcourse.connection`, planar motions and arms in
`rbcourse.planar` and `rbcourse.arm`, naive samplers and tests of uniformity in `rbcourse.sampling`,
and the timings θ and f in `rbcourse.straight_line`. The module `rbcourse.textbook` has short
versions of the main algorithms.

The line "Source" of a docstring cites the equations that the function implements. BK is Belta and
Kumar (2002), and RR is the report by Samayamantula and Zou. A source such as "beyond BK 12" is an
entry of docs/ledger.md whose content is in neither text.

`BASIS_SO3`, shape (3, 3, 3), and `BASIS_SE3`, shape (6, 4, 4), are the standard bases of the Lie
algebras. `METRIC_SO3` and `METRIC_SE3` are the matrices of the metrics that the trace induces (BK
(12), (14)). The dict `CLOSED_FORMS` maps names to the functions that approximate the optimum in
closed form.

An argument that is not finite, has the wrong shape or is outside the stated range raises a
ValueError that names it. So does a matrix that is not symmetric or positive definite where this is
required. Batch shapes that do not broadcast also raise ValueError. The docstrings name the other
errors.

Rotation matrices, poses and unit quaternions must be valid. A deviation of at most 1e-9 is
accepted, and one of at most 1e-6, as of numbers in single precision, is removed by projection. A
larger deviation raises a ValueError that states it; `project_so`, `project_se` and
`project_quaternion` return the nearest valid arguments. SciPy's ``Rotation`` and ``RigidTransform``
are accepted in place of matrices. All results are NumPy arrays in double precision.
Angles are in rad, and lengths in m. Angular velocities and twists (ω, v) are in the body frame, per
unit of time.
"""

from rbcourse import arm, connection, files, metrics, planar, quaternion, sampling, straight_line
from rbcourse._numerics import Array
from rbcourse.connection import geodesic_flow
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
from rbcourse.curves.bezier import (
    bezier_long_so3,
    bezier_so3,
    corrected_bezier_so3,
    cumulative_bezier_so3,
)
from rbcourse.curves.chain import (
    Chain,
    chain,
    projected_spline_se3,
    projected_spline_so3,
    quaternion_spline_so3,
)
from rbcourse.curves.closed import (
    CLOSED_FORMS,
    cayley_cubic_so3,
    exponential_cubic_long_so3,
    exponential_cubic_so3,
    exponential_quintic_so3,
    normal_cubic_so3,
    quaternion_cubic_so3,
)
from rbcourse.curves.cost import acceleration_cost, acceleration_cost_parts, jerk_cost, torque_cost
from rbcourse.curves.curve import Curve, Ends, geodesic_so3, retime
from rbcourse.curves.projected_line import projected_line_so3
from rbcourse.curves.projected_polynomial import (
    ProjectedPolynomial,
    projected_cubic_so3,
    projected_quintic_so3,
    weighted_cubic_so3,
)
from rbcourse.curves.rigid import (
    geodesic_se3,
    minimum_acceleration_se3,
    projected_cubic_se3,
    screw_from_pose,
    screw_se3,
)
from rbcourse.curves.timing import Timed, fastest, limits_used
from rbcourse.curves.velocities import bessel_velocities, spline_velocities
from rbcourse.files import read_path, write_path
from rbcourse.metrics import METRIC_SE3, METRIC_SO3
from rbcourse.optimum import (
    ConvergenceError,
    Optimum,
    minimum_acceleration_so3,
    minimum_jerk_so3,
    minimum_torque_so3,
    stationary_so3,
)
from rbcourse.optimum.excess import excess_estimate
from rbcourse.optimum.many_poses import (
    OptimalChain,
    is_local_minimum,
    minimum_acceleration_spline_se3,
    minimum_acceleration_spline_so3,
    minimum_jerk_spline_so3,
    minimum_torque_spline_so3,
)
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
    continuous_quaternions,
    is_unit_quaternion,
    project_quaternion,
    quaternion_multiply,
    rotate_by_quaternion,
    slerp,
)
from rbcourse.sampling import sample_quaternion, sample_rotation
from rbcourse.se3 import (
    BASIS_SE3,
    adjoint_se3,
    components_from_pose,
    coordinates_from_pose,
    exp_se3,
    hat_se3,
    inverse_se3,
    log_se3,
    pose_from_components,
    pose_from_coordinates,
    vee_se3,
)
from rbcourse.so3 import (
    BASIS_SO3,
    angle_between,
    exp_so3,
    hat_so3,
    log_so3,
    right_jacobian_inverse_so3,
    right_jacobian_so3,
    vee_so3,
)

__version__ = "2.0.0a1"

__all__ = [  # noqa: RUF022 - sorted by subject
    # rotations
    "BASIS_SO3",
    "hat_so3",
    "vee_so3",
    "exp_so3",
    "log_so3",
    "angle_between",
    "right_jacobian_so3",
    "right_jacobian_inverse_so3",
    # other representations of rotations
    "quaternion_multiply",
    "rotate_by_quaternion",
    "slerp",
    "continuous_quaternions",
    "quaternion_from_matrix",
    "matrix_from_quaternion",
    "quaternion_from_rotation_vector",
    "rotation_vector_from_quaternion",
    "matrix_from_zyx",
    "zyx_from_matrix",
    "quaternion_from_zyx",
    "zyx_from_quaternion",
    # poses
    "BASIS_SE3",
    "hat_se3",
    "vee_se3",
    "exp_se3",
    "log_se3",
    "adjoint_se3",
    "inverse_se3",
    "pose_from_components",
    "components_from_pose",
    "pose_from_coordinates",
    "coordinates_from_pose",
    # membership and projection
    "is_so",
    "is_se",
    "is_unit_quaternion",
    "project_so",
    "project_se",
    "project_quaternion",
    "project_so_weighted",
    "orthonormalize_gram_schmidt",
    "distance_to_so",
    # random rotations
    "sample_rotation",
    "sample_quaternion",
    # metrics
    "METRIC_SO3",
    "METRIC_SE3",
    "geodesic_flow",
    # curves between two rotations or poses
    "Curve",
    "Ends",
    "geodesic_so3",
    "geodesic_se3",
    "screw_se3",
    "screw_from_pose",
    "projected_line_so3",
    "projected_cubic_so3",
    "projected_cubic_se3",
    "projected_quintic_so3",
    "ProjectedPolynomial",
    # the optimum, and costs of curves
    "minimum_acceleration_so3",
    "minimum_acceleration_se3",
    "minimum_torque_so3",
    "minimum_jerk_so3",
    "stationary_so3",
    "Optimum",
    "ConvergenceError",
    "acceleration_cost",
    "excess_estimate",
    "acceleration_cost_parts",
    "torque_cost",
    "jerk_cost",
    # other closed forms
    "CLOSED_FORMS",
    "exponential_cubic_so3",
    "exponential_cubic_long_so3",
    "bezier_so3",
    "bezier_long_so3",
    "cumulative_bezier_so3",
    "quaternion_cubic_so3",
    "cayley_cubic_so3",
    "corrected_bezier_so3",
    "exponential_quintic_so3",
    "normal_cubic_so3",
    "weighted_cubic_so3",
    # paths through many poses, and files
    "retime",
    "chain",
    "Chain",
    "spline_velocities",
    "bessel_velocities",
    "projected_spline_so3",
    "projected_spline_se3",
    "quaternion_spline_so3",
    "minimum_acceleration_spline_so3",
    "minimum_acceleration_spline_se3",
    "minimum_torque_spline_so3",
    "is_local_minimum",
    "minimum_jerk_spline_so3",
    "OptimalChain",
    "fastest",
    "limits_used",
    "Timed",
    "read_path",
    "write_path",
    # for annotations
    "Array",
    # modules with further names
    "arm",
    "connection",
    "files",
    "metrics",
    "planar",
    "quaternion",
    "sampling",
    "straight_line",
]
