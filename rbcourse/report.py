"""The functions of the report RR, under its own names and with its signatures.

Each hands its work to the package; what the report does not have is keyword-only.
"""

from rbcourse.report_motions import (
    forward_propagate_arm,
    forward_propagate_rigid_body,
    interpolate_arm,
    interpolate_rigid_body,
    visualize_arm_path,
    visualize_path,
)
from rbcourse.report_rotations import (
    check_quaternion,
    check_SEn,
    check_SOn,
    correct_quaternion,
    correct_SEn,
    correct_SOn,
    random_quaternion,
    random_rotation_matrix,
    visualize,
    visualize_rotation,
)

__all__ = [
    "check_SEn",
    "check_SOn",
    "check_quaternion",
    "correct_SEn",
    "correct_SOn",
    "correct_quaternion",
    "forward_propagate_arm",
    "forward_propagate_rigid_body",
    "interpolate_arm",
    "interpolate_rigid_body",
    "random_quaternion",
    "random_rotation_matrix",
    "visualize",
    "visualize_arm_path",
    "visualize_path",
    "visualize_rotation",
]
