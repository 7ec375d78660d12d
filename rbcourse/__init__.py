"""Rigid-body motion: rotations, poses, projections, and curves through them.

To do this                                   call this
-------------------------------------------  ---------------------------------------------------
make rotations, poses                        exp_so3, matrix_from_quaternion, matrix_from_zyx;
                                             pose_from_components, pose_from_coordinates, exp_se3
take them apart                              log_so3, quaternion_from_matrix, zyx_from_matrix;
                                             components_from_pose, coordinates_from_pose, log_se3
compare, invert, change frames               angle_between, inverse_se3, adjoint_se3
repair a matrix that is nearly a rotation    project_so, project_se; is_so, is_se, distance_to_so
sample random rotations                      sample_rotation, sample_quaternion
join two rotations or poses                  geodesic, screw, projected_line, projected_cubic,
                                             projected_quintic; closed_forms has more
join them with the least cost                minimum_acceleration, minimum_torque, minimum_jerk
state the velocities of poses                twist_from_rates
state which body moves                       Body(inertia, mass, centre), Body.box(sides, mass)
pass through many poses with continuous      projected_spline (for any body), quaternion_spline if
acceleration                                 legs turn by more than 90°; joined, for a rotation and
                                             a position
join them with given velocities              chain
pass near noisy poses                        smoothing_spline, or with the least cost
                                             optimum.minimum_acceleration_smoothing
find wrong poses in a recording              outliers.wrong_poses
pass through them with the least cost        minimum_acceleration_spline (for any body); for
                                             rotations, minimum_torque_spline, minimum_jerk_spline
evaluate a curve c                           c(t), c(t, 1), c(t, 2); c.state(t) for all three
slow it down, move it                        c.retimed(duration), c.moved(left, right)
find its cost                                acceleration_cost, torque_cost, jerk_cost
find its excess over the optimum             its cost divided by the cost of the optimum, minus 1;
                                             excess_estimate, for rotations and a ball
find out whether an optimum is a minimum     c.certified
follow a path in the least time              fastest; limits_used for the use of each limit
read and write paths                         read_path, write_path
draw                                         draw.profiles, and the module draw
draw the figures of BK and RR                paper.figure_1, ..., report.figure_4, ...; in a
                                             terminal: python -m rbcourse all

The modules closed_forms, quaternion, metrics, connection, planar, arm, sampling, straight_line,
optimum, outliers, files, textbook (short versions of the main algorithms), paper, report and draw
have more.

Conventions: angles are in rad, and lengths in m. Velocities are in the body frame, per unit of
time: angular velocities ω, shape (3,), of rotations, and twists (ω, v), shape (6,), of poses. The
shape decides: (..., 3, 3) are rotations, and (..., 4, 4) poses. For poses, c(t, 2) is the
acceleration (ω', Rᵀ d''), not the derivative of the twist. Quaternions are (w, x, y, z). Lists, and
objects that have ``as_matrix``, such as SciPy's ``Rotation`` and ``RigidTransform``, are accepted
in place of arrays. Results are NumPy arrays in double precision; there is no automatic
differentiation.

An argument that is not finite, has the wrong shape or is outside the stated range raises a
ValueError that names it. So does a matrix that is not symmetric, to 1e-6 of its largest entry, or
not positive definite where this is required. Batch shapes that do not broadcast also raise
ValueError. The docstrings name the other errors. Rotation matrices, poses and unit quaternions must
be valid: a deviation of at most 1e-6, as of numbers in single precision, is removed by projection,
and a larger one raises a ValueError that states it; `project_so`, `project_se` and
`quaternion.project_quaternion` return the nearest valid arguments.

The line "Source" of a docstring cites the equations that the function implements. BK is Belta and
Kumar (2002), and RR is the report by Samayamantula and Zou. A source such as "beyond BK 12" is an
entry of docs/ledger.md whose content is in neither text.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rbcourse._migration import RENAMED
from rbcourse._numerics import Array
from rbcourse.body import Body
from rbcourse.curves.chain import Chain, chain, joined, projected_spline, quaternion_spline
from rbcourse.curves.cost import acceleration_cost, acceleration_cost_parts, jerk_cost, torque_cost
from rbcourse.curves.curve import Curve
from rbcourse.curves.geodesics import geodesic, projected_line, screw, screw_from_pose
from rbcourse.curves.projected import projected_cubic, projected_quintic
from rbcourse.curves.smoothing import smoothing_spline
from rbcourse.curves.timing import Limits, Timed, fastest, limits_used
from rbcourse.curves.velocities import bessel_velocities, spline_velocities
from rbcourse.files import read_path, write_path
from rbcourse.optimum import (
    excess_estimate,
    minimum_acceleration,
    minimum_acceleration_spline,
    minimum_jerk,
    minimum_jerk_spline,
    minimum_torque,
    minimum_torque_spline,
)
from rbcourse.projection import distance_to_so, is_se, is_so, project_se, project_so
from rbcourse.quaternion import (
    matrix_from_quaternion,
    matrix_from_zyx,
    quaternion_from_matrix,
    slerp,
    zyx_from_matrix,
)
from rbcourse.sampling import sample_quaternion, sample_rotation
from rbcourse.se3 import (
    adjoint_se3,
    components_from_pose,
    coordinates_from_pose,
    exp_se3,
    hat_se3,
    inverse_se3,
    log_se3,
    pose_from_components,
    pose_from_coordinates,
    twist_from_rates,
    vee_se3,
)
from rbcourse.so3 import (
    angle_between,
    exp_so3,
    hat_so3,
    log_so3,
    right_jacobian_inverse_so3,
    right_jacobian_so3,
    vee_so3,
)

__version__ = "2.0.0"

__all__ = [  # noqa: RUF022 - sorted by subject
    # rotations
    "hat_so3",
    "vee_so3",
    "exp_so3",
    "log_so3",
    "angle_between",
    "right_jacobian_so3",
    "right_jacobian_inverse_so3",
    # other representations of rotations
    "quaternion_from_matrix",
    "matrix_from_quaternion",
    "slerp",
    "matrix_from_zyx",
    "zyx_from_matrix",
    # poses
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
    "twist_from_rates",
    # membership and projection
    "is_so",
    "is_se",
    "project_so",
    "project_se",
    "distance_to_so",
    # random rotations
    "sample_rotation",
    "sample_quaternion",
    # curves between two rotations or poses
    "Curve",
    "Body",
    "geodesic",
    "screw",
    "screw_from_pose",
    "projected_line",
    "projected_cubic",
    "projected_quintic",
    # the optimum, and costs of curves
    "minimum_acceleration",
    "minimum_torque",
    "minimum_jerk",
    "acceleration_cost",
    "acceleration_cost_parts",
    "torque_cost",
    "jerk_cost",
    "excess_estimate",
    # curves through many poses, their timing, and files
    "chain",
    "projected_spline",
    "quaternion_spline",
    "minimum_acceleration_spline",
    "minimum_torque_spline",
    "minimum_jerk_spline",
    "spline_velocities",
    "bessel_velocities",
    "smoothing_spline",
    "joined",
    "fastest",
    "limits_used",
    "Limits",
    "read_path",
    "write_path",
    # for annotations
    "Array",
    "Chain",
    "Timed",
]

if TYPE_CHECKING:
    from rbcourse import arm as arm
    from rbcourse import closed_forms as closed_forms
    from rbcourse import connection as connection
    from rbcourse import draw as draw
    from rbcourse import files as files
    from rbcourse import metrics as metrics
    from rbcourse import optimum as optimum
    from rbcourse import outliers as outliers
    from rbcourse import paper as paper
    from rbcourse import planar as planar
    from rbcourse import projection as projection
    from rbcourse import quaternion as quaternion
    from rbcourse import report as report
    from rbcourse import sampling as sampling
    from rbcourse import straight_line as straight_line
    from rbcourse import textbook as textbook
else:
    _MODULES = {
        "arm",
        "closed_forms",
        "connection",
        "draw",
        "files",
        "metrics",
        "optimum",
        "outliers",
        "paper",
        "planar",
        "projection",
        "quaternion",
        "report",
        "sampling",
        "straight_line",
        "textbook",
    }

    def __getattr__(name: str) -> Any:
        """Import a module when it is first used; name the replacement of a name of version 1."""
        if name in _MODULES:
            try:
                return import_module(f"rbcourse.{name}")
            except ModuleNotFoundError as error:
                if error.name == "matplotlib":
                    error.add_note(f"rbcourse.{name} needs the extra draw, see README.md")
                raise
        if name in RENAMED:
            raise AttributeError(f"rbcourse.{name} is gone in version 2.0; use {RENAMED[name]}")
        raise AttributeError(f"module 'rbcourse' has no attribute {name!r}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *_MODULES})
